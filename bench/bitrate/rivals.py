"""Rivals: what else could carry the same numbers, as a file and live.

Every rival gets the numbers as a decoder returns them, int64 (T, N): multiples of their steps, divided by
these, without columns that never move, and is charged nothing for saying which ones those are. Live means
that each frame leaves at once: what a frame takes is flushed and is a packet by itself.
"""

from __future__ import annotations

import lzma
import zlib
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from bench.bitrate.packages import find_package, find_zstd
from fba.arrays import Int64, UInt8

FLUSH_END = b"\x00\x00\xff\xff"
"""What ends every flushed block of deflate; WebSockets leave it out (RFC 7692), and so do we."""

MOST_HISTORY = 1 << 20
"""Bytes that xz and a flushed zstd look back at most, more than an animation has: larger tables take time."""

Flush = Callable[[bytes], bytes]


class Rival(NamedTuple):
    """A way to code numbers.

    name: for tables. file: returns the bytes of a file. live: returns the bytes of each frame, int64 (T,);
    None where it needs all frames before the first. package: the module that it needs, "" for none.
    """

    name: str
    file: Callable[[Int64], int]
    live: Callable[[Int64], Int64] | None
    package: str = ""


def encode_varints(numbers: Int64) -> UInt8:
    """Return integers as variable-length bytes: zigzag, 7 bits a byte, least significant first (as Protocol
    Buffers' sint64). numbers: int64 of any shape, in the order in which they come."""
    return _varint_rows(numbers.reshape(1, -1))[0]


def _varint_rows(rows: Int64) -> list[UInt8]:
    """Return each row (T, N) of integers as variable-length bytes."""
    zigzag = ((rows << 1) ^ (rows >> 63)).astype(np.uint64)
    most = max((int(zigzag.max(initial=0)).bit_length() + 6) // 7, 1)
    groups = np.stack([(zigzag >> np.uint64(7 * k)) & np.uint64(127) for k in range(most)], axis=-1)
    more = np.stack([(zigzag >> np.uint64(7 * (k + 1))) > 0 for k in range(most)], axis=-1)
    used = np.ones_like(more)
    used[..., 1:] = more[..., :-1]
    encoded = (groups + 128 * more).astype(np.uint8)
    return [one[kept] for one, kept in zip(encoded, used, strict=True)]


def differences(numbers: Int64) -> Int64:
    """Return the first frame, and of the others what changes: int64 (T, N)."""
    return np.diff(numbers, axis=0, prepend=0)


def _rows(numbers: Int64) -> bytes:
    return encode_varints(differences(numbers)).tobytes()


def _columns(numbers: Int64) -> bytes:
    return encode_varints(differences(numbers).T.copy()).tobytes()


def _packets(numbers: Int64) -> Iterator[bytes]:
    """Give the differences of each frame as bytes."""
    return (row.tobytes() for row in _varint_rows(differences(numbers)))


def _sizes(flush: Flush, numbers: Int64) -> Int64:
    return np.array([len(flush(packet)) for packet in _packets(numbers)], dtype=np.int64)


def _int16(numbers: Int64) -> Int64:
    return np.full(len(numbers), 2 * numbers.shape[1], dtype=np.int64)


def _varint_sizes(numbers: Int64) -> Int64:
    return np.array([len(packet) for packet in _packets(numbers)], dtype=np.int64)


def _deflate(data: bytes) -> bytes:
    return zlib.compress(data, 9)


def _deflate_live(numbers: Int64) -> Int64:
    compressor = zlib.compressobj(9, wbits=-15)

    def flush(packet: bytes) -> bytes:
        block = compressor.compress(packet) + compressor.flush(zlib.Z_SYNC_FLUSH)
        return block.removesuffix(FLUSH_END)

    return _sizes(flush, numbers)


def _zstd(data: bytes) -> bytes:
    zstd = find_zstd()
    assert zstd is not None
    compressed: bytes = zstd.ZstdCompressor(level=19, write_content_size=False).compress(data)
    return compressed


def _zstd_live(numbers: Int64) -> Int64:
    zstd = find_zstd()
    assert zstd is not None
    settings = zstd.ZstdCompressionParameters.from_level(19, source_size=MOST_HISTORY)
    compressor = zstd.ZstdCompressor(compression_params=settings).compressobj()
    return _sizes(lambda p: compressor.compress(p) + compressor.flush(zstd.COMPRESSOBJ_FLUSH_BLOCK), numbers)


def _brotli(data: bytes) -> bytes:
    brotli = find_package("brotli")
    assert brotli is not None
    compressed: bytes = brotli.compress(data, quality=11)
    return compressed


def _brotli_live(numbers: Int64) -> Int64:
    brotli = find_package("brotli")
    assert brotli is not None
    compressor = brotli.Compressor(quality=11)
    return _sizes(lambda packet: compressor.process(packet) + compressor.flush(), numbers)


def _xz(data: bytes) -> bytes:
    """Return LZMA2 without the container's checks, which are 32 bytes and more."""
    lzma2 = {"id": lzma.FILTER_LZMA2, "preset": 9 | lzma.PRESET_EXTREME, "dict_size": MOST_HISTORY}
    return lzma.compress(data, lzma.FORMAT_RAW, filters=[lzma2])


def _file(compress: Callable[[bytes], bytes], order: Callable[[Int64], bytes]) -> Callable[[Int64], int]:
    return lambda numbers: len(compress(order(numbers)))


RIVALS = (
    Rival("int16", lambda numbers: int(_int16(numbers).sum()), _int16),
    Rival("varints of differences", lambda numbers: len(_rows(numbers)), _varint_sizes),
    Rival("deflate, rows", _file(_deflate, _rows), _deflate_live),
    Rival("deflate, columns", _file(_deflate, _columns), None),
    Rival("zstd 19, rows", _file(_zstd, _rows), _zstd_live, "zstandard"),
    Rival("zstd 19, columns", _file(_zstd, _columns), None, "zstandard"),
    Rival("brotli 11, rows", _file(_brotli, _rows), _brotli_live, "brotli"),
    Rival("brotli 11, columns", _file(_brotli, _columns), None, "brotli"),
    Rival("xz, rows", _file(_xz, _rows), None),
    Rival("xz, columns", _file(_xz, _columns), None),
)


def installed_rivals() -> tuple[Rival, ...]:
    """Return the rivals whose packages are installed."""
    return tuple(one for one in RIVALS if not one.package or find_package(one.package) is not None)


def missing_packages() -> tuple[str, ...]:
    """Return the packages that rivals need and that are not installed."""
    names = dict.fromkeys(one.package for one in RIVALS if one.package)
    return tuple(name for name in names if find_package(name) is None)

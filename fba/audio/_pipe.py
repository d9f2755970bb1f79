"""Sound that comes through a pipe: WAV with a header, or raw samples."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from typing import Protocol

import numpy as np

from fba.arrays import Int16
from fba.audio._mono import Resampler, mix
from fba.errors import FormatError

READ = 4096
"""Most bytes that are read at once: what is there is taken, and not waited for."""
RATES = (1000, 200_000)
"""Samples a second, least and most."""
MOST_CHANNELS = 64
MOST_HEADER = 1 << 20
"""Bytes of chunks before the sound of a WAV."""
LONGEST_PERIOD = 0.04
"""Seconds of a period of both rates, of which resampling holds back two; rates with a longer one count as the
next multiple of `ROUND`."""
ROUND = 100
_KINDS = {
    (1, 8): "u1", (1, 16): "<i2", (1, 24): "3u1", (1, 32): "<i4", (3, 32): "<f4", (3, 64): "<f8"
}  # fmt: skip
"""Types of samples, by the code of the format in a WAV, and bits."""
_OTHERS = {
    b"OggS": "Ogg", b"fLaC": "FLAC", b"ID3": "MP3", b"\xff\xfb": "MP3", b"FORM": "AIFF", b".snd": "AU",
    b"RIFX": "WAV with the highest byte first", b"\x1aE\xdf\xa3": "WebM",
}  # fmt: skip
_REMEDY = "let FFmpeg make a WAV of it on the way: ffmpeg -i SOURCE -f wav -"


class Pipe(Protocol):
    """What sound comes from: `read` returns at least a byte as soon as there is one, b"" at the end."""

    def read(self, size: int, /) -> bytes:
        """Return up to `size` bytes."""


def read_pipe(pipe: Pipe, rate: int, raw_rate: int | None = None) -> Iterator[Int16]:
    """Yield samples int16 (N,) as they come, all channels mixed.

    Where they are resampled, they are 0.04 s late at most, from 11,025 Hz 0.08 s.

    rate: samples per second to yield. raw_rate: those of raw samples, signed 16 bits, lowest byte first, one
    channel; a WAV says its own, of 8 to 32 bits or floats. The length in its header does not count, since
    programs that record do not know it. Part of a sample at the end is left out.

    Raises FormatError for what is no WAV, unless raw_rate is given, and for a WAV that cannot be read.
    """
    head = _read_up_to(pipe, b"", 12)
    if head[:4] == b"RIFF" and head[8:] == b"WAVE":
        kind, channels, own = _read_header(pipe)
        head = b""
    elif raw_rate is None:
        raise FormatError(_not_wave(head))
    else:
        kind, channels, own = "<i2", 1, raw_rate
    if not RATES[0] <= own <= RATES[1]:
        raise FormatError(f"the sound claims {own} samples a second; {RATES[0]} to {RATES[1]} can be heard")
    if own // np.gcd(own, rate) > LONGEST_PERIOD * own:
        own = round(own / ROUND) * ROUND
    resampler = Resampler(own, rate)
    for samples in _samples(pipe, head, np.dtype(kind), channels):
        yield resampler(mix(samples))
    yield resampler(np.zeros(0, dtype=np.int16), last=True)


def _samples(pipe: Pipe, rest: bytes, kind: np.dtype[np.generic], channels: int) -> Iterator[Int16]:
    """Yield samples (N, channels) as int16."""
    size = kind.itemsize * channels
    while True:
        whole = len(rest) // size * size
        if whole:
            yield _as_int16(np.frombuffer(rest[:whole], dtype=kind)).reshape(-1, channels)
        part = pipe.read(READ)
        if not part:
            return
        rest = rest[whole:] + part


def _as_int16(samples: np.ndarray) -> Int16:
    if samples.ndim == 2:  # 24 bits: the upper two bytes
        return np.asarray(samples[:, 1:].copy().view("<i2")[:, 0])
    if samples.dtype.kind == "f":
        return np.asarray(
            np.clip(np.nan_to_num(samples).clip(-1, 1) * 32768.0, -32768, 32767), dtype=np.int16
        )
    if samples.dtype == np.uint8:
        return np.asarray((samples.astype(np.int16) - 128) * 256, dtype=np.int16)
    return np.asarray(samples >> 16 if samples.dtype.itemsize == 4 else samples, dtype=np.int16)


def _read_header(pipe: Pipe) -> tuple[str, int, int]:
    """Return type of samples, channels, and samples per second of a WAV; its sound comes next."""
    found: tuple[str, int, int] | None = None
    read = 0
    while True:
        name, size = struct.unpack("<4sI", _read_exactly(pipe, 8))
        if name == b"data":
            break
        read += size
        if read > MOST_HEADER:
            raise FormatError(f"the WAV has {read} bytes before its sound; its header is damaged")
        body = _read_exactly(pipe, size + size % 2)
        if name == b"fmt ":
            found = _read_format(body)
    if found is None:
        raise FormatError("the WAV does not say what its samples are (no chunk fmt before data)")
    return found


def _read_format(body: bytes) -> tuple[str, int, int]:
    if len(body) < 16:
        raise FormatError(f"the WAV's chunk fmt has {len(body)} bytes; 16 are needed")
    code, channels, own, _, _, bits = struct.unpack_from("<HHIIHH", body)
    if code == 0xFFFE and len(body) >= 26:  # extensible: the code comes later
        code = struct.unpack_from("<H", body, 24)[0]
    kind = _KINDS.get((code, bits))
    if kind is None or not 1 <= channels <= MOST_CHANNELS:
        raise FormatError(
            f"the WAV has samples of format {code} with {bits} bits in {channels} channels; {_REMEDY}"
        )
    return kind, channels, own


def _not_wave(head: bytes) -> str:
    if not head:
        return "the sound is empty: nothing came"
    kind = next((name for begin, name in _OTHERS.items() if head.startswith(begin)), None)
    if kind is None:
        return (
            f"the sound has no header of a WAV: it begins with {head[:4]!r}. Of raw samples, say the rate: "
            "`fba speak --audio - --pcm 16000`"
        )
    return f"the sound is {kind}, and only WAV and raw samples are heard while they come: {_REMEDY}"


def _read_up_to(pipe: Pipe, data: bytes, size: int) -> bytes:
    while len(data) < size and (part := pipe.read(size - len(data))):
        data += part
    return data


def _read_exactly(pipe: Pipe, size: int) -> bytes:
    data = _read_up_to(pipe, b"", size)
    if len(data) < size:
        raise FormatError("the WAV is cut off before its sound")
    return data

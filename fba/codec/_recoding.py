"""The planes of a complete stream, and the same planes coded again with other start codes between them.

`read_plane_start` and `replace_time_code` treat a plane that stands alone.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from fba.animation import Animation
from fba.arrays import Bool, Int64
from fba.codec._coded_frames import Block
from fba.codec._decoder import Decoder
from fba.codec._frame_buffers import CompactBuffer
from fba.codec._plane import slots, syntax
from fba.codec._plane.bits import BitReader, OutOfDataError
from fba.codec._script import encode_planes
from fba.codec._stream.mark import marked_table
from fba.codec.settings import FrameRate, PlaneSettings, TimeCode
from fba.errors import BitstreamError
from fba.limits import DEFAULT_LIMITS, Limits
from fba.parameters import BAP_STEPS_DEFAULT, BapTable

_CODE_BITS = 18
"""Bits of a time code."""
_CHUNK_BYTES = 1 << 16
_PLANE_BYTES = 400
"""Memory of a plane besides its values."""


@dataclass(frozen=True, eq=False)
class StreamPlanes:
    """All planes of a complete stream.

    animation: their values and times, a frame a plane. settings: of each plane; face_frame and body_frame are
    its number. begins, ends: int64 (T,), the bits at which each plane begins, with the alignment and the
    start code before it, and ends. bap_steps: the table of BAP steps that they were decoded with.
    """

    animation: Animation
    settings: tuple[PlaneSettings, ...]
    begins: Int64
    ends: Int64
    bap_steps: BapTable

    @property
    def intra(self) -> Bool:
        """bool (T,), True for I planes."""
        return np.array([plane.intra for plane in self.settings], dtype=np.bool_)

    @property
    def coded(self) -> Bool:
        """bool (T,), True for planes with a start code before them."""
        return np.array([plane.start_code for plane in self.settings], dtype=np.bool_)


def read_planes(
    data: bytes, *, bap_steps: BapTable | None = None, limits: Limits = DEFAULT_LIMITS
) -> StreamPlanes:
    """Return the planes of a complete stream, with their settings and places.

    bap_steps: as for `decode`. Raises BitstreamError, UnsupportedError, LimitError.
    """
    table = bap_steps or marked_table(data) or BAP_STEPS_DEFAULT
    decoder, buffer = Decoder(bap_steps=table, limits=limits), CompactBuffer(limits, len(data))
    settings: list[PlaneSettings] = []
    begins: list[Int64] = []
    ends: list[Int64] = []

    def add(blocks: list[Block]) -> None:
        for block in blocks:
            settings.extend(_settings(block, len(settings)))
            begins.append(block.borders[:-1])
            ends.append(block.borders[1:])
            buffer.add(block)
        limits.check_bytes(len(settings) * _PLANE_BYTES, "the list of planes", source=len(data))

    for start in range(0, len(data), _CHUNK_BYTES):
        add(decoder.push_blocks(data[start : start + _CHUNK_BYTES]))
    add(decoder.finish_blocks())
    if not settings:
        raise BitstreamError("the stream holds no plane that can be decoded", plane=0)
    return StreamPlanes(
        buffer.animation(), tuple(settings), np.concatenate(begins), np.concatenate(ends), table
    )


def recode(planes: StreamPlanes, coded: Bool) -> bytes:
    """Return the stream of the same planes, in one object, without a mark; values and settings are kept.

    coded: bool (T,), the planes to be written with a start code before them. Raises RangeError for planes of
    several objects that do not fit into one.
    """
    animation = replace(planes.animation, index=np.arange(len(planes.settings)))
    settings = [
        replace(plane, start_code=bool(with_code))
        for plane, with_code in zip(planes.settings, coded.tolist(), strict=True)
    ]
    return encode_planes(animation, settings, bap_steps=planes.bap_steps)


def _settings(block: Block, number: int) -> Iterator[PlaneSettings]:
    """Yield the settings of the planes of a block. number: of the first."""
    whole = block.settings
    for position, (parts, skip) in enumerate(zip(block.parts.tolist(), block.skips.tolist(), strict=True)):
        face, body = parts & slots.FACE_BIT, parts & slots.BODY_BIT
        yield PlaneSettings(
            whole.intra,
            number + position if face else None,
            number + position if body else None,
            whole.face if face else None,
            whole.body if body else None,
            whole.frame_rate,
            whole.time_code,
            skip,
            whole.start_code and position == 0,
        )


class PlaneStart(NamedTuple):
    """What a plane says before its FAPs and BAPs; see `PlaneSettings`."""

    intra: bool
    frame_rate: FrameRate | None
    time_code: TimeCode | None
    skip: int
    code_bit: int
    """Where is_time_code is, in an I plane."""


def read_plane_start(plane: bytes) -> PlaneStart:
    """Return what a plane says first. plane: its bytes behind the start code. Raises BitstreamError.

    ISO/IEC 14496-2, fba_object_plane_header and temporal_header.
    """
    reader = BitReader(np.frombuffer(plane, np.uint8), 0, 8 * len(plane))
    try:
        intra = bool(reader.read(1))
        if not reader.read(2):
            raise BitstreamError("fba_object_mask is 0: the plane carries neither face nor body", bit=1)
        rate = syntax.read_frame_rate(reader) if intra and reader.read(1) else None
        if rate is not None and not rate.fraction:
            raise BitstreamError("the frame rate is 0", bit=4)
        code_bit = reader.bit
        code = syntax.read_time_code(reader) if intra and reader.read(1) else None
        return PlaneStart(intra, rate, code, syntax.read_skip(reader), code_bit)
    except OutOfDataError:
        raise BitstreamError("the plane ends inside its header", bit=8 * len(plane)) from None


def replace_time_code(plane: bytes, code: TimeCode | None) -> bytes:
    """Return an I plane with another time code, or without one.

    plane: its bytes behind the start code, with the stuffing at its end. Raises BitstreamError for a plane
    that is no I plane, or has no stuffing.
    """
    start = read_plane_start(plane)
    number, bits = int.from_bytes(plane, "big"), 8 * len(plane)
    stuffing = (number ^ (number + 1)).bit_length()  # 1s, and the 0 before them
    after = start.code_bit + 1 + (_CODE_BITS if start.time_code is not None else 0)
    if not start.intra or stuffing > 8 or after > bits - stuffing:
        raise BitstreamError("an I plane with stuffing at its end is needed", bit=0)
    head = number >> bits - start.code_bit
    tail = (number & ((1 << bits - after) - 1)) >> stuffing
    written = 1 if code is None else 1 + _CODE_BITS
    sent = 0
    if code is not None:
        sent = (((32 + code.hours) << 6 | code.minutes) << 1 | code.marker) << 6 | code.seconds
    rest = bits - stuffing - after
    content = (head << written | sent) << rest | tail
    length = start.code_bit + written + rest
    added = 8 - length % 8
    return (content << added | (1 << added - 1) - 1).to_bytes((length + added) // 8, "big")

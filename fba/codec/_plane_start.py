"""The beginning of a plane that stands alone: when it is shown, and the same plane with another time code."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fba.codec._plane import syntax
from fba.codec._plane.bits import BitReader, OutOfDataError
from fba.codec.settings import FrameRate, TimeCode
from fba.errors import BitstreamError

_CODE_BITS = 18
"""Bits of a time code."""


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

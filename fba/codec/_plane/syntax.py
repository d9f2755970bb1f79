"""Read and write headers of the FBA object and its planes (ISO/IEC 14496-2, FBA object plane).

A plane is::

    [alignment, fba_object_plane_start_code]                     optional
    is_intra 1, fba_object_mask 2
    I only: is_frame_rate 1 [frame_rate 8, seconds 4, frequency_offset 1]
            is_time_code 1 [hours 5, minutes 6, marker 1, seconds 6]
    skip_frames 1 [number_of_frames_to_skip 4, more while 15]
    FAPs, where fba_object_mask & 1:
        I only: fap_quant 5, 10 x (marker 1, fap_mask_type 2 [fap_group_mask]),
                suggested_gender 1, object_coding_type 1, four is_*_new_* flags, range lists
        arithmetic segments: viseme (then viseme_def), expression (then init_face, expression_def), FAPs
    BAPs, where fba_object_mask & 2: the same with bap_quant and 24 groups, one arithmetic segment
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple, NoReturn

import numpy as np
import numpy.typing as npt

from fba.arrays import Bool
from fba.codec._plane import slots
from fba.codec._plane.arithmetic import OK, OUT_OF_DATA
from fba.codec._plane.bits import BitReader, BitWriter, OutOfDataError
from fba.codec._plane.loops import STATUS_TEXT
from fba.codec._plane.loops import read_skip as read_skip_words
from fba.codec.settings import FrameRate, PartSettings, RangeLists, TimeCode
from fba.errors import BitstreamError
from fba.parameters import BAP_COUNT, FAP_COUNT, bap_groups, fap_groups

START_CODE_PREFIX = b"\x00\x00\x01"
OBJECT_CODES = (0xBA, 0x01)
"""Last bytes of fba_object_start_code: the standard's, and one of old tools, which is only read."""
PLANE_CODES = (0xBB, 0x03)
"""Last bytes of fba_object_plane_start_code: likewise."""
END_CODE = 0xB1

PREDICTIVE, DCT = 0, 1
MASK_NONE, MASK_KEEP, MASK_INTERPOLATE, MASK_ALL = range(4)

LISTS = ("i_max", "i_min", "p_max", "p_min")
RANGE_BITS = 5
_MARKER_EVERY = 4
_RANGE_WEIGHTS = 1 << np.arange(RANGE_BITS, dtype=np.uint8)[::-1]


def interpolated(settings: PartSettings) -> Bool | None:
    """Return bool (68,): unsent FAPs that mask type 2 asks to interpolate; None without mask type 2."""
    if MASK_INTERPOLATE not in settings.mask_types:
        return None
    result = np.zeros_like(settings.mask)
    for kind, group in zip(settings.mask_types, groups(slots.FACE_BIT), strict=True):
        if kind == MASK_INTERPOLATE:
            columns = np.array(group) - 1
            result[columns] = ~settings.mask[columns]
    return result


def groups(part: int) -> tuple[tuple[int, ...], ...]:
    """Return the numbers of FAPs or BAPs by group, in coding order."""
    return fap_groups() if part == slots.FACE_BIT else bap_groups()


def read_frame_rate(reader: BitReader) -> FrameRate:
    """Read frame_rate, seconds and frequency_offset."""
    return FrameRate(reader.read(8), reader.read(4), reader.read(1))


def write_frame_rate(writer: BitWriter, rate: FrameRate) -> None:
    """Write frame_rate, seconds and frequency_offset."""
    writer.write(rate.frame_rate, 8)
    writer.write(rate.seconds, 4)
    writer.write(rate.frequency_offset, 1)


def read_time_code(reader: BitReader) -> TimeCode:
    """Read a time code."""
    hours, minutes, marker, seconds = (reader.read(bits) for bits in (5, 6, 1, 6))
    return TimeCode(hours, minutes, seconds, marker)


def write_time_code(writer: BitWriter, code: TimeCode) -> None:
    """Write a time code."""
    for value, bits in ((code.hours, 5), (code.minutes, 6), (code.marker, 1), (code.seconds, 6)):
        writer.write(value, bits)


def read_skip(reader: BitReader) -> int:
    """Read skip_frames and number_of_frames_to_skip; return the frames skipped."""
    if not reader.read(1):
        return 0
    status, skip, reader.bit = read_skip_words(reader.data, reader.bit, reader.end)
    if status == OUT_OF_DATA:
        raise OutOfDataError
    if status != OK:
        raise BitstreamError(STATUS_TEXT[status], bit=reader.bit)
    return skip


def write_skip(writer: BitWriter, skip: int) -> None:
    """Write skip_frames and number_of_frames_to_skip."""
    writer.write(1 if skip else 0, 1)
    if skip:
        for _ in range(skip // 15):
            writer.write(15, 4)
        writer.write(skip % 15, 4)


def read_part(reader: BitReader, part: int) -> PartSettings:
    """Read the header of the FAP or BAP half of an I plane, up to its first arithmetic segment.

    Raises BitstreamError on a wrong marker bit or a reserved mask type.
    """
    name = "fap" if part == slots.FACE_BIT else "bap"
    mask = np.zeros(FAP_COUNT if part == slots.FACE_BIT else BAP_COUNT, dtype=bool)
    quant = reader.read(5)
    types = []
    for number, group in enumerate(groups(part), 1):
        bits = reader.read(3)
        if not bits >> 2:
            raise _marker_error(reader, f"before {name}_mask_type of group {number}", 3)
        kind = bits & 3
        if kind == MASK_INTERPOLATE and part == slots.BODY_BIT:
            raise BitstreamError(
                f"bap_mask_type of group {number} is 2 (interpolate), which exists for FAPs only",
                bit=reader.bit - 2,
            )
        types.append(kind)
        columns = np.array(group) - 1
        if kind == MASK_ALL:
            mask[columns] = True
        elif kind != MASK_NONE:
            bits = reader.read(len(group))
            mask[columns] = [(bits >> shift) & 1 for shift in reversed(range(len(group)))]
    gender = reader.read(1)
    coding_type = reader.read(1)
    ranges = RangeLists() if coding_type == DCT else _read_ranges(reader, part, mask)
    mask.flags.writeable = False
    return PartSettings(tuple(types), mask, quant, gender, coding_type, ranges)


def write_part(writer: BitWriter, part: int, settings: PartSettings) -> None:
    """Write the header of the FAP or BAP half of an I plane, up to its first arithmetic segment."""
    writer.write(settings.quant, 5)
    for kind, group in zip(settings.mask_types, groups(part), strict=True):
        writer.write(0b100 | kind, 3)
        if kind in (MASK_KEEP, MASK_INTERPOLATE):
            for number in group:
                writer.write(int(settings.mask[number - 1]), 1)
    writer.write(settings.gender, 1)
    writer.write(settings.coding_type, 1)
    for codes in settings.ranges:
        writer.write(int(codes is not None), 1)
    chunks = _range_chunks(part, settings.mask) if settings.ranges else []
    for codes in settings.ranges:
        if codes is not None:
            for chunk in chunks:
                bits = 1
                for number in chunk:
                    bits = bits << RANGE_BITS | int(codes[number - 1])
                writer.write(bits, 1 + RANGE_BITS * len(chunk))


def _read_ranges(reader: BitReader, part: int, mask: Bool) -> RangeLists:
    """Read the four is_*_new_* flags and the range lists."""
    flags = [reader.read(1) for _ in LISTS]
    layout = _range_layout(part, mask.tobytes()) if any(flags) else None
    lists: list[np.ndarray | None] = []
    for name, present in zip(LISTS, flags, strict=True):
        if not present or layout is None:
            lists.append(None)
            continue
        codes = np.zeros(len(mask), dtype=np.uint8)
        bits = reader.peek(layout.size)
        if bits is not None and bits[layout.markers].all():
            codes[layout.columns] = bits[layout.codes] @ _RANGE_WEIGHTS
            reader.bit += layout.size
        else:
            _raise_range_error(reader, name, layout.chunks)
        codes.flags.writeable = False
        lists.append(codes)
    return RangeLists(*lists)


def _raise_range_error(reader: BitReader, name: str, chunks: list[list[int]]) -> NoReturn:
    """Raise the error of a range list with a marker bit of 0, or that goes beyond the end of the data."""
    for chunk in chunks:
        bits = reader.read(1 + RANGE_BITS * len(chunk))
        if not bits >> RANGE_BITS * len(chunk):
            raise _marker_error(reader, f"in the {name} range list", 1 + RANGE_BITS * len(chunk))
    raise AssertionError("this range list has no error")


class _RangeLayout(NamedTuple):
    """Where the bits of a range list are, for one mask.

    chunks: parameter numbers after each marker bit. markers: (M,), positions of the marker bits, from the
    start of the list. columns: (C,), column of each limit. codes: (C, 5), positions of its bits. size: bits.
    """

    chunks: list[list[int]]
    markers: npt.NDArray[np.intp]
    columns: npt.NDArray[np.intp]
    codes: npt.NDArray[np.intp]
    size: int


@lru_cache(maxsize=64)
def _range_layout(part: int, mask: bytes) -> _RangeLayout:
    """Return the layout of a range list. mask: bytes of a bool array."""
    chunks = _range_chunks(part, np.frombuffer(mask, dtype=bool))
    markers: list[int] = []
    codes: list[int] = []
    bit = 0
    for chunk in chunks:
        markers.append(bit)
        codes += range(bit + 1, bit + 1 + RANGE_BITS * len(chunk), RANGE_BITS)
        bit += 1 + RANGE_BITS * len(chunk)
    columns = np.array([number - 1 for chunk in chunks for number in chunk], dtype=np.intp)
    starts = np.array(codes, dtype=np.intp)[:, None]
    return _RangeLayout(
        chunks, np.array(markers, dtype=np.intp), columns, starts + np.arange(RANGE_BITS), bit
    )


def _range_chunks(part: int, mask: Bool) -> list[list[int]]:
    """Return the numbers of the sent parameters whose limits follow each marker bit of a range list."""
    ranged = groups(part)[1:] if part == slots.FACE_BIT else groups(part)  # FAP 1 and 2 have no ranges
    return [
        [number for number in group[start : start + _MARKER_EVERY] if mask[number - 1]]
        for group in ranged
        for start in range(0, len(group), _MARKER_EVERY)
    ]


def _marker_error(reader: BitReader, where: str, back: int) -> BitstreamError:
    """Return the error for a marker bit of 0, `back` bits before the reader."""
    return BitstreamError(f"marker bit {where} is 0, expected 1", bit=reader.bit - back)

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

import numpy as np

from fba.arrays import Bool
from fba.codec._plane import header_loops, slots
from fba.codec._plane.arithmetic import OK, OUT_OF_DATA
from fba.codec._plane.bits import BitReader, BitWriter, OutOfDataError
from fba.codec._plane.header_loops import MARKER_EVERY, MASK_INTERPOLATE, MASK_KEEP, RANGE_BITS
from fba.codec._plane.loops import STATUS_TEXT
from fba.codec._plane.loops import read_skip as read_skip_words
from fba.codec.settings import FrameRate, PartSettings, RangeLists, TimeCode
from fba.errors import BitstreamError
from fba.parameters import bap_groups, fap_groups

START_CODE_PREFIX = b"\x00\x00\x01"
OBJECT_CODES = (0xBA, 0x01)
"""Last bytes of fba_object_start_code: the standard's, and that of old tools, which is only read."""
PLANE_CODES = (0xBB, 0x03)
"""Last bytes of fba_object_plane_start_code: likewise."""
END_CODE = 0xB1
"""Last byte of visual_object_sequence_end_code, which closes the last object of a stream."""
LAYER_CODES = (0xB0, 0xB5)
"""Last bytes of the start codes of a visual object sequence and of a visual object. Their headers may stand
before the next object, so they close an object, too."""

LISTS = ("i_max", "i_min", "p_max", "p_min")


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
    header = header_loops.empty_header(part)
    status, bit, place = header_loops.read_part_header(
        reader.data, reader.bit, reader.end, header_loops.groups(part), header
    )
    if status == OUT_OF_DATA:
        raise OutOfDataError
    name = "fap" if part == slots.FACE_BIT else "bap"
    if status == header_loops.BAD_MASK_MARKER:
        raise _marker_error(f"before {name}_mask_type of group {place}", bit)
    if status == header_loops.BAD_MASK_TYPE:
        raise BitstreamError(
            f"bap_mask_type of group {place} is 2 (interpolate), which exists for FAPs only", bit=bit
        )
    if status == header_loops.BAD_RANGE_MARKER:
        raise _marker_error(f"in the {LISTS[place]} range list", bit)
    reader.bit = bit
    quant, gender, coding_type, *present = header.fields.tolist()
    header.mask.flags.writeable = header.ranges.flags.writeable = False
    lists = (codes if sent else None for codes, sent in zip(header.ranges, present, strict=True))
    ranges = RangeLists(*lists) if any(present) else RangeLists()
    return PartSettings(tuple(header.types.tolist()), header.mask, quant, gender, coding_type, ranges)


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


def _range_chunks(part: int, mask: Bool) -> list[list[int]]:
    """Return the numbers of the sent parameters whose limits follow each marker bit of a range list."""
    ranged = groups(part)[1:] if part == slots.FACE_BIT else groups(part)  # FAP 1 and 2 have no ranges
    return [
        [number for number in group[start : start + MARKER_EVERY] if mask[number - 1]]
        for group in ranged
        for start in range(0, len(group), MARKER_EVERY)
    ]


def _marker_error(where: str, bit: int) -> BitstreamError:
    """Return the error for a marker bit of 0."""
    return BitstreamError(f"marker bit {where} is 0, expected 1", bit=bit)

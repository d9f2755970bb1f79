"""Compiled loops that decode and encode runs of planes (ISO/IEC 14496-2, FBA object plane).

P planes have a header of a few bits and use the settings of the I plane before them, so that runs of them are
coded without returning to Python. I planes have new settings: `fba.codec._plane.syntax` codes their headers,
`decode_values` and `encode_values` here their values.

Bounds: a layout's segments are consecutive parts of its order, whose slots are rows of the state
(`slots.coding_order`); segments have at most two flags. The functions that are called from Python, or those
of `arithmetic`, check the length of everything else: IndexError for a fault of the caller.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fba.arrays import Int32, Int64, UInt8, UInt16
from fba.codec._plane import arithmetic, slots
from fba.codec._plane.arithmetic import OK, OUT_OF_DATA, Counts, decode_segment, encode_segment, learn
from fba.compiled import compiled

# Why a run of planes ended; 0 to 3 are those of the arithmetic coder.
INTRA = 4
"""An I plane comes next."""
MISSING_PART = 5
"""A P plane comes next that carries a part without settings."""
START_CODE = 6
BAD_MASK = 7
"""fba_object_mask 0."""
SKIP_TOO_LONG = 8
OUT_OF_RANGE = 9
"""A value outside the limits of its parameter (decoding) or of its range (encoding)."""

SKIP_MAX = 15 << 20
"""Most frames that a plane may skip: a week at 25 frames/s. More is damage."""

FIRST_FLAG = slots.FLAGS.start

START_CODE_ROOM = 40
"""Bits of a start code and of the alignment before it, at most."""

AFTER_CODE = -2
"""In place of the first bit of the plane before: a start code ends here, and no reader looks for another."""

START_CODE_ZEROS = 23
"""Number of zero bits that at a byte boundary only a start code begins with."""

# Results of `find_start_code` without a start code.
NO_START_CODE = -1
UNDECIDED = -2

_INT32_MAX = 2147483647


class Layout(NamedTuple):
    """Slots that a plane codes, in order, and their segments: see `slots.coding_order`."""

    order: Int64
    segments: Int64


class Layouts(NamedTuple):
    """Layouts of planes with FAPs, with BAPs, and with both.

    available: the parts, added up, that planes can carry. order, segments: of planes with both; first come
    `face_slots` slots and `face_segments` segments of the FAPs.
    """

    available: int
    order: Int64
    segments: Int64
    face_slots: int
    face_segments: int


class Coding(NamedTuple):
    """How values become symbols.

    int64 (slots,) each: smallest level, quantiser step, limits and last value of the parameter. models: those
    of the symbols.
    """

    minimum: Int64
    step: Int64
    lowest: Int64
    highest: Int64
    last: Int64
    models: Counts


# Rows of `State.numbers`. Smallest level and size of the alphabet differ between I and P planes.
I_MINIMUM, I_SIZE, P_MINIMUM, P_SIZE, STEP, LOWEST, HIGHEST, LAST, USUAL, TOTAL, BELOW_USUAL = range(11)
NUMBERS = 11


class State(NamedTuple):
    """All that encoder and decoder must share of the slots, in few arrays: passing an array takes time.

    numbers: int64 (NUMBERS, slots), one row for each array of `Coding` and `Counts`. added, tree: those of
    `Counts`, for as many slots as are in use.
    """

    numbers: Int64
    added: UInt16
    tree: UInt16


@compiled
def coding_of(state: State, adaptive: bool) -> Coding:
    """Return the arrays of a state by name. adaptive: for P planes, else for I planes."""
    numbers = state.numbers
    size = numbers[P_SIZE] if adaptive else numbers[I_SIZE]
    models = Counts(size, numbers[USUAL], numbers[TOTAL], numbers[BELOW_USUAL], state.added, state.tree)
    minimum = numbers[P_MINIMUM] if adaptive else numbers[I_MINIMUM]
    return Coding(minimum, numbers[STEP], numbers[LOWEST], numbers[HIGHEST], numbers[LAST], models)


@compiled
def read_bit(data: UInt8, bit: int) -> int:
    """Return the bit at a position."""
    return (int(data[bit >> 3]) >> (7 - (bit & 7))) & 1


@compiled
def read_skip(data: UInt8, bit: int, end: int) -> tuple[int, int, int]:
    """Read number_of_frames_to_skip at `bit`; return status, skip, and the bit after it or of the error."""
    skip = 0
    word = 15
    while word == 15:
        if bit + 4 > end:
            return OUT_OF_DATA, skip, end
        word = 0
        for _ in range(4):
            word = 2 * word + read_bit(data, bit)
            bit += 1
        skip += word
        if skip > SKIP_MAX:
            return SKIP_TOO_LONG, skip, bit - 4
    return OK, skip, bit


@compiled
def find_start_code(data: UInt8, bit: int, end: int, after_code: bool) -> tuple[int, int]:
    """Look for alignment and a start code at `bit`; return the last byte of the code and the bit after it.

    The alignment is a 0 and then 1s up to the byte boundary (a whole byte if already aligned), or zeros;
    after a start code (after_code) none follows. NO_START_CODE: a plane begins here. UNDECIDED: the bits up
    to `end` fit a start code, but it is not complete.
    """
    here = bit & 7
    if here == 0:
        if bit + 8 > end:
            return UNDECIDED, bit
        aligned = bit + 8 if data[bit >> 3] == 0x7F and not after_code else bit
    else:
        aligned = bit + 8 - here
        if aligned > end:  # `end` is a byte boundary
            return UNDECIDED, bit
        rest = int(data[bit >> 3]) & (255 >> here)
        if rest != 0 and rest != (255 >> here) >> 1:
            return NO_START_CODE, bit
    for position in range(4):
        if aligned + 8 * position + 8 > end:
            return UNDECIDED, bit
        value = int(data[(aligned >> 3) + position])
        if position == 3:
            return value, aligned + 32
        if value != (1 if position == 2 else 0):
            return NO_START_CODE, bit
    return NO_START_CODE, bit


@compiled
def _zeros_ahead(data: UInt8, start: int, stop: int) -> int:
    """Return how many bits of the plane start..stop are 0 between a reader's look-ahead and the first 1.

    Readers that do not check alignment look at the next byte boundary, and behind a byte 0x7F if they stand
    on a boundary. -1 - zeros if no 1 follows in this plane: what is written behind it decides.
    """
    bit = (start + 7) >> 3 << 3
    if bit == start and data[bit >> 3] == 0x7F:
        bit += 8
    zeros = 0
    while bit < stop:
        if read_bit(data, bit):
            return zeros
        zeros += 1
        bit += 1
    return -1 - zeros


@compiled
def hides_plane(data: UInt8, start: int, stop: int) -> bool:
    """Return whether a start code written at `stop`, behind its alignment, hides the plane start..stop.

    A reader that stands at `start` and looks ahead at the byte boundary then finds the start code there, or
    zeros before it, and takes the plane for alignment.
    """
    within_a_byte = start & 7 != 0 and start >> 3 == stop >> 3
    return within_a_byte or (stop & 7 == 7 and _zeros_ahead(data, start, stop) < 0)


@compiled
def insert_start_code(data: UInt8, start: int, stop: int) -> int:
    """Put alignment and fba_object_plane_start_code before the bits start..stop; return their new stop.

    data: zeroed from `stop` on, with room for 40 bits more; IndexError without.
    """
    if start < 0 or stop + START_CODE_ROOM > 8 * len(data):
        raise IndexError("no room for a start code")
    aligned = (start >> 3) + 1
    shift = 8 * (aligned + 4) - start
    for bit in range(stop - 1, start - 1, -1):
        mask = np.uint8(128 >> ((bit + shift) & 7))
        if read_bit(data, bit):
            data[(bit + shift) >> 3] |= mask
            data[bit >> 3] &= np.uint8(255 - (128 >> (bit & 7)))
        else:
            data[(bit + shift) >> 3] &= np.uint8(255 - mask)
    for bit in range(start + 1, 8 * aligned):
        data[bit >> 3] |= np.uint8(128 >> (bit & 7))
    data[aligned : aligned + 4] = 0
    data[aligned + 2] = 0x01
    data[aligned + 3] = 0xBB
    return stop + shift


@compiled
def guard_plane(data: UInt8, before: int, start: int, stop: int) -> tuple[int, int]:
    """Put a start code before the plane start..stop if a reader may take the plane itself for one.

    A look-ahead takes 23 zero bits for a start code; the guard against them counts zeros within segments
    only, not in headers. before: first bit of the plane before, or -1 if a start code stands before it.
    Returns stop, and the first bit of this plane, or -1 with a start code before it.

    data: zeroed from `stop` on, with room for 80 bits more: `insert_start_code` checks that.
    """
    zeros = _zeros_ahead(data, start, stop)
    if zeros < 0:
        zeros = -1 - zeros + 2  # those of the next plane, before the first bit of its fba_object_mask
    if zeros < START_CODE_ZEROS:
        return stop, start
    if before >= 0 and hides_plane(data, before, start):
        moved = insert_start_code(data, before, stop) - stop
        start += moved
        stop += moved
    return insert_start_code(data, start, stop), -1


class PlaneValues(NamedTuple):
    """What is decoded of a plane.

    symbols, values: int64, symbols[k] and values[k] of slot layout.order[k]. flags: int64 (3,), viseme_def,
    init_face, expression_def.
    """

    symbols: Int64
    values: Int64
    flags: Int64


@compiled
def decode_values(
    data: UInt8, bit: int, end: int, layout: Layout, coding: Coding, adaptive: bool, plane: PlaneValues
) -> tuple[int, int]:
    """Decode the segments of one plane from `bit` on; return status, and the bit after them or of the damage.

    adaptive: a P plane, else an I plane. Fills `plane`; changes neither models nor last values. OUT_OF_RANGE
    returns the slot instead of a bit. IndexError for arrays that are shorter than the layout.
    """
    symbols, values, flags = plane
    if len(values) < len(layout.order) or len(flags) < 3:
        raise IndexError("values beyond their array")
    flags[:] = 0
    flag = 0
    order = layout.order
    for segment in range(len(layout.segments)):
        first = int(layout.segments[segment, 0])
        stop = int(layout.segments[segment, 1])
        flag_count = int(layout.segments[segment, 2])
        status, bit = decode_segment(
            data, bit, end, order[first:stop], coding.models, adaptive, symbols[first:stop]
        )
        if status != OK:
            return status, bit
        if flag_count > 0:
            if bit + flag_count > end:
                return OUT_OF_DATA, end
            flag = 0 if flag_count == 1 else 1
            for _ in range(flag_count):
                flags[flag] = read_bit(data, bit)
                flag += 1
                bit += 1
    for position in range(len(order)):
        slot = int(order[position])
        value = (int(symbols[position]) + int(coding.minimum[slot])) * int(coding.step[slot])
        if adaptive:
            value += int(coding.last[slot])
        if value < coding.lowest[slot] or value > coding.highest[slot]:
            return OUT_OF_RANGE, slot
        values[position] = value
    return OK, bit


@compiled
def decode_intra(
    data: UInt8, bit: int, end: int, layout: Layout, state: State, values: Int64, flags: Int64
) -> tuple[int, int]:
    """Decode an I plane as `decode_values` does."""
    symbols = np.zeros(len(layout.order), np.int64)
    plane = PlaneValues(symbols, values, flags)
    return decode_values(data, bit, end, layout, coding_of(state, False), False, plane)


@compiled
def _body_layout(layouts: Layouts) -> Layout:
    """Return the layout of planes with BAPs only."""
    segments = layouts.segments[layouts.face_segments :].copy()
    for segment in range(len(segments)):
        segments[segment, 0] -= layouts.face_slots
        segments[segment, 1] -= layouts.face_slots
    return Layout(layouts.order[layouts.face_slots :], segments)


class PlaneRows(NamedTuple):
    """Decoded P planes.

    rows: int32 (T, C), values of all slots, then flags; 0 where a plane lacks the part. parts: uint8 (T,),
    fba_object_mask. skips: int64 (T,). borders: int64 (T + 1,), the first bit of each, the last one's end.
    """

    rows: Int32
    parts: UInt8
    skips: Int64
    borders: Int64


@compiled
def _read_header(data: UInt8, bit: int, end: int, available: int) -> tuple[int, int, int, int]:
    """Read the header of a P plane; return status, fba_object_mask, frames to skip, and the bit after it.

    available: the parts, added up, that planes can carry. Where the status is not OK, the bit is that of the
    fault.
    """
    if bit + 3 > end:
        return OUT_OF_DATA, 0, 0, end
    if read_bit(data, bit):
        return INTRA, 0, 0, bit
    mask = 2 * read_bit(data, bit + 1) + read_bit(data, bit + 2)
    if mask == 0:
        return BAD_MASK, 0, 0, bit + 1
    if mask & available != mask:
        return MISSING_PART, mask, 0, bit
    if bit + 4 > end:
        return OUT_OF_DATA, mask, 0, end
    if not read_bit(data, bit + 3):
        return OK, mask, 0, bit + 4
    status, skip, place = read_skip(data, bit + 4, end)
    return status, mask, skip, place


@compiled
def decode_run(
    data: UInt8, bit: int, end: int, after_code: bool, layouts: Layouts, state: State, planes: PlaneRows
) -> tuple[int, int, int, int]:
    """Decode P planes from `bit` on until something else comes; return (count, status, carried, place).

    after_code: a start code ends at `bit`. count: planes that were decoded. status: OK if all rows are full,
    else why the run ended. carried: the parts, added up, that planes carry. place: the bit, or slot, at which
    the next plane failed. A plane that fails does not change models and `last`. IndexError for results that
    are shorter than rows, or rows that are narrower than a plane.
    """
    rows, parts, skips, borders = planes
    if min(len(parts), len(skips), len(borders) - 1) < len(rows):
        raise IndexError("results of a run beyond their arrays")
    if not len(layouts.order) <= rows.shape[1] <= len(layouts.order) + 3:
        raise IndexError("rows that are not those of a plane")
    coding = coding_of(state, True)
    both = Layout(layouts.order, layouts.segments)
    face = Layout(layouts.order[: layouts.face_slots], layouts.segments[: layouts.face_segments])
    body = _body_layout(layouts)
    width = len(both.order)
    plane = PlaneValues(np.zeros(width, np.int64), np.zeros(width, np.int64), np.zeros(3, np.int64))
    count = 0
    carried = 0
    borders[0] = bit
    while count < len(rows):
        code, _ = find_start_code(data, bit, end, after_code and count == 0)
        if code != NO_START_CODE:
            return count, OUT_OF_DATA if code == UNDECIDED else START_CODE, carried, bit
        status, mask, skip, place = _read_header(data, bit, end, layouts.available)
        if status != OK:
            return count, status, carried, place
        layout = both
        first = 0
        if mask == slots.FACE_BIT:
            layout = face
        elif mask == slots.BODY_BIT:
            layout = body
            first = layouts.face_slots
        status, place = decode_values(data, place, end, layout, coding, True, plane)
        if status != OK:
            return count, status, carried, place
        order = layout.order
        learn(order, plane.symbols, coding.models)
        if len(order) < width:
            rows[count] = 0
        for position in range(len(order)):
            coding.last[int(order[position])] = plane.values[position]
            rows[count, first + position] = plane.values[position]
        for flag in range(rows.shape[1] - width):
            rows[count, width + flag] = plane.flags[flag]
        parts[count] = mask
        carried |= mask
        skips[count] = skip
        bit = place
        count += 1
        borders[count] = bit
    return count, OK, carried, bit


@compiled
def quantise(value: int, step: int) -> int:
    """Return the level of a value: nearest multiple of step, halves away from 0, but 0 up to step // 2."""
    if value < 0:
        return -quantise_size(-value, step)
    return quantise_size(value, step)


@compiled
def quantise_size(size: int, step: int) -> int:
    """Return the level of a value that is 0 or more."""
    half = step // 2
    return 0 if size <= half else (size + half) // step


@compiled
def quantise_change(value: int, last: int, step: int) -> int:
    """Return the level of a difference: nearest to value - last, but such that the sum stays an int32."""
    level = quantise(value - last, step)
    rounded = last + level * step
    if rounded > _INT32_MAX:
        return level - 1
    if rounded < -_INT32_MAX - 1:
        return level + 1
    return level


@compiled
def encode_values(
    data: UInt8, bit: int, layout: Layout, coding: Coding, adaptive: bool, symbols: Int64, flags: Int64
) -> int:
    """Encode the segments of one plane at `bit`; return the bit after them.

    symbols: symbols[k] for slot layout.order[k]. flags: as decoded. data: zeroed from `bit` on, with room for
    16 bits for each symbol and 20 for each segment: `encode_segment` checks all but the last 4 of these for
    each, and writes at most 4 of the 16 that are left, so that two flags have room.
    """
    for segment in range(len(layout.segments)):
        first = int(layout.segments[segment, 0])
        stop = int(layout.segments[segment, 1])
        flag_count = int(layout.segments[segment, 2])
        bit = encode_segment(
            data, bit, layout.order[first:stop], coding.models, adaptive, symbols[first:stop]
        )
        flag = 0 if flag_count == 1 else 1
        for _ in range(flag_count):
            if flags[flag]:
                data[bit >> 3] |= np.uint8(128 >> (bit & 7))
            flag += 1
            bit += 1
    return bit


@compiled
def encode_intra(data: UInt8, bit: int, layout: Layout, state: State, symbols: Int64, flags: Int64) -> int:
    """Encode an I plane as `encode_values` does."""
    return encode_values(data, bit, layout, coding_of(state, False), False, symbols, flags)


@compiled
def _write_nibble(data: UInt8, bit: int, value: int) -> int:
    """Write 4 bits; return the bit after them."""
    for shift in range(3, -1, -1):
        if (value >> shift) & 1:
            data[bit >> 3] |= np.uint8(128 >> (bit & 7))
        bit += 1
    return bit


@compiled
def room_for(skip: int, layout: Layout) -> int:
    """Return an upper bound of the bits of a P plane, and of start codes before it and the plane before."""
    return 152 + 4 * (skip // 15) + 20 * len(layout.segments) + 17 * len(layout.order)


@compiled
def _write_header(data: UInt8, bit: int, object_mask: int, skip: int) -> int:
    """Write the header of a P plane; return the bit after it."""
    header = 2 * object_mask + (1 if skip > 0 else 0)  # is_intra 0, fba_object_mask, skip_frames
    bit = _write_nibble(data, bit, header)
    while skip >= 0 and header & 1:
        word = min(skip, 15)
        bit = _write_nibble(data, bit, word)
        skip = skip - 15 if word == 15 else -1
    return bit


@compiled
def encode_run(
    data: UInt8,
    bit: int,
    before: int,
    object_mask: int,
    layout: Layout,
    state: State,
    rows: Int32,
    skips: Int64,
) -> tuple[int, int, int, int, int]:
    """Encode rows[t] as P planes at `bit`; return (planes, status, bit, slot, before).

    before: first bit of the last plane written, AFTER_CODE if a start code ends at `bit`, or -1 if one stands
    before that plane. A start code is written before a plane that a reader may take for one, see
    `guard_plane`. OUT_OF_RANGE: the difference of `slot` in the next plane does not fit its range; nothing of
    that plane was written. OUT_OF_DATA: `data` has no room for another plane. IndexError for fewer skips than
    rows, or rows that are narrower than the flags.
    """
    if len(skips) < len(rows) or rows.shape[1] < FIRST_FLAG + 3 or bit < 0:
        raise IndexError("rows of a run beyond their arrays")
    coding = coding_of(state, True)
    order, minimum, step, last = layout.order, coding.minimum, coding.step, coding.last
    symbols = np.zeros(len(order), np.int64)
    flags = np.zeros(3, np.int64)
    room = 8 * len(data)
    for count in range(len(rows)):
        skip = int(skips[count])
        if bit + room_for(skip, layout) > room:
            return count, OUT_OF_DATA, bit, -1, before
        for position in range(len(order)):
            slot = int(order[position])
            level = quantise_change(int(rows[count, slot]), int(last[slot]), int(step[slot]))
            symbol = level - int(minimum[slot])
            if symbol < 0 or symbol >= coding.models.size[slot]:
                return count, OUT_OF_RANGE, bit, slot, before
            symbols[position] = symbol
        for flag in range(3):
            flags[flag] = rows[count, FIRST_FLAG + flag]
        start = bit
        bit = _write_header(data, start, object_mask, skip)
        bit = encode_values(data, bit, layout, coding, True, symbols, flags)
        if before == AFTER_CODE:
            before = -1
        else:
            bit, before = guard_plane(data, before, start, bit)
        learn(order, symbols, coding.models)
        for position in range(len(order)):
            slot = int(order[position])
            last[slot] += (int(symbols[position]) + int(minimum[slot])) * int(step[slot])
    return len(rows), OK, bit, -1, before


@compiled
def measure_plane(
    data: UInt8,
    bit: int,
    before: int,
    object_mask: int,
    layout: Layout,
    state: State,
    levels: Int64,
    flags: Int64,
) -> int:
    """Return the bit after a P plane without a skip, written to `data` at `bit` as `encode_run` does.

    No model learns. levels: int64, of the differences, by layout.order. data: a copy, with room for the plane
    (`room_for`). IndexError for another number of levels, and without that room.
    """
    if len(levels) != len(layout.order) or bit < 0 or bit + room_for(0, layout) > 8 * len(data):
        raise IndexError("a plane beyond its arrays")
    coding = coding_of(state, True)
    symbols = np.zeros(len(levels), np.int64)
    for position in range(len(levels)):
        symbols[position] = levels[position] - coding.minimum[int(layout.order[position])]
    after = _write_header(data, bit, object_mask, 0)
    after = encode_values(data, after, layout, coding, True, symbols, flags)
    if before != AFTER_CODE:
        after, before = guard_plane(data, before, bit, after)
    return after


STATUS_TEXT = {
    arithmetic.BAD_GUARD: "22 zero bits are followed by another 0, where a 1 must be inserted; "
    "the stream is damaged here or before",
    arithmetic.BAD_FLUSH: "the arithmetic segment does not end with bits that close it; "
    "the stream is damaged here or before",
    BAD_MASK: "fba_object_mask is 0, expected 1 (FAPs), 2 (BAPs) or 3 (both)",
    SKIP_TOO_LONG: f"number_of_frames_to_skip exceeds {SKIP_MAX}",
}

"""Compiled loops that read and apply the header of the FAPs or BAPs in an I plane (ISO/IEC 14496-2)."""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np

from fba.arrays import Bool, Int64, UInt8
from fba.codec._plane import slots
from fba.codec._plane.arithmetic import ALPHABET_MAX, OK, OUT_OF_DATA
from fba.codec._plane.loops import State, coding_of
from fba.compiled import compiled, inlined
from fba.parameters import BAP_COUNT, FAP_COUNT, bap_groups, fap_groups

# Damage, besides that of the arithmetic coder.
BAD_MASK_MARKER = 20
"""The marker bit before a mask type is 0."""
BAD_MASK_TYPE = 21
"""A mask type that the part does not have."""
BAD_RANGE_MARKER = 22
"""A marker bit in a range list is 0."""

MASK_NONE, MASK_KEEP, MASK_INTERPOLATE, MASK_ALL = range(4)
DCT = 1
"""object_coding_type of DCT segments; 0 is predictive coding."""

RANGE_BITS = 5
MARKER_EVERY = 4

# Fields of a part: quant, gender and coding type, and whether each of the four range lists is present.
QUANT, GENDER, CODING_TYPE, FIRST_LIST = range(4)
FIELDS = FIRST_LIST + 4


class Groups(NamedTuple):
    """The groups of a part.

    members: int64 (N,), the columns of all groups, in coding order. stops: int64 (G,), where each group ends
    in it. first_ranged: the first group with range lists. interpolates: whether mask type 2 exists.
    """

    members: Int64
    stops: Int64
    first_ranged: int
    interpolates: bool


@cache
def groups(part: int) -> Groups:
    """Return the groups of the FAPs or of the BAPs."""
    face = part == slots.FACE_BIT
    numbers = fap_groups() if face else bap_groups()
    return Groups(
        np.array([number - 1 for group in numbers for number in group], dtype=np.int64),
        np.cumsum([len(group) for group in numbers], dtype=np.int64),
        1 if face else 0,  # FAP 1 and 2 have no ranges
        face,
    )


class Header(NamedTuple):
    """A header: mask types (G,), mask bool (columns,), range codes uint8 (4, columns), fields int64."""

    types: Int64
    mask: Bool
    ranges: UInt8
    fields: Int64


def empty_header(part: int) -> Header:
    """Return a header to be read into."""
    columns = FAP_COUNT if part == slots.FACE_BIT else BAP_COUNT
    return Header(
        np.zeros(len(groups(part).stops), dtype=np.int64),
        np.zeros(columns, dtype=np.bool_),
        np.zeros((4, columns), dtype=np.uint8),
        np.zeros(FIELDS, dtype=np.int64),
    )


@inlined
def _bits(data: UInt8, bit: int, count: int) -> int:
    """Return `count` bits as an unsigned number."""
    value = 0
    for position in range(bit, bit + count):
        value = 2 * value + ((int(data[position >> 3]) >> (7 - (position & 7))) & 1)
    return value


@compiled
def read_part_header(data: UInt8, bit: int, end: int, part: Groups, header: Header) -> tuple[int, int, int]:
    """Read the header of a part from `bit` on, up to its first arithmetic segment; return status, bit, place.

    header: zeroed; filled. bit: after the header, or of the damage. place: with BAD_MASK_MARKER and
    BAD_MASK_TYPE the number of the group, from 1 on; with BAD_RANGE_MARKER that of the list, from 0 on.

    Bounds: groups and header are those of the same part (`groups`, `empty_header`), so that members are
    columns of its arrays. Bits are read before `end` only; IndexError if that is beyond the data.
    """
    if end > 8 * len(data) or bit < 0:
        raise IndexError("a header beyond its data")
    types, mask, ranges, fields = header.types, header.mask, header.ranges, header.fields
    if bit + 5 > end:
        return OUT_OF_DATA, end, 0
    fields[QUANT] = _bits(data, bit, 5)
    bit += 5
    first = 0
    for group in range(len(part.stops)):
        stop = int(part.stops[group])
        if bit + 3 > end:
            return OUT_OF_DATA, end, 0
        if not _bits(data, bit, 1):
            return BAD_MASK_MARKER, bit, group + 1
        kind = _bits(data, bit + 1, 2)
        if kind == MASK_INTERPOLATE and not part.interpolates:
            return BAD_MASK_TYPE, bit + 1, group + 1
        bit += 3
        types[group] = kind
        has_mask = kind in (MASK_KEEP, MASK_INTERPOLATE)
        if has_mask and bit + stop - first > end:
            return OUT_OF_DATA, end, 0
        for member in range(first, stop):
            mask[part.members[member]] = _bits(data, bit, 1) == 1 if has_mask else kind == MASK_ALL
            bit += 1 if has_mask else 0
        first = stop
    if bit + 2 > end:
        return OUT_OF_DATA, end, 0
    fields[GENDER] = _bits(data, bit, 1)
    fields[CODING_TYPE] = _bits(data, bit + 1, 1)
    bit += 2
    if fields[CODING_TYPE] == DCT:
        return OK, bit, 0
    if bit + 4 > end:
        return OUT_OF_DATA, end, 0
    for which in range(4):
        fields[FIRST_LIST + which] = _bits(data, bit + which, 1)
    bit += 4
    for which in range(4):
        if not fields[FIRST_LIST + which]:
            continue
        first = 0
        for group in range(len(part.stops)):
            stop = int(part.stops[group])
            for member in range(first, stop):
                column = part.members[member]
                if group < part.first_ranged:
                    continue
                if (member - first) % MARKER_EVERY == 0:
                    if bit + 1 > end:
                        return OUT_OF_DATA, end, 0
                    if not _bits(data, bit, 1):
                        return BAD_RANGE_MARKER, bit, which
                    bit += 1
                if mask[column]:
                    if bit + RANGE_BITS > end:
                        return OUT_OF_DATA, end, 0
                    ranges[which, column] = _bits(data, bit, RANGE_BITS)
                    bit += RANGE_BITS
            first = stop
    return OK, bit, 0


@compiled
def begin_models(span: tuple[int, int], scale: int, limits: Int64, high_level: Int64, state: State) -> None:
    """Set the ranges of the slots in a span to limits divided by scale, and all counts of their models to 1.

    limits: int64 (4, slots), magnitudes of I max, I min, P max, P min. high_level: limits of the slots before
    the first FAP with ranges: those of visemes and expressions, which are 0..limit in I planes. IndexError
    for slots that the state has no models for, and for an alphabet larger than ALPHABET_MAX, which no range
    has.
    """
    if span[0] < 0 or span[1] > len(state.added) or span[1] > limits.shape[1]:
        raise IndexError("slots without models")
    intra, predicted = coding_of(state, False), coding_of(state, True)
    models = predicted.models
    for slot in range(span[0], span[1]):
        if models.total[slot] != models.size[slot]:  # only a few models have learnt something
            for symbol in range(models.size[slot] + 1):
                models.added[slot, symbol] = 0
                models.tree[slot, symbol] = 0
        if slot < len(high_level):
            limit = int(high_level[slot])
            i_max, i_min, p_max, p_min = limit, 0, limit, limit
        else:
            i_max, i_min = max(int(limits[0, slot]), 0) // scale, max(int(limits[1, slot]), 0) // scale
            p_max, p_min = max(int(limits[2, slot]), 0) // scale, max(int(limits[3, slot]), 0) // scale
        if max(i_max + i_min, p_max + p_min) >= ALPHABET_MAX:
            raise IndexError("an alphabet beyond its model")
        intra.minimum[slot] = -i_min
        intra.models.size[slot] = i_max + i_min + 1
        predicted.minimum[slot] = -p_min
        models.size[slot] = models.total[slot] = p_max + p_min + 1
        models.usual[slot] = models.below_usual[slot] = p_min

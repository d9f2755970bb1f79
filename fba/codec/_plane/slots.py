"""Numbering of everything that a plane carries: 372 slots.

The codec's loops know parameters by slot: 3 of the viseme, 4 of the expression, FAPs 3..68, BAPs
1..296. Three slots between face and body hold the flags viseme_def, init_face and expression_def, which
are plain bits. A row of values is int32, one column a slot; of a face alone it ends before the BAPs.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from fba.animation import BodyTrack, FaceTrack
from fba.arrays import Bool, Int32, Int64
from fba.parameters import BAP_COUNT, EXPRESSION_FIELDS, FAP_COUNT, VISEME_FIELDS, bap_groups, baps, faps

VISEME = slice(0, 3)
EXPRESSION = slice(3, 7)
AMOUNTS = [2, 4, 6]
"""Viseme blend and expression intensities."""
FAPS = slice(7, 73)
FLAGS = slice(73, 76)
VISEME_DEF, INIT_FACE, EXPRESSION_DEF = 73, 74, 75
BAPS = slice(76, 372)
SLOTS = 372

FACE_BIT, BODY_BIT = 1, 2
"""Bits of fba_object_mask."""


def row_width(*, body: bool) -> int:
    """Columns of a row of values with or without a body."""
    return SLOTS if body else FLAGS.stop


def fap_slot(number: int) -> int:
    """Slot of a low-level FAP, 3..68."""
    return FAPS.start + number - 3


def bap_slot(number: int) -> int:
    return BAPS.start + number - 1


@cache
def body_order() -> Int64:
    """(296,) slots of the BAPs in coding order: group by group, in each group's listed order."""
    return np.array([bap_slot(number) for group in bap_groups() for number in group], dtype=np.int64)


def label(slot: int) -> str:
    """The standard's name for what a slot carries."""
    if slot < VISEME.stop:
        return f"FAP 1 {VISEME_FIELDS[slot]}"
    if slot < EXPRESSION.stop:
        return f"FAP 2 {EXPRESSION_FIELDS[slot - EXPRESSION.start]}"
    if slot < FAPS.stop:
        return faps()[slot - FAPS.start + 2].label
    return baps()[slot - BAPS.start].label


def coding_order(face_mask: Bool | None, body_mask: Bool | None) -> tuple[Int64, Int64]:
    """What a plane codes: (order int64 (K,), segments int64 (S, 3)).

    order: slots in coding order. segments: one row for each arithmetic segment: position in `order` of
    its first slot, of the slot after its last, and how many flag bits follow it (1 after the viseme,
    2 after the expression). A mask of None means that the plane lacks the part.
    """
    order: list[int] = []
    segments: list[tuple[int, int, int]] = []

    def segment(slots: list[int], flags: int) -> None:
        segments.append((len(order), len(order) + len(slots), flags))
        order.extend(slots)

    if face_mask is not None:
        if face_mask[0]:
            segment(list(range(VISEME.start, VISEME.stop)), 1)
        if face_mask[1]:
            segment(list(range(EXPRESSION.start, EXPRESSION.stop)), 2)
        segment((np.flatnonzero(face_mask[2:]) + FAPS.start).tolist(), 0)
    if body_mask is not None:
        in_order = body_order()
        segment(in_order[body_mask[in_order - BAPS.start]].tolist(), 0)
    return np.array(order, dtype=np.int64), np.array(segments, dtype=np.int64).reshape(-1, 3)


def face_rows(track: FaceTrack, rows: Int32) -> None:
    """Write a face track into rows (T, columns)."""
    rows[:, VISEME] = track.viseme[:, :3]
    rows[:, VISEME_DEF] = track.viseme[:, 3]
    rows[:, EXPRESSION] = track.expression[:, :4]
    rows[:, INIT_FACE : FLAGS.stop] = track.expression[:, 4:]
    rows[:, FAPS] = track.values[:, 2:]


def body_rows(track: BodyTrack, rows: Int32) -> None:
    """Write a body track into rows (T, columns)."""
    rows[:, BAPS] = track.values


def face_track(rows: Int32, mask: Bool, interpolated: Bool | None) -> FaceTrack:
    """The face track that rows (T, columns) and one mask (68,) for all of them hold; the same for what
    is to be interpolated."""
    count = len(rows)
    values = np.zeros((count, FAP_COUNT), dtype=np.int32)
    values[:, 2:] = rows[:, FAPS]
    viseme = np.zeros((count, len(VISEME_FIELDS)), dtype=np.int16)
    viseme[:, :3] = rows[:, VISEME]
    viseme[:, 3] = rows[:, VISEME_DEF]
    expression = np.zeros((count, len(EXPRESSION_FIELDS)), dtype=np.int16)
    expression[:, :4] = rows[:, EXPRESSION]
    expression[:, 4:] = rows[:, INIT_FACE : FLAGS.stop]
    for array in (values, viseme, expression):
        array.flags.writeable = False
    shape = (count, FAP_COUNT)
    asked = np.broadcast_to(interpolated, shape) if interpolated is not None else None
    return FaceTrack(values, np.broadcast_to(mask, shape), viseme, expression, asked)


def body_track(rows: Int32, mask: Bool) -> BodyTrack:
    """The body track that rows (T, columns) and one mask (296,) for all of them hold."""
    values = rows[:, BAPS].copy()
    values.flags.writeable = False
    return BodyTrack(values, np.broadcast_to(mask, (len(rows), BAP_COUNT)))

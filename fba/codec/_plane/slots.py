"""Slots: the numbers 0..371 of everything that a plane carries.

The codec's loops address parameters by slot: 3 of the viseme, 4 of the expression, FAPs 3..68, BAPs
1..296. Three slots between face and body hold the flags viseme_def, init_face and expression_def, which
are single bits. A row of values is int32 with one column for each slot; without a body it ends before the
BAPs.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from fba.animation import Animation, BodyTrack, FaceTrack
from fba.arrays import Bool, Float64, Int32, Int64
from fba.encoder_options import EncoderOptions
from fba.parameters import EXPRESSION_FIELDS, FAP_COUNT, VISEME_FIELDS, bap_groups, baps, faps

VISEME = slice(0, 3)
EXPRESSION = slice(3, 7)
AMOUNTS = [2, 4, 6]
"""Viseme blend and expression intensities."""
FAPS = slice(7, 73)
FLAGS = slice(73, 76)
VISEME_DEF, INIT_FACE = 73, 74
BAPS = slice(76, 372)
SLOTS = 372

FACE_BIT, BODY_BIT = 1, 2
"""Bits of fba_object_mask."""


def fap_slot(number: int) -> int:
    """Return the slot of a low-level FAP, 3..68."""
    return FAPS.start + number - 3


def bap_slot(number: int) -> int:
    """Return the slot of a BAP, 1..296."""
    return BAPS.start + number - 1


def part_of(slot: int) -> int:
    """Return the bit of fba_object_mask for the part that a slot belongs to."""
    return FACE_BIT if slot < FLAGS.stop else BODY_BIT


def quantiser_of(options: EncoderOptions, part: int) -> int:
    """Return the quantiser of a part: `FACE_BIT` or `BODY_BIT`."""
    return options.fap_quant if part == FACE_BIT else options.bap_quant


def label(slot: int) -> str:
    """Return the standard's name of a slot."""
    if slot < VISEME.stop:
        return f"FAP 1 {VISEME_FIELDS[slot]}"
    if slot < EXPRESSION.stop:
        return f"FAP 2 {EXPRESSION_FIELDS[slot - EXPRESSION.start]}"
    if slot < FAPS.stop:
        return faps()[slot - FAPS.start + 2].label
    return baps()[slot - BAPS.start].label


def coding_order(face_mask: Bool | None, body_mask: Bool | None) -> tuple[Int64, Int64]:
    """Return the slots that a plane codes, in order, and its arithmetic segments.

    face_mask, body_mask: bool (68,), (296,), or None if the plane lacks the part. Returns order, int64 (K,),
    and segments, int64 (S, 3): position in order of the segment's first slot, of the slot after its last, and
    number of flag bits that follow it (1 after the viseme, 2 after the expression).
    """
    return _coding_order(
        face_mask.tobytes() if face_mask is not None else None,
        body_mask.tobytes() if body_mask is not None else None,
    )


@lru_cache(maxsize=64)
def _coding_order(face: bytes | None, body: bytes | None) -> tuple[Int64, Int64]:
    """Return the same from bytes, which can be keys of the cache: streams of I planes ask for every plane."""
    face_mask = np.frombuffer(face, dtype=np.bool_) if face is not None else None
    body_mask = np.frombuffer(body, dtype=np.bool_) if body is not None else None
    order: list[int] = []
    segments: list[tuple[int, int, int]] = []

    def add_segment(slots: list[int], flags: int) -> None:
        segments.append((len(order), len(order) + len(slots), flags))
        order.extend(slots)

    if face_mask is not None:
        if face_mask[0]:
            add_segment(list(range(VISEME.start, VISEME.stop)), 1)
        if face_mask[1]:
            add_segment(list(range(EXPRESSION.start, EXPRESSION.stop)), 2)
        add_segment((np.flatnonzero(face_mask[2:]) + FAPS.start).tolist(), 0)
    if body_mask is not None:
        in_order = [number for group in bap_groups() for number in group]
        add_segment([bap_slot(number) for number in in_order if body_mask[number - 1]], 0)
    return np.array(order, dtype=np.int64), np.array(segments, dtype=np.int64).reshape(-1, 3)


def track_rows(face: FaceTrack | None, body: BodyTrack | None) -> Int32:
    """Return the values of tracks of T frames as rows, int32 (T, columns), 0 for a part without a track."""
    count = len(face if face is not None else body or ())
    result = np.zeros((count, FLAGS.stop if body is None else SLOTS), dtype=np.int32)
    if face is not None:
        result[:, VISEME] = face.viseme[:, :3]
        result[:, VISEME_DEF] = face.viseme[:, 3]
        result[:, EXPRESSION] = face.expression[:, :4]
        result[:, INIT_FACE : FLAGS.stop] = face.expression[:, 4:]
        result[:, FAPS] = face.values[:, 2:]
    if body is not None:
        result[:, BAPS] = body.values
    return result


def with_values(frame: Animation, row: Int32) -> Animation:
    """Return a frame with the low-level FAPs and the BAPs of row (columns,), otherwise unchanged."""
    face, body = frame.face, frame.body
    if face is not None:
        values = np.concatenate([np.zeros(2, np.int32), row[FAPS]])[None]
        face = FaceTrack(values, face.mask, face.viseme, face.expression, face.interpolated)
    if body is not None:
        body = BodyTrack(row[BAPS][None], body.mask)
    return Animation(frame.rate, frame.index, face, body, frame.name)


def weights_of_slots(weights: Float64) -> Float64:
    """Return the weights of slots, float64 (372,), from those of the FAPs and the BAPs after them, (364,).

    Infinite for visemes and expressions.
    """
    result = np.full(SLOTS, np.inf)
    result[FAPS], result[BAPS] = weights[2:FAP_COUNT], weights[FAP_COUNT:]
    return result

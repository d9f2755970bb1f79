"""Displaced masks as FAPs: each FAP is how far its feature point has moved along its axis, in its FAPU."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from fba.arrays import Float64
from fba.capture.blendshapes.combination import part_lids
from fba.errors import ModelError
from fba.face import Fapu, feature_point_names
from fba.face.feature_points import row_of
from fba.face.points import DIRECTIONS
from fba.parameters import FAP_COUNT, faps
from fba.persona.points.layout import IRIS, SAME, TRACKED, point_weights, standard_points
from fba.persona.recognition.recogniser import JAW_FAPS

PUPILS = {"3.5": (61, 63), "3.6": (62, 64)}
"""Pupils are between these points."""
JAW = 3
UPPER_LIDS = (18, 19)
"""Columns of the FAPs of the upper lids."""
LOWER_LIDS = (20, 21)
"""Columns of the FAPs of the lower lids."""
MIN_LID_FAPS = (-450.0, -150.0)
"""FAPs of upper and lower lids that are open as far as lids go; narrow eyes at rest would ask for more."""
LEFT_OUT = frozenset({61, 62, 63, 64})
"""FAPs of the nose, by whose points faces are laid on the mask."""


@dataclass(frozen=True)
class Moved:
    """A FAP that a vertex of the mask tells. row: of the vertex; axis and sign: of its motion; unit: its
    FAPU."""

    fap: int
    row: int
    axis: int
    sign: float
    unit: str


@cache
def told_faps() -> tuple[Moved, ...]:
    """Return the FAPs whose feature point is a vertex of the mask."""
    weights = point_weights()[:SAME]
    vertex = {}
    for name, column in row_of().items():
        rows = np.flatnonzero((weights[:, column] == 1.0) & ((weights != 0).sum(axis=1) == 1))
        if len(rows):
            vertex[name] = int(rows[0])
    told = []
    for fap in faps()[2:]:
        points = fap.feature_points
        if (
            fap.number in LEFT_OUT
            or fap.positive not in DIRECTIONS
            or len(points) != 1
            or points[0] not in vertex
        ):
            continue
        direction = np.array(DIRECTIONS[fap.positive])
        axis = int(np.abs(direction).argmax())
        told.append(Moved(fap.number, vertex[points[0]], axis, float(direction[axis]), fap.unit))
    return tuple(told)


@cache
def told_numbers() -> tuple[int, ...]:
    """Return the numbers of the FAPs that masks tell, the jaw's among them."""
    return tuple(sorted([JAW, *(one.fap for one in told_faps())]))


def measure_fapu(neutral: Float64) -> Fapu:
    """Return the FAPU of a neutral face, millimetres, from its tracked points (64, 2) on the standard mask.

    Raises ModelError where they are not those of a neutral face.
    """
    features = np.full((len(feature_point_names()), 3), np.nan)
    weights = point_weights()[: TRACKED - IRIS]
    for row in row_of().values():
        points = np.flatnonzero((weights[:, row] == 1.0) & ((weights != 0).sum(axis=1) == 1))
        if len(points):
            features[row, :2] = neutral[points[0]]
    for pupil, (one, other) in PUPILS.items():
        features[row_of()[pupil], :2] = (neutral[one - 1] + neutral[other - 1]) / 2
    try:
        return Fapu.measure(features)
    except ModelError as error:
        raise ModelError(f"the neutral face is impossible: {error.finding}") from error


PART_UNITS = {
    "mouth": ("MW", "MNS"), "left_eye": ("ES", "IRISD"), "right_eye": ("ES", "IRISD"),
    "left_brow": ("ES", "ENS"), "right_brow": ("ES", "ENS"),
}  # fmt: skip
"""FAPU by which a part moves across and up."""


def face_scale(fapu: Fapu, part: str) -> Float64:
    """Return how much further a part of a face moves, across and up, than that of the standard face does:
    (2,).

    Faces show the same where they move by the same FAPs: an eye that is less open needs less to close.
    """
    standard = _standard_fapu()
    return np.array([fapu[unit] / standard[unit] for unit in PART_UNITS[part]])


@cache
def _standard_fapu() -> Fapu:
    return measure_fapu(standard_points()[:TRACKED, :2])


def mask_faps(moved: Float64, fapu: Fapu, jaw: Float64) -> Float64:
    """Return FAPs (T, 68) of masks whose vertices have moved by (T, 86, 3) millimetres from the neutral mask.

    fapu: of the neutral mask. jaw: (5,), `Recogniser.jaw`: FAP 3 is told by the lips.
    """
    values = np.zeros((len(moved), FAP_COUNT))
    for one in told_faps():
        values[:, one.fap - 1] = one.sign * moved[:, one.row, one.axis] / fapu[one.unit]
    for lids, widest in zip((UPPER_LIDS, LOWER_LIDS), MIN_LID_FAPS, strict=True):
        values[:, lids] = np.maximum(values[:, lids], widest)
    part_lids(values)
    values[:, JAW - 1] = np.maximum(values[:, [fap - 1 for fap in JAW_FAPS]] @ jaw, 0.0)
    return values

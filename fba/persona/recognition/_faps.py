"""Conversion of displaced masks to FAPs: displacements of feature points along their axes, in FAPU."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from fba.arrays import Float64
from fba.capture.blendshapes.combination import part_lids
from fba.errors import ModelError
from fba.face import Fapu, feature_point_names
from fba.face.points import DIRECTIONS
from fba.parameters import FAP_COUNT, faps, point_rows
from fba.persona.points.layout import SAME, TRACKED, point_weights, standard_points
from fba.persona.recognition._recogniser import JAW_FAPS

PUPILS = {"3.5": (61, 63), "3.6": (62, 64)}
"""Points of the irises halfway between which the pupils are."""
JAW = 3
UPPER_LIDS = (18, 19)
"""Columns of the FAPs of the upper lids."""
LOWER_LIDS = (20, 21)
"""Columns of the FAPs of the lower lids."""
MIN_LID_FAPS = (-450.0, -150.0)
"""Smallest FAPs of upper and lower lids, the eyes wide open; faces with narrow eyes would exceed them."""
NOSE_FAPS = frozenset({61, 62, 63, 64})
"""FAPs that masks do not show: faces are registered by the points of the nose."""


@dataclass(frozen=True)
class MaskFap:
    """A FAP shown by a vertex of the mask. row: of the vertex; axis, sign: of its motion; unit: its FAPU."""

    fap: int
    row: int
    axis: int
    sign: float
    unit: str


@cache
def shown_faps() -> tuple[MaskFap, ...]:
    """Return the FAPs whose feature point is a vertex of the mask."""
    vertex = _vertex_of()
    shown = []
    for fap in faps()[2:]:
        points = fap.feature_points
        if fap.number in NOSE_FAPS or fap.positive not in DIRECTIONS or len(points) != 1:
            continue
        if points[0] in vertex:
            direction = np.array(DIRECTIONS[fap.positive])
            axis = int(np.abs(direction).argmax())
            shown.append(MaskFap(fap.number, vertex[points[0]], axis, float(direction[axis]), fap.unit))
    return tuple(shown)


@cache
def _vertex_of() -> dict[str, int]:
    """Return the vertex of the mask at each feature point that has one."""
    weights = point_weights()[:SAME]
    alone = (weights != 0).sum(axis=1) == 1
    rows = {
        name: np.flatnonzero((weights[:, column] == 1.0) & alone) for name, column in point_rows().items()
    }
    return {name: int(found[0]) for name, found in rows.items() if len(found)}


@cache
def shown_numbers() -> tuple[int, ...]:
    """Return the numbers of the FAPs that masks show, including the jaw's."""
    return tuple(sorted([JAW, *(fap.fap for fap in shown_faps())]))


def measure_fapu(neutral: Float64) -> Fapu:
    """Return the FAPU of a neutral face, millimetres, from its tracked points (64, 2) on the standard mask.

    Raises ModelError where they cannot be those of a neutral face.
    """
    features = np.full((len(feature_point_names()), 3), np.nan)
    for name, vertex in _vertex_of().items():
        features[point_rows()[name], :2] = neutral[vertex]
    for pupil, (above, below) in PUPILS.items():
        features[point_rows()[pupil], :2] = (neutral[above - 1] + neutral[below - 1]) / 2
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
    """Return the factors (2,), across and up, from the standard face's displacements to those of a face."""
    standard = _standard_fapu()
    return np.array([fapu[unit] / standard[unit] for unit in PART_UNITS[part]])


@cache
def _standard_fapu() -> Fapu:
    return measure_fapu(standard_points()[:TRACKED, :2])


def mask_faps(moved: Float64, fapu: Fapu, jaw: Float64) -> Float64:
    """Return FAPs (T, 68) for displacements (T, 86, 3) of masks from the neutral mask, millimetres.

    fapu: of the neutral mask. jaw: (5,), `ClassRecogniser.jaw`, from which FAP 3 follows the lips.
    """
    values = np.zeros((len(moved), FAP_COUNT))
    for fap in shown_faps():
        values[:, fap.fap - 1] = fap.sign * moved[:, fap.row, fap.axis] / fapu[fap.unit]
    for lids, widest in zip((UPPER_LIDS, LOWER_LIDS), MIN_LID_FAPS, strict=True):
        values[:, lids] = np.maximum(values[:, lids], widest)
    part_lids(values)
    values[:, JAW - 1] = np.maximum(values[:, [number - 1 for number in JAW_FAPS]] @ jaw, 0.0)
    return values

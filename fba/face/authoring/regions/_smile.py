"""What corners of the mouth do beside moving their points, above all in a smile.

Corners that are drawn apart slide back round the teeth. Corners that are raised push the cheek up into a
bulge below the eye, beside which the fold from nose to mouth deepens.
"""

from __future__ import annotations

import numpy as np

from fba.arrays import Float64
from fba.face.authoring.surface._fold_limits import Limiter
from fba.face.authoring.surface._motion import Motion, including
from fba.face.authoring.surface._motion_limits import human_range, soft_limit, stop_at_folds
from fba.face.authoring.surface._weights import trim_small
from fba.face.authoring.surface.landmarks import Landmarks
from fba.sampling import smoothstep

STRETCHING = (6, 7, 53, 54)
RAISING = {12: 1.0, 59: 1.0, 13: -1.0, 60: -1.0}
"""Side of the corner that each FAP raises."""
STRAIGHT = 100.0
"""Value up to which a stretched corner goes straight to the side; then it meets the teeth."""
BEND = 0.62
"""From there on, its way back as a share of its way to the side."""
BULGE = (0.62, 0.40)
"""How far the cheek comes out, and up, as shares of the way of a raised corner."""
FOLD = -0.20
"""The same of the fold beside it."""
CHEEK, CHEEK_BREADTH = {"5.3": 0.55, "9.1": 0.35, "8.3": 0.10}, 0.32
"""Where the bulge is: shares of feature points of the left side, and its breadth in ES0."""
FOLD_ENDS, FOLD_BREADTH = ({"8.3": 0.15, "9.1": 0.85}, {"8.3": 0.65, "9.1": 0.35}), 0.12
"""The same of the ends of the fold."""
RIGHT = {"5.3": "5.4", "9.1": "9.2", "8.3": "8.4"}
SMILE_NEAR, SMILE_REACH = 0.54, 0.78
"""Distances from the corner of the mouth between which all that fades out, in ES0."""
CORNER_STILL = 0.10
"""Distance from the corner of the mouth up to which it does not, in ES0."""
LEAST_CHEEK = 0.08
"""What is less of the bulge and the fold is left out."""
FOLD_OUTWARD = 0.09
"""Distance of the fold outside of the line from nose to mouth, in ES0."""


def add_smile(marks: Landmarks, limiter: Limiter, fap: int, motion: Motion) -> Motion:
    """Return the motion of the corner of the mouth by a FAP with what goes along; others as they are."""
    if fap in STRETCHING:
        return stop_at_folds(limiter, _stretched(_with_knot(motion)))
    if fap in RAISING:
        return stop_at_folds(limiter, _with_cheek(marks, motion, RAISING[fap], outer=fap > 50))
    return motion


def _with_knot(motion: Motion) -> Motion:
    """Return the same motion with `STRAIGHT` among its values."""
    values = np.union1d(motion.values, [min(STRAIGHT, motion.values[-1])])
    return Motion(values, motion.vertices, np.stack([motion.shifts_at(value) for value in values]))


def _stretched(motion: Motion) -> Motion:
    """Return a stretch that bends round the teeth."""
    shifts = motion.shifts.copy()
    apart = np.abs(motion.shifts[..., 0]) * (motion.values > 0)[:, None]
    shifts[..., 2] -= BEND * np.maximum(apart - np.abs(motion.shifts_at(STRAIGHT)[:, 0]), 0.0)
    return Motion(motion.values, motion.vertices, shifts)


def _with_cheek(marks: Landmarks, motion: Motion, side: float, *, outer: bool) -> Motion:
    """Return a raised corner with the cheek's bulge, of which the outer contour's FAP has the most."""
    surface, es = marks.surface, marks.fapu.ES * 1024
    share = 0.8 if outer else 0.2
    corner = marks.point_or_average("8.3" if side > 0 else "8.4")
    away = np.linalg.norm(surface.vertices - corner, axis=1) / es
    near = smoothstep((SMILE_REACH - away) / (SMILE_REACH - SMILE_NEAR)) * ~(marks.inside_mouth | marks.lips)
    near = near * smoothstep((away - CORNER_STILL) / CORNER_STILL)  # the corner has FAPs of its own
    bulge = _near_segment(marks, side, (CHEEK, CHEEK), 0.0) / CHEEK_BREADTH
    fold = _near_segment(marks, side, FOLD_ENDS, FOLD_OUTWARD) / FOLD_BREADTH
    bulge, fold = (near * trim_small(np.exp(-(distance**2)), LEAST_CHEEK) for distance in (bulge, fold))
    field = bulge[:, None] * (BULGE[0] * surface.normals + (0.0, BULGE[1], 0.0))
    field = share * (field + FOLD * fold[:, None] * surface.normals)
    motion = including(motion, np.flatnonzero(field.any(axis=1)))
    raised = _ways(motion.values, 12) * marks.fapu.MNS
    shifts = motion.shifts + raised[:, None, None] * field[motion.vertices]
    return Motion(motion.values, motion.vertices, shifts)


def _near_segment(
    marks: Landmarks, side: float, ends: tuple[dict[str, float], dict[str, float]], outward: float
) -> Float64:
    """Return (N,) distances in ES0 from a segment between mixtures of feature points, moved outward."""
    es = marks.fapu.ES * 1024
    points = [{name if side > 0 else RIGHT[name]: part for name, part in mixture.items()} for mixture in ends]
    start, end = (
        np.sum([part * marks.point_or_average(name) for name, part in mixture.items()], axis=0)
        for mixture in points
    )
    along = end - start
    offset = marks.surface.vertices - start - (side * outward * es, 0.0, 0.0)
    place = np.clip(offset @ along / max(float(along @ along), 1e-12), 0.0, 1.0)
    return np.asarray(np.linalg.norm(offset - place[:, None] * along, axis=1) / es)


def _ways(values: Float64, fap: int) -> Float64:
    """Return the values (K,) of a FAP, slowed where human faces end."""
    most = human_range(fap)
    return np.array([soft_limit(value, most[int(value > 0)]) for value in values])

"""What a smile does beside moving the corners of the mouth: FAPs 6, 7, 12, 13 and 53, 54, 59, 60.

Corners that are drawn apart slide back round the teeth. Lips do not grow thin: their contours have FAPs of
their own, and captures would find those moved. Corners that are raised push the cheek up into a bulge below
the eye, beside which the fold from nose to mouth deepens.
"""

from __future__ import annotations

import numpy as np

from fba.arrays import Float64, Intp
from fba.face.authoring.surface._fold_limits import Limiter
from fba.face.authoring.surface._motion import Motion
from fba.face.authoring.surface._motion_limits import human_range, soft_limit, stop_at_folds
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
CHEEK, FOLD_PLACE = ({"5.3": 0.55, "9.1": 0.35, "8.3": 0.10}, 0.265), ({"8.3": 0.62, "9.1": 0.38}, 0.13)
"""Where they are: shares of feature points of the left side, and their breadth in ES0."""
RIGHT = {"5.3": "5.4", "9.1": "9.2", "8.3": "8.4"}
NEAR, REACH = 0.54, 0.78
"""Distances from the corner of the mouth between which all that fades out, in ES0."""
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
    near = smoothstep((REACH - away) / (REACH - NEAR)) * ~(marks.inside_mouth | marks.lips)
    field = np.zeros((len(surface), 3))
    for (points, breadth), (out, up), beside in (
        (CHEEK, BULGE, 0.0),
        (FOLD_PLACE, (FOLD, 0.0), FOLD_OUTWARD),
    ):
        names = {name if side > 0 else RIGHT[name]: part for name, part in points.items()}
        centre = np.sum([part * marks.point_or_average(name) for name, part in names.items()], axis=0)
        centre[0] += side * beside * es
        distance = np.linalg.norm(surface.vertices - centre, axis=1)
        weight = near * np.exp(-((distance / (breadth * es)) ** 2))
        field += weight[:, None] * (out * surface.normals + (0.0, up, 0.0))
    field *= share
    motion = _including(motion, np.flatnonzero(field.any(axis=1)))
    raised = _ways(motion.values, 12) * marks.fapu.MNS
    shifts = motion.shifts + raised[:, None, None] * field[motion.vertices]
    return Motion(motion.values, motion.vertices, shifts)


def _ways(values: Float64, fap: int) -> Float64:
    """Return the values (K,) of a FAP, slowed where human faces end."""
    most = human_range(fap)
    return np.array([soft_limit(value, most[int(value > 0)]) for value in values])


def _including(motion: Motion, more: Intp) -> Motion:
    """Return the same motion with further vertices, which stay where they are."""
    vertices = np.union1d(motion.vertices, more)
    shifts = np.zeros((len(motion.values), len(vertices), 3))
    shifts[:, np.searchsorted(vertices, motion.vertices)] = motion.shifts
    return Motion(motion.values, vertices, shifts)

"""Motions of the tongue: FAPs 43-47."""

from __future__ import annotations

import numpy as np

from fba.arrays import Float64
from fba.easing import smoothstep
from fba.face.authoring.surface._fold_limits import Limiter
from fba.face.authoring.surface._motion import Motion, fap_limits
from fba.face.authoring.surface._motion_limits import human_range, linear_motion, stop_at_folds
from fba.face.authoring.surface.landmarks import Landmarks
from fba.face.model import Part
from fba.face.points import TONGUE_ROLL

FAPS = (43, 44, 45, 46, 47)
POINTS = {43: ("6.1",), 44: ("6.1",), 45: ("6.1",), 46: ("6.2",), 47: ("6.2", "6.3", "6.4")}
TIP_BEND = 2.0
"""Power of the length with which the tip's motion falls off to the root, so that the tongue bends."""
ROLL_STEPS = 8
"""Number of values at which the roll is computed."""


def tongue_motion(marks: Landmarks, part: Part, fap: int) -> Motion | str:
    """Return the motion of the tongue's part for a FAP, or the reason why it cannot be made."""
    missing = [name for name in POINTS[fap] if np.isnan(marks.point(name)).any()]
    if missing:
        return f"feature point {missing[0]} is unknown"
    points = part.vertices.astype(np.float64)
    limiter = Limiter.from_mesh(points, part.triangles.astype(np.intp))
    if fap == TONGUE_ROLL:
        return stop_at_folds(limiter, _roll(marks, points))
    tip = marks.point("6.1")
    root = float(points[:, 2].min())
    if tip[2] - root <= 0:
        return "the tongue's tip (6.1) is not before its root"
    length = np.clip((points[:, 2] - root) / (tip[2] - root), 0.0, 1.0)
    if fap == 46:
        middle = (marks.point("6.2")[2] - root) / (tip[2] - root)
        if not 0 < middle < 1:
            return "the tongue's body (6.2) is not between its root and its tip"
        share = np.where(
            length < middle, smoothstep(length / middle), smoothstep((1 - length) / (1 - middle))
        )
    elif fap == 45:
        share = length
    else:
        share = length**TIP_BEND
    field = share[:, None] * marks.step(fap)
    return linear_motion(limiter, np.arange(len(points)), field, *fap_limits(fap), human_range(fap))


def _roll(marks: Landmarks, points: Float64) -> Motion:
    """Return the motion that turns the sides up about the middle line, more further out: a U in section."""
    middle, left, right = (marks.point(name) for name in ("6.2", "6.3", "6.4"))
    unit = marks.fapu.AU
    low, high = fap_limits(TONGUE_ROLL)
    steps = np.append(np.linspace(low, 0.0, 3), np.linspace(0.0, high, ROLL_STEPS + 1))
    values: Float64 = np.unique(np.round(steps)).astype(np.float64)
    half = (left[0] - right[0]) / 2
    x, y = points[:, 0] - middle[0], points[:, 1] - middle[1]
    root, tip = float(points[:, 2].min()), float(points[:, 2].max())
    along = (
        smoothstep((points[:, 2] - root) / max(left[2] - root, 1e-9)) if tip > root else np.ones(len(points))
    )
    shifts = np.zeros((len(values), len(points), 3))
    for k, value in enumerate(values):
        turn = value * unit * np.clip(x / half, -1.2, 1.2) * along
        shifts[k, :, 0] = x * np.cos(turn) - y * np.sin(turn) - x
        shifts[k, :, 1] = x * np.sin(turn) + y * np.cos(turn) - y
    return Motion(values, np.arange(len(points)), shifts)

"""Where eyes look, from points on their pupils."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from fba.arrays import Float64
from fba.capture.markers.targets import PUPILS
from fba.face.feature_points import row_of
from fba.face.gaze import LARGEST_GAZE

RADIUS = 0.01205
"""Metres from the middle of an adult's eyeball to its front, hardly different between them."""
SHUT = 0.3
"""Share of its neutral opening from which an eye is too shut to see the pupil."""
LIDS = {"3.5": ("3.1", "3.3"), "3.6": ("3.2", "3.4")}
"""Upper and lower lid of each pupil's eye."""


def find_gaze(moved: Float64, points: Float64, places: Collection[str], size: float) -> Float64 | None:
    """Return how far the eyes look to the left and down, float64 (T, 2), radians; None if no pupil is known.

    moved: (T, 84, 3), displacements of feature points from the neutral face, in which eyes look ahead,
    relative to the head, metres. points: (84, 3), the neutral face. places: those that are known. size: of
    the face, relative to an adult's. Both eyes look the same way, as eyes do, so that their noise is halved;
    an eye that is shut does not count, and if both are, they look as before and after.
    """
    known = [name for name in PUPILS if name in places]
    if not known:
        return None
    total, weight = np.zeros((len(moved), 2)), np.zeros(len(moved))
    for name in known:
        shift = moved[:, row_of()[name]] / (RADIUS * size)
        most = np.sin(LARGEST_GAZE)
        pitch = -np.arcsin(np.clip(shift[:, 1], -most, most))
        yaw = np.arcsin(np.clip(shift[:, 0] / np.cos(pitch), -most, most))
        counts = _open(moved, points, name, places)
        total += np.stack([yaw, pitch], axis=1) * counts[:, None]
        weight += counts
    rows = np.flatnonzero(weight > 0)
    if not len(rows):
        return np.zeros((len(moved), 2))
    seen = total[rows] / weight[rows, None]
    every = np.arange(len(moved))
    return np.stack([np.interp(every, rows, seen[:, axis]) for axis in range(2)], axis=1)


def _open(moved: Float64, points: Float64, pupil: str, places: Collection[str]) -> Float64:
    """Return 1 where an eye is open, 0 where it is shut, float64 (T,); 1 if nothing tells."""
    upper, lower = LIDS[pupil]
    if not {upper, lower} <= set(places):
        return np.ones(len(moved))
    above, below = row_of()[upper], row_of()[lower]
    neutral = points[above, 1] - points[below, 1]
    opening = neutral + moved[:, above, 1] - moved[:, below, 1]
    return np.asarray((opening > SHUT * neutral).astype(np.float64))

"""Where eyes look, from points on their pupils."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from fba.arrays import Float64
from fba.capture.markers.targets import PUPILS
from fba.face.feature_points import row_of

RADIUS = 0.01205
"""Metres from the middle of an adult's eyeball to its front, hardly different between them."""
MOST = 0.95
"""Share of the radius that a pupil goes to a side at most."""


def find_gaze(moved: Float64, places: Collection[str], size: float) -> Float64 | None:
    """Return yaw of the left and the right eye (to the left), then their pitch (down): float64 (T, 4).

    Angles are in radians. moved: (T, 84, 3), displacements of feature points from the neutral face, in which
    eyes look ahead, relative to the head, metres. places: those that are known; an eye whose pupil is not
    does as the other. size: of the face, relative to an adult's. None if no pupil is known.
    """
    known = [name for name in PUPILS if name in places]
    if not known:
        return None
    angles = []
    for name in PUPILS:
        shift = moved[:, row_of()[name if name in known else known[0]]] / (RADIUS * size)
        pitch = -np.arcsin(np.clip(shift[:, 1], -MOST, MOST))
        yaw = np.arcsin(np.clip(shift[:, 0] / np.cos(pitch), -MOST, MOST))
        angles.append((yaw, pitch))
    (left_yaw, left_pitch), (right_yaw, right_pitch) = angles
    return np.stack([left_yaw, right_yaw, left_pitch, right_pitch], axis=1)

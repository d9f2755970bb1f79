"""Synthetic faces as a tracker sees them: turned, in perspective, and with noise."""

from __future__ import annotations

import numpy as np

from fba.arrays import Float64
from fba.parameters import point_rows
from fba.persona.points._tracked import head_matrices
from fba.persona.points.layout import TRACKED, points_of_face

FAR = 0.9
"""Metres from the camera to the head."""
PIXELS = 1000.0
"""Pixels that a metre at this distance has: a face is about 150 of them wide."""
NOISE = 0.35
"""Pixels by which each point is off."""
ANGLE_NOISE = 0.02
"""Radians by which the angles of the head are off."""
TO_CAMERA = np.array([1.0, -1.0, -1.0])


def photograph(
    features: Float64, angles: Float64, random: np.random.Generator, *, noise: float = NOISE
) -> tuple[Float64, Float64]:
    """Return tracked points (T, 64, 2), pixels, y down, and head angles (T, 3) with their noise, radians.

    features: (T, 84, 3), metres. angles: (T, 3), pitch, yaw and roll of the head. noise: pixels.
    """
    centre = features[:, point_rows()["7.1"]][:, None]
    turned = (features - centre) @ np.swapaxes(head_matrices(angles), 1, 2)
    points = points_of_face(turned)[:, :TRACKED] / 1000.0 * TO_CAMERA
    picture = PIXELS * FAR * points[..., :2] / (FAR + points[..., 2:])
    picture = picture + noise * random.normal(size=picture.shape) + 500.0
    return picture, angles + ANGLE_NOISE * (noise > 0) * random.normal(size=angles.shape)

"""How far eyes turn: one limit for the gaze of every source."""

from __future__ import annotations

import warnings

import numpy as np

from fba.arrays import Float64
from fba.errors import FbaWarning
from fba.face.points import PITCH_EYE, YAW_EYE

LARGEST_GAZE = 0.6
"""Radians from straight ahead that an eye turns at most here, in any direction.

Eyes reach about 55 degrees at the very most (Guitton and Volle, 1987); beyond 30, people turn their heads."""
UNITS_PER_RADIAN = 1e5
"""FAP units per radian, of the FAPs that turn eyeballs."""


def limit_gaze(values: Float64, *, warn: bool = True) -> None:
    """Bring eyes in FAPs (T, 68) that turn too far back to the limit, in the same direction, in place.

    warn: whether to warn (FbaWarning) of eyes that turn further. What lies beyond is lost: the head turns as
    its own source says.
    """
    found = False
    for yaw, pitch in zip(YAW_EYE, PITCH_EYE, strict=True):
        columns = [yaw - 1, pitch - 1]
        angles = np.hypot(values[:, yaw - 1], values[:, pitch - 1]) / UNITS_PER_RADIAN
        values[:, columns] *= (LARGEST_GAZE / np.maximum(angles, LARGEST_GAZE))[:, None]
        found |= bool((angles > 1.01 * LARGEST_GAZE).any())
    if found and warn:
        warnings.warn(
            f"eyes that turn further than {np.degrees(LARGEST_GAZE):.0f} degrees from straight ahead are "
            "shown at that angle; what lies beyond is for the head, whose turns stay as they are",
            FbaWarning,
            stacklevel=3,
        )

"""Joint angles, in radians, that rotation matrices (..., 3, 3) hold."""

from __future__ import annotations

import numpy as np

from fba.arrays import Float64


def limb_angles(rotation: Float64) -> tuple[Float64, Float64, Float64]:
    """Angles x, y, z of Rx . Rz . Ry, the order of a limb's joint: flexion outermost, twisting innermost."""
    z = np.arcsin(np.clip(-rotation[..., 0, 1], -1.0, 1.0))
    x = np.arctan2(rotation[..., 2, 1], rotation[..., 1, 1])
    y = np.arctan2(rotation[..., 0, 2], rotation[..., 0, 0])
    return x, y, z


def foot_angles(rotation: Float64) -> tuple[Float64, Float64, Float64]:
    """Angles x, y, z of Rx . Ry . Rz: the ankle's flexion and twisting, then the subtalar joint's roll."""
    y = np.arcsin(np.clip(rotation[..., 0, 2], -1.0, 1.0))
    x = np.arctan2(-rotation[..., 1, 2], rotation[..., 2, 2])
    z = np.arctan2(-rotation[..., 0, 1], rotation[..., 0, 0])
    return x, y, z

"""Rotation matrices about the axes of the body's frame, and the angles in them. Radians, batched."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fba.arrays import Float64


def about(axis: int, angle: npt.ArrayLike) -> Float64:
    """Rotations about x, y or z (axis 0, 1, 2): float64 (..., 3, 3) for angles (...)."""
    angle = np.asarray(angle, dtype=np.float64)
    sine, cosine = np.sin(angle), np.cos(angle)
    result = np.zeros((*angle.shape, 3, 3))
    one, two = (axis + 1) % 3, (axis + 2) % 3
    result[..., axis, axis] = 1.0
    result[..., one, one] = result[..., two, two] = cosine
    result[..., two, one], result[..., one, two] = sine, -sine
    return result


def turned(rotation: Float64, vector: Float64) -> Float64:
    """Vectors (..., 3) under rotations (..., 3, 3)."""
    result: Float64 = np.einsum("...ij,...j->...i", rotation, vector)
    return result


def turned_back(rotation: Float64, vector: Float64) -> Float64:
    """Vectors (..., 3) under the inverse of rotations (..., 3, 3)."""
    result: Float64 = np.einsum("...ji,...j->...i", rotation, vector)
    return result


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

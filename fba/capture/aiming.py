"""Joint angles that point a bone in a wanted direction, for joints that lack a freedom."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fba.capture import rotations

Float = npt.NDArray[np.float64]

STEPS = 8


def product(axes: Float, angles: Float) -> Float:
    """Matrices (T, 3, 3): turns about axes (K, 3) by angles (T, K), outermost first."""
    result = np.broadcast_to(np.eye(3), (len(angles), 3, 3))
    for number, axis in enumerate(axes):
        result = result @ rotations.turn(axis, angles[:, number])
    return result


def aim(axes: Float, start: Float, bone: Float, wanted: Float, weights: Float) -> Float:
    """Angles (T, K) whose turns about axes (K, 3) bring bone (3,) or (T, 3) to wanted (T, 3).

    Of all that do, those closest to start (T, K), freedoms with small weights (K,) giving way first.
    Gauss-Newton from start, so start must not be far off. Directions are unit vectors.
    """
    angles = np.array(start)
    count = axes.shape[0]
    for _ in range(STEPS):
        reached = (product(axes, angles) @ bone[..., None])[:, :, 0]
        slopes = np.zeros((len(angles), 3, count))
        frame = np.broadcast_to(np.eye(3), (len(angles), 3, 3))
        for number, axis in enumerate(axes):
            slopes[:, :, number] = np.cross(frame @ axis, reached)
            frame = frame @ rotations.turn(axis, angles[:, number])
        square = weights * weights
        normal = np.einsum("tik,til->tkl", slopes, slopes) + np.diag(square)
        pull = np.einsum("tik,ti->tk", slopes, wanted - reached) + square * (start - angles)
        step = np.linalg.solve(normal, pull[:, :, None])[:, :, 0]
        length = np.abs(step).max(axis=1, keepdims=True)
        step *= np.minimum(1.0, 0.5 / np.maximum(length, 1e-12))  # no leaps where the bone is almost straight
        angles += step
        if np.abs(step).max(initial=0.0) < 1e-7:
            break
    return angles

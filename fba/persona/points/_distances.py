"""How far two masks are apart: Hausdorff's distance, and its modification by Dubuisson and Jain."""

from __future__ import annotations

import numpy as np

from fba.arrays import Float64


def _nearest(points: Float64, others: Float64) -> Float64:
    """Return how far each point (..., N, D) is from the nearest of the others (..., M, D): (..., N)."""
    own, other = (points**2).sum(axis=-1), (others**2).sum(axis=-1)
    square = own[..., :, None] + other[..., None, :] - 2 * points @ np.swapaxes(others, -1, -2)
    return np.asarray(np.sqrt(np.maximum(square.min(axis=-1), 0.0)))


def hausdorff_distance(points: Float64, others: Float64) -> Float64:
    """Return the largest distance of a point from the nearest of the others (equation 3.15): float64 (...).

    points: (..., N, D); others: (..., M, D). The distance back may be another.
    """
    return np.asarray(_nearest(points, others).max(axis=-1))


def mask_distance(points: Float64, others: Float64) -> Float64:
    """Return the mean distance of points from the nearest of the others (equation 3.16): float64 (...).

    points: (..., N, D); others: (..., M, D). The distance back may be another; the source has this one only.
    """
    return np.asarray(_nearest(points, others).mean(axis=-1))

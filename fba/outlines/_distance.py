"""Distances of silhouettes: the earth mover's between sets of points of equal mass, and that of outlines.

Rubner, Tomasi and Guibas, "The earth mover's distance as a metric for image retrieval", 2000. With masses
that are multiples of one quantum, the transportation problem is an assignment of quanta, which SciPy solves
exactly; sets of different mass are matched in part, as far as the smaller one reaches.

For the other, a silhouette becomes the distances of its pixels from its outline, negative outside, which are
cut off at a few pixels: unlike those of filled pixels, differences of these grow with how far an outline
moves, and unlike those of whole distances, they stay near the outline.
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from fba.arrays import Bool, Float32, Float64, Floating, Int64

BAND = 3.0
"""Pixels from the outline, of a silhouette 96 pixels long, at which its distances are cut off."""
Ground = Literal["cityblock", "euclidean"]
"""The distance between points, by SciPy's name: l1 or l2."""


def sample(masses: Float64, count: int) -> Int64:
    """Return nodes (count,), each as often as its share of the mass says, ascending."""
    reached = np.cumsum(masses)
    places = (np.arange(count) + 0.5) * (reached[-1] / count)
    nodes = np.minimum(np.searchsorted(reached, places), len(masses) - 1)
    return np.asarray(nodes, dtype=np.int64)


def earth_movers_distance(first: Floating, second: Floating, ground: Ground = "cityblock") -> float:
    """Return the least mean distance over which the points of one set are moved onto those of the other.

    first, second: (N, D) and (M, E), points of equal mass; missing dimensions are 0. If one set has more
    points, only as many of them are used as the other has.
    """
    from scipy.optimize import linear_sum_assignment
    from scipy.spatial.distance import cdist

    width = max(first.shape[1], second.shape[1])
    cost = cdist(_widen(first, width), _widen(second, width), ground)
    rows, columns = linear_sum_assignment(cost)
    return float(cost[rows, columns].mean())


def project(points: Floating) -> Floating:
    """Return sorted coordinates (D, N) of points (N, D), or (S, D, N) of (S, N, D): see `lower_bounds`."""
    return np.sort(np.swapaxes(points, -1, -2), axis=-1)


def lower_bounds(projected: Floating, all_projected: Floating, ground: Ground = "cityblock") -> Float64:
    """Return numbers (S,) that the distances from one set of points to S others cannot be below.

    projected: (D, N), all_projected: (S, D, N), as `project` returns them. In one dimension the least cost
    is that of matching in sorted order. What is moved in space moves in every coordinate, so that the l1
    distance is at least the sum of these costs, and the l2 distance the length of their vector.
    """
    along = np.abs(all_projected - projected).mean(axis=-1, dtype=np.float64)
    return np.asarray(along.sum(axis=-1) if ground == "cityblock" else np.sqrt((along**2).sum(axis=-1)))


def _widen(points: Floating, width: int) -> Floating:
    return np.pad(points, ((0, 0), (0, width - points.shape[1])))


def signed_distances(mask: Bool) -> Float32:
    """Return the distances (H, W) of pixels from the outline, -3..3 pixels, with the figure in the middle.

    mask: (H, W), of a figure that does not touch its border. Half a pixel aside is half the difference.
    """
    from scipy import ndimage

    away = ndimage.distance_transform_edt(mask) - ndimage.distance_transform_edt(~mask)
    result: Float32 = np.clip(away - np.sign(away) / 2, -BAND, BAND).astype(np.float32)
    for axis in (0, 1):
        used = np.flatnonzero(mask.any(axis=1 - axis))
        aside, half = divmod(mask.shape[axis] - 1 - int(used[0] + used[-1]), 2)
        result = np.roll(result, aside, axis)
        if half:
            result = np.asarray((result + np.roll(result, 1, axis)) / 2, dtype=np.float32)
    return result


def outline_distances(first: Bool, others: Bool) -> Float64:
    """Return how far the outlines of silhouettes (K, H, W) are from that of one (H, W): (K,).

    The root mean square, over the pixels near the first outline, of the differences of `signed_distances`,
    relative to the width of the masks.
    """
    one = signed_distances(first)
    near = max(int((np.abs(one) < BAND).sum()), 1)
    squares = [float(((signed_distances(other) - one) ** 2).sum()) for other in others]
    return np.asarray(np.sqrt(np.array(squares) / near) / first.shape[1])

"""The earth mover's distance between sets of points of equal mass, and bounds below it.

Rubner, Tomasi and Guibas, "The earth mover's distance as a metric for image retrieval", 2000. With masses
that are multiples of one quantum, the transportation problem is an assignment of quanta, which SciPy solves
exactly; sets of different mass are matched in part, as far as the smaller one reaches.
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from fba.arrays import Float64, Floating, Int64

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

"""Compiled search for the nearest points on triangles.

Ericson, "Real-Time Collision Detection" (2005), section 5.1.5.

Bounds: `_memoryless.py` makes the lists of triangles from triangles that it has checked, and an array of
results for each point.
"""

from __future__ import annotations

import numpy as np

from fba.arrays import Float64, Int32, Int64
from fba.compiled import compiled


@compiled
def nearest(
    points: Float64,
    corners: Float64,
    start: Int64,
    lists: Int32,
    own: Int32,
    triangle: Int32,
    weights: Float64,
) -> None:
    """Write the nearest triangle to each point i of the list own[i], and the weights of its corners.

    The triangles of list k are lists[start[k] : start[k + 1]].
    """
    for i in range(len(points)):
        best = np.inf
        for o in range(start[own[i]], start[own[i] + 1]):
            t = lists[o]
            v, w = _weights(points[i], corners[t])
            u = 1.0 - v - w
            squared = 0.0
            for k in range(3):
                off = u * corners[t, 0, k] + v * corners[t, 1, k] + w * corners[t, 2, k] - points[i, k]
                squared += off * off
            if squared < best:
                best = squared
                triangle[i] = t
                weights[i, 0], weights[i, 1], weights[i, 2] = u, v, w


@compiled
def _weights(p: Float64, corners: Float64) -> tuple[float, float]:
    """Return the weights of the second and the third corner of a triangle's point nearest to p."""
    ab0, ab1, ab2 = (
        corners[1, 0] - corners[0, 0],
        corners[1, 1] - corners[0, 1],
        corners[1, 2] - corners[0, 2],
    )
    ac0, ac1, ac2 = (
        corners[2, 0] - corners[0, 0],
        corners[2, 1] - corners[0, 1],
        corners[2, 2] - corners[0, 2],
    )
    x, y, z = p[0] - corners[0, 0], p[1] - corners[0, 1], p[2] - corners[0, 2]
    d1, d2 = ab0 * x + ab1 * y + ab2 * z, ac0 * x + ac1 * y + ac2 * z
    bb, bc = ab0 * ab0 + ab1 * ab1 + ab2 * ab2, ab0 * ac0 + ab1 * ac1 + ab2 * ac2
    cc = ac0 * ac0 + ac1 * ac1 + ac2 * ac2
    if d1 <= 0.0 and d2 <= 0.0:
        return 0.0, 0.0
    d3, d4 = d1 - bb, d2 - bc
    if d3 >= 0.0 and d4 <= d3:
        return 1.0, 0.0
    vc = d1 * d4 - d3 * d2
    if vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        return d1 / (d1 - d3) if d1 != d3 else 0.0, 0.0
    d5, d6 = d1 - bc, d2 - cc
    if d6 >= 0.0 and d5 <= d6:
        return 0.0, 1.0
    vb = d5 * d2 - d1 * d6
    if vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        return 0.0, d2 / (d2 - d6) if d2 != d6 else 0.0
    va = d3 * d6 - d5 * d4
    one, two = d4 - d3, d5 - d6
    if va <= 0.0 and one >= 0.0 and two >= 0.0:
        share = one / (one + two) if one + two > 0.0 else 0.0
        return 1.0 - share, share
    whole = va + vb + vc
    return (vb / whole, vc / whole) if whole > 0.0 else (0.0, 0.0)

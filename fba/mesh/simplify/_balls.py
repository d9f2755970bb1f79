"""How deep moving triangles cut the balls that they slide on, as lids do on eyeballs.

A ball is a row of numbers: its centre (3), the direction in which it looks (3), its size, and its radius at
equal steps of the angle from that direction, 0 to 180 degrees, as a cornea stands out.

Bounds: rows have at least two radii (`_memoryless.py` checks that); corners have shape (3, 3). An angle that
is no number never becomes an index.
"""

from __future__ import annotations

import math

import numpy as np

from fba.arrays import Float64
from fba.compiled import compiled, inlined

OUTSIDE = 0.97
"""Triangles whose corners at rest are this far out, in radii of the ball, must stay outside."""
NEAR = 2.0
"""Triangles further off than this, in sizes of the ball, do not cut it."""
SAMPLES = np.array([(0.5, 0.5, 0), (0, 0.5, 0.5), (0.5, 0, 0.5), (1 / 3, 1 / 3, 1 / 3)])
"""Places on a triangle that are looked at, as weights of its corners."""


@inlined
def _depth(ball: Float64, x: float, y: float, z: float) -> float:
    """Return how far a point is below the ball's surface, negative outside."""
    x, y, z = x - ball[0], y - ball[1], z - ball[2]
    away = math.sqrt(x * x + y * y + z * z)
    if away == 0.0:
        return float(ball[6])
    cosine = (x * ball[3] + y * ball[4] + z * ball[5]) / away
    steps = math.acos(min(max(cosine, -1.0), 1.0)) / math.pi * (len(ball) - 8)
    if not steps >= 0.0:  # NaN: too far away for squares
        return -math.inf
    k = min(int(steps), len(ball) - 9)
    return float(ball[7 + k] + (steps - k) * (ball[8 + k] - ball[7 + k]) - away)


@compiled
def cut_depth(ball: Float64, rest: Float64, moved: Float64) -> float:
    """Return how much deeper a triangle's middles are in a ball where it moved than at rest, in sizes of the
    ball; 0 for a triangle that is inside at rest, far away, or behind the ball's centre."""
    size = ball[6]
    for i in range(3):
        if _depth(ball, rest[i, 0], rest[i, 1], rest[i, 2]) > (1.0 - OUTSIDE) * size:
            return 0.0
    deepest = 0.0
    for s in range(len(SAMPLES)):
        x, y, z, u, v, w = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for i in range(3):
            share = SAMPLES[s, i]
            x, y, z = x + share * moved[i, 0], y + share * moved[i, 1], z + share * moved[i, 2]
            u, v, w = u + share * rest[i, 0], v + share * rest[i, 1], w + share * rest[i, 2]
        if (x - ball[0]) * ball[3] + (y - ball[1]) * ball[4] + (z - ball[2]) * ball[5] > 0.0:
            deepest = max(deepest, _depth(ball, x, y, z) - max(_depth(ball, u, v, w), 0.0))
    return float(deepest / size)


@compiled
def is_near(balls: Float64, ball: int, places: Float64, v: int) -> bool:
    """Return whether a vertex, of places (V, K, 3), is near a ball in any pose."""
    for k in range(places.shape[1]):
        squared = 0.0
        for i in range(3):
            squared += (places[v, k, i] - balls[ball, i]) ** 2
        if squared < (NEAR * balls[ball, 6]) ** 2:
            return True
    return False

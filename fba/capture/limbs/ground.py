"""The ground that the source's feet stand on: level, or, where a capture was not levelled, sloping."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.arrays import Float64

LOWEST = 20
"""Percentile of the lower foot's height that is the ground: single frames may dip through it."""
FAR = 0.15
"""Metres: a ground further than this from height 0 is no ground, but a chair, or a leap cut out."""
STEEPEST = 0.08
"""Rise over run: a steeper ground is none, but stairs, or a climb."""
LONG = 1.0
"""Metres that feet must have walked for a slope to be seen, and the shortest way that it is sought over."""
SLIGHT = 0.015
"""Metres by which a slope must rise under the feet to count."""
UPPER = 0.05
"""Weight of feet above the sought plane against that of feet below: it is to lie under them."""
NEAR = 0.03
"""Metres beyond which a foot above or below the plane says no more about it."""
STEPS = 20


@dataclass(frozen=True)
class Ground:
    """A plane: height at the origin, and rise along x and z, in metres."""

    height: float
    slope: tuple[float, float] = (0.0, 0.0)

    def under(self, points: Float64) -> Float64:
        """Heights (...) of the ground under points (..., 3)."""
        result: Float64 = self.height + points[..., 0] * self.slope[0] + points[..., 2] * self.slope[1]
        return result


def found(lowest: Float64, points: Float64) -> Ground:
    """The ground under feet that stand on it now and then; at height 0 where they never do.

    lowest: (2, T), heights of the lowest points of the feet, points: (2, T, 3), where the feet are, metres.
    """
    lower = lowest.argmin(axis=0)
    frames = np.arange(len(lower))
    heights, places = lowest[lower, frames], points[lower, frames]
    level = float(np.percentile(heights, LOWEST))
    flat = Ground(level if abs(level) <= FAR else 0.0)
    middle = places[:, [0, 2]].mean(axis=0)
    across = places[:, [0, 2]] - middle
    if np.ptp(across, axis=0).max() < LONG:
        return flat
    plane = _plane(heights, across)
    rise = across @ plane[1:]
    if np.linalg.norm(plane[1:]) > STEEPEST or np.ptp(np.percentile(rise, [5, 95])) < SLIGHT:
        return flat
    over = heights - rise
    sloping = float(np.percentile(over, LOWEST))
    # feet stand at one height above a plane that is the ground
    spread = [np.ptp(np.percentile(values, [LOWEST / 2, 60])) for values in (over, heights)]
    if abs(sloping) > FAR or spread[0] > 0.6 * spread[1]:
        return flat
    return Ground(sloping - float(middle @ plane[1:]), (float(plane[1]), float(plane[2])))


def _plane(heights: Float64, across: Float64) -> Float64:
    """Height and slopes (3,) of the plane under most points: least squares, those above counting little."""
    columns = np.column_stack([np.ones(len(heights)), across])
    hold = np.diag([0.0, 1.0, 1.0]) * len(heights) * (0.3 * LONG) ** 2 * UPPER
    plane = np.array([np.percentile(heights, 30), 0.0, 0.0])
    for _ in range(STEPS):
        over = heights - columns @ plane
        weights = np.where(over > 0, UPPER, 1.0) / np.maximum(1.0, np.abs(over) / NEAR)
        matrix = (columns * weights[:, None]).T @ columns + hold
        plane = np.linalg.solve(matrix, columns.T @ (weights * heights))
    return plane

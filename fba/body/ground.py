"""The ground under the feet of a capture: level, or sloping if the capture was not levelled."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.arrays import Float64

GROUND_PERCENTILE = 20
"""Percentile of the lower foot's height that is the ground: single frames may be below it."""
MAX_HEIGHT = 0.15
"""Largest height of the ground, metres; higher feet stand on a chair, or leap. Its depth has no limit: feet
are never under it."""
MAX_SLOPE = 0.08
"""Largest slope of the ground, rise over run; a steeper source climbs or uses stairs."""
MIN_EXTENT = 1.0
"""Smallest extent of the feet's path for which a slope is estimated, metres."""
MIN_RISE = 0.015
"""Smallest rise of a slope under the feet, metres."""
WEIGHT_ABOVE = 0.05
"""Weight of feet above the plane relative to feet below it: the plane must be under the feet."""
FULL_WEIGHT_DISTANCE = 0.03
"""Metres from the plane beyond which feet count less."""
PLANE_ROUNDS = 20


@dataclass(frozen=True)
class Ground:
    """A plane: height at the origin, and rise along x and z, in metres."""

    height: float
    slope: tuple[float, float] = (0.0, 0.0)

    def under(self, points: Float64) -> Float64:
        """Return the heights (...) of the ground under points (..., 3)."""
        return self.height + points[..., 0] * self.slope[0] + points[..., 2] * self.slope[1]


def level_under(lowest: Float64, points: Float64) -> Float64:
    """Return heights (2, T) of the ground, from the feet's lowest (2, T), heels and balls (2, 2, T, 3)."""
    middles = points.mean(axis=1)
    return find(lowest, middles).under(middles)


def find(lowest: Float64, points: Float64) -> Ground:
    """Return the ground under feet that sometimes stand on it; at height 0 if they are never near it.

    lowest: (2, T), heights of the lowest points of the feet. points: (2, T, 3), positions of the feet.
    Metres.
    """
    lower = lowest.argmin(axis=0)
    frames = np.arange(len(lower))
    heights, positions = lowest[lower, frames], points[lower, frames]
    level = float(np.percentile(heights, GROUND_PERCENTILE))
    flat = Ground(level if level <= MAX_HEIGHT else 0.0)
    middle = positions[:, [0, 2]].mean(axis=0)
    across = positions[:, [0, 2]] - middle
    if np.ptp(across, axis=0).max() < MIN_EXTENT:
        return flat
    plane = _plane(heights, across)
    rise = across @ plane[1:]
    if np.linalg.norm(plane[1:]) > MAX_SLOPE or np.ptp(np.percentile(rise, [5, 95])) < MIN_RISE:
        return flat
    over = heights - rise
    sloping = float(np.percentile(over, GROUND_PERCENTILE))
    # if the plane is the ground, standing feet are all at one height above it
    spread = [np.ptp(np.percentile(values, [GROUND_PERCENTILE / 2, 60])) for values in (over, heights)]
    if sloping > MAX_HEIGHT or spread[0] > 0.6 * spread[1]:
        return flat
    return Ground(sloping - float(middle @ plane[1:]), (float(plane[1]), float(plane[2])))


def _plane(heights: Float64, across: Float64) -> Float64:
    """Return height and slopes (3,) of the plane under most points: least squares, less weight above."""
    columns = np.column_stack([np.ones(len(heights)), across])
    hold = np.diag([0.0, 1.0, 1.0]) * len(heights) * (0.3 * MIN_EXTENT) ** 2 * WEIGHT_ABOVE
    plane = np.array([np.percentile(heights, 30), 0.0, 0.0])
    for _ in range(PLANE_ROUNDS):
        over = heights - columns @ plane
        weights = np.where(over > 0, WEIGHT_ABOVE, 1.0) / np.maximum(1.0, np.abs(over) / FULL_WEIGHT_DISTANCE)
        matrix = (columns * weights[:, None]).T @ columns + hold
        try:
            plane = np.linalg.solve(matrix, columns.T @ (weights * heights))
        except np.linalg.LinAlgError:  # heights so large that the weights vanish: no ground of any person
            break
    return plane

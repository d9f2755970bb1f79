"""Where the feet of a capture stand, and when."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from fba.arrays import Bool, Float64
from fba.body import SIDES
from fba.capture.comparison._figure import Figure

MAX_STANDING_SPEED = 0.25
"""Largest speed of a standing foot, in metres per second."""
MAX_STANDING_HEIGHT = 0.05
"""Largest height of a standing foot above the lowest heights, in metres."""
MAX_HEIGHT_DIFFERENCE = 0.3
"""Largest height, in metres, of a standing foot above the other: one that is always higher is in the air."""


class Floor(NamedTuple):
    """Where the feet of a source stand, in metres.

    lows: by side, the largest height at which a foot may stand. ground: the usual height at which feet stand;
    None if they never do. level: height of the person's floor; None where it has none.
    """

    lows: dict[str, float]
    ground: float | None
    level: float | None


def find_floor(sources: Iterable[Figure], rate: float, level: float | None = None) -> Floor:
    """Return where feet stand in all pieces of a motion together: in a piece they may never stand."""
    still: dict[str, list[Bool]] = {side: [] for side in SIDES}
    ends: dict[str, list[Float64]] = {side: [] for side in SIDES}
    lowest: dict[str, list[Float64]] = {side: [] for side in SIDES}
    for source in sources:
        for side in SIDES:
            if points := foot_points(source, side):
                still[side].append(_still(points, rate))
                ends[side].append(points[-1][:, 1])
                lowest[side].append(np.min([point[:, 1] for point in points], axis=0))
    heights = {side: np.concatenate(ends[side]) for side in SIDES if ends[side]}
    lows = {side: float(np.percentile(at, 5)) + MAX_STANDING_HEIGHT for side, at in heights.items()}
    lowest_of_both = min(lows.values(), default=0.0)
    lows = {side: min(low, lowest_of_both + MAX_HEIGHT_DIFFERENCE) for side, low in lows.items()}
    standing = [
        np.concatenate(lowest[side])[np.concatenate(still[side]) & (at < lows[side])]
        for side, at in heights.items()
    ]
    together = np.concatenate(standing) if standing else np.zeros(0)
    return Floor(lows, float(np.median(together)) if len(together) else None, level)


def find_standing(source: Figure, rate: float, lows: Mapping[str, float]) -> dict[str, Bool]:
    """Return by side bool (T,): whether a foot of the source stands: low, and hardly moving."""
    return {
        side: _still(points, rate) & (points[-1][:, 1] < lows[side])
        for side in SIDES
        if side in lows and (points := foot_points(source, side))
    }


def foot_points(source: Figure, side: str) -> list[Float64]:
    """Return the ankle (T, 3) and the end (T, 3) of a foot, without those that are missing."""
    return [point for point in (source.points.get(f"{side}_ankle"), source.toe(side)) if point is not None]


def _still(points: Sequence[Float64], rate: float) -> Bool:
    """Return bool (T,): whether any of the points (T, 3) hardly moves."""
    steps = np.diff(points, axis=1, append=np.array(points)[:, -1:])
    still: Bool = (np.linalg.norm(steps, axis=2) * rate < MAX_STANDING_SPEED).any(axis=0)
    return still

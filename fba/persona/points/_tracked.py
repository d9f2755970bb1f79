"""`TrackedFace`: the points that a tracker followed in a film of a face."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from fba.arrays import Bool, Float64
from fba.errors import ModelError
from fba.persona.points.layout import TRACKED

MAX_COORDINATE = 1e7
"""Largest coordinate, in pixels or any other unit."""


@dataclass(frozen=True, eq=False)
class TrackedFace:
    """64 points of a face in each picture of a film, and the turn of its head.

    points: float64 (T, 64, 2), in any unit, x to the right in the picture, y down; in the order of
    `fba.persona.points.layout`. angles: float64 (T, 3), radians, of the head about x (alpha, down), y (beta,
    to its left) and z (gamma, to its right), as FAPs 48 to 50 count them. tracked: bool (T,), whether the
    tracker saw the face; False for frames with numbers that are not finite. times: float64 (T,), seconds,
    increasing. rate: nominal frames per second. name: of the performance.

    Arrays are read-only copies. Raises ModelError if the parts contradict each other.
    """

    points: Float64
    angles: Float64
    tracked: Bool
    times: Float64
    rate: Fraction
    name: str = ""

    def __post_init__(self) -> None:
        points = np.array(self.points, dtype=np.float64)
        angles, times = np.array(self.angles, dtype=np.float64), np.array(self.times, dtype=np.float64)
        tracked = np.array(self.tracked, dtype=bool)
        count = len(points)
        if points.ndim != 3 or points.shape[1:] != (TRACKED, 2):
            raise ModelError(f"TrackedFace: points must have shape (T, {TRACKED}, 2), not {points.shape}")
        if angles.shape != (count, 3) or tracked.shape != (count,) or times.shape != (count,):
            raise ModelError(
                f"TrackedFace: {count} frames of points, but angles {angles.shape}, tracked {tracked.shape} "
                f"and times {times.shape}"
            )
        if count and not (np.isfinite(times).all() and (np.diff(times) > 0).all()):
            raise ModelError("TrackedFace: times must be finite, and each later than the one before")
        object.__setattr__(self, "rate", Fraction(self.rate))
        if self.rate <= 0:
            raise ModelError(f"TrackedFace: the rate must be positive, not {self.rate}")
        if (np.abs(points) > MAX_COORDINATE).any():
            frame, point, axis = np.argwhere(np.abs(points) > MAX_COORDINATE)[0].tolist()
            raise ModelError(f"frame {frame}: point {point + 1} is at {points[frame, point, axis]:g}")
        tracked &= np.isfinite(points).all(axis=(1, 2)) & np.isfinite(angles).all(axis=1)
        points[~tracked], angles[~tracked] = np.nan, np.nan
        for name, array in (("points", points), ("angles", angles), ("tracked", tracked), ("times", times)):
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    def __len__(self) -> int:
        return len(self.times)

"""Segments: frames from one I plane to the next, chosen for the fewest bits."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.arrays import Bool, Float64, Int64

MAX_CUTS = 48
"""Most places where a segment may begin, with the end: the time to weigh them grows with the square."""
MIN_SEGMENT_FRAMES = 5
"""Least number of frames between two such places. An I plane costs as much as a few P planes."""


@dataclass(frozen=True, eq=False)
class Cuts:
    """Where segments may begin and end.

    frames: int64 (C,), increasing, from 0 to the number of frames. needed: bool (C,), where one must begin.
    """

    frames: Int64
    needed: Bool

    def segment(self, first: int, last: int) -> slice:
        """Return the frames from one cut to another."""
        return slice(int(self.frames[first]), int(self.frames[last]))


def find_cuts(needed: Bool) -> Cuts | None:
    """Return cuts where they are needed, bool (T,), and evenly between; None if too many are needed.

    In that case the sent parameters change so often that weighing segments would take too long.
    """
    count = len(needed)
    forced = np.union1d(np.flatnonzero(needed), [0])
    if len(forced) >= MAX_CUTS:
        return None
    spare = MAX_CUTS - len(forced)
    even = np.arange(0, count, max(MIN_SEGMENT_FRAMES, -(-count // spare)))
    frames = np.union1d(np.union1d(forced, even), [count]).astype(np.int64)
    return Cuts(frames, np.isin(frames, forced))


def cheapest_segments(bits: Float64, cuts: Cuts) -> list[tuple[int, int]]:
    """Return the segments that take the fewest bits together, as pairs of cuts.

    bits: float64 (C, C), of a segment from one cut to another.
    """
    count = len(cuts.frames)
    best = np.full(count, np.inf)
    best[0] = 0.0
    before = np.zeros(count, dtype=np.intp)
    earliest = 0
    for last in range(1, count):
        candidates = best[earliest:last] + bits[earliest:last, last]
        before[last] = earliest + int(np.argmin(candidates))
        best[last] = candidates.min()
        if cuts.needed[last]:
            earliest = last
    segments: list[tuple[int, int]] = []
    last = count - 1
    while last:
        segments.append((int(before[last]), last))
        last = int(before[last])
    return segments[::-1]

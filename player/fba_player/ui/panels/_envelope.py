"""A curve with as many points as a line of pixels can show: extremes of the frames that share a column."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.arrays import Bool, Float64


@dataclass(frozen=True, eq=False)
class Envelope:
    """Points (N,) of a line: x as a share of the width, values, and whether the frame there was sent."""

    x: Float64
    values: Float64
    sent: Bool

    def runs(self) -> list[tuple[int, int]]:
        """(first, behind the last) of the stretches of points that were sent; single points have a pair."""
        edges = np.flatnonzero(np.diff(np.r_[False, self.sent, False].astype(np.int8)))
        return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def envelope(times: Float64, values: Float64, sent: Bool, low: float, high: float, columns: int) -> Envelope:
    """The curve between two times in so many columns.

    times: ascending. Where there are few frames, each is a point, and one before and one after the stretch
    as well; where there are many, each column has its least and its largest value.
    """
    if not len(times) or columns < 1 or not high > low:
        return Envelope(np.zeros(0), np.zeros(0), np.zeros(0, bool))
    first = np.searchsorted(times, low, side="left")
    last = np.searchsorted(times, high, side="right")
    if last - first <= 2 * columns:
        part = slice(max(int(first) - 1, 0), min(int(last) + 1, len(times)))
        return Envelope((times[part] - low) / (high - low), values[part], sent[part])
    edges = np.searchsorted(times, np.linspace(low, high, columns + 1)[:-1], side="left")
    starts, places = np.unique(edges, return_index=True)  # the last of those that begin alike has the frames
    places = np.r_[places[1:] - 1, columns - 1]
    kept = starts < last
    starts, places = starts[kept], places[kept]
    seen = values[: int(last)]
    least, largest = np.minimum.reduceat(seen, starts), np.maximum.reduceat(seen, starts)
    any_sent = np.logical_or.reduceat(sent[: int(last)], starts)
    # there and back, so that neighbours are joined
    up = (np.arange(len(starts)) % 2).astype(bool)
    pairs = np.where(up, [largest, least], [least, largest]).T
    return Envelope(np.repeat((places + 0.5) / columns, 2), pairs.ravel(), np.repeat(any_sent, 2))

"""Where decoding can go on after damage: I planes behind start codes, which most encoders send regularly."""

from __future__ import annotations

from collections import deque

_CYCLE = 2
"""Intervals that repeat at most: half a second at 25 frames/s is 13 and 12 frames in turn."""


class RestartPoints:
    """Learns the intervals between restart points, and predicts the next ones from them."""

    def __init__(self) -> None:
        self._last: int | None = None
        self._intervals: deque[int] = deque(maxlen=2 * _CYCLE)

    def add(self, index: int, *, behind_loss: bool) -> None:
        """Add the index of a restart point. behind_loss: others before it may have been lost."""
        if self._last is not None:
            if not behind_loss:
                self._intervals.append(index - self._last)
            elif index not in self._upcoming(index):
                self._intervals.clear()
            else:
                count = self._upcoming(index).index(index) % len(self._cycle()) + 1
                self._intervals.extend(self._cycle()[:count])
        self._last = index

    def forget(self) -> None:
        """Forget all, because indices count otherwise from now on."""
        self._last = None
        self._intervals.clear()

    def nearest(self, index: int) -> int | None:
        """Return the expected restart point, behind the last one, nearest to an index; None if irregular."""
        upcoming = self._upcoming(index)
        return min(upcoming, key=lambda point: abs(point - index)) if upcoming else None

    def _cycle(self) -> list[int]:
        """Return the intervals that repeat, beginning with the next; empty if they do not."""
        known = list(self._intervals)
        for count in range(1, _CYCLE + 1):
            if len(known) >= 2 * count and known[-count:] == known[-2 * count : -count]:
                return known[-count:]
        return []

    def _upcoming(self, index: int) -> list[int]:
        """Return restart points that are expected around an index, without those long before it."""
        cycle = self._cycle()
        if not cycle or self._last is None:
            return []
        whole = sum(cycle)
        point = self._last + max((index - self._last) // whole - 1, 0) * whole
        points = []
        for interval in 3 * cycle:
            point += interval
            points.append(point)
        return points

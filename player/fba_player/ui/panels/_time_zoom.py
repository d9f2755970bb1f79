"""The stretch of time that curves show: all of it at first, zoomed and moved by the mouse."""

from __future__ import annotations

SHORTEST = 0.05
"""Seconds that are always shown."""
NEAR = 1e-6


class Stretch:
    """From `low` to `high`, seconds, within the first and the last time of what is shown."""

    def __init__(self) -> None:
        self.first = self.last = self.low = self.high = 0.0

    @property
    def whole(self) -> bool:
        """Whether all of it is shown."""
        return self.low <= self.first + NEAR and self.high >= self.last - NEAR

    def bound(self, first: float, last: float) -> None:
        """What there is; where all of it was shown, it still is."""
        if (first, last) == (self.first, self.last):
            return
        everything = self.whole
        self.first, self.last = first, max(last, first)
        if everything:
            self.reset()
        else:
            self._set(self.low, self.high)

    def reset(self) -> None:
        """Show all."""
        self.low, self.high = self.first, self.last

    def zoom(self, factor: float, about: float) -> None:
        """Show so many times as much; the time `about` stays where it is."""
        self._set(about - (about - self.low) * factor, about + (self.high - about) * factor)

    def pan(self, seconds: float) -> None:
        """Move on by seconds, as far as there is something."""
        wide = self.high - self.low
        low = min(max(self.low + seconds, self.first), max(self.last - wide, self.first))
        self.low, self.high = low, low + wide

    def follow(self, time: float) -> None:
        """Turn the page where a time lies outside: it is then near the left edge."""
        wide = self.high - self.low
        if not self.low - NEAR <= time <= self.high + NEAR:
            self.pan(time - wide * 0.1 - self.low)

    def _set(self, low: float, high: float) -> None:
        if high - low < SHORTEST:
            middle = (low + high) / 2
            low, high = middle - SHORTEST / 2, middle + SHORTEST / 2
        wide = min(high - low, self.last - self.first)
        low = min(max(low, self.first), max(self.last - wide, self.first))
        self.low, self.high = low, low + wide

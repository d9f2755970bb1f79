"""The part of the time of a performance that its timeline and its curves show."""

from __future__ import annotations

MIN_SHOWN_SECONDS = 0.05
"""Shortest range of time that is shown."""
TIME_TOLERANCE = 1e-6
"""Seconds within which two times are the same."""


class TimeZoom:
    """The range of time that is shown: `low` to `high` in seconds, within `first` to `last`.

    At first it is all; the mouse zooms and moves it.
    """

    def __init__(self) -> None:
        self.first = self.last = self.low = self.high = 0.0

    @property
    def shows_all(self) -> bool:
        return self.low <= self.first + TIME_TOLERANCE and self.high >= self.last - TIME_TOLERANCE

    def bound(self, first: float, last: float) -> None:
        """Set the full range; if all of it was shown, it still is."""
        if (first, last) == (self.first, self.last):
            return
        everything = self.shows_all
        self.first, self.last = first, max(last, first)
        if everything:
            self.reset()
        else:
            self._set(self.low, self.high)

    def shows(self, time: float) -> bool:
        """Return whether a time is within the part that is shown."""
        return self.low - TIME_TOLERANCE <= time <= self.high + TIME_TOLERANCE

    def reset(self) -> None:
        """Show all."""
        self.low, self.high = self.first, self.last

    def zoom(self, factor: float, about: float) -> None:
        """Show `factor` times as much; the time `about` stays where it is on the screen."""
        self._set(about - (about - self.low) * factor, about + (self.high - about) * factor)

    def pan(self, seconds: float) -> None:
        """Move the range by seconds, within the full range."""
        wide = self.high - self.low
        low = min(max(self.low + seconds, self.first), max(self.last - wide, self.first))
        self.low, self.high = low, low + wide

    def follow(self, time: float) -> None:
        """If a time lies outside, move on by a page: the time is then near the left edge."""
        wide = self.high - self.low
        if not self.shows(time):
            self.pan(time - wide * 0.1 - self.low)

    def _set(self, low: float, high: float) -> None:
        if high - low < MIN_SHOWN_SECONDS:
            middle = (low + high) / 2
            low, high = middle - MIN_SHOWN_SECONDS / 2, middle + MIN_SHOWN_SECONDS / 2
        wide = min(high - low, self.last - self.first)
        low = min(max(low, self.first), max(self.last - wide, self.first))
        self.low, self.high = low, low + wide

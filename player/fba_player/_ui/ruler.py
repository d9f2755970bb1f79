"""A time axis: times to positions on the screen and back, ticks and labels."""

from __future__ import annotations

import math
from dataclasses import dataclass

LABEL_STEPS = (
    *(0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 15, 30),
    *(60, 120, 300, 600, 900, 1800, 3600, 7200, 18000, 36000),
)
"""Steps between labels that are easy to read, in seconds."""


@dataclass(frozen=True, slots=True)
class Ruler:
    """An axis from time `low` at x = `left` to `high` at x = `right`; seconds, and any unit of length."""

    low: float
    high: float
    left: float
    right: float

    def x(self, time: float) -> float:
        """Return the x of a time, limited to left..right."""
        share = (time - self.low) / (self.high - self.low) if self.high > self.low else 0.0
        return self.left + min(max(share, 0.0), 1.0) * (self.right - self.left)

    def time(self, x: float) -> float:
        """Return the time at x, limited to low..high."""
        wide = self.right - self.left
        share = min(max((x - self.left) / wide, 0.0), 1.0) if wide > 0 else 0.0
        return self.low + share * (self.high - self.low)

    def step(self, apart: float) -> float:
        """Return the least step in seconds for labels that are at least `apart` from each other."""
        wide = max(self.right - self.left, 1e-6)
        least = (self.high - self.low) * apart / wide
        tens_of_hours = max(math.ceil(least / 36000), 1) * 36000.0
        return next((step for step in LABEL_STEPS if step >= least), tens_of_hours)

    def ticks(self, step: float) -> list[float]:
        """Return the multiples of a step from low to high; at most 1001."""
        first, last = math.ceil(self.low / step - 1e-6), math.floor(self.high / step + 1e-6)
        return [number * step for number in range(first, min(last, first + 1000) + 1)]


def label(seconds: float, step: float) -> str:
    """Return the label of a time, with the digits that the step needs: "0:05", "0:05.2", "1:00:05"."""
    digits = 0 if step >= 1 else 1 if step >= 0.1 else 2
    parts = round(abs(seconds) * 10**digits)
    seconds_shown, rest = divmod(parts, 10**digits)
    minutes, seconds_shown = divmod(seconds_shown, 60)
    hours, minutes = divmod(minutes, 60)
    text = f"{seconds_shown:02d}" + (f".{rest:0{digits}d}" if digits else "")
    sign = "-" if seconds < 0 and parts else ""
    return f"{sign}{hours}:{minutes:02d}:{text}" if hours else f"{sign}{minutes}:{text}"

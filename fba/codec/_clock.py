"""Times of planes from frame rate, skips and time codes, as exact fractions."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np

from fba.arrays import Int64
from fba.codec.settings import FrameRate, TimeCode

DEFAULT_RATE = Fraction(25)
"""Frames per second, assumed with a warning if the first I plane states no rate."""


class StreamClock:
    """Computes the times of planes: `index`, `rate` and exact `time` of the next one.

    A plane follows the one before it after one frame period, and as many more as that one skips. A time code
    sets the clock; between two frames, the index is that of the nearer one.
    """

    def __init__(self) -> None:
        self.index = 0
        self.rate: Fraction | None = None
        self._anchor = Fraction(0)  # time of the plane that had index `_anchor_index`
        self._anchor_index = 0

    @property
    def time(self) -> Fraction:
        """Seconds at which the next plane is shown."""
        if self.rate is None:
            return self._anchor
        return self._anchor + Fraction(self.index - self._anchor_index) / self.rate

    def begin_intra(self, frame_rate: FrameRate | None, time_code: TimeCode | None) -> list[str]:
        """Apply the frame rate and time code of an I plane; return warnings about them."""
        problems = []
        rate = frame_rate.fraction if frame_rate is not None else self.rate
        if rate is None:
            rate = DEFAULT_RATE
            problems.append(f"the first I plane says no frame rate; {rate} frames/s assumed")
        now = self.time
        if rate != self.rate:
            if self.rate is not None:
                problems.append(f"the frame rate changes from {self.rate} to {rate}")
            self._anchor, self.rate = now, rate
            self.index = self._anchor_index = math.ceil(now * rate)
        if time_code is not None:
            text = f"time code {time_code.hours}:{time_code.minutes:02}:{time_code.seconds:02}"
            if not time_code.marker:
                problems.append(f"the marker bit of {text} is 0; that time code was not used")
            elif time_code.total_seconds < now:
                problems.append(f"{text} lies before the previous plane; it was not used")
            else:
                self._anchor = Fraction(time_code.total_seconds)
                nearest = math.floor(self._anchor * rate + Fraction(1, 2))
                self.index = self._anchor_index = max(nearest, self.index)
        return problems

    def advance(self, skips: Int64) -> Int64:
        """Return the indices of planes with these skips, int64 (T,), and advance the clock past them."""
        steps = np.cumsum(skips + 1)
        index = self.index + np.concatenate([[0], steps[:-1]])
        self.index += int(steps[-1])
        return index

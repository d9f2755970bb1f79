"""When planes are shown: frame rate, skips and time codes, in exact fractions."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np

from fba.arrays import Int64
from fba.codec.settings import FrameRate, TimeCode

DEFAULT_RATE = Fraction(25)
"""Assumed, with a warning, where the first I plane says none."""


class StreamClock:
    """Gives planes their times: `index` / `rate` of the next plane, and its exact `time`.

    A plane comes one frame period, and as many more as the plane before it skips, after that plane. A
    time code sets the clock; where it falls between two frames, the index is that of the nearer one.
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
        """Take in what an I plane says of time; what was odd about it."""
        odd = []
        rate = frame_rate.fraction if frame_rate is not None else self.rate
        if rate is None:
            rate = DEFAULT_RATE
            odd.append(f"the first I plane says no frame rate; {rate} frames/s assumed")
        now = self.time
        if rate != self.rate:
            if self.rate is not None:
                odd.append(f"the frame rate changes from {self.rate} to {rate}")
            self._anchor, self.rate = now, rate
            self.index = self._anchor_index = math.ceil(now * rate)
        if time_code is not None:
            said = f"time code {time_code.hours}:{time_code.minutes:02}:{time_code.seconds:02}"
            if not time_code.marker:
                odd.append(f"the marker bit of {said} is 0; that time code was not used")
            elif time_code.total_seconds < now:
                odd.append(f"{said} lies before the previous plane; it was not used")
            else:
                self._anchor = Fraction(time_code.total_seconds)
                nearest = math.floor(self._anchor * rate + Fraction(1, 2))
                self.index = self._anchor_index = max(nearest, self.index)
        return odd

    def advance(self, skips: Int64) -> Int64:
        """Indices of planes with these skips, int64 (T,); the clock moves on behind them."""
        steps = np.cumsum(skips + 1)
        index = self.index + np.concatenate([[0], steps[:-1]])
        self.index += int(steps[-1])
        return index

"""`CaptureTimes`: the frames of a capture, at its own times."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np

from fba.arrays import Float64


class CaptureTimes:
    """The frames of a capture whose times are its own, for a window or a film; see `Times`.

    times: float64 (T,), seconds, rising, one at least. rate: nominal frames a second.
    """

    growing = False
    arrived = 0

    def __init__(self, times: Float64, rate: Fraction) -> None:
        self._times = times
        self._rate = rate
        self.interpolate = True

    @property
    def frames(self) -> int:
        """How many frames there are."""
        return len(self._times)

    @property
    def rate(self) -> Fraction:
        """Frames a second, as the capture says."""
        return self._rate

    @property
    def start(self) -> Fraction:
        """Time of the first frame, seconds."""
        return self.time_of(0)

    @property
    def end(self) -> Fraction:
        """Time one frame period after the last frame, seconds."""
        return self.time_of(len(self._times) - 1) + 1 / self._rate

    @property
    def duration(self) -> Fraction:
        """Seconds from start to end."""
        return self.end - self.start

    def time_of(self, frame: int) -> Fraction:
        """Time of a frame, seconds, to a microsecond."""
        return Fraction(float(self._times[frame])).limit_denominator(1_000_000)

    def position(self, time: float) -> tuple[int, int, float]:
        """(frame, next frame, weight of the next) at a time in seconds; ValueError if it is not finite."""
        if not math.isfinite(time):
            raise ValueError(f"the time must be a finite number of seconds, not {time}")
        last = len(self._times) - 1
        # a frame's own time shows that frame, whatever the rounding
        before = int(np.searchsorted(self._times, time + 1e-6, side="right")) - 1
        before = min(max(before, 0), last)
        after = min(before + 1, last)
        gap = float(self._times[after] - self._times[before])
        share = (time - float(self._times[before])) / gap if gap > 0 else 0.0
        return before, after, min(max(share, 0.0), 1.0) if self.interpolate else 0.0

"""Times of planes from frame rate, skips and time codes, as exact fractions; and these fields for a time."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np

from fba.arrays import Int64
from fba.codec.settings import FrameRate, TimeCode
from fba.errors import RangeError, Remedy, warn

_MAX_JUMP_SECONDS = 60
"""Longest jump of a time code that is taken for lost frames without other damage."""
_REPEATED_RATES = 2
"""Number of I planes with the same rate after which another rate in a single I plane is damage."""
_CODED_HOURS = 32
"""Time codes are below this number of hours."""
DEFAULT_RATE = Fraction(25)
"""Frames per second, assumed with a warning if the first I plane states no rate."""


class StreamClock:
    """Computes the times of planes: `index`, `rate` and exact `time` of the next one.

    A plane follows the plane before it after one frame period, and the periods that it skips. A time code
    sets the clock; between two frames, the index is that of the nearer frame. A code that names the frame
    that comes next anyway does not change the clock: codes are whole seconds, and at a rate such as
    30000/1001 hardly any frame is at a whole second.
    """

    def __init__(self) -> None:
        self.index = 0
        self.rate: Fraction | None = None
        self.jump: int | None = None
        """Frames by which the time code of the last I plane exceeds the count of planes; None without."""
        self.refused = ""
        """The rate or time code of the last I plane that was not believed, for messages; else empty."""
        self.agreements = 0
        """Number of time codes that agreed with the count of planes."""
        self._anchor = Fraction(0)  # time of the plane that had index `_anchor_index`
        self._anchor_index = 0
        self._offset: int | None = None  # frames from the count to the last time code that was refused
        self._object_index = 0  # index at which this object begins
        self._last_jump = 0
        self._repeated_rates = 0  # I planes with the same rate as before
        self._doubted_rate: Fraction | None = None
        self._coded_index = -1  # index of the last plane whose time code was used
        self._started = False

    @property
    def time(self) -> Fraction:
        """Seconds at which the next plane is shown."""
        if self.rate is None:
            return self._anchor
        frames = self.index - self._anchor_index
        passed = Fraction(frames * self.rate.denominator, self.rate.numerator)
        return self._anchor + passed if self._anchor else passed

    def begin_intra(
        self, frame_rate: FrameRate | None, time_code: TimeCode | None, *, repair: bool = False
    ) -> list[str]:
        """Apply the frame rate and time code of an I plane; return warnings about them.

        repair: trust time codes more than the count of planes, which damage may have falsified, even a code
        before the previous plane, if it is after the last code. Another code must confirm a code that is
        before the last code, or more than a minute ahead of a count with which all codes have agreed. Another
        I plane must confirm a new frame rate in a stream that repeats its rate.
        """
        problems = []
        self.refused = ""
        rate = frame_rate.fraction if frame_rate is not None else self.rate
        if rate is None:
            rate = DEFAULT_RATE
            problems.append(f"the first I plane says no frame rate; {rate} frames/s assumed")
        if repair and frame_rate is not None and self._doubts_rate(rate):
            self.refused = f"the frame rate {rate} in place of {self.rate} was not used"
            rate = self.rate or rate
        now = self.time
        if rate != self.rate:
            if self.rate is not None:
                problems.append(f"the frame rate changes from {self.rate} to {rate}")
            self._anchor, self.rate = now, rate
            self.index = self._anchor_index = math.ceil(now * rate)
        self.jump = None
        if time_code is not None:
            nearest = nearest_frame(time_code.total_seconds, rate)
            if not time_code.marker:
                problems.append(f"the marker bit of time code {time_code} is 0; that time code was not used")
            elif self._started and nearest == self.index:
                self.jump = self._last_jump = 0
                self.agreements += 1
                self._coded_index = self.index
            elif time_code.total_seconds < now and not (repair and self._can_go_back(nearest)):
                problems.append(f"time code {time_code} lies before the previous plane; it was not used")
            elif repair and self._goes_too_far(nearest, rate):
                self.refused = f"time code {time_code} is far ahead of the count of planes; it was not used"
            else:
                if time_code.total_seconds >= now:
                    nearest = max(nearest, self.index)
                self.jump = self._last_jump = nearest - self.index
                self._anchor = Fraction(time_code.total_seconds)
                self.index = self._anchor_index = self._coded_index = nearest
        self._started = True
        return problems

    def skip_lost(self, frames: int) -> None:
        """Leave out frames that were lost."""
        self.index += frames

    def begin_object(self) -> None:
        """Begin another object of the stream; time codes do not go back to before its begin."""
        self._object_index = self.index

    def _can_go_back(self, index: int) -> bool:
        """Return whether a time code for an earlier frame corrects the count, or the last time code."""
        undone = self._last_jump > 0 and index == self.index - self._last_jump
        return self._is_confirmed(index) or index > self._coded_index or undone

    def _goes_too_far(self, index: int, rate: Fraction) -> bool:
        """Return whether a time code jumps ahead for the first time."""
        far = self.agreements > 0 and index - self.index > _MAX_JUMP_SECONDS * rate
        return not self._is_confirmed(index) and far

    def _is_confirmed(self, index: int) -> bool:
        """Return whether a frame of this object is as far from the count as the last that was compared."""
        offset, before = index - self.index, self._offset
        self._offset = offset
        return offset == before and index >= self._object_index

    def _doubts_rate(self, rate: Fraction) -> bool:
        """Return whether a rate is new in a stream that repeats its rate; a second I plane confirms it."""
        repeated, before = self._repeated_rates, self._doubted_rate
        self._doubted_rate = rate
        self._repeated_rates = repeated + 1 if rate == self.rate else repeated
        return rate not in (self.rate, before) and repeated >= _REPEATED_RATES

    def advance(self, skips: Int64) -> Int64:
        """Return the indices of planes with these skips, int64 (T,), and advance the clock past them."""
        following = self.index + np.cumsum(skips + 1)
        self.index = int(following[-1])
        return following - skips - 1


def nearest_frame(seconds: int, rate: Fraction) -> int:
    """Return the index of the frame that a time code, in seconds, names; halves are rounded up."""
    return math.floor(seconds * rate + Fraction(1, 2))


def frame_rate_fields(rate: Fraction) -> FrameRate:
    """Return the header fields for a rate. Raises RangeError if the syntax cannot carry it."""
    fields = FrameRate.from_fraction(rate)
    if fields is None:
        nearest = max(Fraction(round(rate * 16), 16), Fraction(1, 16))
        raise RangeError(
            f"{rate} frames/s cannot be coded: a rate is n/16 below 256, or 1000/1001 of that"
        ).with_remedies(
            Remedy(
                "rate", "resample first, e.g. with {}", f"{float(min(nearest, Fraction(4095, 16))):g}",
                "Animation.resample",
            )
        )  # fmt: skip
    return fields


def first_time_code(index: int, rate: Fraction) -> TimeCode | None:
    """Return the time code with which a decoder shows the first plane at this index; None for index 0.

    If no time code gives the index, returns None with an FbaWarning.
    """
    if index == 0:
        return None
    code = time_code(index, rate)
    if code is None:
        warn(
            f"the animation starts at {float(index / rate):g} s, which no time code says; the stream starts "
            "at 0",
            stacklevel=3,
        )
    return code


def time_code(index: int, rate: Fraction) -> TimeCode | None:
    """Return the time code of the frame with an index, or None.

    Time codes are whole seconds below 32 hours, and name the nearest frame.
    """
    seconds = math.floor(index / rate + Fraction(1, 2))
    if 0 <= seconds < _CODED_HOURS * 3600 and nearest_frame(seconds, rate) == index:
        return TimeCode(seconds // 3600, seconds // 60 % 60, seconds % 60)
    return None


def last_named_frame(index: float, rate: Fraction) -> int:
    """Return the last frame up to an index that a time code names."""
    seconds = math.floor(index / rate) + 1
    while nearest_frame(seconds, rate) > index:
        seconds -= 1
    return nearest_frame(seconds, rate)

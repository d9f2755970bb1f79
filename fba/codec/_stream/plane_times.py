"""Times of planes: exact in an undamaged stream, the most likely times behind damage."""

from __future__ import annotations

from collections import deque
from fractions import Fraction

import numpy as np

from fba.arrays import Int64
from fba.codec._stream.clock import StreamClock
from fba.codec._stream.damage import DamageLog
from fba.codec.settings import PlaneSettings
from fba.errors import BitstreamError

MAX_CYCLE = 2
"""Most intervals in a pattern that repeats: half a second at 25 frames/s is 13 and 12 frames in turn."""


class PlaneTimes:
    """Gives planes their times.

    log: of the damage; None if the first damage is an error. The log also gets what times reveal: how many
    frames were lost, and time codes and frame rates that contradict the planes before them.

    may_step_back: whether frames may have lower indices than misread frames before them. If not, frames that
    a time code puts before the last frame follow it at once.
    """

    def __init__(self, log: DamageLog | None) -> None:
        self.may_step_back = False
        self._log = log
        self._clock = StreamClock()
        self._restarts = RestartPoints()
        self._following = 0  # index after that of the last frame
        self._catching_up = False  # whether the clock stepped back behind `_following`

    @property
    def rate(self) -> Fraction:
        """Frames per second, since the last I plane."""
        rate = self._clock.rate
        assert rate is not None
        return rate

    def begin_object(self) -> None:
        """Begin another object of the stream."""
        self._clock.begin_object()

    def begin_intra(self, settings: PlaneSettings, number: int, bit: int) -> list[str]:
        """Apply the frame rate and time code of an I plane; return warnings about them.

        number, bit: of the plane, in the stream.
        """
        clock, log = self._clock, self._log
        behind_loss = log is not None and log.resuming
        lost = self._skip_lost(settings) if behind_loss else None
        agreed, rate = clock.agreements, clock.rate
        problems = clock.begin_intra(settings.frame_rate, settings.time_code, repair=log is not None)
        jump = clock.jump or 0
        if settings.start_code:
            if clock.rate != rate:
                self._restarts.forget()
            self._restarts.add(clock.index, behind_loss=behind_loss)
        if clock.rate != rate:
            self._catching_up = False  # indices of another rate
        elif jump < 0:
            self._catching_up = not self.may_step_back
        if log is not None:
            if behind_loss:
                log.resume(*((max(jump, 0), 0) if clock.jump is not None else lost or (None, None)))
            elif jump < 0 or (agreed and jump):
                error = BitstreamError(_describe_jump(settings, jump), plane=number, bit=bit)
                log.add(error, bit >> 3, frames_lost=max(jump, 0))
            if clock.refused:
                log.add(BitstreamError(clock.refused, plane=number, bit=bit), bit >> 3)
        return problems

    def advance(self, skips: Int64) -> tuple[Fraction, Int64]:
        """Return seconds of the first of the next planes, and index int64 (T,) of all. skips: (T,)."""
        start, index = self._clock.time, self._clock.advance(skips)
        if self._catching_up:
            late = max(self._following - int(index[0]), 0)
            self._catching_up = late > 0
            start += late / self.rate
            steps = np.arange(len(index))
            index = np.maximum(index - steps, self._following) + steps
        self._following = int(index[-1]) + 1
        return start, index

    def _skip_lost(self, settings: PlaneSettings) -> tuple[int, int] | None:
        """Skip as many frames as seem lost before an I plane; return their number and its uncertainty."""
        assert self._log is not None
        clock, code = self._clock, settings.time_code
        lost = self._log.estimate()
        if lost is not None and (code is None or not code.marker):
            expected = self._restarts.nearest(clock.index + lost[0])
            if expected is not None and expected >= clock.index:
                lost = expected - clock.index, lost[1]
                clock.skip_lost(lost[0])
            else:
                # In a stream with time codes, the next one sets the clock; until then it must not be ahead.
                clock.skip_lost(max(lost[0] - lost[1], 0) if clock.agreements else lost[0])
        return lost


def _describe_jump(settings: PlaneSettings, jump: int) -> str:
    """Return the text for a time code that contradicts the count of planes, unlike earlier time codes."""
    frames = f"{abs(jump)} frame{'s' if abs(jump) != 1 else ''}"
    finding = (
        f"{frames} are missing before this plane" if jump > 0 else f"the planes before it are {frames} late"
    )
    return f"the time code {settings.time_code} says that {finding}"


class RestartPoints:
    """Intervals between restart points, which predict the next ones.

    Decoding can go on after damage at I planes behind start codes, which most encoders send regularly.
    """

    def __init__(self) -> None:
        self._last: int | None = None
        self._intervals: deque[int] = deque(maxlen=2 * MAX_CYCLE)

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
        """Return the expected restart point after the last, nearest to an index; None if irregular."""
        upcoming = self._upcoming(index)
        return min(upcoming, key=lambda point: abs(point - index)) if upcoming else None

    def _cycle(self) -> list[int]:
        """Return the intervals that repeat, the next of them first; empty if none repeat."""
        past = list(self._intervals)
        for count in range(1, MAX_CYCLE + 1):
            if len(past) >= 2 * count and past[-count:] == past[-2 * count : -count]:
                return past[-count:]
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

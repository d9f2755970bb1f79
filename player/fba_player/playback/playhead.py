"""Where a performance is at any reading of a clock: what the picture and the sound both follow."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Motion:
    """A stretch of playing, or a standstill; immutable, so that the sound's thread may read it at any time.

    since: reading of the clock, seconds, at which the time is `here`, and before which it stands. speed:
    seconds of the animation a second of the clock; playing: False holds `here`. stop: the time at which it
    turns back or ends; low and high: what it then repeats, where loop is set; rest: where it else stands at
    the end. All times in seconds of the animation.
    """

    since: float
    here: float
    speed: float
    playing: bool
    stop: float
    low: float
    high: float
    rest: float
    loop: bool

    def time(self, clock: float) -> float:
        """Seconds of the animation at a reading of the clock."""
        if not self.playing or clock <= self.since:
            return self.here
        reached = self.here + (clock - self.since) * self.speed
        if reached < self.stop:
            return reached
        if self.loop and self.high > self.low:
            return self.low + (reached - self.stop) % (self.high - self.low)
        return self.rest

    def moving(self, clock: float) -> bool:
        """Whether the time moves on at that reading."""
        repeats = self.loop and self.high > self.low
        return self.playing and clock >= self.since and (repeats or not self.over(clock))

    def until_turn(self, clock: float) -> float:
        """Seconds of the clock until it starts, jumps or stops, at least; infinite where it stands still."""
        if not self.playing:
            return math.inf
        if clock < self.since:
            return self.since - clock
        if not self.over(clock):
            return (self.stop - self.time(clock)) / self.speed
        if self.loop and self.high > self.low:
            return (self.high - self.time(clock)) / self.speed
        return math.inf

    def over(self, clock: float) -> bool:
        """Whether the end has been passed by then, once at least."""
        return self.playing and self.here + (clock - self.since) * self.speed >= self.stop

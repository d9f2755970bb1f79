"""The time of an animation at any reading of a clock, for the picture and the sound alike."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Motion:
    """How the time follows the clock since the last change of the transport, playing or standing still.

    Immutable, so that the sound's thread may read it at any time. since: reading of the clock, in seconds, at
    which the time is `here`, as before it. speed: seconds of the animation per second of the clock. playing:
    False stays at `here`. stop: the time at which it jumps back or ends; low, high: the range that it repeats
    after that, if loop is set; rest: where it ends without a loop. Times are seconds of the animation.
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
        """Return the seconds of the animation at a reading of the clock."""
        if not self.playing or clock <= self.since:
            return self.here
        reached = self.here + (clock - self.since) * self.speed
        if reached < self.stop:
            return reached
        if self.loop and self.high > self.low:
            return self.low + (reached - self.stop) % (self.high - self.low)
        return self.rest

    def moving(self, clock: float) -> bool:
        """Return whether the time goes on at a reading of the clock."""
        repeats = self.loop and self.high > self.low
        return self.playing and clock >= self.since and (repeats or not self.over(clock))

    def until_turn(self, clock: float) -> float:
        """Return the seconds of the clock until it starts, jumps or stops; infinite if it stands still."""
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
        """Return whether it has reached the end at least once by that reading."""
        return self.playing and self.here + (clock - self.since) * self.speed >= self.stop

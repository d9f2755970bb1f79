"""Where a performance is at any reading of a clock: what the picture and the sound both follow."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Motion:
    """A stretch of playing, or a standstill; immutable, so that the sound's thread may read it at any time.

    since: reading of the clock, seconds, at which the time was `here`. speed: seconds of the animation a
    second of the clock; playing: False holds `here`. stop: the time at which it turns back or ends; low and
    high: what it then repeats, where loop is set; rest: where it else stands at the end. All times in
    seconds of the animation.
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
        if not self.playing:
            return self.here
        reached = self.here + (clock - self.since) * self.speed
        if reached < self.stop:
            return reached
        if self.loop and self.high > self.low:
            return self.low + (reached - self.stop) % (self.high - self.low)
        return self.rest

    def over(self, clock: float) -> bool:
        """Whether the end has been passed by then, once at least."""
        return self.playing and self.here + (clock - self.since) * self.speed >= self.stop

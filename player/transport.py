"""Playing, pausing, seeking: where in the performance the player is, without a window or OpenGL.

The clock is the wall clock times the speed. How often a picture is drawn plays no part: a slow machine
shows fewer pictures, never slower motion.
"""

from __future__ import annotations

import math
import time as wall
from collections.abc import Callable
from fractions import Fraction

from player.timeline import Timeline

SPEEDS = (0.1, 0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 2.0, 3.0, 4.0)
"""The steps of `faster` and `slower`."""


class Transport:
    """The position in a performance.

    timeline: gives the start, the end and the frames' own times. clock: seconds from any origin, for
    tests; the process's monotonic clock by default. Times are seconds of the animation.

    Starts paused at the first frame. At the end it goes back to the start where `loop` is set, else it
    stops on the last frame.
    """

    def __init__(
        self, timeline: Timeline, *, loop: bool = True, clock: Callable[[], float] = wall.monotonic
    ) -> None:
        self._timeline = timeline
        self._clock = clock
        self.start = float(timeline.start)
        self.end = max(float(timeline.end), self.start)
        self.loop = loop
        self.playing = False
        self.speed = 1.0
        self._anchor = (clock(), self.start)

    @property
    def duration(self) -> float:
        """Seconds from start to end."""
        return self.end - self.start

    @property
    def time(self) -> float:
        """Where the player is now; while playing, it moves with the clock."""
        self._settle()
        return self._reached()

    @property
    def frame(self) -> int:
        """Position, in the animation, of the frame shown now or the last one before."""
        return self._timeline.position(self.time)[0]

    def play(self) -> None:
        """Go on from here; from the start where the end has been reached."""
        if self.playing:
            return
        here = self._anchor[1]
        if here >= self._last_time():
            here = self.start
        self._anchor = (self._clock(), here)
        self.playing = True

    def pause(self) -> None:
        """Stop here, without jumping anywhere."""
        here = self.time
        self.playing = False
        self._anchor = (self._clock(), here)

    def toggle(self) -> None:
        """Play where paused, pause where playing."""
        if self.playing:
            self.pause()
        else:
            self.play()

    def seek(self, time: float) -> None:
        """Go to a time, kept within start and end; goes on playing where it was."""
        if not math.isfinite(time):
            raise ValueError(f"cannot seek to {time} seconds")
        self._anchor = (self._clock(), min(max(time, self.start), self.end))

    def seek_share(self, share: float) -> None:
        """Go to a share of the whole, 0 the start, 1 the last frame."""
        self.seek(self.start + min(max(share, 0.0), 1.0) * (self._last_time() - self.start))

    def step(self, frames: int) -> None:
        """Pause, and go this many frames on (or back): to the frame's own time."""
        self.pause()
        before, _, share = self._timeline.position(self._anchor[1])
        if frames < 0 and share > 0:
            frames += 1  # first back to the frame whose time has been passed
        target = min(max(before + frames, 0), self._timeline.frames - 1)
        self._anchor = (self._clock(), float(self._timeline.time_of(target)))

    def first(self) -> None:
        """Go to the first frame."""
        self.seek(self.start)

    def last(self) -> None:
        """Go to the last frame."""
        self.seek(self._last_time())

    def faster(self) -> None:
        """The next higher speed, up to 4."""
        self.set_speed(next((s for s in SPEEDS if s > self.speed + 1e-9), SPEEDS[-1]))

    def slower(self) -> None:
        """The next lower speed, down to 0.1."""
        self.set_speed(next((s for s in reversed(SPEEDS) if s < self.speed - 1e-9), SPEEDS[0]))

    def set_speed(self, speed: float) -> None:
        """Wall seconds become this many seconds of the animation; 0.1 to 4, else ValueError."""
        if not SPEEDS[0] <= speed <= SPEEDS[-1]:
            raise ValueError(f"the speed must lie between {SPEEDS[0]} and {SPEEDS[-1]}, not {speed}")
        self._anchor = (self._clock(), self.time)
        self.speed = speed

    def toggle_loop(self) -> None:
        """Loop or not."""
        self._settle()
        self.loop = not self.loop

    @property
    def share(self) -> float:
        """Where the player is, 0 the start, 1 the last frame or after."""
        whole = self._last_time() - self.start
        return min(max((self.time - self.start) / whole, 0.0), 1.0) if whole > 0 else 0.0

    def text(self) -> str:
        """Time, frame and speed, for people: "0:01.240 / 0:04.000   frame 31 / 100   1x"."""
        time = self.time
        parts = [
            f"{clock_text(time - self.start)} / {clock_text(self.duration)}",
            f"frame {self.frame + 1} / {self._timeline.frames}",
            f"{self.speed:g}x",
        ]
        if self.loop:
            parts.append("loop")
        return "   ".join(parts)

    def _last_time(self) -> float:
        return float(self._timeline.time_of(self._timeline.frames - 1))

    def _reached(self) -> float:
        since, here = self._anchor
        return here + (self._clock() - since) * self.speed if self.playing else here

    def _settle(self) -> None:
        """Deal with an end that has been passed."""
        if not self.playing:
            return
        now = self._clock()
        here = self._anchor[1] + (now - self._anchor[0]) * self.speed
        if here < self.end:
            return
        if self.loop and self.duration > 0:
            self._anchor = (now, self.start + (here - self.start) % self.duration)
        else:
            self.playing = False
            self._anchor = (now, self._last_time())


def clock_text(seconds: float | Fraction) -> str:
    """Seconds as minutes, or hours where there are any: "0:07.040", "1:02:03.500"."""
    thousandths = round(float(seconds) * 1000)
    minutes, rest = divmod(thousandths, 60_000)
    hours, minutes = divmod(minutes, 60)
    text = f"{rest // 1000:02d}.{rest % 1000:03d}"
    return f"{hours}:{minutes:02d}:{text}" if hours else f"{minutes}:{text}"

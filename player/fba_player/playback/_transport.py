"""Play, pause, seek, loop: the current time of what is played.

Time follows the wall clock, or that of the sound, times the speed, however often a picture is drawn: a slow
machine shows fewer pictures, never slower motion.

Picture and sound share a `Motion`, which gives the time of an animation at any reading of a clock.
"""

from __future__ import annotations

import math
import time as wall
from collections.abc import Callable
from dataclasses import dataclass

from fba_player.playback._timeline import clock_text, timecode
from fba_player.view.protocols import Times


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


SPEEDS = (0.1, 0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 2.0, 3.0, 4.0)
"""The steps of `faster` and `slower`."""
BUFFER_SECONDS = 0.25
"""Seconds of a live stream that must have arrived before it plays, and again after a gap."""
LATE_MARK_SECONDS = 0.1
"""Seconds: a mark out this shortly before the current time counts as set at it."""


class Transport:
    """The current time of a timeline that is played. Times are seconds of the animation.

    timeline: gives the start, the end and the times of frames; it may grow (`fba_player.playback.live`).
    clock: seconds from any origin, never going back; by default the monotonic clock of the process, see
    `use_clock`.

    It starts paused at the first frame. At the end it goes back to the start if `loop` is set, else it stops
    on the last frame. Marks limit what is played: at `mark_out` it jumps back to `mark_in`, or stops. After a
    seek beyond `mark_out` it plays to the end.

    At the end of what has arrived of a live stream it shows the last frame until `BUFFER_SECONDS` more have
    arrived, and goes on with the next frame: nothing that arrives late is skipped.
    """

    def __init__(
        self, timeline: Times, *, loop: bool = True, clock: Callable[[], float] = wall.monotonic
    ) -> None:
        self._timeline = timeline
        self._clock = clock
        self._latency = 0.0
        self._loop = loop
        self._speed = 1.0
        self._playing = False
        self._waiting = False
        self._mark_in: float | None = None
        self._mark_out: float | None = None
        self._arrived = timeline.arrived
        self._motion = self._motion_from(clock(), self.start)

    @property
    def start(self) -> float:
        """Time of the first frame."""
        return float(self._timeline.start)

    @property
    def end(self) -> float:
        """One frame period after the last frame, of those that have arrived."""
        return max(float(self._timeline.end), self.start)

    @property
    def duration(self) -> float:
        """Seconds from start to end."""
        return self.end - self.start

    @property
    def time(self) -> float:
        """The current time; while playing, it goes on with the clock."""
        return self._settle().time(self._clock())

    @property
    def clock(self) -> float:
        """Reading of the clock that it follows, seconds from any origin."""
        return self._clock()

    @property
    def frame(self) -> int:
        """The current frame, or the last one before the current time: its position in the animation."""
        return self._timeline.position(self.time)[0]

    @property
    def share(self) -> float:
        """The current time as a share: 0 at the start, 1 at the last frame or after."""
        duration = self._last_time() - self.start
        return min(max((self.time - self.start) / duration, 0.0), 1.0) if duration > 0 else 0.0

    @property
    def motion(self) -> Motion:
        """How the time follows the clock since the last change; any thread may read it."""
        return self._motion

    @property
    def playing(self) -> bool:
        """Whether it plays; also while it waits for a stream to arrive."""
        self._settle()
        return self._playing

    @property
    def waiting(self) -> bool:
        """Whether it shows the last frame until more of a live stream has arrived."""
        return self.playing and self._waiting

    @property
    def behind(self) -> float:
        """Seconds from the current time to the last frame that has arrived."""
        return max(self._last_time() - self.time, 0.0)

    def play(self) -> None:
        """Play from here; from the end, or `mark_out`, go back to the start, or `mark_in`, first."""
        if self.playing:
            return
        here = self._motion.here
        if (here >= self._last_time() and not self._timeline.growing) or here == self._mark_out:
            here = self._low()
        self._playing = True
        self._move(here, later=True)

    def pause(self) -> None:
        """Stop at the current time."""
        here = self.time
        self._playing = False
        self._move(here)

    def stop(self) -> None:
        """Stop at the current time, as `pause` does: no jump to the start."""
        self.pause()

    def toggle(self) -> None:
        """Play if paused, pause if playing."""
        if self.playing:
            self.pause()
        else:
            self.play()

    def seek(self, time: float) -> None:
        """Go to a time, limited to start..end, and go on from there. ValueError if it is not finite."""
        if not math.isfinite(time):
            raise ValueError(f"cannot seek to {time} seconds")
        self._settle()
        self._move(min(max(time, self.start), self.end), later=True)

    def seek_share(self, share: float) -> None:
        """Go to a share of the duration: 0 is the start, 1 the last frame."""
        self.seek(self.start + min(max(share, 0.0), 1.0) * (self._last_time() - self.start))

    def step(self, frames: int) -> None:
        """Pause, and go forward by a number of frames, or back if negative: to the exact time of a frame."""
        self.pause()
        before, _, share = self._timeline.position(self._motion.here)
        if frames < 0 and share > 0:
            frames += 1  # first back to the frame whose time has been passed
        target = min(max(before + frames, 0), self._timeline.frames - 1)
        self._move(float(self._timeline.time_of(target)))

    def first(self) -> None:
        """Go to the first frame."""
        self.seek(self.start)

    def last(self) -> None:
        """Go to the last frame; while a live stream is playing, `BUFFER_SECONDS` before it."""
        self.seek(self._last_time() - (BUFFER_SECONDS if self._timeline.growing and self._playing else 0.0))

    @property
    def speed(self) -> float:
        """Seconds of the animation per second of the clock."""
        return self._speed

    def faster(self) -> None:
        """Set the next higher speed, up to 4."""
        self.set_speed(next((s for s in SPEEDS if s > self.speed + 1e-9), SPEEDS[-1]))

    def slower(self) -> None:
        """Set the next lower speed, down to 0.1."""
        self.set_speed(next((s for s in reversed(SPEEDS) if s < self.speed - 1e-9), SPEEDS[0]))

    def set_speed(self, speed: float) -> None:
        """Set the speed: seconds of the animation per second of the clock, 0.1 to 4, else ValueError."""
        if not SPEEDS[0] <= speed <= SPEEDS[-1]:
            raise ValueError(f"the speed must lie between {SPEEDS[0]} and {SPEEDS[-1]}, not {speed}")
        here = self.time
        self._speed = float(speed)
        self._move(here)

    @property
    def loop(self) -> bool:
        """Whether it jumps back at the end, or at `mark_out`."""
        return self._loop

    @loop.setter
    def loop(self, loop: bool) -> None:
        here = self.time
        self._loop = bool(loop)
        self._move(here)

    def toggle_loop(self) -> None:
        """Turn the loop on or off."""
        self.loop = not self.loop

    @property
    def mark_in(self) -> float | None:
        """Where a loop begins, seconds; None for the start. Setting it at or after `mark_out` clears that."""
        return self._mark_in

    @mark_in.setter
    def mark_in(self, time: float | None) -> None:
        here = self.time
        self._mark_in = self._checked_mark(time, self.start, self._last_time())
        if self._mark_in is not None and self._mark_out is not None and self._mark_out <= self._mark_in:
            self._mark_out = None
        self._move(here)

    @property
    def mark_out(self) -> float | None:
        """Where a loop ends, seconds; None for the end. Setting it at or before `mark_in` clears that.

        If it is set to the current time while playing, playback jumps back or stops at once.
        """
        return self._mark_out

    @mark_out.setter
    def mark_out(self, time: float | None) -> None:
        here = self.time
        self._mark_out = out = self._checked_mark(time, self.start, self._stop())
        if self._mark_in is not None and out is not None and out <= self._mark_in:
            self._mark_in = None
        if out is not None and self._playing and out <= here < out + LATE_MARK_SECONDS:
            here = out
        self._move(here)

    def clear_marks(self) -> None:
        """Remove both marks."""
        here = self.time
        self._mark_in = self._mark_out = None
        self._move(here)

    @property
    def interpolate(self) -> bool:
        """Whether values between two frames are interpolated; False shows the earlier frame."""
        return self._timeline.interpolate

    @interpolate.setter
    def interpolate(self, interpolate: bool) -> None:
        self._timeline.interpolate = bool(interpolate)

    def use_clock(
        self, clock: Callable[[], float] = wall.monotonic, latency: float = 0.0
    ) -> tuple[Callable[[], float], float]:
        """Follow another clock from now on, without a jump; return the former clock and latency.

        latency: seconds that playing and seeking wait before time goes on, so that the sound, which a device
        still has to be given, begins with the picture and is not cut.
        """
        here, before = self.time, (self._clock, self._latency)
        self._clock = clock
        self._latency = latency
        self._motion = self._motion_from(clock(), here)
        return before

    @property
    def until_next_frame(self) -> float:
        """Seconds of the clock until another frame is shown, where each stays until the next."""
        time = self.time
        frame = self._timeline.position(time)[0]
        last = frame + 1 >= self._timeline.frames
        following = self.end if last else float(self._timeline.time_of(frame + 1))
        return max(following - time, 0.0) / self._speed

    def text(self) -> str:
        """Return the time, frame and speed as text: "0:01.240 / 0:04.000 frame 31 / 99 1x"."""
        clock = f"{clock_text(self.time - self.start)} / {clock_text(self.duration)}"
        parts = [clock, self.frame_text(), f"{self.speed:g}x"]
        return "   ".join([*parts, "loop"] if self.loop else parts)

    def frame_text(self) -> str:
        """Return the numbers of the current and of the last frame, from 0: "frame 31 / 99"."""
        return f"frame {self.frame} / {self._timeline.frames - 1}"

    def timecode(self, time: float | None = None) -> str:
        """Return the time code "h:mm:ss:ff" of a time, by default the current one.

        Times of frames follow the time codes of a stream, if it has any. Hours, minutes and seconds are those
        of the time itself at any rate; ff counts the frame periods that have begun in that second, from 00.
        """
        return timecode(self.time if time is None else time, self._timeline.rate)

    def _last_time(self) -> float:
        return float(self._timeline.time_of(self._timeline.frames - 1))

    def _stop(self) -> float:
        """Return when the last frame has been shown; in a live stream, the time of its last frame."""
        return self._last_time() if self._timeline.growing else self.end

    def _low(self) -> float:
        return self.start if self._mark_in is None else self._mark_in

    def _checked_mark(self, time: float | None, low: float, high: float) -> float | None:
        if time is None:
            return None
        if not math.isfinite(time):
            raise ValueError(f"a mark must be a finite number of seconds, not {time}")
        return min(max(float(time), low), high)

    def _motion_from(self, clock: float, here: float) -> Motion:
        out = self._mark_out
        inside = out is not None and here <= out
        stop = out if inside and out is not None else self._stop()
        return Motion(
            since=clock,
            here=here,
            speed=self._speed,
            playing=self._playing and not self._waiting,
            stop=stop,
            low=self._low(),
            high=self._stop() if out is None else out,
            rest=stop if inside else self._last_time(),
            loop=self._loop and (inside or not self._timeline.growing),
        )

    def _move(self, here: float, *, later: bool = False) -> None:
        now = self._clock()
        self._motion = self._motion_from(now + self._latency if later else max(now, self._motion.since), here)

    def _settle(self) -> Motion:
        """Update the motion after the end was passed, or frames have arrived."""
        arrived = self._timeline.arrived
        if arrived != self._arrived:
            self._arrived = arrived
            self._motion = self._motion_from(self._motion.since, self._motion.here)
        now = self._clock()
        if self._motion.over(now):
            motion, here = self._motion, self._motion.time(now)
            if not (motion.loop and motion.high > motion.low):
                at_mark = self._mark_out is not None and here <= self._mark_out
                self._waiting = self._timeline.growing and not at_mark
                self._playing = self._waiting
            self._motion = self._motion_from(now, here)
        elif self._waiting and (
            not self._timeline.growing or self._last_time() - self._motion.here >= BUFFER_SECONDS
        ):
            self._waiting = False
            self._motion = self._motion_from(now, self._motion.here)
        return self._motion

"""What a sound device is given: the sound of the moment at which it will be heard."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from fba.arrays import Float32, Int16
from fba_player.playback.playhead import Motion

FADE = 0.004
"""Seconds in which sound begins, ends, and goes over into another place: without them it would click."""
ROUNDING = 1e-7
"""Seconds: a turn this far ahead, by rounding, is now."""
SLIP = 0.002
"""Seconds by which the place that is due may differ from the one that follows the last."""


class SoundMixer:
    """Samples for a device from where the performance is when they are heard.

    take: gives samples, `SoundBlocks.take`. rate: of both. motion: where the performance is. origin: time of
    the animation, seconds, at which the first sample is heard; it may change at any time.

    At other speeds the sound is that of a tape: faster is higher. volume: 0 to 1; muted: silence, whatever
    the volume.
    """

    def __init__(
        self, take: Callable[[int, int], Int16], rate: int, motion: Callable[[], Motion], origin: float
    ) -> None:
        self.volume = 1.0
        self.muted = False
        self._take = take
        self._rate = rate
        self._motion = motion
        self.origin = origin
        self._cursor: float | None = None  # sample that follows the last; None in silence
        self._speed = 1.0
        self._since_start = math.inf  # samples since the sound began or jumped
        self._fade = max(round(FADE * rate), 1)
        self._tail: Float32 = np.zeros((0, 2), dtype=np.float32)  # what is left of the fading end

    def fill(self, clock: float, count: int) -> Int16:
        """Samples int16 (count, 2), of which the first is heard at that reading of the clock."""
        motion, rate = self._motion(), self._rate
        mixed = np.zeros((count, 2), dtype=np.float32)
        done = 0
        while done < count:
            now = clock + done / rate + ROUNDING
            turn = motion.until_turn(now) * rate
            piece = min(count - done, max(math.ceil(turn), 1)) if turn < count else count - done
            due = (motion.time(now) - self.origin) * rate if motion.moving(now) else None
            self._continue_at(due, motion.speed)
            if self._cursor is not None:
                mixed[done : done + piece] = self._fade_in(
                    self._read_at_speed(self._cursor, self._speed, piece)
                )
                self._cursor += piece * self._speed
            ending = min(piece, len(self._tail))
            mixed[done : done + ending] += self._tail[:ending]
            self._tail = self._tail[ending:]
            done += piece
        level = 0.0 if self.muted else self.volume
        return np.asarray(np.clip(np.rint(mixed * np.float32(level)), -32768, 32767), dtype=np.int16)

    def _continue_at(self, due: float | None, speed: float) -> None:
        """Go on with the sample that is due; where it does not follow the last, end that one softly."""
        here = self._cursor
        if here is not None and due is not None and abs(due - here) <= SLIP * self._rate * max(speed, 1.0):
            self._speed = speed
            return
        if here is not None:
            ramp = np.linspace(1, 0, self._fade, endpoint=False, dtype=np.float32)[:, None]
            self._tail = self._read_at_speed(here, self._speed, self._fade) * ramp
        self._cursor, self._speed = due, speed
        self._since_start = 0

    def _fade_in(self, samples: Float32) -> Float32:
        if self._since_start < self._fade:
            ramp = (np.arange(len(samples), dtype=np.float32) + np.float32(self._since_start)) / self._fade
            samples = samples * np.minimum(ramp, np.float32(1))[:, None]
        self._since_start += len(samples)
        return samples

    def _read_at_speed(self, first: float, speed: float, count: int) -> Float32:
        """(count, 2) samples from a place on, so many of the file's for one."""
        if speed == 1.0:
            return self._take(round(first), count).astype(np.float32)
        low = math.floor(first)
        samples = self._take(low, math.ceil(count * speed) + 2).astype(np.float32)
        at = first - low + np.arange(count + 1) * speed
        if speed < 1.0:
            rows = at[:-1].astype(np.intp)
            share = (at[:-1] - rows).astype(np.float32)[:, None]
            slow: Float32 = samples[rows] * (1 - share) + samples[rows + 1] * share
            return slow
        # The mean over what one sample stands for: the highest tones, which no device could play, are lost.
        sums = np.concatenate([np.zeros((1, 2)), np.cumsum(samples, axis=0, dtype=np.float64)])
        rows = np.minimum(at.astype(np.intp), len(samples) - 1)
        whole = sums[rows] + samples[rows] * (at - rows)[:, None]
        fast: Float32 = (np.diff(whole, axis=0) / speed).astype(np.float32)
        return fast

"""Samples for a sound device, matching the animation at the time when they are heard."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from fba.arrays import Float32, Int16
from fba_player.playback._transport import Motion

FADE_SECONDS = 0.004
"""Seconds over which sound fades in, out, and across a jump: without them it would click."""
ROUNDING_SECONDS = 1e-7
"""Seconds: a jump that is at most this far ahead is due now; the rest is rounding."""
SLIP_SECONDS = 0.002
"""Seconds by which the sample due now may differ from the next one in the file without counting as a jump."""


class SoundMixer:
    """Mixes the samples of a file that belong to the animation's time, with fades at starts, ends and jumps.

    take: returns samples of the file, as `SoundBlocks.take`. rate: samples per second, of the file and the
    device. motion: returns how the animation's time follows the clock. origin: time of the animation, in
    seconds, at which the file begins; it may change at any time.

    At other speeds than 1 the pitch changes, as with a tape. volume: 0 to 1; muted: silence, whatever the
    volume.
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
        self._fade = max(round(FADE_SECONDS * rate), 1)
        self._tail: Float32 = np.zeros((0, 2), dtype=np.float32)  # what is left of the fading end

    def fill(self, clock: float, count: int) -> Int16:
        """Return the samples int16 (count, 2); the first is heard at this reading of the clock."""
        motion, rate = self._motion(), self._rate
        mixed = np.zeros((count, 2), dtype=np.float32)
        done = 0
        while done < count:
            now = clock + done / rate + ROUNDING_SECONDS
            turn = motion.until_turn(now) * rate
            piece = min(count - done, max(math.ceil(turn), 1)) if turn < count else count - done
            due = (motion.time(now) - self.origin) * rate if motion.moving(now) else None
            self._continue_at(due, motion.speed)
            if self._cursor is not None:
                samples = self._read_at_speed(self._cursor, self._speed, piece)
                mixed[done : done + piece] = self._fade_in(samples)
                self._cursor += piece * self._speed
            ending = min(piece, len(self._tail))
            mixed[done : done + ending] += self._tail[:ending]
            self._tail = self._tail[ending:]
            done += piece
        level = 0.0 if self.muted else self.volume
        return np.asarray(np.clip(np.rint(mixed * np.float32(level)), -32768, 32767), dtype=np.int16)

    def _continue_at(self, due: float | None, speed: float) -> None:
        """Go on with the sample that is due; fade out the last one if this is a jump. None: silence."""
        here, slip = self._cursor, SLIP_SECONDS * self._rate * max(speed, 1.0)
        if here is not None and due is not None and abs(due - here) <= slip:
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
        """Return the samples float32 (count, 2) of the file from `first` on, resampled by `speed`."""
        if speed == 1.0:
            return self._take(round(first), count).astype(np.float32)
        low = math.floor(first)
        samples = self._take(low, math.ceil(count * speed) + 2).astype(np.float32)
        at = first - low + np.arange(count + 1) * speed
        if speed < 1.0:
            rows = at[:-1].astype(np.intp)
            share = (at[:-1] - rows).astype(np.float32)[:, None]
            return np.asarray(samples[rows] * (1 - share) + samples[rows + 1] * share)
        # The mean over the samples that become one: it removes the tones that would alias.
        sums = np.concatenate([np.zeros((1, 2)), np.cumsum(samples, axis=0, dtype=np.float64)])
        rows = np.minimum(at.astype(np.intp), len(samples) - 1)
        integral = sums[rows] + samples[rows] * (at - rows)[:, None]
        return (np.diff(integral, axis=0) / speed).astype(np.float32)

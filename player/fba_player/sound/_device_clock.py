"""A clock that follows a sound device."""

from __future__ import annotations

import time as wall
from collections import deque
from collections.abc import Callable

GAIN = 0.05
"""Share of the measured error by which each call of the device corrects the clock: calls are irregular."""
WINDOW = 10
"""Number of latest calls of which the earliest is used: a busy machine answers late, never early."""
JUMP = 0.05
"""Seconds of error, in the earliest call, beyond which the device must have stopped for a while."""


class SoundClock:
    """Seconds of sound that have been heard; call it for a reading.

    It counts the samples that the device takes, and follows the wall clock in between, which evens out the
    irregular times of its calls. It never goes back. Where the device stops taking samples, it goes on with
    the wall clock, and the samples that were not taken in time are never heard.

    rate: samples per second. latency: seconds from handing over samples to hearing them. monotonic: the wall
    clock, for tests. `take` is for the device's thread, reading the clock for any.
    """

    def __init__(self, rate: int, latency: float, *, monotonic: Callable[[], float] = wall.monotonic) -> None:
        self.rate = rate
        self.latency = latency
        self._monotonic = monotonic
        self._ahead: float | None = None  # this clock minus the wall clock
        self._samples = 0
        self._lost = 0.0  # seconds for which the device took nothing
        self._called = 0.0
        self._recent: deque[float] = deque(maxlen=WINDOW)  # by how much calls were early
        self._filling = True
        self._last = -latency

    def __call__(self) -> float:
        """Seconds; 0 when the first sample is heard, before that negative."""
        ahead = self._ahead
        if ahead is not None:
            self._last = max(self._last, self._monotonic() + ahead)
        return self._last

    def take(self, samples: int) -> float:
        """Count samples that the device takes; returns the reading at which the first of them is heard."""
        now = self._monotonic()
        if self._ahead is None:
            # A device fills its buffers at once when it starts, and begins to play then.
            self._ahead = -now
        elif self._filling:
            self._filling = now - self._called < 0.5 * samples / self.rate
        if not self._filling:
            here = self._samples / self.rate + self._lost - self.latency
            self._recent.append(here - now)
            off = max(self._recent) - self._ahead
            if off < -JUMP and len(self._recent) == WINDOW:
                self._lost -= off
                self._recent.clear()
            elif off > JUMP:
                self._ahead += off
            elif off > -JUMP:
                self._ahead += GAIN * off
        self._called = now
        first = self._samples / self.rate + self._lost
        self._samples += samples
        return first

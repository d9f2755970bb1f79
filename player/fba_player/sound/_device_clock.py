"""Time as a sound device counts it."""

from __future__ import annotations

import time as wall
from collections import deque
from collections.abc import Callable

GAIN = 0.05
"""Share of the difference by which each call of the device moves the clock: calls come irregularly."""
WINDOW = 10
"""Calls of which the most punctual tells: a busy machine answers late, never early."""
JUMP = 0.05
"""Seconds of difference, in the most punctual call, beyond which the device has stopped for a while."""


class SoundClock:
    """Seconds of sound that have been heard, read at any moment.

    The device says how many samples it takes each time; in between, and to even out when exactly it is
    served, the wall clock goes on. Never goes back. Where the device stops taking any, the wall clock alone
    counts on, and the samples it did not take in time are never heard.

    rate: samples a second. latency: seconds from handing over samples to hearing them. monotonic: the wall
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
        """The device takes so many samples; the reading at which the first of them is heard."""
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

"""`SampleOrder`: samples in the order of the sender's clock, despite late datagrams and clocks that jump."""

from __future__ import annotations

from bisect import insort
from collections import deque
from dataclasses import dataclass
from fractions import Fraction

from fba.live._protocols.sample import Sample

DAY = 86_400.0


@dataclass(frozen=True)
class Limits:
    """Limits of the order. Times are in seconds of the sender's clock."""

    jump: float = 1.0  # difference from the sample before from which a second sample must confirm the time
    clock_lead: float = 5.0  # by which the sender's clock may advance more than ours over a gap
    gap: float = 600.0  # longest gap that keeps its length
    step: float = 1.5  # periods between two samples above which another may still arrive
    waiting: int = 2  # samples that wait for an earlier one
    remembered: int = 64  # samples whose duplicates are recognised


LIMITS = Limits()

Timed = tuple[float, Sample]
"""Seconds from a sender's first sample, and the sample."""


class SampleOrder:
    """Gives times to the samples of a sender, and puts them in order.

    rate: the sender's frames per second. Counts of datagrams: doubled, that came twice; late, too late to be
    used; reordered, after a later datagram; strayed, whose time no other confirms. jumps: count of the times
    the sender's clock was set.
    """

    def __init__(self, rate: Fraction) -> None:
        self.doubled = self.late = self.reordered = self.strayed = self.jumps = 0
        self._period = 1.0 / float(rate)
        self._offset: float | None = None  # seconds of the sender's clock that are our 0
        self._newest = 0.0
        self._newest_at = 0.0  # on our clock
        self._aside: tuple[float, Sample] | None = None
        self._waiting: list[tuple[float, int, Sample]] = []
        self._count = 0
        self._last: float | None = None  # time of the last sample given out
        self._recent: deque[float] = deque(maxlen=LIMITS.remembered)

    def push(self, sample: Sample, now: float) -> list[Timed]:
        """Add a sample that came at `now`, seconds of our clock; return the samples that are in order now."""
        ready: list[Timed] = []
        for time, placed in self._place(sample, now):
            self._insert(time, placed, now)
            ready += self._take(LIMITS.waiting)
        return ready

    def finish(self) -> list[Timed]:
        """Return the remaining samples."""
        self.strayed += self._aside is not None
        self._aside = None
        return self._take(0)

    def _place(self, sample: Sample, now: float) -> list[Timed]:
        """Return samples with their times: this sample, and another that it confirms; none if unconfirmed."""
        if self._offset is None:
            self._offset, self._newest_at = sample.seconds, now
            return [(0.0, sample)]
        time = sample.seconds - self._offset
        time -= DAY * round((time - self._newest) / DAY) if abs(time - self._newest) > DAY / 2 else 0.0
        if abs(time - self._newest) <= LIMITS.jump:
            self.strayed += self._aside is not None
            self._aside = None
            return [(time, sample)]
        aside, self._aside = self._aside, (time, sample)
        if aside is None or abs(time - aside[0]) > LIMITS.jump:
            self.strayed += aside is not None
            return []
        self._aside = None
        shift = self._shift(min(aside[0], time), now)
        return [(aside[0] + shift, aside[1]), (time + shift, sample)]

    def _shift(self, time: float, now: float) -> float:
        """Return the shift of times from `time` on, which jumps: 0 for a gap."""
        passed = max(now - self._newest_at, self._period)
        if 0 < time - self._newest <= min(passed + LIMITS.clock_lead, LIMITS.gap):
            return 0.0
        assert self._offset is not None
        self.jumps += 1
        shift = self._newest + min(passed, LIMITS.gap) - time
        self._offset -= shift
        return shift

    def _insert(self, time: float, sample: Sample, now: float) -> None:
        if time in self._recent or any(time == other for other, _, _ in self._waiting):
            self.doubled += 1
            return
        if self._last is not None and time <= self._last:
            self.late += 1
            return
        self.reordered += time < self._newest
        if time >= self._newest:
            self._newest, self._newest_at = time, now
        self._count += 1
        insort(self._waiting, (time, self._count, sample))

    def _take(self, waiting: int) -> list[Timed]:
        """Return samples in order, but keep at most `waiting` that wait for an earlier sample."""
        ready = []
        while self._waiting:
            time, _, sample = self._waiting[0]
            next_frame = self._last is None or time - self._last <= LIMITS.step * self._period
            if not next_frame and len(self._waiting) <= waiting:
                break
            self._waiting.pop(0)
            self._last = time
            self._recent.append(time)
            ready.append((time, sample))
        return ready

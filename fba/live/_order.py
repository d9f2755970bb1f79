"""Put what a sender sends in order of its own clock: late, doubled and stray datagrams, clocks that jump."""

from __future__ import annotations

from bisect import insort
from collections import deque
from fractions import Fraction

from fba.live._protocols.sample import Sample

DAY = 86_400.0
NOON = DAY / 2
JUMP = 1.0
"""Seconds between two datagrams above which the second has to be confirmed by a third."""
TOLERANCE = 5.0
"""Seconds by which a sender's clock may have gone on further than ours."""
LONGEST_GAP = 600.0
"""Seconds of the longest gap that is kept as long as it was."""
WHOLE_STEP = 1.5
"""Frames between two datagrams above which one may still be on its way."""
MOST_HELD = 2
"""Datagrams that wait for one before them that is missing."""
REMEMBERED = 64
"""Datagrams, of which a second copy is known as such."""

Timed = tuple[float, Sample]
"""Seconds from a sender's first datagram, and what it says."""


class SampleOrder:
    """Gives times to the samples of one sender, and puts them in order.

    rate: frames per second that the sender sends. doubled, late, reordered: datagrams that came twice, too
    late to be used, and behind one that is later. strayed: those whose time no other confirms. jumps: how
    often the sender's clock was set to another time.
    """

    def __init__(self, rate: Fraction) -> None:
        self.doubled = self.late = self.reordered = self.strayed = self.jumps = 0
        self._period = 1.0 / float(rate)
        self._offset: float | None = None  # seconds of the sender's clock that are our 0
        self._newest = 0.0
        self._newest_at = 0.0  # on our own clock
        self._aside: tuple[float, Sample] | None = None
        self._held: list[tuple[float, int, Sample]] = []
        self._count = 0
        self._last: float | None = None  # time of the last sample given out
        self._known: deque[float] = deque(maxlen=REMEMBERED)

    def push(self, sample: Sample, now: float) -> list[Timed]:
        """Add a sample that came at `now`, seconds of our own clock; return those that are in order now."""
        ready: list[Timed] = []
        for time, one in self._place(sample, now):
            self._hold(time, one, now)
            ready += self._take(MOST_HELD)
        return ready

    def finish(self) -> list[Timed]:
        """Return the samples that are left."""
        self.strayed += self._aside is not None
        self._aside = None
        return self._take(0)

    def _place(self, sample: Sample, now: float) -> list[Timed]:
        """Return samples with their times: the one given, none, or also one that it confirms."""
        if self._offset is None:
            self._offset, self._newest_at = sample.seconds, now
            return [(0.0, sample)]
        time = sample.seconds - self._offset
        time -= DAY * round((time - self._newest) / DAY) if abs(time - self._newest) > NOON else 0.0
        if abs(time - self._newest) <= JUMP:
            self.strayed += self._aside is not None
            self._aside = None
            return [(time, sample)]
        aside, self._aside = self._aside, (time, sample)
        if aside is None or abs(time - aside[0]) > JUMP:
            self.strayed += aside is not None
            return []
        self._aside = None
        shift = self._shift(min(aside[0], time), now)
        return [(aside[0] + shift, aside[1]), (time + shift, sample)]

    def _shift(self, time: float, now: float) -> float:
        """Return what to add to times from `time` on, which lies apart from those before."""
        passed = max(now - self._newest_at, self._period)
        if 0 < time - self._newest <= min(passed + TOLERANCE, LONGEST_GAP):
            return 0.0
        assert self._offset is not None
        self.jumps += 1
        shift = self._newest + min(passed, LONGEST_GAP) - time
        self._offset -= shift
        return shift

    def _hold(self, time: float, sample: Sample, now: float) -> None:
        if time in self._known or any(time == held for held, _, _ in self._held):
            self.doubled += 1
            return
        if self._last is not None and time <= self._last:
            self.late += 1
            return
        self.reordered += time < self._newest
        if time >= self._newest:
            self._newest, self._newest_at = time, now
        self._count += 1
        insort(self._held, (time, self._count, sample))

    def _take(self, held: int) -> list[Timed]:
        """Return samples in order, but not those that wait for one before them, up to `most`."""
        ready = []
        while self._held:
            time, _, sample = self._held[0]
            whole = self._last is None or time - self._last <= WHOLE_STEP * self._period
            if not whole and len(self._held) <= held:
                break
            self._held.pop(0)
            self._last = time
            self._known.append(time)
            ready.append((time, sample))
        return ready

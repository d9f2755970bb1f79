"""A timeline of several performances, and the differences between two, parameter by parameter."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from fba.arrays import Float32, Float64, Int64
from fba.parameters import Bap, Fap, baps, faps
from fba_player.playback._timeline import FRAME_ROUNDING, Timeline, frame_position

MAX_COMMON_RATE = 1_000_000
"""Largest common rate, in frames per second, of performances with different rates."""


class CompareTimeline:
    """The frames of all performances at their own times. A `fba_player.view.protocols.Times`.

    A performance that does not overlap the first, as with time codes of different hours, is shifted to begin
    with it. A frame is every moment at which one of them has a frame. The rate is the first's.
    """

    def __init__(self, timelines: Sequence[Timeline]) -> None:
        if not timelines:
            raise ValueError("nothing to compare: there is no timeline")
        self.timelines = tuple(timelines)
        self.later = _later(self.timelines)
        """Exact seconds by which each performance is shifted to later times."""
        self._merged: tuple[int, Fraction, Int64] | None = None

    @property
    def rate(self) -> Fraction:
        """Frames per second of the first performance."""
        return self.timelines[0].rate

    @property
    def start(self) -> Fraction:
        """Start of the earliest performance."""
        return min(timeline.start + later for timeline, later in self._shown())

    @property
    def end(self) -> Fraction:
        """End of the latest performance."""
        return max(timeline.end + later for timeline, later in self._shown())

    @property
    def duration(self) -> Fraction:
        return self.end - self.start

    @property
    def frames(self) -> int:
        """Number of moments at which at least one performance has a frame."""
        return len(self._frames()[1])

    @property
    def growing(self) -> bool:
        return any(timeline.growing for timeline in self.timelines)

    @property
    def arrived(self) -> int:
        return sum(timeline.arrived for timeline in self.timelines)

    @property
    def interpolate(self) -> bool:
        return self.timelines[0].interpolate

    @interpolate.setter
    def interpolate(self, interpolate: bool) -> None:
        for timeline in self.timelines:
            timeline.interpolate = interpolate

    def own_time(self, number: int, time: float) -> float:
        """Return the time of performance `number` at a common time, seconds."""
        return time - float(self.later[number])

    def time_of(self, frame: int) -> Fraction:
        rate, index = self._frames()
        return Fraction(int(index[frame])) / rate

    def position(self, time: float) -> tuple[int, int, float]:
        rate, index = self._frames()
        return frame_position(index, rate, time, FRAME_ROUNDING * float(rate / self.rate))

    def times(self) -> Float64:
        """Return float64 (T,): times of all frames, seconds."""
        rate, index = self._frames()
        return index * rate.denominator / rate.numerator

    def _shown(self) -> zip[tuple[Timeline, Fraction]]:
        return zip(self.timelines, self.later, strict=True)

    def _frames(self) -> tuple[Fraction, Int64]:
        """Return a common rate, and the ascending indices of all frames at that rate."""
        arrived = self.arrived
        if self._merged is None or self._merged[0] != arrived:
            parts = [timeline.rate for timeline in self.timelines]
            parts += [1 / later for later in self.later if later]
            common = math.lcm(*(abs(part).numerator for part in parts))
            rate = Fraction(common, math.gcd(*(part.denominator for part in parts)))
            rate = min(rate, Fraction(MAX_COMMON_RATE))
            indices = []
            for timeline, later in self._shown():
                step, first = rate / timeline.rate, later * rate
                index = timeline.animation.index * step.numerator // step.denominator
                indices.append(index + first.numerator // first.denominator)
            self._merged = (arrived, rate, np.unique(np.concatenate(indices)))
        return self._merged[1:]


def _later(timelines: tuple[Timeline, ...]) -> tuple[Fraction, ...]:
    first = timelines[0]
    later = []
    for timeline in timelines:
        overlaps = timeline.start < first.end and first.start < timeline.end
        later.append(Fraction(0) if overlaps else first.start - timeline.start)
    return tuple(later)


MAX_FRAMES = 20_000
"""Longer performances are sampled at this many moments."""


@dataclass(frozen=True)
class Largest:
    """The largest difference in one parameter.

    kind: "fap" or "bap". most: in its unit, at `time` seconds. rms: root mean square over all moments.
    """

    kind: str
    number: int
    name: str
    unit: str
    most: float
    time: float
    rms: float


@dataclass(frozen=True, eq=False)
class Differences:
    """The second performance minus the first, at every moment at which either has a frame.

    times: float64 (T,), seconds, those that both have. faps: float32 (T, 68), in the FAPs' units. baps:
    float64 (T, 296), 1e-5 rad or mm. Values are as shown: held until the next is sent, interpolated between
    frames. Zeros if one performance has no face, or no body.
    """

    times: Float64
    faps: Float32
    baps: Float64

    def largest(self, count: int = 10) -> list[Largest]:
        """Return the `count` parameters with the largest differences in quantiser steps, largest first."""
        largest = []
        rows: list[tuple[str, Fap | Bap, int, Float32 | Float64]] = [
            *(("fap", fap, fap.step, self.faps) for fap in faps()),
            *(("bap", bap, bap.step_iso, self.baps) for bap in baps()),
        ]
        for kind, row, step, values in rows:
            course = values[:, row.number - 1].astype(np.float64)
            if not course.any():
                continue
            at = int(np.abs(course).argmax())
            unit = "1e-5 rad" if row.unit == "AU" else row.unit
            most, rms = float(abs(course[at])), float(np.sqrt(np.mean(course**2)))
            item = Largest(kind, row.number, row.name, unit, most, float(self.times[at]), rms)
            largest.append((most / max(step, 1), item))
        largest.sort(key=lambda pair: -pair[0])
        return [item for _, item in largest[:count]]


def differences(timeline: CompareTimeline, second: int = 1) -> Differences:
    """Return the differences between the first performance and number `second`; ValueError without one."""
    if not 0 < second < len(timeline.timelines):
        raise ValueError(f"there is no performance {second} to compare: {len(timeline.timelines)} are shown")
    first, other = timeline.timelines[0], timeline.timelines[second]
    bounds = [
        (shown.time_of(0) + later, shown.time_of(shown.frames - 1) + later)
        for shown, later in ((first, timeline.later[0]), (other, timeline.later[second]))
    ]
    low, high = (float(v) for v in (max(b[0] for b in bounds), min(b[1] for b in bounds)))
    times = timeline.times()
    times = times[(times >= low - 1e-9) & (times <= high + 1e-9)]
    if len(times) > MAX_FRAMES:
        times = times[np.linspace(0, len(times) - 1, MAX_FRAMES).astype(int)]
    faces, bodies = first.many(times - float(timeline.later[0]))
    other_faces, other_bodies = other.many(times - float(timeline.later[second]))
    face = first.animation.face is not None and other.animation.face is not None
    body = first.animation.body is not None and other.animation.body is not None
    return Differences(times, (other_faces - faces) * face, (other_bodies - bodies) * body)

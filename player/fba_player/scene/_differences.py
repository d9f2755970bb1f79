"""Differences between two performances, parameter by parameter, on one timeline."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.arrays import Float32, Float64
from fba.parameters import Bap, Fap, baps, faps
from fba_player.scene._compare_timeline import CompareTimeline

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

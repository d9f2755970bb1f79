"""The strip under the timeline: which expression a face shows when."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import groupby, pairwise

import numpy as np

from fba.animation import Animation
from fba.emotion import Readings, read_expressions
from fba.emotion.recogniser import NEUTRAL, UNKNOWN
from fba.errors import OptionError
from fba.face.resolve import FaceSettings

MAX_FRAMES = 20_000
"""Longer animations are not read: that would take more than some seconds beside the playing."""


@dataclass(frozen=True, slots=True)
class Stretch:
    """A time in which a face shows the same.

    start, end: seconds of the timeline. label: a family, an expression without one, "neutral" or "unknown".
    intensity: the mean, 0 to 100.
    """

    start: float
    end: float
    label: str
    intensity: float

    @property
    def shows(self) -> bool:
        """Whether it is an expression, not "neutral" or "unknown"."""
        return self.label not in (NEUTRAL, UNKNOWN)

    def __str__(self) -> str:
        return f"{self.label} {self.intensity:.0f}" if self.shows else self.label


def read_stretches(animation: Animation, model: FaceSettings | None) -> tuple[Stretch, ...]:
    """Return the expressions of an animation, one stretch after the other; none without a face, or if it is
    long."""
    if animation.face is None or len(animation) > MAX_FRAMES:
        return ()
    try:
        readings = read_expressions(animation, model)
    except OptionError:
        return ()
    return _stretches(readings, float(animation.index[0] / animation.rate), 1 / float(animation.rate))


def stretch_at(stretches: tuple[Stretch, ...], time: float) -> Stretch | None:
    """Return the stretch at a time in seconds; None without one."""
    return next((one for one in stretches if one.start <= time < one.end), None)


def _stretches(readings: Readings, begin: float, step: float) -> tuple[Stretch, ...]:
    found = []
    pairs = zip(readings.times.tolist(), readings.readings, strict=True)
    groups = [(label, list(group)) for label, group in groupby(pairs, key=lambda pair: pair[1].label)]
    starts = [group[0][0] for _, group in groups] + [readings.times[-1].item() + step]
    for (label, group), (start, end) in zip(groups, pairwise(starts), strict=True):
        intensity = float(np.mean([reading.intensity for _, reading in group]))
        found.append(Stretch(begin + start, begin + end, label, intensity))
    return tuple(found)

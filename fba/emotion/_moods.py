"""Moods: expressions with an intensity over time, for `fba.emotion.emote`."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fba.arrays import Float64
from fba.emotion._expressions import expression
from fba.emotion.blending import MAX_INTENSITY, NEUTRAL
from fba.errors import OptionError
from fba.sampling import smoothstep


@dataclass(frozen=True)
class Mood:
    """An expression at an intensity for a time.

    name: of an expression, or an alias. intensity: 0 to 100. start, end: seconds; None for the beginning and
    the end of the performance, without easing. ease: seconds from 0 to full intensity after `start`, and back
    before `end`; at most half the mood's length each.

    Raises OptionError for an unknown name, with the nearest, and for invalid numbers.
    """

    name: str
    intensity: float
    start: float | None = None
    end: float | None = None
    ease: float = 0.5

    def __post_init__(self) -> None:
        known = self.name if self.name == NEUTRAL else expression(self.name).name
        object.__setattr__(self, "name", known)
        if not math.isfinite(self.intensity) or not 0 <= self.intensity <= MAX_INTENSITY:
            raise OptionError(f"the intensity of {known!r} must be from 0 to 100, not {self.intensity:g}")
        for what, value in (("start", self.start), ("end", self.end)):
            if value is not None and not math.isfinite(value):
                raise OptionError(f"the {what} of {known!r} must be a number of seconds, not {value:g}")
        if not math.isfinite(self.ease) or self.ease < 0:
            raise OptionError(f"ease must be 0 or more seconds, not {self.ease:g}")
        if self.start is not None and self.end is not None and self.start >= self.end:
            raise OptionError(
                f"{known!r} ends at {self.end:g} s, but begins at {self.start:g} s: give an end after that"
            )

    def curve(self, times: Float64) -> Float64:
        """Return the intensity at times (T,), seconds: float64 (T,), 0 to 100."""
        start = -math.inf if self.start is None else self.start
        end = math.inf if self.end is None else self.end
        inside = (times >= start) & (times <= end)
        ease = min(self.ease, (end - start) / 2)
        if not ease:
            return np.where(inside, self.intensity, 0.0)
        share = smoothstep(np.minimum(times - start, end - times) / ease)
        return np.where(inside, self.intensity * share, 0.0)


@dataclass(frozen=True, eq=False)
class MoodCurve:
    """An expression whose intensity follows keys.

    times: float64 (K,), increasing, seconds. intensities: float64 (K,), 0 to 100; smooth between keys,
    constant before the first and after the last.

    Raises OptionError for an unknown name, and for keys that contradict each other.
    """

    name: str
    times: Float64
    intensities: Float64

    def __post_init__(self) -> None:
        object.__setattr__(self, "name", self.name if self.name == NEUTRAL else expression(self.name).name)
        times, intensities = (np.asarray(v, dtype=np.float64) for v in (self.times, self.intensities))
        if times.ndim != 1 or times.shape != intensities.shape or not len(times):
            raise OptionError(f"{self.name!r} needs one intensity for each of its times, and at least one")
        if not (np.isfinite(times).all() and np.isfinite(intensities).all()):
            raise OptionError(f"the keys of {self.name!r} must be numbers")
        if (np.diff(times) <= 0).any():
            at = times[int(np.argmax(np.diff(times) <= 0)) + 1]
            raise OptionError(f"the keys of {self.name!r} are not in increasing order at {at:g} s")
        if (intensities < 0).any() or (intensities > MAX_INTENSITY).any():
            raise OptionError(f"the intensities of {self.name!r} must be from 0 to 100")
        object.__setattr__(self, "times", times)
        object.__setattr__(self, "intensities", intensities)

    def curve(self, times: Float64) -> Float64:
        """Return the intensity at times (T,), seconds: float64 (T,), 0 to 100."""
        after = np.searchsorted(self.times, times, side="right")
        first, second = np.maximum(after - 1, 0), np.minimum(after, len(self.times) - 1)
        length = np.maximum(self.times[second] - self.times[first], 1e-12)
        share = smoothstep((times - self.times[first]) / length)
        step = self.intensities[second] - self.intensities[first]
        return np.asarray(self.intensities[first] + share * step)


def check_spans(moods: Sequence[Mood | MoodCurve], length: float) -> None:
    """Raise OptionError for a mood outside a performance of `length` seconds."""
    for mood in moods:
        if isinstance(mood, MoodCurve):
            if mood.times[0] > length or mood.times[-1] < 0:
                raise OptionError(
                    f"the keys of {mood.name!r} are at {mood.times[0]:g} to {mood.times[-1]:g} s, outside "
                    f"the performance, which lasts from 0 to {length:g} s: give times in it"
                )
            continue
        if mood.start is not None and mood.start > length:
            raise OptionError(
                f"{mood.name!r} begins at {mood.start:g} s, but the performance ends at {length:g} s: give "
                "an earlier time"
            )
        if mood.end is not None and mood.end <= 0:
            raise OptionError(f"{mood.name!r} ends at {mood.end:g} s: the performance begins at 0 s")


def intensity_curves(moods: Sequence[Mood | MoodCurve], times: Float64) -> dict[str, Float64]:
    """Return the intensity of each expression at times (T,), seconds: float64 (T,) by name.

    Where two moods of an expression ease into each other, the larger intensity counts.

    Raises OptionError where two moods of an expression have different intensities at the same time.
    """
    curves: dict[str, list[tuple[Mood | MoodCurve, Float64]]] = defaultdict(list)
    for mood in moods:
        if mood.name != NEUTRAL:
            curves[mood.name].append((mood, mood.curve(times)))
    for name, several in curves.items():
        for number, (one, _) in enumerate(several):
            for other, _ in several[:number]:
                _check_apart(name, one, other)
    return {name: np.max([curve for _, curve in several], axis=0) for name, several in curves.items()}


def _check_apart(name: str, one: Mood | MoodCurve, other: Mood | MoodCurve) -> None:
    """Raise OptionError unless two moods of an expression differ in time or have the same intensity."""
    if not isinstance(one, Mood) or not isinstance(other, Mood):
        raise OptionError(f"{name!r} has keys and another intensity as well: give one of them")
    begin = max(-math.inf if m.start is None else m.start for m in (one, other))
    end = min(math.inf if m.end is None else m.end for m in (one, other))
    if end - begin > one.ease + other.ease and one.intensity != other.intensity:
        between = "" if math.isinf(begin) or math.isinf(end) else f" from {begin:g} to {end:g} s"
        raise OptionError(
            f"{name!r} is given as {other.intensity:g} and as {one.intensity:g} at the same time{between}: "
            "give one of them, or other times"
        )

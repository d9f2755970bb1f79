"""Reads expressions from FAPs, frame by frame, without flicker: live, or a whole animation.

The likelihoods of single frames (`likelihood`) are joined over time by a hidden Markov model of what a face
shows: neutral, unknown, the six families and the expressions without a family. A state lasts `LASTING`
seconds on average, so that another needs evidence, not a moment's noise, to take over: the hysteresis.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from functools import cache

import numpy as np
import numpy.typing as npt
from numpy.lib.stride_tricks import sliding_window_view

from fba.arrays import Bool, Float64, Intp
from fba.emotion.expression import FAMILIES, NEUTRAL_POINT
from fba.emotion.expressions import expression
from fba.emotion.likelihood import INTENSITIES, NEUTRAL_PRIOR, UNKNOWN_PRIOR, candidates, model
from fba.emotion.mixing import point_of
from fba.errors import OptionError
from fba.parameters import FAP_COUNT, fap_numbers

NEUTRAL, UNKNOWN = "neutral", "unknown"
LASTING = 1.5
"""Seconds that a face shows the same, on average."""
INDEPENDENT = 6.0
"""Frames a second that say something new; more of them are alike."""
BLINK = 0.5
"""Seconds after which lids that are shut are no blink any more, and count."""
SHUT = 400
"""An upper lid that is this far down, in IRISD, may belong to a blink."""
STRESS_SECONDS = 2.0
"""Seconds in which brows that were lower may stress a word; those that are held show something."""
STRESS_SHARE = 0.5
"""Share of their height below which brows were lower at any time in these seconds."""
NEAREST = 3
"""Expressions that a reading lists."""
MIN_PROBABILITY = 0.02
"""Smallest probability of an expression in a reading's list."""
TINY = 1e-12


@dataclass(frozen=True)
class Nearest:
    """A named expression that a face may show. intensity: 0 to 100. probability: 0 to 1."""

    name: str
    intensity: float
    probability: float


@dataclass(frozen=True)
class Reading:
    """What a face shows in a frame.

    label: a family, an expression without a family, "neutral" or "unknown". probability: of the label.
    intensity: 0 to 100, of the label; 0 for neutral and unknown. nearest: named expressions, likeliest first;
    none where nothing is shown, or what is shown is like none. activation, evaluation: between the points of
    what may be shown; None for unknown.
    """

    label: str
    probability: float
    intensity: float
    nearest: tuple[Nearest, ...]
    activation: float | None
    evaluation: float | None


@cache
def labels() -> tuple[str, ...]:
    """Return all labels: "neutral", "unknown", the six families, expressions without a family."""
    loners = {one.name: None for one in candidates() if one.family >= len(FAMILIES)}
    return (NEUTRAL, UNKNOWN, *FAMILIES, *loners)


class ExpressionRecogniser:
    """Reads expressions from frames as they come.

    rate: frames a second. known: bool (68,), the FAPs that the source sends; a FAP that it never sends says
    nothing. None: all. baseline: float (68,), what the face shows at rest, which is subtracted; None: zeros,
    as the standard defines FAPs.

    Raises OptionError for a rate that is not positive, or arrays of another shape.
    """

    def __init__(
        self,
        rate: Fraction | float = 25,
        *,
        known: npt.ArrayLike | None = None,
        baseline: npt.ArrayLike | None = None,
    ) -> None:
        if not (math.isfinite(rate) and rate > 0):
            raise OptionError(f"the rate must be a positive number of frames a second, not {rate}")
        self._known = np.ones(FAP_COUNT, dtype=bool) if known is None else _row(known, "known").astype(bool)
        self._baseline = None if baseline is None else _row(baseline, "baseline").astype(np.float64)
        self._seconds = 1 / float(rate)
        self._shut_for = math.inf  # lids that are shut from the start are shut
        self._heights = np.zeros(0)  # of the brows in the last frames; held before the first
        self._state: Float64 | None = None  # of each label
        self._within: Float64 | None = None  # of each name and intensity, within its label

    def prepare(self) -> None:
        """Compute what frames are compared with, so that not even the first waits for it."""
        for known in (self._known, self._known & ~_lids()):
            for accents in (False, True):
                model(known, accents)
        _states()

    def push(self, faps: npt.ArrayLike) -> Reading:
        """Return what the next frame shows. faps: (68,), as `fba.face.resolve` gives them.

        A frame with a number that is not finite says nothing: it is read as the one before.
        """
        return self.push_frames(_row(faps, "faps")[None])[0]

    def push_frames(self, faps: npt.ArrayLike) -> list[Reading]:
        """Return what each of the next frames shows. faps: (T, 68)."""
        values = np.asarray(faps, dtype=np.float64)
        if values.ndim != 2 or values.shape[1] != FAP_COUNT:
            raise OptionError(f"FAPs must have shape (T, {FAP_COUNT}), not {values.shape}")
        valid = np.asarray(np.isfinite(values).all(axis=1))
        values = np.where(valid[:, None], values, 0.0)
        if self._baseline is not None:
            values = values - self._baseline
        logs = self._log_probabilities(values)
        readings = []
        for seen, usable in zip(logs, valid.tolist(), strict=True):
            self._advance(seen if usable else None)
            readings.append(self._reading())
        return readings

    def _log_probabilities(self, values: Float64) -> Float64:
        """Return logs for (T, 68) frames: those in a blink without the lids, those in an accent with it."""
        blinking, accented = self._find_blinks(values), self._find_accents(values)
        logs = np.empty((len(values), 2 + len(candidates()) * len(INTENSITIES)))
        for lids, known in ((True, self._known & ~_lids()), (False, self._known)):
            for accents in (False, True):
                chosen = (blinking == lids) & (accented == accents)
                if chosen.any():
                    logs[chosen] = model(known, accents).log_probabilities(values[chosen])
        return logs

    def _find_blinks(self, values: Float64) -> Bool:
        """Return which frames have lids that were shut a moment ago: bool (T,)."""
        upper = [column for column in _UPPER_LIDS if self._known[column]]
        blinking = np.zeros(len(values), dtype=bool)
        if not upper:
            return blinking
        shut_lids: list[bool] = np.asarray(values[:, upper].mean(axis=1) > SHUT).tolist()
        for frame, shut in enumerate(shut_lids):
            self._shut_for = self._shut_for + self._seconds if shut else 0.0
            blinking[frame] = shut and self._shut_for <= BLINK
        return blinking

    def _find_accents(self, values: Float64) -> Bool:
        """Return which frames have brows that were raised a moment ago: bool (T,)."""
        sides = [[column for column in side if self._known[column]] for side in _BROWS]
        heights = [values[:, side].mean(axis=1) for side in sides if side]
        if not heights or not len(values):
            return np.zeros(len(values), dtype=bool)
        height = np.max(heights, axis=0)
        before = max(1, round(STRESS_SECONDS / self._seconds))
        missing = np.full(before - len(self._heights), height[0])
        every = np.concatenate([missing, self._heights, height])
        self._heights = every[-before:]
        lowest = sliding_window_view(every, before + 1).min(axis=1)
        accented: Bool = (height > 0) & (lowest < STRESS_SHARE * height)
        return accented

    def _advance(self, logs: Float64 | None) -> None:
        """Take in the logs of a frame, (2 + 7 N,); None for one that says nothing."""
        if self._state is None or self._within is None:
            if logs is not None:
                self._state, self._within = _weigh(logs)
            return
        stay = math.exp(-self._seconds / LASTING)
        state = stay * self._state + (1 - stay) * _states().priors
        if logs is not None:
            weight = min(1.0, self._seconds * INDEPENDENT)
            seen, within = _weigh(logs)
            state = state * (np.maximum(seen, TINY) / _states().priors) ** weight
            self._within = (1 - weight) * self._within + weight * within
        self._state = state / state.sum()

    def _reading(self) -> Reading:
        if self._state is None or self._within is None:
            return Reading(UNKNOWN, 1.0, 0.0, (), None, None)
        table = _states()
        number = int(self._state.argmax())
        label = labels()[number]
        joint = self._within * self._state[table.label_of, None]  # of each name at each intensity
        shown = joint.sum(axis=1)
        strength = joint @ _STRENGTHS
        own = table.label_of == number
        intensity = float(strength[own].sum() / shown[own].sum()) if own.any() and shown[own].any() else 0.0
        nearest: tuple[Nearest, ...] = ()
        point: tuple[float, float] | tuple[None, None] = (None, None)
        if label != UNKNOWN:
            offset = strength @ table.offsets / max(1 - float(self._state[1]), TINY)
            point = (NEUTRAL_POINT[0] + float(offset[0]), NEUTRAL_POINT[1] + float(offset[1]))
        if number >= len((NEUTRAL, UNKNOWN)):
            order = np.argsort(-shown)[:NEAREST]
            nearest = tuple(
                Nearest(
                    table.names[row], 100 * min(float(strength[row] / shown[row]), 1.0), float(shown[row])
                )
                for row in order.tolist()
                if shown[row] >= MIN_PROBABILITY
            )
        return Reading(label, float(self._state[number]), 100 * min(intensity, 1.0), nearest, *point)


@dataclass(frozen=True, eq=False)
class _States:
    """How candidates, names and labels belong together.

    names: K, of expressions. name_of: float64 (K, N), 1 where a candidate has a name. label_of: int (K,), the
    label of each name. of_label: float64 (L, K), 1 where a name has a label. priors: float64 (L,). offsets:
    float64 (K, 2), from `NEUTRAL_POINT`.
    """

    names: tuple[str, ...]
    name_of: Float64
    label_of: Intp
    of_label: Float64
    priors: Float64
    offsets: Float64


@cache
def _states() -> _States:
    listed = candidates()
    names = tuple(dict.fromkeys(one.name for one in listed))
    label = {one.name: 2 + one.family for one in listed}
    label_of = np.array([label[name] for name in names], dtype=np.intp)
    name_of = np.array([[one.name == name for one in listed] for name in names], dtype=np.float64)
    of_label = (np.arange(len(labels()))[:, None] == label_of).astype(np.float64)
    priors = of_label @ name_of @ np.array([one.prior for one in listed])
    priors[:2] = NEUTRAL_PRIOR, UNKNOWN_PRIOR
    offsets = np.array([point_of(expression(name)) for name in names]) - NEUTRAL_POINT
    return _States(names, name_of, label_of, of_label, priors, offsets)


def _weigh(logs: Float64) -> tuple[Float64, Float64]:
    """Return the probability of each label, (L,), and of names at each intensity within it, (K, 7).

    logs: (2 + 7 N,), as `Model.log_probabilities` gives them, with their priors.
    """
    table = _states()
    joint = np.exp(logs - logs.max())
    by_name = table.name_of @ joint[2:].reshape(-1, len(INTENSITIES))
    state = table.of_label @ by_name.sum(axis=1)
    within = by_name / np.maximum(state[table.label_of, None], TINY)
    state[:2] = joint[:2]
    return state / state.sum(), within


def _row(values: npt.ArrayLike, name: str) -> Float64:
    row = np.asarray(values)
    if row.shape != (FAP_COUNT,):
        raise OptionError(f"{name} must have shape ({FAP_COUNT},), not {row.shape}")
    return row


@cache
def _lids() -> Bool:
    """Return which FAPs belong to lids: bool (68,)."""
    mask = np.zeros(FAP_COUNT, dtype=bool)
    mask[[fap_numbers()[f"close_{lid}_{side}_eyelid"] - 1 for lid in "tb" for side in "lr"]] = True
    return mask


_UPPER_LIDS = tuple(fap_numbers()[f"close_t_{side}_eyelid"] - 1 for side in "lr")
_BROWS = tuple([fap_numbers()[f"raise_{side}_{part}_eyebrow"] - 1 for part in "mo"] for side in "lr")
_STRENGTHS = np.array(INTENSITIES)

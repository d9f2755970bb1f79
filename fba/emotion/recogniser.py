"""Recognition of expressions from FAPs, frame by frame and without flicker, live or for a whole animation.

A hidden Markov model combines the likelihoods of single frames (`likelihood`) over time. Its states are
neutral, unknown, the six families and the expressions without a family. A state lasts 1.5 seconds on average,
so that a change needs evidence, not a moment's noise.
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
from fba.emotion._expression import FAMILIES, NEUTRAL_POINT
from fba.emotion._expressions import expression
from fba.emotion._likelihood import INTENSITIES, PRIORS, candidates, model
from fba.emotion._rules import point_of
from fba.errors import OptionError
from fba.parameters import FAP_COUNT, fap_numbers

NEUTRAL = "neutral"
UNKNOWN = "unknown"
TINY = 1e-12


@dataclass(frozen=True)
class Tuning:
    """Constants of the recogniser."""

    state_seconds: float = 1.5  # mean duration of an expression
    independent_rate: float = 6.0  # independent frames a second; at higher rates, frames repeat each other
    blink_seconds: float = 0.5  # longest time for which shut lids are a blink, and ignored
    shut_lid: float = 400  # IRISD by which an upper lid is down in a blink
    accent_seconds: float = 2.0  # longest time for which raised brows stress a word
    accent_share: float = 0.5  # share of their height below which the brows must have been in that time
    listed: int = 3  # most expressions that a reading lists
    min_probability: float = 0.02  # of a listed expression


TUNING = Tuning()


@dataclass(frozen=True)
class Nearest:
    """A named expression that a face may show: intensity, 0 to 100, and probability, 0 to 1."""

    name: str
    intensity: float
    probability: float


@dataclass(frozen=True)
class Reading:
    """The expression in a frame.

    label: a family, an expression without a family, "neutral" or "unknown". probability: of the label.
    intensity: 0 to 100, of the label; 0 for neutral and unknown. nearest: named expressions, likeliest first;
    empty for neutral and unknown. activation, evaluation: means over all expressions; None for unknown.
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
    loners = {each.name: None for each in candidates() if each.family >= len(FAMILIES)}
    return (NEUTRAL, UNKNOWN, *FAMILIES, *loners)


class ExpressionRecogniser:
    """Recognises expressions in frames as they come.

    rate: frames a second. known: bool (68,), the FAPs that the source sends, all by default; others are
    ignored. baseline: float (68,), FAPs of the face at rest, which are subtracted; 0 by default.

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
        self._shut_for = math.inf  # seconds; lids that are shut from the start are no blink
        self._heights = np.zeros(0)  # of the brows in the last frames
        self._state: Float64 | None = None  # of each label
        self._within: Float64 | None = None  # of each name and intensity, within its label

    def prepare(self) -> None:
        """Compute the models, so that the first frame does not wait for them."""
        for known in (self._known, self._known & ~_lids()):
            for accents in (False, True):
                model(known, accents)
        _states()

    def push(self, faps: npt.ArrayLike) -> Reading:
        """Return the expression in the next frame. faps: (68,), as `fba.face.resolve` returns them.

        A frame with numbers that are not finite repeats the reading before it.
        """
        return self.push_frames(_row(faps, "faps")[None])[0]

    def push_frames(self, faps: npt.ArrayLike) -> list[Reading]:
        """Return the expression in each of the next frames. faps: (T, 68)."""
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
        """Return log probabilities of frames (T, 68): in a blink without lids, with accents of brows."""
        blinking, accented = self._find_blinks(values), self._find_accents(values)
        logs = np.empty((len(values), 2 + len(candidates()) * len(INTENSITIES)))
        for lids, known in ((True, self._known & ~_lids()), (False, self._known)):
            for accents in (False, True):
                chosen = (blinking == lids) & (accented == accents)
                if chosen.any():
                    logs[chosen] = model(known, accents).log_probabilities(values[chosen])
        return logs

    def _find_blinks(self, values: Float64) -> Bool:
        """Return which frames are in a blink: bool (T,)."""
        upper = [column for column in _UPPER_LIDS if self._known[column]]
        blinking = np.zeros(len(values), dtype=bool)
        if not upper:
            return blinking
        shut_lids: list[bool] = np.asarray(values[:, upper].mean(axis=1) > TUNING.shut_lid).tolist()
        for frame, shut in enumerate(shut_lids):
            self._shut_for = self._shut_for + self._seconds if shut else 0.0
            blinking[frame] = shut and self._shut_for <= TUNING.blink_seconds
        return blinking

    def _find_accents(self, values: Float64) -> Bool:
        """Return which frames have brows that were raised recently: bool (T,)."""
        sides = [[column for column in side if self._known[column]] for side in _BROWS]
        heights = [values[:, side].mean(axis=1) for side in sides if side]
        if not heights or not len(values):
            return np.zeros(len(values), dtype=bool)
        height = np.max(heights, axis=0)
        before = max(1, round(TUNING.accent_seconds / self._seconds))
        missing = np.full(before - len(self._heights), height[0])
        every = np.concatenate([missing, self._heights, height])
        self._heights = every[-before:]
        lowest = sliding_window_view(every, before + 1).min(axis=1)
        accented: Bool = (height > 0) & (lowest < TUNING.accent_share * height)
        return accented

    def _advance(self, logs: Float64 | None) -> None:
        """Advance the state by a frame. logs: (2 + 7 N,); None for a frame without information."""
        if self._state is None or self._within is None:
            if logs is not None:
                self._state, self._within = _weigh(logs)
            return
        stay = math.exp(-self._seconds / TUNING.state_seconds)
        state = stay * self._state + (1 - stay) * _states().priors
        if logs is not None:
            weight = min(1.0, self._seconds * TUNING.independent_rate)
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
        names = table.label_of == number  # those with the label
        total = float(shown[names].sum())
        intensity = float(strength[names].sum()) / total if total else 0.0
        nearest: tuple[Nearest, ...] = ()
        point: tuple[float, float] | tuple[None, None] = (None, None)
        if label != UNKNOWN:
            offset = strength @ table.offsets / max(1 - float(self._state[1]), TINY)
            point = (NEUTRAL_POINT[0] + float(offset[0]), NEUTRAL_POINT[1] + float(offset[1]))
        if number >= len((NEUTRAL, UNKNOWN)):
            order = np.argsort(-shown)[: TUNING.listed]
            nearest = tuple(
                Nearest(
                    table.names[row], 100 * min(float(strength[row] / shown[row]), 1.0), float(shown[row])
                )
                for row in order.tolist()
                if shown[row] >= TUNING.min_probability
            )
        return Reading(label, float(self._state[number]), 100 * min(intensity, 1.0), nearest, *point)


@dataclass(frozen=True, eq=False)
class _States:
    """The names of candidates and their labels.

    names: K, of expressions. name_of: float64 (K, N), 1 where a candidate has a name. label_of: int (K,), the
    label of each name. of_label: float64 (L, K), 1 where a name has a label. priors: float64 (L,). offsets:
    float64 (K, 2), of the names' points from `NEUTRAL_POINT`.
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
    names = tuple(dict.fromkeys(each.name for each in listed))
    label = {each.name: 2 + each.family for each in listed}
    label_of = np.array([label[name] for name in names], dtype=np.intp)
    name_of = np.array([[each.name == name for each in listed] for name in names], dtype=np.float64)
    of_label = (np.arange(len(labels()))[:, None] == label_of).astype(np.float64)
    priors = of_label @ name_of @ np.array([each.prior for each in listed])
    priors[:2] = PRIORS.neutral, PRIORS.unknown
    offsets = np.array([point_of(expression(name)) for name in names]) - NEUTRAL_POINT
    return _States(names, name_of, label_of, of_label, priors, offsets)


def _weigh(logs: Float64) -> tuple[Float64, Float64]:
    """Return the probability of each label, (L,), and of names at each intensity within it, (K, 7).

    logs: (2 + 7 N,), of `Model.log_probabilities`.
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

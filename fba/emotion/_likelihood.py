"""How likely each expression is, given the features of a frame: Gaussian models at several intensities.

An expression at intensity k is a Gaussian about k times its features. Its variance is that of a face that
shows nothing (`features.csv`, `RESTING_UNITS`), of speech (the spread of the 14 visemes, so that a mouth that
speaks says nothing by itself), and k times how far people differ: as measured in Table 8-4, else a share of
each feature. "Neutral" is the same without an expression; "unknown" is a wide Gaussian, which is likeliest
for what no expression comes near. Who talks raises brows to stress a word: `model` takes that for neutral,
or for the smile that goes with it.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass
from fractions import Fraction
from functools import cache, lru_cache
from importlib.resources import files

import numpy as np

from fba.arrays import Bool, Float64, Intp
from fba.capture.action_units.conversion import unit_shapes
from fba.emotion._features import features, known_features, measure
from fba.emotion._profiles import measured_faps, measurements
from fba.emotion.expression import FAMILIES
from fba.emotion.expressions import expressions
from fba.face import Definitions, resolve
from fba.parameters import FAP_COUNT, fap_numbers

INTENSITIES = (0.3, 0.42, 0.56, 0.7, 0.85, 1.0, 1.25)
"""Intensities at which each expression is tried."""
FAINT = (0.12, 0.22)
"""Intensities at which an expression is too faint to count: they belong to neutral."""
FAINT_PRIOR = 0.15
"""Their share, of what neutral has before anything is seen."""
DIFFERENCE = 0.4
"""Standard deviation between people, as a share of a feature, where none was measured."""
OWN = 0.08
"""The same, as a share of each feature's spread: nobody moves only what an expression lists."""
SPEECH = 1.0
"""Amplitude of speech, in visemes."""
OPEN_MOUTH = 500.0
"""By how much a jaw, and the lower lip with it, open for no reason, standard deviation, in MNS."""
RESTING_UNITS = {4: 0.08, 7: 0.06, 10: 0.08}
"""Action units that trackers report of faces which express nothing, narrow eyes above all: standard deviation
between people, as shares of full intensity. Of five actors who speak neutrally, OpenFace says 0.0 to 0.17,
0.13 to 0.34 and 0.0 to 0.15."""
REST_SCALES = (0.4, 0.8, 1.5)
"""A face that shows nothing is nearer to its neutral position in one recording than in another: it is a
mixture of Gaussians with the noise of `features.csv` times these."""
ACCENT, ACCENT_SPREAD, ACCENT_INNER = 140.0, 120.0, 100.0
"""By how much brows are raised to stress a word: mean and standard deviation, in ENS at their inner ends; and
by how much inner ends alone differ. Of twelve filmed nods, nine raise inner ends by 200 to 370, for 0.5 to
1.3 s; lids stay as they are."""
ACCENT_SHARE = 0.6
"""How likely raised brows are, as a share of what shows the same with brows at rest."""
ACCENTED = "joy"
"""The family whose expressions hardly move brows (24 ENS in Table 8-4, 143 in surprise): who smiles may
raise them."""
SHOWING_NOISE = 0.4
"""What an expression adds to, times that noise."""
VISIBLE = 0.2
"""Share of what tells an expression from a face at rest that must be known for it to be read at all."""
HIDDEN_PRIOR = 1e-12
UNKNOWN_SPREAD = 1.4
"""Width of "unknown", in spreads of the features."""
NEUTRAL_PRIOR, UNKNOWN_PRIOR, MADE_UP_PRIOR = 0.2, 0.02, 0.01
"""Shares before anything is seen: neutral, unknown, and expressions of no family; the six share the rest."""
LEADING, MEASURED, CAPTURED = 0.2, 0.2, 0.35
"""Shares in a family of its own expression, its measured profile, its prototypes; variants share the rest."""
BLOCK = 512
"""Frames that are read at once, which limits the memory."""
UNIT_DIFFERENCE = 0.5
"""Standard deviation of an action unit of a prototype, as a share of its intensity there, and"""
LEAST_UNIT_DIFFERENCE = 0.1
"""the least of it."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """What a frame may show.

    name: of the expression; measured profiles and prototypes have the name of their family. family: the row
    of FAMILIES, or 6 and up for an expression without a family. prior: before anything is seen. faps: float64
    (68,), at full intensity. deviations: float64 (68,), how far each FAP differs between people. directions:
    float64 (R, 68), what varies together: one standard deviation each.
    """

    name: str
    family: int
    prior: float
    faps: Float64
    deviations: Float64
    directions: Float64


@cache
def candidates() -> tuple[Candidate, ...]:
    """Return all expressions, and of the six families the measured profiles and the prototypes."""
    none = np.zeros((0, FAP_COUNT))
    named = expressions()
    variants = {one: sum(x.family == one for x in named) - 1 for one in FAMILIES}
    loners = [one.name for one in named if not one.family and not one.recipe]
    each = (1 - NEUTRAL_PRIOR - UNKNOWN_PRIOR - MADE_UP_PRIOR) / len(FAMILIES)
    rest = 1 - LEADING - MEASURED - CAPTURED
    found = []
    for one in named:
        if not one.family and one.recipe:
            continue  # lies between families, and is read as one of them
        faps = one.faps.astype(np.float64)
        if one.family:
            row = FAMILIES.index(one.family)
            prior = each * (LEADING if one.select else rest / variants[one.family])
        else:
            row, prior = len(FAMILIES) + loners.index(one.name), MADE_UP_PRIOR / len(loners)
        found.append(Candidate(one.name, row, prior, faps, DIFFERENCE * np.abs(faps), none))
    for row, name in enumerate(FAMILIES):
        mean, deviations = measured_faps(name).astype(np.float64), _measured_deviations(name)
        found.append(Candidate(name, row, each * MEASURED, mean, deviations, none))
        listed = _prototypes(name)
        for faps, directions in listed:
            prior = each * CAPTURED / len(listed)
            found.append(Candidate(name, row, prior, faps, np.zeros(FAP_COUNT), directions))
    return tuple(found)


def _measured_deviations(family: str) -> Float64:
    low = measured_faps(family)
    high = measured_faps(family, {one.feature: 1.0 for one in measurements(family)})
    return np.abs(high.astype(np.float64) - low)


def _prototypes(family: str) -> list[tuple[Float64, Float64]]:
    """Return FAPs of a family's action units, as trackers give them, and the directions they vary in."""
    units = _unit_faps()
    found = []
    with (files(__package__) / "prototypes.csv").open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            if row["family"] == family:
                pairs = [pair.split("=") for pair in row["units"].split()]
                weights = {int(unit): float(weight) for unit, weight in pairs}
                scale = 1 / max(weights.values())
                faps = sum(scale * weight * units[unit] for unit, weight in weights.items())
                vary = [
                    scale * max(UNIT_DIFFERENCE * weight, LEAST_UNIT_DIFFERENCE) * units[unit]
                    for unit, weight in weights.items()
                ]
                found.append((np.asarray(faps), np.array(vary)))
    return found


@cache
def _unit_faps() -> dict[int, Float64]:
    """Return the FAPs of each action unit at full intensity, as `from_action_units` makes them."""
    from fba.capture import ActionUnitMotion, from_action_units

    units = tuple(unit_shapes())
    motion = ActionUnitMotion(units, np.eye(len(units)), np.arange(len(units)) / 25, Fraction(25))
    face = from_action_units(motion).face
    assert face is not None
    return dict(zip(units, resolve(face).astype(np.float64), strict=True))


@dataclass(frozen=True, eq=False)
class Model:
    """The Gaussians for one set of known FAPs: neutral, unknown, and each candidate at each intensity.

    known: bool (68,). used: bool (F,), features. quadratic: float64 (F' * F', M), linear: (F', M), constants:
    (M,): the log of the likelihood of features f is constant + linear f + quadratic (f f^T). starts: int
    (2 + 7 N,), the first Gaussian of neutral, of unknown, and of each candidate at each intensity.
    """

    known: Bool
    used: Bool
    quadratic: Float64
    linear: Float64
    constants: Float64
    starts: Intp

    def log_probabilities(self, faps: Float64) -> Float64:
        """Return logs of the joint probabilities of FAPs and what they show: float64 (T, 2 + 7 N).

        faps: float64 (T, 68). Columns: neutral, unknown, then each candidate at each intensity. They are not
        normalised; the largest of each row is about 0.
        """
        result = np.empty((len(faps), len(self.starts)))
        for start in range(0, len(faps), BLOCK):
            seen = measure(faps[start : start + BLOCK], self.known)[:, self.used]
            pairs = (seen[:, :, None] * seen[:, None, :]).reshape(len(seen), -1)
            logs = pairs @ self.quadratic + seen @ self.linear + self.constants
            logs -= logs.max(axis=1, keepdims=True)
            np.logaddexp.reduceat(logs, self.starts, axis=1, out=result[start : start + BLOCK])
        return result


def model(known: Bool, accents: bool = False) -> Model:
    """Return the model for FAPs that are known: bool (68,).

    accents: whether brows that are raised on both sides may stress a word. On one side they always may.
    """
    return _model(np.asarray(known, dtype=bool).tobytes(), accents)


Gaussian = tuple[Float64, Float64, float]
"""Mean (F,), covariance (F, F) and prior."""


@lru_cache(maxsize=64)
def _model(packed: bytes, accents: bool) -> Model:
    known = np.frombuffer(packed, dtype=bool)
    used = known_features(known)
    noise, spread = features().noise[used], features().spread[used]
    habits = _variation(known, used)
    resting = habits + np.diag((SHOWING_NOISE * noise) ** 2)
    showing = [_show(one, known, used) for one in candidates()]
    every = np.ones(FAP_COUNT, dtype=bool)
    visible = [_distance(one, known) >= VISIBLE * _distance(one, every) for one in candidates()]
    total = sum(one.prior for one in candidates())
    both, single = _accents(known, used)
    columns: list[list[Gaussian]] = [[]]
    for scale in REST_SCALES:
        prior = NEUTRAL_PRIOR * (1 - FAINT_PRIOR) / len(REST_SCALES)
        still = (np.zeros(len(noise)), habits + np.diag((scale * noise) ** 2), prior)
        columns[0] += [still, _add(still, single), *([_add(still, both)] if accents else [])]
    for intensity in FAINT:
        for one, (target, varied) in zip(candidates(), showing, strict=True):
            prior = NEUTRAL_PRIOR * FAINT_PRIOR * one.prior / total / len(FAINT)
            columns[0].append((intensity * target, resting + intensity**2 * varied, prior))
    columns.append([(np.zeros(len(noise)), habits + np.diag((UNKNOWN_SPREAD * spread) ** 2), UNKNOWN_PRIOR)])
    for one, (target, varied), seen in zip(candidates(), showing, visible, strict=True):
        accented = accents and one.family == FAMILIES.index(ACCENTED)
        for intensity in INTENSITIES:
            prior = one.prior / len(INTENSITIES) * (1.0 if seen else HIDDEN_PRIOR)
            own = (intensity * target, resting + intensity**2 * varied, prior)
            columns.append([own, _add(own, both)] if accented else [own])
    starts = np.cumsum([0, *(len(column) for column in columns[:-1])])
    means, covariances, priors = (
        np.array(each) for each in zip(*(one for column in columns for one in column), strict=True)
    )
    inverse = np.linalg.inv(covariances)
    linear = np.einsum("mij,mj->mi", inverse, means)
    constants = 0.5 * np.linalg.slogdet(inverse)[1] - 0.5 * (linear * means).sum(axis=1) + np.log(priors)
    quadratic = -0.5 * inverse.reshape(len(inverse), -1)
    return Model(
        known, used, np.ascontiguousarray(quadratic.T), np.ascontiguousarray(linear.T), constants, starts
    )


def _accents(known: Bool, used: Bool) -> tuple[Gaussian, Gaussian]:
    """Return what brows that stress a word add to features: raised on both sides, and on one.

    They go as action units 1 and 2 take them. The prior is a share.
    """
    units = _unit_faps()
    inner, whole = units[1], units[1] + units[2]
    faps = np.array([inner, whole, np.where(_LEFT, whole, 0)]) / inner[_INNER_BROW]
    alone, both, single = measure(faps, known)[:, used]
    varied = ACCENT_SPREAD**2 * np.outer(both, both) + ACCENT_INNER**2 * np.outer(alone, alone)
    return (
        (ACCENT * both, varied, ACCENT_SHARE),
        (ACCENT * single, ACCENT_SPREAD**2 * np.outer(single, single), ACCENT_SHARE),
    )


def _add(one: Gaussian, other: Gaussian) -> Gaussian:
    return one[0] + other[0], one[1] + other[1], one[2] * other[2]


def _variation(known: Bool, used: Bool) -> Float64:
    """Return the covariance of the features of a face that expresses nothing.

    Its mouth speaks, or is open for no reason; its owner's eyes are narrow, as `RESTING_UNITS` says.
    """
    spoken = measure(Definitions.default().visemes[1:].astype(np.float64), known)[:, used]
    opened = measure(_open_mouth(), known)[None, used]
    rest: Float64 = np.diag(features().speech[used] ** 2)
    units = np.array([share * _unit_faps()[unit] for unit, share in RESTING_UNITS.items()])
    owners = measure(units, known)[:, used]
    return SPEECH**2 * spoken.T @ spoken / len(spoken) + opened.T @ opened + owners.T @ owners + rest


def _distance(one: Candidate, known: Bool) -> float:
    """Return how far a candidate is from a face at rest in the features of known FAPs: squared deviations."""
    used = known_features(known)
    target = measure(one.faps, known)[used]
    covariance = _variation(known, used) + np.diag(features().noise[used] ** 2)
    return float(target @ np.linalg.solve(covariance, target)) if used.any() else 0.0


@cache
def _open_mouth() -> Float64:
    faps = np.zeros(FAP_COUNT)
    faps[fap_numbers()["open_jaw"] - 1] = OPEN_MOUTH
    faps[[n - 1 for name, n in fap_numbers().items() if name.startswith("raise_b_")]] = -OPEN_MOUTH
    return faps


def _show(one: Candidate, known: Bool, used: Bool) -> tuple[Float64, Float64]:
    """Return the features of a candidate, and their covariance between people, both at full intensity."""
    target = measure(one.faps, known)[used]
    together = measure(one.directions, known)[:, used]
    alone = measure(one.deviations, known)[used] ** 2 + (OWN * features().spread[used]) ** 2
    return target, np.diag(alone) + together.T @ together


_INNER_BROW = fap_numbers()["raise_l_i_eyebrow"] - 1
_LEFT = np.array(["_l_" in name for name in fap_numbers()])

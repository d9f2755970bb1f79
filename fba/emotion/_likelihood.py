"""Likelihood of each expression, given the features of a frame: Gaussian models at several intensities.

Features are means and differences of FAPs, such as the height of the lip corners.

An expression at intensity k is a Gaussian about k times its features. Its variance is that of a neutral face
(`features.csv`, `RESTING_UNITS`), that of speech (the spread of the 14 visemes: a speaking mouth is no
evidence), and k times the differences between people: as measured in Table 8-4, or a share of each feature.
"Neutral" is the same without an expression; "unknown" is a wide Gaussian, the likeliest far from all
expressions. Speakers raise the brows to stress a word: `model` counts that as neutral, or as part of a smile.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import cache, lru_cache

import numpy as np

from fba.arrays import Bool, Float64, Intp
from fba.capture.blendshapes.conversion import unit_shapes
from fba.emotion._expression import FAMILIES
from fba.emotion._expressions import expressions
from fba.emotion._profiles import measured_faps, measurements
from fba.face import Definitions, resolve
from fba.parameters import FAP_COUNT, fap_numbers
from fba.text_files import packaged_rows

UPPER_LID_PER_GAZE = 0.0089
"""Motion of an upper lid that follows the gaze, IRISD per 1e-5 rad of pitch."""
LOWER_LID_PER_GAZE = -0.0054
INTENSITIES = (0.3, 0.42, 0.56, 0.7, 0.85, 1.0, 1.25)
"""Intensities at which each expression is tried."""
FAINT = (0.12, 0.22)
"""Intensities at which an expression is too faint to count, and is neutral."""
RESTING_UNITS = {4: 0.08, 7: 0.06, 10: 0.08}
"""Action units that trackers report for neutral faces, above all narrow eyes: standard deviation between
people, relative to full intensity. For five actors who speak neutrally, OpenFace reports 0.0 to 0.17, 0.13 to
0.34 and 0.0 to 0.15."""
REST_SCALES = (0.4, 0.8, 1.5)
"""Factors of the noise in `features.csv`. Neutral is a mixture of Gaussians with these, as some
recordings are quieter than others."""
ACCENTED = "joy"
"""The family whose expressions hardly move the brows (24 ENS in Table 8-4; surprise 143): smiling speakers
may raise them."""
BLOCK = 512
"""Number of frames that are read at once, to limit the memory."""


@dataclass(frozen=True)
class Spreads:
    """Standard deviations between people, and of a face that expresses nothing."""

    feature: float = 0.4  # share of a feature, where none was measured
    other_features: float = 0.08  # share of each feature's spread: nobody moves only what an expression lists
    unit: float = 0.5  # of an action unit in a prototype, share of its intensity there
    min_unit: float = 0.1  # least of that
    open_mouth: float = 500.0  # MNS, of a jaw and a lower lip that are open for no reason
    speech: float = 1.0  # amplitude of speech, in visemes
    showing_noise: float = 0.4  # factor of the noise of `features.csv` where an expression is shown
    unknown: float = 1.4  # width of "unknown", in spreads of the features


@dataclass(frozen=True)
class Accent:
    """Brows raised to stress a word, ENS at their inner ends.

    In nine of twelve filmed nods, the inner ends rise by 200 to 370, for 0.5 to 1.3 s; the lids do not move.
    """

    mean: float = 140.0
    spread: float = 120.0
    inner_spread: float = 100.0  # of the inner ends alone
    share: float = 0.6  # probability relative to the same expression with the brows at rest


@dataclass(frozen=True)
class Priors:
    """Probabilities before anything is seen. The families share the rest; so do a family's variants."""

    neutral: float = 0.2
    unknown: float = 0.02
    without_family: float = 0.01  # of all expressions without a family together
    faint: float = 0.15  # share of neutral
    leading: float = 0.2  # share in a family of the expression with its name
    measured: float = 0.2  # share in a family of its measured profile
    prototypes: float = 0.35  # share in a family of its prototypes
    hidden: float = 1e-12  # factor for expressions that the known FAPs do not show
    visible: float = 0.2  # share of the difference from neutral below which an expression is hidden


SPREADS = Spreads()
ACCENT = Accent()
PRIORS = Priors()


@dataclass(frozen=True, eq=False)
class Candidate:
    """An expression that a frame may show.

    name: of the expression; measured profiles and prototypes have the name of their family. family: its row
    in FAMILIES, or 6 and up for an expression without a family. prior: probability. faps: float64 (68,), at
    full intensity. deviations: float64 (68,), standard deviation of each FAP between people. directions:
    float64 (R, 68), FAPs that vary together: one standard deviation each.
    """

    name: str
    family: int
    prior: float
    faps: Float64
    deviations: Float64
    directions: Float64


@cache
def candidates() -> tuple[Candidate, ...]:
    """Return all expressions, and the measured profiles and prototypes of the six families."""
    none = np.zeros((0, FAP_COUNT))
    named = expressions()
    variants = {family: sum(each.family == family for each in named) - 1 for family in FAMILIES}
    loners = [each.name for each in named if not each.family and not each.recipe]
    of_family = (1 - PRIORS.neutral - PRIORS.unknown - PRIORS.without_family) / len(FAMILIES)
    rest = 1 - PRIORS.leading - PRIORS.measured - PRIORS.prototypes
    result = []
    for each in named:
        if not each.family and each.recipe:
            continue  # lies between families, and is read as one of them
        faps = each.faps.astype(np.float64)
        if each.family:
            row = FAMILIES.index(each.family)
            prior = of_family * (PRIORS.leading if each.select else rest / variants[each.family])
        else:
            row, prior = len(FAMILIES) + loners.index(each.name), PRIORS.without_family / len(loners)
        result.append(Candidate(each.name, row, prior, faps, SPREADS.feature * np.abs(faps), none))
    for row, name in enumerate(FAMILIES):
        mean, deviations = measured_faps(name).astype(np.float64), _measured_deviations(name)
        result.append(Candidate(name, row, of_family * PRIORS.measured, mean, deviations, none))
        listed = _prototypes(name)
        for faps, directions in listed:
            prior = of_family * PRIORS.prototypes / len(listed)
            result.append(Candidate(name, row, prior, faps, np.zeros(FAP_COUNT), directions))
    return tuple(result)


def _measured_deviations(family: str) -> Float64:
    low = measured_faps(family)
    high = measured_faps(family, {each.feature: 1.0 for each in measurements(family)})
    return np.abs(high.astype(np.float64) - low)


def _prototypes(family: str) -> list[tuple[Float64, Float64]]:
    """Return the FAPs of each of a family's sets of action units, and the directions in which they vary."""
    units = _unit_faps()
    result = []
    for row in packaged_rows(__package__, "prototypes.csv"):
        if row["family"] == family:
            pairs = [pair.split("=") for pair in row["units"].split()]
            weights = {int(unit): float(weight) for unit, weight in pairs}
            scale = 1 / max(weights.values())
            faps = sum(scale * weight * units[unit] for unit, weight in weights.items())
            directions = [
                scale * max(SPREADS.unit * weight, SPREADS.min_unit) * units[unit]
                for unit, weight in weights.items()
            ]
            result.append((np.asarray(faps), np.array(directions)))
    return result


@cache
def _unit_faps() -> dict[int, Float64]:
    """Return the FAPs of each action unit at full intensity, by `from_action_units`."""
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
        """Return log probabilities, not normalised, of FAPs (T, 68): float64 (T, 2 + 7 N), about 0 at most.

        Columns: neutral, unknown, then each candidate at each intensity.
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
    """Return the model for known FAPs, bool (68,).

    accents: whether brows raised on both sides may stress a word. Brows raised on one side always may.
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
    resting = habits + np.diag((SPREADS.showing_noise * noise) ** 2)
    showing = [_show(each, known, used) for each in candidates()]
    every = np.ones(FAP_COUNT, dtype=bool)
    visible = [_distance(each, known) >= PRIORS.visible * _distance(each, every) for each in candidates()]
    total = sum(each.prior for each in candidates())
    both, single = _accents(known, used)
    columns: list[list[Gaussian]] = [[]]
    for scale in REST_SCALES:
        prior = PRIORS.neutral * (1 - PRIORS.faint) / len(REST_SCALES)
        still = (np.zeros(len(noise)), habits + np.diag((scale * noise) ** 2), prior)
        columns[0] += [still, _add(still, single), *([_add(still, both)] if accents else [])]
    for intensity in FAINT:
        for candidate, (target, varied) in zip(candidates(), showing, strict=True):
            prior = PRIORS.neutral * PRIORS.faint * candidate.prior / total / len(FAINT)
            columns[0].append((intensity * target, resting + intensity**2 * varied, prior))
    wide = habits + np.diag((SPREADS.unknown * spread) ** 2)
    columns.append([(np.zeros(len(noise)), wide, PRIORS.unknown)])
    for candidate, (target, varied), seen in zip(candidates(), showing, visible, strict=True):
        accented = accents and candidate.family == FAMILIES.index(ACCENTED)
        for intensity in INTENSITIES:
            prior = candidate.prior / len(INTENSITIES) * (1.0 if seen else PRIORS.hidden)
            plain = (intensity * target, resting + intensity**2 * varied, prior)
            columns.append([plain, _add(plain, both)] if accented else [plain])
    starts = np.cumsum([0, *(len(column) for column in columns[:-1])])
    means, covariances, priors = (
        np.array(values)
        for values in zip(*(gaussian for column in columns for gaussian in column), strict=True)
    )
    inverse = np.linalg.inv(covariances)
    linear = np.einsum("mij,mj->mi", inverse, means)
    constants = 0.5 * np.linalg.slogdet(inverse)[1] - 0.5 * (linear * means).sum(axis=1) + np.log(priors)
    quadratic = -0.5 * inverse.reshape(len(inverse), -1)
    return Model(
        known, used, np.ascontiguousarray(quadratic.T), np.ascontiguousarray(linear.T), constants, starts
    )


def _accents(known: Bool, used: Bool) -> tuple[Gaussian, Gaussian]:
    """Return the change of features by brows that stress a word, raised on both sides and on the left.

    They are raised as by action units 1 and 2. The prior is a share.
    """
    units = _unit_faps()
    inner, whole = units[1], units[1] + units[2]
    faps = np.array([inner, whole, np.where(_LEFT, whole, 0)]) / inner[_INNER_BROW]
    alone, both, single = measure(faps, known)[:, used]
    varied = ACCENT.spread**2 * np.outer(both, both) + ACCENT.inner_spread**2 * np.outer(alone, alone)
    return (
        (ACCENT.mean * both, varied, ACCENT.share),
        (ACCENT.mean * single, ACCENT.spread**2 * np.outer(single, single), ACCENT.share),
    )


def _add(one: Gaussian, other: Gaussian) -> Gaussian:
    return one[0] + other[0], one[1] + other[1], one[2] * other[2]


def _variation(known: Bool, used: Bool) -> Float64:
    """Return the covariance of features by speech, open mouths and the habits in `RESTING_UNITS`."""
    spoken = measure(Definitions.default().visemes[1:].astype(np.float64), known)[:, used]
    opened = measure(_open_mouth(), known)[None, used]
    rest: Float64 = np.diag(features().speech[used] ** 2)
    units = np.array([share * _unit_faps()[unit] for unit, share in RESTING_UNITS.items()])
    habits = measure(units, known)[:, used]
    speech = SPREADS.speech**2 * spoken.T @ spoken / len(spoken)
    return speech + opened.T @ opened + habits.T @ habits + rest


def _distance(candidate: Candidate, known: Bool) -> float:
    """Return the squared Mahalanobis distance of a candidate from neutral, in the features of known FAPs."""
    used = known_features(known)
    target = measure(candidate.faps, known)[used]
    covariance = _variation(known, used) + np.diag(features().noise[used] ** 2)
    return float(target @ np.linalg.solve(covariance, target)) if used.any() else 0.0


@cache
def _open_mouth() -> Float64:
    faps = np.zeros(FAP_COUNT)
    faps[fap_numbers()["open_jaw"] - 1] = SPREADS.open_mouth
    faps[[n - 1 for name, n in fap_numbers().items() if name.startswith("raise_b_")]] = -SPREADS.open_mouth
    return faps


def _show(candidate: Candidate, known: Bool, used: Bool) -> tuple[Float64, Float64]:
    """Return the features of a candidate, and their covariance between people, both at full intensity."""
    target = measure(candidate.faps, known)[used]
    together = measure(candidate.directions, known)[:, used]
    others = (SPREADS.other_features * features().spread[used]) ** 2
    alone = measure(candidate.deviations, known)[used] ** 2 + others
    return target, np.diag(alone) + together.T @ together


_INNER_BROW = fap_numbers()["raise_l_i_eyebrow"] - 1
_LEFT = np.array(["_l_" in name for name in fap_numbers()])


@dataclass(frozen=True, eq=False)
class Features:
    """The table of features.

    weights: float64 (F, 68), of the FAPs. folded: bool (F,), whether the absolute value is used, as for
    differences between left and right. noise, spread, speech: float64 (F,), standard deviation of a face that
    expresses nothing and is silent, of all faces, and of speech beyond the visemes.
    """

    names: tuple[str, ...]
    weights: Float64
    folded: Bool
    noise: Float64
    spread: Float64
    speech: Float64


@cache
def features() -> Features:
    """Return the table `features.csv`."""
    rows = packaged_rows(__package__, "features.csv")
    weights = np.zeros((len(rows), FAP_COUNT))
    for number, row in enumerate(rows):
        pairs = [pair.partition("=") for pair in row["faps"].split()]
        for name, _, weight in pairs:
            weights[number, fap_numbers()[name] - 1] = float(weight)
    folded = np.array([row["kind"] == "difference" for row in rows])
    weights[~folded] /= np.abs(weights[~folded]).sum(axis=1, keepdims=True)
    return Features(
        tuple(row["feature"] for row in rows), weights, folded,
        *(np.array([float(row[name]) for row in rows]) for name in ("noise", "spread", "speech")),
    )  # fmt: skip


def measure(faps: Float64, known: Bool) -> Float64:
    """Return the features of FAPs (..., 68): float64 (..., F), less the motion of lids that follow the gaze.

    Lids follow the gaze in captures of blendshapes, but not in action units and many streams.

    known: bool (68,), the FAPs that are sent. A mean is taken over these; without any it is 0.
    """
    table = features()
    values = np.where(known, faps, 0.0).astype(np.float64)
    for side in range(2):
        pitch = values[..., _PITCH + side]
        for lid, per_gaze in ((_UPPER, UPPER_LID_PER_GAZE), (_LOWER, LOWER_LID_PER_GAZE)):
            if known[lid + side]:
                gaze = per_gaze * pitch
                lids = values[..., lid + side]
                values[..., lid + side] = lids - np.clip(lids, np.minimum(gaze, 0), np.maximum(gaze, 0))
    size = np.abs(table.weights)
    share = (size @ known) / size.sum(axis=1)
    weights = table.weights / np.where(table.folded | (share == 0), 1.0, share)[:, None]
    means = values @ weights.T
    result: Float64 = np.where(table.folded, np.abs(means), means)
    return result


def known_features(known: Bool) -> Bool:
    """Return which features follow from known FAPs, bool (68,): bool (F,). A difference needs both FAPs."""
    table = features()
    used = table.weights != 0
    count = used.astype(np.int64) @ known.astype(np.int64)
    result: Bool = np.where(table.folded, count == used.sum(axis=1), count > 0)
    return result


# Columns of the left lids and of the left eyeball's pitch; the right column follows each.
_UPPER = 18
_LOWER = 20
_PITCH = 24

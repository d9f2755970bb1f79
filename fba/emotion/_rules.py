"""The two rules for mixing expressions: within a family, and of different families.

`mix` applies the first to each family, then the second to the families.

Section 8.4 of the thesis in docs/emotion.md, which gives no numbers; here they are parameters.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import cache

import numpy as np

from fba.arrays import Bool, Float32, Float64, Floating
from fba.emotion._expression import NEUTRAL_POINT, Expression, whissel_points
from fba.emotion._profiles import measurements, vocabulary
from fba.errors import OptionError
from fba.face import Definitions
from fba.parameters import EXPRESSIONS, FAP_COUNT, faps
from fba.sampling import smoothstep

MIN_ACTIVATION = 2.0
"""Activation of an expression without one and without a family: the smallest in the table."""


@dataclass(frozen=True)
class Rules:
    """Parameters of the rules, 0 to 1.

    interpolation: share of the second of two expressions of a family in the FAPs that both move; by default
    by their intensities. reduction: factor of a FAP that only one of them moves. nearness: within a family,
    largest distance of such a FAP from the family's own value, relative to that value; beyond, it is dropped.
    presence: an expression moves a FAP if Table 8-3 or 8-4 lists it for the family, or if its value is at
    least this share of the largest among the six. crossover: the rules are blended in, so that nothing jumps
    while intensities change: within a family, until the weaker expression has this share; of two families,
    until their activations differ by this share of their sum. 0: at once.

    Raises OptionError for other values.
    """

    interpolation: float | None = None
    reduction: float = 0.6
    nearness: float = 0.6
    presence: float = 0.5
    crossover: float = 0.1

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if value is None and field.name == "interpolation":
                continue
            if not isinstance(value, int | float) or not math.isfinite(value) or not 0 <= value <= 1:
                raise OptionError(f"{field.name} must be a number from 0 to 1, not {value!r}")


@dataclass(frozen=True, eq=False)
class Part:
    """An expression at an intensity, as part of a mixture.

    faps: float64 (68,), at full intensity. moved: float64 (68,), 1 for the FAPs that it moves, 0 for others;
    in between for mixtures. activation: at full intensity. intensity: 0 to 1. family: "" for none.
    """

    faps: Float64
    moved: Float64
    activation: float
    intensity: float
    family: str

    @property
    def shown(self) -> Float64:
        """The FAPs at the intensity: float64 (68,)."""
        return self.faps * self.intensity

    @property
    def shown_activation(self) -> float:
        """The activation at the intensity, which decides the dominant part."""
        return self.activation * self.intensity


def part(expression: Expression, intensity: float, activation: float | None, presence: float) -> Part:
    """Return an expression at an intensity of 0 to 1.

    activation: of the expression or its family, None without one. presence: see `Rules`.
    """
    return Part(
        expression.faps.astype(np.float64),
        moved_faps(expression, presence).astype(np.float64),
        MIN_ACTIVATION if activation is None else activation,
        intensity,
        expression.family,
    )


def moved_faps(expression: Expression, presence: float) -> Bool:
    """Return which FAPs an expression moves, bool (68,); see `Rules`."""
    largest = np.abs(Definitions.default().expressions).max(axis=0)
    size = np.abs(expression.faps)
    listed = _listed_faps(expression.family) if expression.family else np.zeros(FAP_COUNT, dtype=bool)
    moved: Bool = (size > 0) & (listed | (size >= presence * largest))
    return moved


@cache
def _listed_faps(family: str) -> Bool:
    listed = np.zeros(FAP_COUNT, dtype=bool)
    listed[[movement.fap - 1 for movement in vocabulary(family)]] = True
    listed[[fap - 1 for measurement in measurements(family) for fap in measurement.faps]] = True
    return listed


def mix_within_family(first: Part, second: Part, centre: Float64, rules: Rules) -> Part:
    """Return the mixture of two expressions of a family, with the larger of their intensities.

    A FAP that both move, or neither, is interpolated. A FAP that only one moves is reduced if it is near the
    family's own value, and otherwise dropped.

    centre: float64 (68,), the expression with the family's name, at full intensity.
    """
    total = first.intensity + second.intensity
    share = second.intensity / total if rules.interpolation is None else rules.interpolation
    interpolated = (1 - share) * first.faps + share * second.faps
    ruled = interpolated
    for this, other in ((first, second), (second, first)):
        near = np.abs(this.faps - centre) <= rules.nearness * np.abs(centre)
        kept = np.where(near, rules.reduction * this.faps, 0.0)
        alone = this.moved * (1 - other.moved)
        ruled = ruled + alone * (kept - interpolated)
    hold = _grow(min(share, 1 - share), rules.crossover)
    return Part(
        hold * ruled + (1 - hold) * interpolated,
        (1 - share) * first.moved + share * second.moved,
        (1 - share) * first.activation + share * second.activation,
        max(first.intensity, second.intensity),
        first.family,
    )


def mix_families(parts: Sequence[Part], rules: Rules) -> Float64:
    """Return the FAPs of expressions of different families: float64 (68,).

    The expression with the largest activation at its intensity dominates: its FAPs stay. The others, mixed by
    the same rule, are reduced and added to the FAPs that it does not move.
    """
    return _mix(tuple(parts), rules, {})[0]


def _mix(
    parts: tuple[Part, ...], rules: Rules, mixed: dict[tuple[Part, ...], tuple[Float64, Float64]]
) -> tuple[Float64, Float64]:
    """Return FAPs (68,), and how far each is moved, 0 to 1. mixed: a cache of mixtures."""
    if len(parts) == 1:
        return parts[0].shown, parts[0].moved
    if parts in mixed:
        return mixed[parts]
    values, moved = np.zeros(FAP_COUNT), np.zeros(FAP_COUNT)
    for number, weight in enumerate(_dominance([part.shown_activation for part in parts], rules)):
        if not weight:
            continue
        leader, others = parts[number], parts[:number] + parts[number + 1 :]
        added, added_moved = _mix(others, rules, mixed)
        free = added_moved * (1 - leader.moved)
        activation = max(part.shown_activation for part in others)
        part_of = _grow(activation / (activation + leader.shown_activation or 1.0), rules.crossover)
        values += weight * (leader.shown + rules.reduction * free * added)
        moved += weight * (leader.moved + free * part_of)
    mixed[parts] = values, moved
    return values, moved


def _dominance(activations: list[float], rules: Rules) -> list[float]:
    """Return the share of dominance of each: 1 for the largest activation, less where others are near it."""
    largest = max(activations) or 1.0
    near = [1 - _grow((largest - value) / (largest + value), rules.crossover) for value in activations]
    return [value / sum(near) for value in near]


def _grow(value: float, crossover: float) -> float:
    """Return a smooth step from 0 at 0 to 1 at the crossover."""
    if value <= 0:
        return 0.0
    return 1.0 if value >= crossover else float(smoothstep(value / crossover))


def limited(values: Floating) -> Float32:
    """Return FAPs (..., 68) within the limits of the standard: float32."""
    low, high = fap_limits()
    return np.clip(values, low, high).astype(np.float32)


@cache
def fap_limits() -> tuple[Float64, Float64]:
    """Return the smallest and the largest value of each FAP, float64 (68,) each; zeros for FAP 1 and 2."""
    limits = np.array([fap.i_limits or (0, 0) for fap in faps()]) * np.array(
        [[float(fap.step)] for fap in faps()]
    )
    return limits[:, 0], limits[:, 1]


def mix(weights: Sequence[tuple[Expression, float]], rules: Rules) -> Float32:
    """Return the FAPs of expressions at intensities of 0 to 100, within the limits of the standard: (68,)."""
    families: dict[str, Part] = {}
    for expression, intensity in weights:
        if not intensity:
            continue
        new = part(expression, intensity / 100, activation_of(expression), rules.presence)
        key = expression.family or expression.name
        if key in families:
            new = mix_within_family(families[key], new, _centre(expression), rules)
        families[key] = new
    if not families:
        return np.zeros(FAP_COUNT, dtype=np.float32)
    return limited(mix_families(list(families.values()), rules))


def activation_of(expression: Expression) -> float | None:
    """Return the activation of an expression, or else of its family; None without either."""
    if expression.activation is not None:
        return expression.activation
    return whissel_points()[expression.family][0] if expression.family else None


def point_of(expression: Expression) -> tuple[float, float]:
    """Return activation and evaluation of an expression, or else of its family, or of neutral."""
    if expression.point is not None:
        return expression.point
    return whissel_points()[expression.family] if expression.family else NEUTRAL_POINT


def _centre(expression: Expression) -> Float64:
    select = EXPRESSIONS.index(expression.family)
    centre: Float64 = Definitions.default().expressions[select].astype(np.float64)
    return centre

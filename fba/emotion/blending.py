"""Intermediate expressions: several named ones, each with an intensity, mixed by the rules."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fba.arrays import Float32, Int16
from fba.emotion._mixing import mix, point_of
from fba.emotion._rules import Rules
from fba.emotion.expression import NEUTRAL_POINT, Expression
from fba.emotion.expressions import expression
from fba.errors import OptionError
from fba.parameters import INTENSITY_MAX

NEUTRAL = "neutral"
FULL = 100.0
"""The largest intensity."""


@dataclass(frozen=True, eq=False)
class Blend:
    """An expression that is made of named ones.

    parts: each with its intensity, more than 0 and up to 100; none for a neutral face. faps: float32 (68,),
    by the rules. activation, evaluation: between those of the parts and `NEUTRAL_POINT`; a part without them
    counts as its family.
    """

    parts: tuple[tuple[Expression, float], ...]
    faps: Float32
    activation: float
    evaluation: float

    @property
    def fields(self) -> Int16 | None:
        """The fields of FAP 2, int16 (6,), if one or two of its expressions are all that there is; else None.

        FAP 2 adds up two expressions, so that a face may show others FAPs than `faps` for two.
        """
        if len(self.parts) > 2 or not all(one.select for one, _ in self.parts):
            return None
        fields = np.zeros(6, dtype=np.int16)
        for number, (one, intensity) in enumerate(self.parts):
            fields[2 * number : 2 * number + 2] = one.select, round(intensity / FULL * INTENSITY_MAX)
        return fields

    def __str__(self) -> str:
        return " ".join(f"{_word(one.name)}={intensity:.3g}" for one, intensity in self.parts) or NEUTRAL


def combine(weights: Mapping[str, float], rules: Rules | None = None) -> Blend:
    """Return expressions mixed by the rules of `fba.emotion._rules`.

    weights: intensities, 0 to 100, by name or alias; "neutral" adds nothing. rules: their parameters.

    Raises OptionError for an unknown name, which suggests the nearest; for an intensity out of range; where
    two names mean one expression.
    """
    parts: dict[str, tuple[Expression, float]] = {}
    for name, intensity in weights.items():
        _check_intensity(name, intensity)
        if name == NEUTRAL:
            continue
        one = expression(name)
        if one.name in parts:
            raise OptionError(f"{name!r} means {one.name!r}, which is given already: give one of them")
        parts[one.name] = one, float(intensity)
    chosen = tuple((one, intensity) for one, intensity in parts.values() if intensity > 0)
    return Blend(chosen, mix(chosen, rules or Rules()), *_point(chosen))


def parse_weights(text: str) -> dict[str, float]:
    """Return intensities by name from text such as "fear=60 joy=30"; a name alone has 100.

    Commas or spaces separate; names of several words are written with underscores, hyphens or spaces.

    Raises OptionError where a number is missing or none, or a name is given twice.
    """
    weights: dict[str, float] = {}
    words: list[str] = []

    def add(amount: str) -> None:
        name = " ".join(words)
        words.clear()
        if not name:
            raise OptionError(f"{text!r}: a name is missing before ={amount}; write e.g. fear=60")
        if name in weights:
            raise OptionError(f"{text!r}: {name!r} is given twice")
        try:
            weights[name] = float(amount.removesuffix("%"))
        except ValueError:
            raise OptionError(
                f"{text!r}: the intensity of {name!r} must be a number from 0 to 100, not {amount!r}"
            ) from None

    for group in text.split(","):
        for word in group.split():
            before, equals, amount = word.partition("=")
            words += [before] if before else []
            if equals:
                add(amount)
        if words:
            add("100")
    if not weights:
        raise OptionError("no expression is given; write e.g. fear=60")
    return weights


def _check_intensity(name: str, intensity: float) -> None:
    if isinstance(intensity, bool) or not isinstance(intensity, int | float | np.number):
        raise OptionError(f"the intensity of {name!r} must be a number, not {intensity!r}")
    if not math.isfinite(intensity) or not 0 <= intensity <= FULL:
        raise OptionError(f"the intensity of {name!r} must be from 0 to 100, not {intensity:g}")


def _point(parts: tuple[tuple[Expression, float], ...]) -> tuple[float, float]:
    placed = [(point_of(one), intensity / FULL) for one, intensity in parts]
    total = max(sum(weight for _, weight in placed), 1.0)
    offset = [
        sum(weight * (point[axis] - NEUTRAL_POINT[axis]) for point, weight in placed) / total
        for axis in (0, 1)
    ]
    return NEUTRAL_POINT[0] + offset[0], NEUTRAL_POINT[1] + offset[1]


def _word(name: str) -> str:
    return name.replace(" ", "_")

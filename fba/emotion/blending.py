"""Intermediate expressions: named expressions, each with an intensity, mixed by the rules."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fba.arrays import Float32, Int16
from fba.emotion._expression import NEUTRAL_POINT, Expression
from fba.emotion._expressions import expression
from fba.emotion._rules import Rules, mix, point_of
from fba.errors import OptionError
from fba.parameters import INTENSITY_MAX

NEUTRAL = "neutral"
MAX_INTENSITY = 100.0


@dataclass(frozen=True, eq=False)
class Blend:
    """A mixture of named expressions.

    parts: each with its intensity, above 0 and up to 100; empty for a neutral face. faps: float32 (68,), by
    the rules. activation, evaluation: between those of the parts and `NEUTRAL_POINT`; a part without them
    has those of its family.
    """

    parts: tuple[tuple[Expression, float], ...]
    faps: Float32
    activation: float
    evaluation: float

    @property
    def fields(self) -> Int16 | None:
        """The fields of FAP 2, int16 (6,), or None if FAP 2 cannot show this mixture.

        FAP 2 shows one or two of its own expressions, and adds two up, not by the rules.
        """
        if len(self.parts) > 2 or not all(part.select for part, _ in self.parts):
            return None
        fields = np.zeros(6, dtype=np.int16)
        for number, (part, intensity) in enumerate(self.parts):
            amount = round(intensity / MAX_INTENSITY * INTENSITY_MAX)
            fields[2 * number : 2 * number + 2] = part.select, amount
        return fields

    def __str__(self) -> str:
        words = (f"{part.name.replace(' ', '_')}={intensity:.3g}" for part, intensity in self.parts)
        return " ".join(words) or NEUTRAL


def combine(weights: Mapping[str, float], rules: Rules | None = None) -> Blend:
    """Return a mixture by the rules of `fba.emotion._rules`.

    weights: intensities, 0 to 100, by name or alias; "neutral" adds nothing. rules: their parameters.

    Raises OptionError for an unknown name, with the nearest; for an intensity out of range; where two names
    mean the same expression.
    """
    parts: dict[str, tuple[Expression, float]] = {}
    for name, intensity in weights.items():
        _check_intensity(name, intensity)
        if name == NEUTRAL:
            continue
        part = expression(name)
        if part.name in parts:
            raise OptionError(f"{name!r} means {part.name!r}, which is given already: give one of them")
        parts[part.name] = part, float(intensity)
    chosen = tuple((part, intensity) for part, intensity in parts.values() if intensity > 0)
    return Blend(chosen, mix(chosen, rules or Rules()), *_point(chosen))


def parse_weights(text: str) -> dict[str, float]:
    """Return intensities by name from text such as "fear=60 joy=30"; a name without a number has 100.

    Entries are separated by commas or spaces; words of a name by underscores, hyphens or spaces.

    Raises OptionError where a number is missing or invalid, or a name is given twice.
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
    if not math.isfinite(intensity) or not 0 <= intensity <= MAX_INTENSITY:
        raise OptionError(f"the intensity of {name!r} must be from 0 to 100, not {intensity:g}")


def _point(parts: tuple[tuple[Expression, float], ...]) -> tuple[float, float]:
    """Return activation and evaluation of a mixture."""
    placed = [(point_of(part), intensity / MAX_INTENSITY) for part, intensity in parts]
    total = max(sum(weight for _, weight in placed), 1.0)
    offset = [
        sum(weight * (point[axis] - NEUTRAL_POINT[axis]) for point, weight in placed) / total
        for axis in (0, 1)
    ]
    return NEUTRAL_POINT[0] + offset[0], NEUTRAL_POINT[1] + offset[1]

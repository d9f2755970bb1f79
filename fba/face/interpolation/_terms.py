"""Terms, functions and links of an interpolation table (FIT)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

from fba.parameters import EXPRESSION_FIELDS, VISEME_FIELDS

EXPONENT_MAX = 15
"""Largest exponent in a FIT node."""
TERMS_MAX = 10
"""Most terms of a numerator or denominator in a FIT node."""
HIGH_LEVEL_NUMBERS = {"viseme": VISEME_FIELDS[:3], "expression": EXPRESSION_FIELDS[:4]}
"""The numbers that FAP 1 and FAP 2 stand for in a source set."""


@dataclass(frozen=True)
class Term:
    """coefficient x product of powers if the impulse is met, else 0.

    coefficient: finite. powers: exponent 0..15 of each number of the source set, by name; absent is 0.
    when: (select, value), such as ("expression_select1", 1), or None for always; numerators only.
    """

    coefficient: float = 1.0
    powers: Mapping[str, int] = field(default_factory=dict)
    when: tuple[str, int] | None = None


@dataclass(frozen=True)
class Function:
    """A destination FAP as numerator (empty: 0) / denominator (empty: 1), sums of at most 10 terms."""

    numerator: Sequence[Term] = ()
    denominator: Sequence[Term] = ()


@dataclass(frozen=True)
class Link:
    """A link from one set of FAPs to another.

    source: names of its FAPs, such as ("lower_t_midlip", "raise_b_midlip"). "viseme" stands for the
    numbers viseme_select1, viseme_select2 and viseme_blend, "expression" for expression_select1,
    expression_intensity1, expression_select2 and expression_intensity2 (both 0..63 as sent).
    functions: the destination set, each of its FAPs with its function.
    """

    source: Sequence[str]
    functions: Mapping[str, Function]

    @cached_property
    def numbers(self) -> tuple[str, ...]:
        """Names of the numbers that the functions may use, in order."""
        return tuple(n for name in self.source for n in HIGH_LEVEL_NUMBERS.get(name, (name,)))


def to_float(value: object) -> float:
    """Return the value as a float; NaN if it is not a number."""
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return math.nan
    try:
        return float(value)
    except OverflowError:
        return math.nan

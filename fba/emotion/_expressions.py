"""The table of named expressions: `expressions.csv`, with the FAPs in `expression_faps.csv`.

The six universal expressions are those of FAP 2 (`fba.face._expressions`). An expression with a recipe is
mixed from others by the rules; its FAPs in the table are added.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from fba.arrays import Bool, Float32
from fba.emotion._expression import FAMILIES, Expression, whissel_points
from fba.emotion._rules import Rules, limited, mix
from fba.errors import OptionError, did_you_mean
from fba.face import Definitions
from fba.parameters import EXPRESSIONS, FAP_COUNT, fap_numbers, fill_from_mates
from fba.text_files import packaged_rows


def expressions() -> tuple[Expression, ...]:
    """Return all named expressions, family by family."""
    return tuple(_by_name().values())


def expression(name: str) -> Expression:
    """Return the expression with this name or alias.

    Case does not matter; underscores and hyphens stand for spaces. Raises OptionError, with the nearest name,
    for an unknown one.
    """
    word = " ".join(name.lower().replace("_", " ").replace("-", " ").split())
    table = _by_any_name()
    if word not in table:
        raise OptionError(
            f"there is no expression {name!r}{did_you_mean(word, table)}; they are {', '.join(_by_name())}"
        )
    return table[word]


@cache
def _by_name() -> dict[str, Expression]:
    rows = {row["name"]: row for row in packaged_rows(__package__, "expressions.csv")}
    drawn = _drawn_faps()
    result: dict[str, Expression] = {}
    for mixed in (False, True):  # recipes name expressions that are drawn
        for name, row in rows.items():
            if bool(row["recipe"]) == mixed:
                result[name] = _build(row, drawn.get(name, np.zeros(FAP_COUNT, dtype=np.float32)), result)
    return {name: result[name] for name in rows}


def _build(row: dict[str, str], faps: Float32, drawn: dict[str, Expression]) -> Expression:
    """Return the expression of a row. faps: those in the table. drawn: expressions that a recipe may name."""
    name, recipe = row["name"], _recipe(row["recipe"])
    select = EXPRESSIONS.index(name) if name in FAMILIES else 0
    if select:
        faps = Definitions.default().expressions[select]
    elif recipe:
        faps = limited(mix([(drawn[word], intensity) for word, intensity in recipe], Rules()) + faps)
    activation, evaluation = whissel_points().get(name, (None, None))
    aliases = tuple(row["aliases"].split(", ")) if row["aliases"] else ()
    return Expression(
        name, row["family"], row["about"], faps, activation, evaluation, select, aliases, recipe
    )


@cache
def _by_any_name() -> dict[str, Expression]:
    return {name: each for each in expressions() for name in (each.name, *each.aliases)}


def _drawn_faps() -> dict[str, Float32]:
    values: dict[str, Float32] = {}
    listed: dict[str, Bool] = {}
    for row in packaged_rows(__package__, "expression_faps.csv"):
        name, column = row["expression"], fap_numbers()[row["fap"]] - 1
        values.setdefault(name, np.zeros(FAP_COUNT, dtype=np.float32))[column] = float(row["value"])
        listed.setdefault(name, np.zeros(FAP_COUNT, dtype=bool))[column] = True
    return {name: fill_from_mates(row, listed[name])[0].astype(np.float32) for name, row in values.items()}


def _recipe(text: str) -> tuple[tuple[str, float], ...]:
    """Return the pairs in "fear=50, joy=40"."""
    pairs = (word.rpartition("=") for word in text.split(", ") if word)
    return tuple((name, float(amount)) for name, _, amount in pairs)

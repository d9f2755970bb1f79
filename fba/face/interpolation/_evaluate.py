"""Fills in unsent FAPs by a FIT, for many frames at once."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial, reduce

import numpy as np
import numpy.typing as npt

from fba.arrays import Bool, Float64, Int16, Intp
from fba.face.interpolation._node import HIGH_LEVEL_NUMBERS, Function, Link, Term
from fba.face.interpolation.table import InterpolationTable
from fba.parameters import INTENSITY_MAX, fap_numbers, faps

VALUE_MAX = float(2**31 - 1)
"""A result beyond this counts as no value: FAPs are 32-bit integers."""


def evaluate(
    table: InterpolationTable, values: npt.NDArray[np.generic], known: Bool, viseme: Int16, expression: Int16
) -> tuple[Float64, Bool, Bool]:
    """Return (values, known, from_high_level), all (T, 68): unknown FAPs filled in by a FIT.

    values: (T, 68). known: bool (T, 68), mask of those to keep; columns 0 and 1 say whether a viseme and an
    expression are in force. viseme: int16 (T, 4), expression: int16 (T, 6), their fields. Returns new
    arrays: values, float64; a mask of the values now known; and one of those computed from a viseme or an
    expression, directly or through other FAPs.
    """
    filled, known = values.astype(np.float64), known.copy()
    from_high_level = np.zeros_like(known)
    numbers = _numbers(filled, viseme, expression)
    for fap in table.order:
        column = fap - 1
        for link, rows, result in _results(table, fap, numbers, known, ~known[:, column]):
            filled[rows, column] = result
            known[rows, column] = True
            if any(name in HIGH_LEVEL_NUMBERS for name in link.source):
                from_high_level[rows, column] = True
            else:
                sources = _columns(link)
                from_high_level[rows, column] = reduce(
                    np.logical_or, (from_high_level[rows, source] for source in sources)
                )
    return filled, known, from_high_level


def estimate(
    table: InterpolationTable, values: npt.NDArray[np.generic], known: Bool, viseme: Int16, expression: Int16
) -> tuple[Float64, Bool]:
    """Return what a FIT would give for each FAP if only that were unknown; arguments as of `evaluate`."""
    result = np.zeros(known.shape)
    given = np.zeros_like(known)
    numbers = _numbers(values.astype(np.float64), viseme, expression)
    for fap in table.order:
        for _, rows, one in _results(table, fap, numbers, known, ~given[:, fap - 1]):
            result[rows, fap - 1] = one
            given[rows, fap - 1] = True
    return result, given


_Numbers = Callable[[str], Float64]


def _numbers(filled: Float64, viseme: Int16, expression: Int16) -> _Numbers:
    """Return a function from the name of a FAP, or of a viseme's or expression's field, to it: (T,)."""
    fields = {
        name: np.clip(array[:, column], 0, INTENSITY_MAX).astype(np.float64)
        for high, array in (("viseme", viseme), ("expression", expression))
        for column, name in enumerate(HIGH_LEVEL_NUMBERS[high])
    }

    def number(name: str) -> Float64:
        return fields[name] if name in fields else filled[:, fap_numbers()[name] - 1]

    return number


def _columns(link: Link) -> list[int]:
    """Return the columns of the source set of a link."""
    return [fap_numbers()[name] - 1 for name in link.source]


def _results(
    table: InterpolationTable, fap: int, number: _Numbers, known: Bool, missing: Bool
) -> Iterator[tuple[Link, Intp, Float64]]:
    """Yield the values (N,) that each link to a FAP gives, and the rows (N,) that it gives them for.

    missing: bool (T,), for which the FAP is wanted; cleared here where a link gives it.
    """
    for link in table.links_to[fap]:
        sources = (known[:, column] for column in _columns(link))
        rows = np.flatnonzero(reduce(np.logical_and, sources, missing))
        if not len(rows):
            continue
        frames = slice(None) if len(rows) == len(known) else rows
        with np.errstate(all="ignore"):  # results that are not finite are left out
            function = link.functions[faps()[fap - 1].name]
            result, valid = _ratio(function, partial(_rows, number, frames), len(rows))
        rows = rows[valid]
        missing[rows] = False
        yield link, rows, result[valid]


def _rows(number: _Numbers, frames: Intp | slice, name: str) -> Float64:
    return number(name)[frames]


def _ratio(function: Function, number: Callable[[str], Float64], count: int) -> tuple[Float64, Bool]:
    """Return (count,) values of a function, and a mask of those that are valid."""
    result = _sum(function.numerator, number, count)
    valid = np.isfinite(result)
    if function.denominator:
        divisor = _sum(function.denominator, number, count)
        valid &= np.isfinite(divisor) & (divisor != 0)
        result = result / divisor
    return result, valid & (np.abs(result) <= VALUE_MAX)


def _sum(terms: Sequence[Term], number: Callable[[str], Float64], count: int) -> Float64:
    total = np.zeros(count)
    for term in terms:
        product = np.full(count, term.coefficient)
        for name, exponent in term.powers.items():
            product *= number(name) ** exponent
        if term.when is not None:
            select, value = term.when
            product = np.where(number(select) == value, product, 0.0)
        total += product
    return total

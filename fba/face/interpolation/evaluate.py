"""Fills in unsent FAPs by a FIT, for many frames at once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial, reduce

import numpy as np
import numpy.typing as npt

from fba.arrays import Bool, Float64, Int16, Intp
from fba.face.interpolation.table import InterpolationTable
from fba.face.interpolation.terms import HIGH_LEVEL_NUMBERS, Function, Term
from fba.parameters import INTENSITY_MAX, fap_numbers, faps

VALUE_MAX = float(2**31 - 1)
"""A result beyond this counts as no value: FAPs are 32-bit integers."""


def evaluate(
    table: InterpolationTable,
    values: npt.NDArray[np.generic],
    known: Bool,
    viseme: Int16,
    expression: Int16,
) -> tuple[Float64, Bool, Bool]:
    """FAP values with unknown ones filled in by a FIT: (values, known, from_high_level), all (T, 68).

    values: (T, 68). known: bool (T, 68), mask of those to keep; columns 0 and 1 say whether a viseme and an
    expression are in force. viseme: int16 (T, 4), expression: int16 (T, 6), their fields. Returns new
    arrays: values, float64; a mask of the values now known; and one of those computed from a viseme or an
    expression, directly or through other FAPs.
    """
    filled, known = values.astype(np.float64), known.copy()
    from_high_level = np.zeros_like(known)
    fields = {
        name: np.clip(array[:, column], 0, INTENSITY_MAX).astype(np.float64)
        for high, array in (("viseme", viseme), ("expression", expression))
        for column, name in enumerate(HIGH_LEVEL_NUMBERS[high])
    }

    def number(rows: Intp | slice, name: str) -> Float64:
        column: Float64 = fields[name] if name in fields else filled[:, fap_numbers()[name] - 1]
        return column[rows]

    with np.errstate(all="ignore"):  # results that are not finite are left out below
        for fap in table.order:
            column = fap - 1
            for link in table.links_to[fap]:
                missing = ~known[:, column]
                sources = [fap_numbers()[name] - 1 for name in link.source]
                rows = np.flatnonzero(reduce(np.logical_and, (known[:, s] for s in sources), missing))
                if not len(rows):
                    continue
                frames = slice(None) if len(rows) == len(filled) else rows
                function = link.functions[faps()[column].name]
                result, valid = _ratio(function, partial(number, frames), len(rows))
                rows = rows[valid]
                filled[rows, column] = result[valid]
                known[rows, column] = True
                if any(name in HIGH_LEVEL_NUMBERS for name in link.source):
                    from_high_level[rows, column] = True
                else:
                    from_high_level[rows, column] = reduce(
                        np.logical_or, (from_high_level[rows, source] for source in sources)
                    )
    return filled, known, from_high_level


def _ratio(function: Function, number: Callable[[str], Float64], count: int) -> tuple[Float64, Bool]:
    """(count,) values of a function, and a mask of those that are valid."""
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

"""Sums of products of FAPs over streams; from these, which FAPs to send, and how the others follow.

Everything is linear and without a constant: a neutral face stays neutral. A FIT's function has ten terms.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from fba.arrays import Bool, Float64, Int32
from fba.face.interpolation._node import TERMS_MAX, Function, Link, Term
from fba.face.interpolation.table import InterpolationTable
from fba.parameters import FAP_COUNT, faps

HEAD_COLUMNS = (47, 48, 49)
"""Columns of the head's rotation: sent if they move; nothing is computed from them, nor they from others."""
EYE_COLUMNS = tuple(range(18, 30))
"""Columns of lids, eyeballs and pupils (group 3), which are computed only from one another. A gaze or a blink
goes with the mouth in some streams by chance, and people see at once where it is wrong."""
FACE_COLUMNS = tuple(column for column in range(2, FAP_COUNT) if column not in HEAD_COLUMNS + EYE_COLUMNS)
"""All other columns: jaw, lips, brows, cheeks, tongue, nose, ears."""
REGIONS = (EYE_COLUMNS, FACE_COLUMNS)
RIDGE = 1e-3
"""Share of a FAP's own energy that is added to it, so that coefficients stay small where FAPs go together."""


@dataclass(frozen=True, eq=False)
class Moments:
    """Sums over frames.

    products: float64 (68, 68), of values of two FAPs. equal: bool (68, 68), whether two FAPs of the same
    part of the face are the same in every frame.
    """

    products: Float64
    equal: Bool

    @property
    def moving(self) -> list[int]:
        """Columns of the FAPs that are not 0 throughout; of equal ones, the first."""
        moves = np.flatnonzero(np.diag(self.products) > 0).tolist()
        return [column for column in moves if self.first(column) == column]

    def first(self, column: int) -> int:
        """Return the first of the columns that equal one."""
        return int(self.equal[column].argmax())


def measure(values: Int32) -> Moments:
    """Return the moments of values (T, 68)."""
    exact = values.astype(np.float64)
    equal = np.eye(FAP_COUNT, dtype=np.bool_)
    for region in (HEAD_COLUMNS, EYE_COLUMNS, FACE_COLUMNS):
        for column in region:
            equal[column, region] = (values[:, region] == values[:, column, None]).all(axis=0)
    return Moments(exact.T @ exact, equal)


def add_up(parts: Iterable[Moments]) -> Moments:
    """Return the moments of several streams together."""
    listed = list(parts)
    return Moments(
        np.sum([one.products for one in listed], axis=0), np.logical_and.reduce([one.equal for one in listed])
    )


def choose_order(moments: Moments, metric: Float64, most: int) -> list[int]:
    """Return columns of FAPs to send, the most useful first, at most `most`; the head's rotation before all.

    Each is the one with which the squared error at the vertices that FAPs move most falls furthest; at least
    one of the eyes and one of the rest of the face, where they move.
    metric: float64 (68, 68), the sum over these vertices of the product of two FAPs' motions, mm^2.
    """
    moving = moments.moving
    chosen = [column for column in moving if column in HEAD_COLUMNS]
    while len(chosen) < min(most, len(moving)):
        rest = [column for column in moving if column not in chosen]
        lacking = [
            region for region in REGIONS if set(region) & set(moving) and not set(region) & set(chosen)
        ]
        if most - len(chosen) <= len(lacking):
            rest = [column for column in rest if any(column in region for region in lacking)]
        costs = [_error(moments, metric, [*chosen, column]) for column in rest]
        chosen.append(rest[int(np.argmin(costs))])
    return chosen


def fewest(moments: Moments) -> int:
    """Return how many FAPs must be sent at least: the head's rotation, one of the eyes, one of the rest."""
    moving = set(moments.moving)
    return len(moving & set(HEAD_COLUMNS)) + sum(bool(moving & set(region)) for region in REGIONS)


def fit_coefficients(moments: Moments, sent: list[int]) -> Float64:
    """Return the coefficients of each sent FAP in every other: float64 (68, 68), a row for each source.

    At most ten of a column are not 0. The column is 0 for FAPs that are sent, that never move, or whose part
    of the face sends nothing; for one that equals a sent FAP it is exactly 1 of that.
    """
    result = np.zeros_like(moments.products)
    for region in REGIONS:
        sources = [column for column in sent if column in region]
        for column in _computed(moments, sent, region):
            if moments.first(column) != column:
                result[:, column] = result[:, moments.first(column)]
            elif sources:
                used, solved = _most_useful(moments.products, sources, column)
                # A FIT node has 32-bit floats: so the table is the same in every form.
                result[used, column] = solved.astype(np.float32)
    for column in np.flatnonzero(np.diag(moments.products)).tolist():
        if column not in sent and moments.first(column) in sent:
            result[moments.first(column), column] = 1.0
    return result


def make_table(coefficients: Float64) -> InterpolationTable:
    """Return the table with a link for the eyes and one for the rest, from the FAPs that are used."""
    names = [one.name for one in faps()]
    links = []
    for region in REGIONS:
        own = np.zeros_like(coefficients)
        own[:, region] = coefficients[:, region]
        used = np.flatnonzero(own.any(axis=1)).tolist()
        functions = {
            names[column]: Function(
                [Term(float(own[one, column]), {names[one]: 1}) for one in used if own[one, column]]
            )
            for column in np.flatnonzero(own.any(axis=0)).tolist()
        }
        if functions:
            links.append(Link([names[column] for column in used], functions))
    return InterpolationTable(links)


def _computed(moments: Moments, sent: list[int], region: tuple[int, ...]) -> list[int]:
    """Return columns that move and that neither are sent nor equal one that is."""
    return [c for c in region if moments.products[c, c] > 0 and moments.first(c) not in sent]


def _most_useful(products: Float64, sources: list[int], column: int) -> tuple[list[int], Float64]:
    """Return the at most ten sources to compute a column from, and their coefficients."""
    solved = _solve(products, sources, [column])[:, 0]
    if len(sources) > TERMS_MAX:
        weight = np.abs(solved) * np.sqrt(np.diag(products)[sources])
        sources = [sources[i] for i in np.sort(np.argsort(-weight, kind="stable")[:TERMS_MAX])]
        solved = _solve(products, sources, [column])[:, 0]
    return sources, solved


def _solve(products: Float64, sources: list[int], computed: list[int]) -> Float64:
    own = products[np.ix_(sources, sources)]
    across = products[np.ix_(sources, computed)]
    return np.linalg.solve(own + RIDGE * np.diag(np.diag(own)), across).astype(np.float64)


def _error(moments: Moments, metric: Float64, sent: list[int]) -> float:
    """Return the sum of squared errors, mm^2, with these FAPs sent; the number of terms has no limit."""
    products, total = moments.products, 0.0
    for region in REGIONS:
        sources = [column for column in sent if column in region]
        computed = _computed(moments, sent, region)
        if not computed:
            continue
        missed: Float64 = products[np.ix_(computed, computed)]
        if sources:
            across = products[np.ix_(sources, computed)]
            solved = _solve(products, sources, computed)
            crossed = solved.T @ across
            missed = missed - crossed - crossed.T
            missed = missed + solved.T @ products[np.ix_(sources, sources)] @ solved
        total += float((metric[np.ix_(computed, computed)] * missed).sum())
    return total

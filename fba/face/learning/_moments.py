"""What learning needs to know of streams, however long they are: sums of products of FAPs."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from fba.arrays import Bool, Float64, Int32
from fba.parameters import FAP_COUNT

HEAD = (47, 48, 49)
"""Columns of the head's rotation: sent where they move, as nothing gives them, and they nothing."""
EYES = tuple(range(18, 30))
"""Columns of lids, eyeballs and pupils (group 3), which are computed only from one another. A gaze or a blink
goes with the mouth in some streams by chance, and people see at once where it is wrong."""
FACE = tuple(column for column in range(2, FAP_COUNT) if column not in HEAD + EYES)
"""All other columns: jaw, lips, brows, cheeks, tongue, nose, ears."""


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
    for region in (HEAD, EYES, FACE):
        for column in region:
            equal[column, region] = (values[:, region] == values[:, column, None]).all(axis=0)
    return Moments(exact.T @ exact, equal)


def add_up(parts: Iterable[Moments]) -> Moments:
    """Return the moments of several streams together."""
    listed = list(parts)
    return Moments(
        np.sum([one.products for one in listed], axis=0),
        np.logical_and.reduce([one.equal for one in listed]),
    )

"""The table of BAP steps in which angles are round, as animators set them: `find_rounder_table`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.arrays import Bool, Int64
from fba.body.solve._pose_loops import UNIT
from fba.body.solve.limits import DEGREES, FULL_TURN, widest_limits
from fba.parameters import BAP_STEP_TABLES, BapTable, bap_steps

ROUND_DEGREES = 5.0
"""Unit of angles that were set by hand in degrees."""
ROUND_RADIANS = 0.1
"""Unit of angles that were set by hand in radians."""
ROUND_UNITS = {
    f"{ROUND_DEGREES:g} degrees": ROUND_DEGREES / DEGREES,
    f"{ROUND_RADIANS:g} rad": ROUND_RADIANS / UNIT,
}
"""Both, by name, in units of BAPs."""
MIN_IMPROBABILITY = 6.0
"""Smallest improbability of round angles, see `_improbability`."""
MIN_ADVANTAGE = 2.0
"""Smallest ratio of that to the other table's."""
MIN_IMPROBABILITY_ALL_ROUND = 1.3
"""The same if every key is round with this table, and not with the other."""


@dataclass(frozen=True)
class Roundness:
    """Roundness of angles.

    score: improbability of this number of round angles by chance. every: whether all keys are round. unit: of
    which they are multiples.
    """

    score: float
    every: bool
    unit: str


def find_rounder_table(levels: Int64, used: BapTable) -> tuple[BapTable, str] | None:
    """Return the table in which angles of levels (T, 296) are far rounder, and the unit; or None."""
    turning = widest_limits().any(axis=1) & (bap_steps(BAP_STEP_TABLES[0]) != bap_steps(BAP_STEP_TABLES[1]))
    columns = np.flatnonzero(turning & levels.any(axis=0))
    quantiser = max(int(np.gcd.reduce(levels[:, columns], axis=None)), 1)
    found = {
        table: _roundness(levels[:, columns] // quantiser, bap_steps(table)[columns] * quantiser)
        for table in BAP_STEP_TABLES
    }
    best = max(found, key=lambda table: found[table].score)
    least = MIN_IMPROBABILITY_ALL_ROUND if found[best].every and not found[used].every else MIN_IMPROBABILITY
    clear = found[best].score > least and found[best].score > MIN_ADVANTAGE * found[used].score
    return (best, found[best].unit) if best != used and clear else None


def _roundness(levels: Int64, steps: Int64) -> Roundness:
    """Return the roundness of levels (T, K), in steps (K,), by the unit that fits best.

    The first and last angle of each joint, and those where it turns back or rests, are counted as keys, each
    value once; if all of them are round, all angles are counted as well.
    """
    changes = np.sign(np.diff(levels, axis=0))
    keys = np.ones(levels.shape, dtype=bool)
    keys[1:-1] = changes[1:] != changes[:-1]
    results = []
    for name, unit in ROUND_UNITS.items():
        at_keys, of_all = (
            _count_round(levels, counted, steps, unit) for counted in (keys, np.ones_like(keys))
        )
        every = at_keys[0] == at_keys[1] > 0
        scores = [_improbability(at_keys[1], at_keys[2])]
        if every:
            scores.append(_improbability(of_all[1], of_all[2]))
        results.append(Roundness(max(scores), every, name))
    return max(results, key=lambda result: result.score)


def _count_round(levels: Int64, counted: Bool, steps: Int64, unit: float) -> tuple[int, int, float]:
    """Return the number of different angles except 0, of round ones, and of those expected by chance."""
    count, hits, expected = 0, 0, 0.0
    for column, chosen, step in zip(levels.T, counted.T, steps.tolist(), strict=True):
        used = np.unique(np.abs(column[chosen & (column != 0)]))
        possible = np.arange(1, max(FULL_TURN / DEGREES / step, 2))
        count += len(used)
        hits += int(_round(used * step, step, unit).sum())
        expected += len(used) * float(_round(possible * step, step, unit).mean())
    return count, hits, expected


def _round(angles: Int64, step: int, unit: float) -> Bool:
    """Return bool (K,): which angles are multiples of unit, as near as the quantiser step allows."""
    return np.abs(angles - unit * np.rint(angles / unit)) <= step / 2


def _improbability(hits: int, expected: float) -> float:
    """Return -log10 of Chernoff's bound on the probability of this number of hits: 6 for one in a million."""
    if hits <= expected:
        return 0.0
    return float((hits * np.log(hits / expected) - hits + expected) / np.log(10))

"""Displacements of markers to FAPs: a least-squares solution within bounds, with the responses of a face.

Each feature point is looked at along the directions of its own FAPs, and of those of the lip contour beside
it. The jaw moves on an arc whose shape depends on the skull, so its depth is fitted to the take.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fba.arrays import Float64, Intp
from fba.capture.markers.responses import JAW, JAW_VALUES, Responses
from fba.face import Fapu
from fba.face.feature_points import row_of
from fba.face.points import DIRECTIONS
from fba.parameters import FAP_COUNT, faps

RIDGE = 1e-4
"""Weight of small values, relative to that of the displacements."""
ROUNDS = 3
"""Solutions, each with the jaw's arc at the values of the one before."""
SWEEPS = 8
"""Rounds in which values are held at a bound or let go."""
OPEN = 60.0
"""Value of open_jaw from which a frame tells how deep the jaw's arc is."""
FEWEST = 10
"""Frames with an open jaw that are needed for that."""
DEEPEST = 3.0
"""Largest ratio of two jaws' arcs, either way."""
CHIN_FAPS = (JAW, 14, 18)
"""FAPs that move the chin up, down, forward and back: jaw, thrust, compression."""
INNER = {"8.1": "2.2", "8.2": "2.3", "8.3": "2.4", "8.4": "2.5", "8.5": "2.6", "8.6": "2.7", "8.7": "2.8",
         "8.8": "2.9"}  # fmt: skip
"""The point of the inner lip beside each of the outer lip."""


@dataclass(frozen=True, eq=False)
class Unknowns:
    """What is solved for. faps: the number of each; mates: FAPs that have the same value; rows: (point, axis)
    pairs that are looked at."""

    faps: tuple[int, ...]
    mates: dict[int, int]
    rows: tuple[tuple[int, int], ...]


def choose_unknowns(points: Sequence[str]) -> Unknowns:
    """Return which FAPs markers on these feature points tell, and along which axes."""
    given = set(points)
    solved: list[int] = []
    mates: dict[int, int] = {}
    rows: list[tuple[int, int]] = []
    for fap in faps()[2:]:
        axis = _axis(fap.positive)
        owner = next((point for point in fap.feature_points if point in given), None)
        inner = next((outer for outer, point in INNER.items() if point in fap.feature_points), None)
        if axis is None or fap.unit == "AU":
            continue
        if owner is not None:
            solved.append(fap.number)
            rows.append((row_of()[owner], axis))
        elif inner in given:
            rows.append((row_of()[inner], axis))
            if fap.lip_mate:
                mates[fap.number] = fap.lip_mate
            else:
                solved.append(fap.number)
    return Unknowns(tuple(solved), mates, tuple(dict.fromkeys(rows)))


def solve(moved: Float64, unknowns: Unknowns, responses: Responses, fapu: Fapu) -> Float64:
    """Return FAPs, float64 (T, 68), zero where no marker tells.

    moved: float64 (T, 84, 3), displacements of feature points from the neutral face, relative to the head,
    in metres along the standard's axes. fapu: the actor's.
    """
    points, axes = np.array(unknowns.rows).T
    seen = moved[:, points, axes]
    unit = np.array([fapu[fap.unit] if fap.unit else 0.0 for fap in faps()])
    each = (responses.each * unit[:, None, None])[:, points, axes]  # (68, R), metres for one step
    columns = np.array(unknowns.faps) - 1
    matrix = each[columns].copy()
    for mate, leader in unknowns.mates.items():
        if leader in unknowns.faps:
            matrix[unknowns.faps.index(leader)] += each[mate - 1]
    size = float(np.linalg.norm(matrix, axis=1).mean()) or 1.0
    inverse = np.linalg.inv(matrix @ matrix.T + RIDGE * size**2 * np.eye(len(columns)))
    one_way = np.flatnonzero([faps()[c].direction == "U" for c in columns])
    values = _solve_bounded(inverse, seen @ matrix.T, one_way)
    if JAW in unknowns.faps:
        jaw = unknowns.faps.index(JAW)
        curve = responses.jaw[:, points, axes] * fapu.MNS
        curve *= _arc_factors(seen, values, matrix, curve, unknowns)
        for _ in range(ROUNDS):
            opened = values[:, jaw]
            arc = np.stack([np.interp(opened, JAW_VALUES, curve[:, r]) for r in range(len(points))], axis=1)
            bent = seen - arc + np.outer(opened, matrix[jaw])
            values = _solve_bounded(inverse, bent @ matrix.T, one_way)
    result = np.zeros((len(seen), FAP_COUNT))
    result[:, columns] = values
    for mate, leader in unknowns.mates.items():
        result[:, mate - 1] = result[:, leader - 1]
    return result


def _arc_factors(
    seen: Float64, values: Float64, matrix: Float64, curve: Float64, unknowns: Unknowns
) -> Float64:
    """Return how far each row moves with the jaw, relative to the face of the responses: float64 (R,).

    1 but for depth and height of the chin's points, which depend on where the jaw's hinge is. There it is the
    weighted median, over the frames with an open jaw, of how far the point went relative to how far it
    should: thrusts and presses of the chin that come and go do not disturb it. The chin's lowest point, whose
    height defines how open the jaw is, is the measure.
    """
    result = np.ones(len(unknowns.rows))
    chin = (row_of()["2.1"], 1)
    if chin not in unknowns.rows:
        return result
    others = [n for n, fap in enumerate(unknowns.faps) if fap not in CHIN_FAPS]
    went = seen - values[:, others] @ matrix[others]
    down = unknowns.rows.index(chin)
    opened = np.interp(-went[:, down], -curve[:, down], JAW_VALUES)
    frames = opened > OPEN
    if frames.sum() < FEWEST:
        return result
    for row, (point, axis) in enumerate(unknowns.rows):
        if point in (row_of()["2.1"], row_of()["2.10"]) and axis != 0 and row != down:
            should = np.interp(opened[frames], JAW_VALUES, curve[:, row])
            ratio = went[frames, row] / should
            order = np.argsort(ratio)
            weight = np.cumsum(np.abs(should[order]))
            middle = ratio[order][np.searchsorted(weight, weight[-1] / 2)]
            result[row] = np.clip(middle, 1 / DEEPEST, DEEPEST)
    return result


def _solve_bounded(inverse: Float64, right: Float64, one_way: Intp) -> Float64:
    """Return the minimum of x . normal . x / 2 - right . x for each row: float64 (T, F).

    inverse: of the normal matrix. one_way: columns that must not be negative. A primal-dual active-set
    method: in each round, frames with the same columns held at 0 are solved at once.
    """
    free: Float64 = right @ inverse
    held = free[:, one_way] < 0
    values = free
    for _ in range(SWEEPS):
        values, pull = free.copy(), np.zeros(held.shape)
        codes = held @ (1 << np.arange(len(one_way)))
        for code in np.unique(codes[codes > 0]):
            rows = np.flatnonzero(codes == code)
            pattern = held[rows[0]]
            columns = one_way[pattern]
            # what holds these columns at 0
            force = free[np.ix_(rows, columns)] @ np.linalg.inv(inverse[np.ix_(columns, columns)])
            values[rows] -= force @ inverse[columns]
            pull[np.ix_(rows, pattern)] = force
        now = np.where(held, pull < 0, values[:, one_way] < 0)
        if (now == held).all():
            break
        held = now
    values[:, one_way] = np.maximum(values[:, one_way], 0.0)
    return values


def _axis(word: str) -> int | None:
    """Return the axis of the standard's word for a motion; None for turns and growth."""
    return int(np.argmax(np.abs(DIRECTIONS[word]))) if word in DIRECTIONS else None

"""Displacements of markers to FAPs: a least-squares solution within bounds, with the responses of a face.

Each feature point counts along the directions of its FAPs, and of those of the lip contour beside it. The jaw
turns about a joint in front of the ears, which slides forward meanwhile. So the chin moves on an arc whose
shape depends on the skull: how far it goes back for each millimetre that it sinks differs by a third between
faces, and follows from the places of chin and ears.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from fba.arrays import Float64, Intp
from fba.face import Deformer, FaceModel, Fapu, feature_point_names
from fba.face.authoring.regions.jaw import CHIN, EARS, Jaw, opening_angles, opening_shifts
from fba.face.points import DIRECTIONS
from fba.parameters import FAP_COUNT, faps, point_rows

RESPONSE_VALUE = 200.0
"""FAP value at which a response is measured."""
JAW = 3
JAW_VALUES = np.array([0.0, 100, 200, 400, 600, 800, 1000, 1400])
"""Values of open_jaw at which its curve is measured: the jaw turns, so its points move on arcs."""
RIDGE_WEIGHT = 1e-4
"""Weight of small values, relative to that of the displacements."""
JAW_ROUNDS = 3
"""Number of solutions, each with the jaw's arc at the values of the previous one."""
BOUND_ROUNDS = 8
"""Largest number of rounds in which values are fixed at a bound or released."""
JAW_STEP = 2
"""Row of `JAW_VALUES` whose shifts are the first guess of the jaw's response."""
BESIDE_CHIN = ("2.11", "2.12")
"""Points without a FAP, which go up, down, forward and back with the jaw."""
INNER_LIP = {"8.1": "2.2", "8.2": "2.3", "8.3": "2.4", "8.4": "2.5", "8.5": "2.6", "8.6": "2.7", "8.7": "2.8",
         "8.8": "2.9"}  # fmt: skip
"""Points of the outer lip, and the points of the inner lip beside them."""


@dataclass(frozen=True, eq=False)
class Responses:
    """Shifts of feature points by FAPs, in FAPU of these FAPs, so that they hold for another face's FAPU.

    each: float64 (68, 84, 3), shift for a step of each FAP; zero for FAPs that turn eyes, tongue and head.
    jaw: float64 (J, 84, 3), shift in MNS at each of `JAW_VALUES`.
    """

    each: Float64
    jaw: Float64


@lru_cache(maxsize=4)
def measure_responses(model: FaceModel) -> Responses:
    """Return the responses of a face."""
    deformer = Deformer(model)
    neutral = deformer.feature_points(np.zeros(FAP_COUNT), local=True)
    moving = [fap for fap in faps()[2:] if fap.unit not in ("AU", "")]
    values = np.zeros((len(moving), FAP_COUNT))
    for row, fap in enumerate(moving):
        values[row, fap.number - 1] = RESPONSE_VALUE
    moved = np.nan_to_num(deformer.feature_points(values, local=True) - neutral)
    each = np.zeros((FAP_COUNT, len(feature_point_names()), 3))
    for row, fap in enumerate(moving):
        each[fap.number - 1] = moved[row] / (RESPONSE_VALUE * model.fapu[fap.unit])
    opened = np.zeros((len(JAW_VALUES), FAP_COUNT))
    opened[:, JAW - 1] = JAW_VALUES
    jaw = np.nan_to_num(deformer.feature_points(opened, local=True) - neutral) / model.fapu.MNS
    return Responses(each, jaw)


@dataclass(frozen=True, eq=False)
class Unknowns:
    """The unknowns of the solution. faps: their numbers. mates: FAP -> the FAP whose value it has. rows:
    (point, axis) of the displacements that count."""

    faps: tuple[int, ...]
    mates: dict[int, int]
    rows: tuple[tuple[int, int], ...]


def choose_unknowns(points: Sequence[str], depth: bool = True, untold: Collection[int] = ()) -> Unknowns:
    """Return the FAPs that markers on these feature points show, and along which axes.

    depth: whether the depth of the markers is known; FAPs in that direction need it. untold: other FAPs that
    the markers do not show.
    """
    given = set(points)
    solved: list[int] = []
    mates: dict[int, int] = {}
    rows: list[tuple[int, int]] = []
    for fap in faps()[2:]:
        axis = _axis(fap.positive)
        owner = next((point for point in fap.feature_points if point in given), None)
        inner = next((outer for outer, point in INNER_LIP.items() if point in fap.feature_points), None)
        if axis is None or fap.unit == "AU" or (axis == 2 and not depth) or fap.number in untold:
            continue
        if owner is not None:
            solved.append(fap.number)
            rows.append((point_rows()[owner], axis))
        elif inner in given:
            rows.append((point_rows()[inner], axis))
            if fap.lip_mate:
                mates[fap.number] = fap.lip_mate
            else:
                solved.append(fap.number)
    if JAW in solved:
        rows += [(point_rows()[point], axis) for point in BESIDE_CHIN if point in given for axis in (1, 2)]
    return Unknowns(tuple(solved), mates, tuple(dict.fromkeys(rows)))


def solve(moved: Float64, still: Float64, fapu: Fapu, unknowns: Unknowns, responses: Responses) -> Float64:
    """Return FAPs, float64 (T, 68), zero where no marker shows them.

    moved: float64 (T, 84, 3), displacements of feature points from the neutral face, relative to the head, in
    metres along the standard's axes. still: float64 (84, 3), the actor's neutral feature points. fapu: of
    these points. responses: of any face.
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
    curve = responses.jaw[:, points, axes] * fapu.MNS
    for row, shifts in jaw_curves(still, fapu).items():
        chin = points == row
        curve[:, chin] = shifts[:, axes[chin]] * fapu.MNS
    jaw = unknowns.faps.index(JAW) if JAW in unknowns.faps else None
    if jaw is not None:
        matrix[jaw] = curve[JAW_STEP] / JAW_VALUES[JAW_STEP]
    size = float(np.linalg.norm(matrix, axis=1).mean()) or 1.0
    inverse = np.linalg.inv(matrix @ matrix.T + RIDGE_WEIGHT * size**2 * np.eye(len(columns)))
    one_way = np.flatnonzero([faps()[c].direction == "U" for c in columns])
    values = _solve_bounded(inverse, seen @ matrix.T, one_way)
    if jaw is not None:
        for _ in range(JAW_ROUNDS):
            opened = values[:, jaw]
            arc = np.stack([np.interp(opened, JAW_VALUES, curve[:, r]) for r in range(len(points))], axis=1)
            bent = seen - arc + np.outer(opened, matrix[jaw])
            values = _solve_bounded(inverse, bent @ matrix.T, one_way)
    result = np.zeros((len(seen), FAP_COUNT))
    result[:, columns] = values
    for mate, leader in unknowns.mates.items():
        result[:, mate - 1] = result[:, leader - 1]
    return result


def _solve_bounded(inverse: Float64, right: Float64, one_way: Intp) -> Float64:
    """Return the minimum of x . normal . x / 2 - right . x for each row: float64 (T, F).

    inverse: of the normal matrix. one_way: columns that must not be negative. A primal-dual active-set
    method: each round solves frames with the same columns held at 0 together.
    """
    free: Float64 = right @ inverse
    held = free[:, one_way] < 0
    values = free
    for _ in range(BOUND_ROUNDS):
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


def jaw_curves(points: Float64, fapu: Fapu) -> dict[int, Float64]:
    """Return shifts (J, 3) in MNS at `JAW_VALUES` of each feature point on the chin, by its row.

    points: float64 (84, 3), the actor's neutral feature points, metres, along the standard's axes.
    """
    rows = [point_rows()[name] for name in CHIN]
    hinge = points[[point_rows()[name] for name in EARS]].mean(axis=0)[1:]
    none = np.zeros(0)
    jaw = Jaw(none, none, hinge, points[point_rows()["2.1"]], fapu.ES * 1024)
    values, angles = opening_angles(jaw, fapu.MNS)
    shifts = opening_shifts(points[rows], jaw, np.interp(JAW_VALUES, values, angles)) / fapu.MNS
    return {row: shifts[:, n] for n, row in enumerate(rows)}

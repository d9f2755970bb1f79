"""How FAPs move the vertices of a head that are worst off, in shares of a tolerance.

Each FAP's error moves a vertex along a slope from the model's tables; its displacement is their sum. A few
hundred vertices represent all: those that are worst off for random errors. Parts that transforms move (eyes)
and turns of the head have separate rows, in which each FAP has a separate axis.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from fba.arrays import Float32, Float64, Int64
from fba.face import FaceModel
from fba.face.deform.displacements import DisplacementMeter
from fba.face.deform.flat_tables import KIND_ORDER, Shifts, Transforms
from fba.parameters import FAP_COUNT, mate_columns
from fba.planning._tolerance import Tolerance


@dataclass(frozen=True)
class Tuning:
    """Constants of the measurement."""

    random_errors: int = 1500  # by which the worst vertices are determined
    max_faps_off: int = 8  # in a random error
    near_border: float = 0.5  # share of the tolerance within which a border of intervals counts as near
    max_slope_difference: float = 0.05  # between slopes that count as equal, as a share of the steepest


TUNING = Tuning()

TRANSLATION, ROTATION = (KIND_ORDER.index(kind) for kind in ("translation", "rotation"))

_worst_vertices: WeakKeyDictionary[FaceModel, Int64] = WeakKeyDictionary()
"""Cache of the worst vertices, as long as their models live."""


class Slopes(NamedTuple):
    """How an error of FAPs that are shown alike moves vertices.

    rows: int64 (N,), of the errors. table: float32 (K, N, 3), for a step of 1, in shares of the tolerance.
    which: int64 (T,), the entry of the table at each frame. lowest, highest: float64 (T,), values between
    which the slopes hold. largest: length of the longest slope.
    """

    rows: Int64
    table: Float32
    which: Int64
    lowest: Float64
    highest: Float64
    largest: float


class _Turn(NamedTuple):
    """How far a step of a FAP moves a row along an axis, in shares of the tolerance."""

    column: int
    row: int
    axis: int
    step: float


class ErrorBasis:
    """Rows in which errors of FAPs add up: vertices and turns.

    count: number of rows. A row is a vector in shares of the tolerance: its length must stay below 1.
    """

    def __init__(self, meter: DisplacementMeter, tolerance: Tolerance) -> None:
        self.tolerance = tolerance
        self._shifts = meter.shifts
        vertices = _find_worst_vertices(meter)
        turns = _turn_rows(meter.model, meter.transforms, tolerance)
        self.count = len(vertices) + 1 + max((turn.row for turn in turns), default=-1)
        self._turns = [turn._replace(row=len(vertices) + turn.row) for turn in turns]
        self._slopes = _slopes_at(self._shifts, vertices, self.count) / np.float32(tolerance.face)
        lengths = np.linalg.norm(self._slopes, axis=2)
        self._lengths = lengths.max(axis=1, initial=0.0)
        self._lowest, self._highest = self._find_ends()

    def slopes(self, columns: tuple[int, ...], values: Float64) -> Slopes:
        """Return slopes of FAPs that are shown alike around values (T, 68).

        If a border of a FAP's intervals is so near that the tolerance may extend beyond it, the steeper side
        counts.
        """
        tracks = [
            track for column in columns for track in np.flatnonzero(self._shifts.column == column).tolist()
        ]
        intervals = np.zeros((len(values), len(tracks)), dtype=np.int64)
        lowest, highest = np.full(len(values), -np.inf), np.full(len(values), np.inf)
        for place, track in enumerate(tracks):
            track_values = values[:, self._shifts.column[track]]
            margin = TUNING.near_border / max(self._lengths[self._range(track)].max(), 1e-9)
            near = np.stack([self._intervals(track, track_values + off) for off in (-margin, 0.0, margin)])
            intervals[:, place] = near[self._lengths[near].argmax(axis=0), np.arange(len(values))]
            lowest = np.maximum(lowest, self._lowest[near[0]])
            highest = np.minimum(highest, self._highest[near[2]])
        distinct, which = np.unique(intervals, axis=0, return_inverse=True)
        table = self._slopes[distinct].sum(axis=1)
        for turn in self._turns:
            if turn.column in columns:
                table[:, turn.row, turn.axis] += turn.step
        rows = np.flatnonzero(np.abs(table).max(axis=(0, 2), initial=0.0) > 1e-9)
        table = np.ascontiguousarray(table[:, rows])
        largest = float(np.linalg.norm(table, axis=2).max(initial=0.0))
        return Slopes(rows, table, which.reshape(-1).astype(np.int64), lowest, highest, largest)

    def _range(self, track: int) -> slice:
        """Return the intervals of a track."""
        return slice(int(self._shifts.first[track]), int(self._shifts.first[track + 1]))

    def _intervals(self, track: int, values: Float64) -> Int64:
        """Return the interval that each value (T,) is in."""
        span = self._range(track)
        uppers = self._shifts.upper[span.start : span.stop - 1]
        result: Int64 = span.start + np.searchsorted(uppers, values, side="left").astype(np.int64)
        return result

    def _find_ends(self) -> tuple[Float64, Float64]:
        """Return the lowest and the highest value for which each interval's slopes are valid: float64 (S,).

        Neighbouring intervals with nearly the same slopes are joined.
        """
        lowest, highest = np.zeros(len(self._slopes)), np.zeros(len(self._slopes))
        for track in range(len(self._shifts.column)):
            span = self._range(track)
            uppers = self._shifts.upper[span.start : span.stop - 1]
            change = np.linalg.norm(np.diff(self._slopes[span], axis=0), axis=2).max(axis=1, initial=0.0)
            borders = uppers[change > TUNING.max_slope_difference * self._lengths[span].max()]
            ends = np.concatenate([[-np.inf], borders, [np.inf]])
            at = np.searchsorted(borders, np.append(uppers, np.inf), side="left")
            lowest[span], highest[span] = ends[at], ends[at + 1]
        return lowest, highest


def _find_worst_vertices(meter: DisplacementMeter) -> Int64:
    """Return the vertices of a model that are worst off for any of the random errors."""
    worst = _worst_vertices.get(meter.model)
    if worst is None:
        rng = np.random.default_rng(0)
        shifts = meter.shifts
        steepest = np.zeros(FAP_COUNT)
        for track in range(len(shifts.column)):
            first, last = int(shifts.start[shifts.first[track]]), int(shifts.start[shifts.first[track + 1]])
            lengths = np.linalg.norm(shifts.slopes[first:last], axis=1)
            column = shifts.column[track]
            steepest[column] = max(steepest[column], float(lengths.max(initial=0.0)))
        moving = np.flatnonzero(steepest)
        source = rng.normal(0, 0.004, (TUNING.random_errors, FAP_COUNT)) / np.where(
            steepest > 0, steepest, np.inf
        )
        errors = np.zeros_like(source)
        for row in errors if len(moving) else ():
            chosen = rng.choice(moving, rng.integers(1, TUNING.max_faps_off + 1))
            row[chosen] = rng.uniform(-0.0005, 0.0005, len(chosen)) / steepest[chosen]
            if rng.random() < 0.7:  # both sides alike
                row[mate_columns()[0][chosen]] = row[chosen]
        measured = meter.measure(source, source + errors)
        worst = np.unique(measured.worst[measured.largest > 0])
        _worst_vertices[meter.model] = worst
    return worst


def _slopes_at(shifts: Shifts, vertices: Int64, rows: int) -> Float32:
    """Return the slopes of every interval at some vertices, metres a step: float32 (S, rows, 3)."""
    place = np.full(int(max(shifts.rows.max(initial=0), vertices.max(initial=0))) + 1, -1)
    place[vertices] = np.arange(len(vertices))
    result = np.zeros((len(shifts.upper), rows, 3), dtype=np.float32)
    for interval in range(len(shifts.upper)):
        entries = slice(int(shifts.start[interval]), int(shifts.start[interval + 1]))
        at = place[shifts.rows[entries]]
        result[interval, at[at >= 0]] = shifts.slopes[entries][at >= 0]
    return result


def _turn_rows(model: FaceModel, transforms: Transforms, tolerance: Tolerance) -> list[_Turn]:
    """Return how far steps of FAPs that turn or shift a part, or turn the head, move rows.

    Up to three FAPs of a part have an axis of its row each, as turns about crossing axes add up. Each angle,
    of the head or of a part, also has a separate row.
    """
    result: list[_Turn] = []
    row = 0
    for part in range(len(transforms.start) - 1):
        first, last = int(transforms.start[part]), int(transforms.start[part + 1])
        head = part == len(transforms.start) - 2
        for place, number in enumerate(range(first, last)):
            column, kind = int(transforms.column[number]), int(transforms.kind[number])
            amount = float(np.linalg.norm(transforms.amount[number]))
            if not head:
                points = model.parts[part].vertices.astype(np.float64) - transforms.centre[number]
                reach = 1.0 if kind == TRANSLATION else float(np.linalg.norm(points, axis=1).max(initial=0.0))
                result.append(_Turn(column, row, place % 3, amount * reach / tolerance.face))
            if kind == ROTATION:
                angle = tolerance.head if head else tolerance.gaze
                result.append(_Turn(column, row + 1 + place, 0, float(np.degrees(amount)) / angle))
        row += 1 + last - first
    return result

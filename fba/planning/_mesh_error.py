"""How FAPs move the vertices of a head that are worst off, in shares of what a tolerance allows.

The displacement of a vertex is the sum of what each FAP's error moves it, along slopes from the model's
tables. A few hundred vertices stand for all: those that come out worst for thousands of drawn errors. What
transforms move (eyes) and the turn of the head are rows of their own, in which each FAP has its own axis.
"""

from __future__ import annotations

from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from fba.arrays import Float32, Float64, Int64
from fba.face import FaceModel
from fba.face.deform.displacements import DisplacementMeter
from fba.face.deform.flat_tables import KIND_ORDER, Shifts, Transforms
from fba.face.mates import donors
from fba.parameters import FAP_COUNT
from fba.planning._tolerance import Tolerance

DRAWN = 1500
"""Errors that are drawn to find the worst vertices."""
MOST_AT_ONCE = 8
"""FAPs that are off in one of them."""

NEAR_BORDER = 0.5
"""Share of the tolerance within which a border of intervals counts as near."""
MAX_SLOPE_DIFFERENCE = 0.05
"""Largest difference of equal slopes, as a share of the steepest."""

TRANSLATION, ROTATION = (KIND_ORDER.index(kind) for kind in ("translation", "rotation"))

_worst_vertices: WeakKeyDictionary[FaceModel, Int64] = WeakKeyDictionary()
"""Cache of the worst vertices, as long as their models live."""


class Slopes(NamedTuple):
    """What an error of FAPs that are shown alike moves.

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
    """What a step of a FAP moves in a row along an axis, in shares of the tolerance."""

    column: int
    row: int
    axis: int
    step: float


class ErrorBasis:
    """Rows in which errors of FAPs add up: vertices and turns.

    count: number of rows. A row is a vector in shares of the tolerance: its length is to stay below 1.
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

        Where a border of a FAP's intervals is so near that the tolerance may reach beyond, the steeper side
        counts.
        """
        tracks = [
            track for column in columns for track in np.flatnonzero(self._shifts.column == column).tolist()
        ]
        intervals = np.zeros((len(values), len(tracks)), dtype=np.int64)
        lowest, highest = np.full(len(values), -np.inf), np.full(len(values), np.inf)
        for place, track in enumerate(tracks):
            own = values[:, self._shifts.column[track]]
            margin = NEAR_BORDER / max(self._lengths[self._range(track)].max(), 1e-9)
            near = np.stack([self._intervals(track, own + off) for off in (-margin, 0.0, margin)])
            intervals[:, place] = near[self._lengths[near].argmax(axis=0), np.arange(len(own))]
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
        own = self._range(track)
        uppers = self._shifts.upper[own.start : own.stop - 1]
        result: Int64 = own.start + np.searchsorted(uppers, values, side="left").astype(np.int64)
        return result

    def _find_ends(self) -> tuple[Float64, Float64]:
        """Return where the slopes of each interval cease to hold, below and above: float64 (S,), (S,).

        Intervals with nearly the same slopes count as one.
        """
        lowest, highest = np.zeros(len(self._slopes)), np.zeros(len(self._slopes))
        for track in range(len(self._shifts.column)):
            own = self._range(track)
            change = np.linalg.norm(np.diff(self._slopes[own], axis=0), axis=2).max(axis=1, initial=0.0)
            borders = self._shifts.upper[own.start : own.stop - 1][
                change > MAX_SLOPE_DIFFERENCE * self._lengths[own].max()
            ]
            ends = np.concatenate([[-np.inf], borders, [np.inf]])
            inside = np.append(self._shifts.upper[own.start : own.stop - 1], np.inf)
            at = np.searchsorted(borders, inside, side="left")
            lowest[own], highest[own] = ends[at], ends[at + 1]
        return lowest, highest


def _find_worst_vertices(meter: DisplacementMeter) -> Int64:
    """Return the vertices of a model that are worst off for any of the errors drawn."""
    found = _worst_vertices.get(meter.model)
    if found is None:
        rng = np.random.default_rng(0)
        shifts = meter.shifts
        steepest = np.zeros(FAP_COUNT)
        for track in range(len(shifts.column)):
            first, last = int(shifts.start[shifts.first[track]]), int(shifts.start[shifts.first[track + 1]])
            lengths = np.linalg.norm(shifts.slopes[first:last], axis=1)
            column = shifts.column[track]
            steepest[column] = max(steepest[column], float(lengths.max(initial=0.0)))
        moving = np.flatnonzero(steepest)
        source = rng.normal(0, 0.004, (DRAWN, FAP_COUNT)) / np.where(steepest > 0, steepest, np.inf)
        errors = np.zeros_like(source)
        for row in errors if len(moving) else ():
            chosen = rng.choice(moving, rng.integers(1, MOST_AT_ONCE + 1))
            row[chosen] = rng.uniform(-0.0005, 0.0005, len(chosen)) / steepest[chosen]
            if rng.random() < 0.7:  # both sides alike
                row[donors()[0][chosen]] = row[chosen]
        measured = meter.measure(source, source + errors)
        found = np.unique(measured.worst[measured.largest > 0])
        _worst_vertices[meter.model] = found
    return found


def _slopes_at(shifts: Shifts, vertices: Int64, rows: int) -> Float32:
    """Return the slopes of every interval at some vertices, metres a step: float32 (S, rows, 3)."""
    place = np.full(int(max(shifts.rows.max(initial=0), vertices.max(initial=0))) + 1, -1)
    place[vertices] = np.arange(len(vertices))
    result = np.zeros((len(shifts.upper), rows, 3), dtype=np.float32)
    for interval in range(len(shifts.upper)):
        own = slice(int(shifts.start[interval]), int(shifts.start[interval + 1]))
        at = place[shifts.rows[own]]
        result[interval, at[at >= 0]] = shifts.slopes[own][at >= 0]
    return result


def _turn_rows(model: FaceModel, transforms: Transforms, tolerance: Tolerance) -> list[_Turn]:
    """Return what steps of FAPs with transforms of a part, or of the head, move.

    Up to three FAPs of a part have an axis each: turns about crossing axes add up like that. Each angle, of
    the head or of a part, has also a row of its own.
    """
    result: list[_Turn] = []
    row = 0
    for part in range(len(transforms.start) - 1):
        first, last = int(transforms.start[part]), int(transforms.start[part + 1])
        head = part == len(transforms.start) - 2
        for place, one in enumerate(range(first, last)):
            column, kind = int(transforms.column[one]), int(transforms.kind[one])
            amount = float(np.linalg.norm(transforms.amount[one]))
            if not head:
                points = model.parts[part].vertices.astype(np.float64) - transforms.centre[one]
                reach = 1.0 if kind == TRANSLATION else float(np.linalg.norm(points, axis=1).max(initial=0.0))
                result.append(_Turn(column, row, place % 3, amount * reach / tolerance.face))
            if kind == ROTATION:
                own = row + 1 + place
                angle = tolerance.head if head else tolerance.gaze
                result.append(_Turn(column, own, 0, float(np.degrees(amount)) / angle))
        row += 1 + last - first
    return result

"""Search for the cheapest parameters within a tolerance: path by path, each within what the others leave.

Errors of all parameters add up in rows at every frame: vertices of a face, points of a body. For each
parameter in turn the rows say how far it may move either way without any of them getting too long;
`find_path` takes the cheapest levels there. Later rounds give what the first has left over to those that
came early. `Rows` is what faces and bodies do differently.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from fba.arrays import Bool, Float64, Int32, Int64
from fba.codec import level_bits
from fba.planning._paths import ROUNDS, Bounds, find_path

SWEEPS = 3
"""Rounds over all parameters."""
PLANE_BITS, SKIP_BITS = 6, 4
"""Bits of a P plane that no parameter pays for, and more where frames are left out behind it."""


@dataclass(frozen=True)
class Effort:
    """How a search goes about it.

    steps: int64 (N,), of the quantiser, one for each parameter. scale: table steps in each. share: of the
    tolerance that each parameter may take at first. gap_share: of the tolerance, what leaving frames out may
    take; 0 leaves out none that move. margin: share of the tolerance that the search fills. most: frames
    left out in a row.
    """

    steps: Int64
    scale: int
    share: float
    gap_share: float
    margin: float
    most: int


@dataclass(frozen=True, eq=False)
class Found:
    """Result of a search. keys: int64 (K,), frames sent. values: int32 (K, N).

    bits: what they take, about. longest: the largest error at any frame, in shares of the tolerance; infinite
    where the search was given up before it was measured.
    """

    keys: Int64
    values: Int32
    bits: float
    longest: float

    @property
    def within(self) -> bool:
        """Whether all frames keep within the tolerance."""
        return self.longest <= 1


class Room(NamedTuple):
    """Where a parameter may be: lower, upper, float64 (T,). jump: see `Bounds`."""

    lower: Float64
    upper: Float64
    jump: float = np.inf


class Rows(Protocol):
    """What a search measures: the errors of all parameters in rows, as shares of the tolerance.

    wanted: float64 (T, N), the values of the source.
    """

    wanted: Float64

    def begin_sweep(self, shown: Float64) -> Sequence[int]:
        """Return the parameters in the order in which they choose. shown: (T, N), the values so far."""

    def room(self, column: int, shown: Float64, limit: Float64, share: float | None) -> Room:
        """Return where a parameter may be so that no row becomes longer than limit (T,).

        shown: (T,), its values so far. share: see `Effort`, in the first round.
        """

    def add(self, column: int, change: Float64) -> None:
        """Add to the errors what a change (T,) of a parameter moves."""


class PathSearch:
    """Paths of all parameters.

    keys: int64 (K,), frames that are sent. paths: levels (K,) of each parameter. shown: float64 (T, N), the
    values at all frames. limit: float64 (T,), how long rows may be.
    """

    def __init__(self, rows: Rows, keys: Int64, effort: Effort) -> None:
        self.rows, self.keys, self.effort = rows, keys, effort
        self.frames = np.arange(len(rows.wanted))
        self.shown = interpolated(rows.wanted, keys).copy()
        self.paths: dict[int, Int64] = {}
        self.limit = np.full(len(rows.wanted), effort.margin)

    def sweep(self, *, first: bool = False, around: Bool | None = None) -> None:
        """Give each parameter the cheapest path within what the others leave.

        first: none may take more than its share. around: bool (T,), frames at which paths may change; default
        all.
        """
        for column in self.rows.begin_sweep(self.shown):
            shown = self.shown[:, column]
            room = self.rows.room(column, shown, self.limit, self.effort.share if first else None)
            lower, upper = room.lower, room.upper
            if around is not None:
                lower, upper = np.where(around, lower, shown), np.where(around, upper, shown)
            step, wanted = int(self.effort.steps[column]), self.rows.wanted[:, column]
            bounds = Bounds(lower, upper, self.keys, step, self.effort.scale, wanted, room.jump)
            rounds = ROUNDS if around is None else 1
            self.take(column, find_path(bounds, self.paths.get(column), rounds=rounds))

    def take(self, column: int, path: Int64) -> None:
        """Take a path (K,) for a parameter."""
        now = np.interp(self.frames, self.keys, path * int(self.effort.steps[column]))
        self.rows.add(column, now - self.shown[:, column])
        self.paths[column], self.shown[:, column] = path, now

    def drop_repeated(self, gaps: Bool) -> None:
        """Leave out frames that a player shows the same without: those between two that are the same.

        gaps: bool (T,), frames that may be left out.
        """
        if not self.paths:
            return
        rows = np.stack(list(self.paths.values()), axis=1)
        same = (rows[1:] == rows[:-1]).all(axis=1)
        kept = np.ones(len(self.keys), dtype=np.bool_)
        kept[1:-1] = ~(same[:-1] & same[1:] & gaps[self.keys[1:-1]])
        self.keys = self.keys[kept]
        self.paths = {column: path[kept] for column, path in self.paths.items()}

    def bits(self) -> float:
        """Return the bits of all that is sent, about."""
        planes = PLANE_BITS * (len(self.keys) - 1) + SKIP_BITS * int((np.diff(self.keys) > 1).sum())
        return planes + sum(level_bits(path, self.effort.scale) for path in self.paths.values())

    def result(self, longest: float) -> Found:
        """Return what was found, whose largest error is this."""
        values = np.zeros((len(self.keys), self.shown.shape[1]), dtype=np.int32)
        for column, path in self.paths.items():
            values[:, column] = path * self.effort.steps[column]
        return Found(self.keys, values, self.bits(), longest)


def interpolated(values: Float64, keys: Int64) -> Float64:
    """Return values (T, N) at all frames, straight lines between those at keys (K,)."""
    if len(keys) == len(values):
        return values
    result = np.zeros_like(values)
    for column in np.flatnonzero(values.any(axis=0)):
        result[:, column] = np.interp(np.arange(len(values)), keys, values[keys, column])
    return result

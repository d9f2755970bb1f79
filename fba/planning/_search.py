"""Search for the cheapest parameters within a tolerance: path by path, each within the tolerance left over.

Errors of all parameters add up in rows at every frame: vertices of a face, points of a body. For each
parameter in turn, the rows determine how far it may move up and down before any of them gets too long;
`find_path` takes the cheapest levels there. Later rounds distribute the tolerance that the first left over.
`Rows` has what differs between faces and bodies.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from fba.arrays import Bool, Float64, Int32, Int64
from fba.planning._code_lengths import level_bits
from fba.planning._paths import MAX_ROUNDS, Bounds, find_path

SWEEPS = 3
"""Rounds over all parameters."""
PLANE_BITS = 6
"""Bits of a P plane apart from its parameters."""
SKIP_BITS = 4
"""Further bits of a P plane if frames are left out behind it."""


@dataclass(frozen=True)
class Effort:
    """Settings of a search. Shares are of the tolerance.

    steps: int64 (N,), the quantiser's step of each parameter. scale: table steps in each. share: what each
    parameter may take at first. gap_share: what frames that are left out may take; with 0, no frames that
    move are left out. margin: share that the search fills. most: frames left out in a row.
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

    bits: approximate size. longest: the largest error at any frame, in shares of the tolerance; infinite if
    the search was given up before it was measured.
    """

    keys: Int64
    values: Int32
    bits: float
    longest: float

    @property
    def within(self) -> bool:
        """Whether all frames stay within the tolerance."""
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
        """Give each parameter the cheapest path within the tolerance that the others leave.

        first: no parameter may take more than its share. around: bool (T,), frames at which paths may change;
        default: all.
        """
        for column in self.rows.begin_sweep(self.shown):
            shown = self.shown[:, column]
            room = self.rows.room(column, shown, self.limit, self.effort.share if first else None)
            lower, upper = room.lower, room.upper
            if around is not None:
                lower, upper = np.where(around, lower, shown), np.where(around, upper, shown)
            step, wanted = int(self.effort.steps[column]), self.rows.wanted[:, column]
            bounds = Bounds(lower, upper, self.keys, step, self.effort.scale, wanted, room.jump)
            rounds = MAX_ROUNDS if around is None else 1
            self.take(column, find_path(bounds, self.paths.get(column), rounds=rounds))

    def take(self, column: int, path: Int64) -> None:
        """Take a path (K,) for a parameter."""
        now = np.interp(self.frames, self.keys, path * int(self.effort.steps[column]))
        self.rows.add(column, now - self.shown[:, column])
        self.paths[column], self.shown[:, column] = path, now

    def drop_repeated(self, gaps: Bool) -> None:
        """Leave out frames between two equal frames, which a player shows the same without them.

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
        """Return the approximate bits of all that is sent."""
        planes = PLANE_BITS * (len(self.keys) - 1) + SKIP_BITS * int((np.diff(self.keys) > 1).sum())
        return planes + sum(level_bits(path, self.effort.scale) for path in self.paths.values())

    def result(self, longest: float) -> Found:
        """Return the result of the search. longest: its largest error."""
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

"""Levels of detail: meshes with fewer triangles, for what is small on the screen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fba.arrays import Bool, Float32, Float64, Int32
from fba.cache import load_or_make, make_key
from fba.compiled import is_compiled

TOLERANCES = (0.0001, 0.0002, 0.0004, 0.0008, 0.0016, 0.0032, 0.0064, 0.0128, 0.0256)
"""Root-mean-square errors of the levels of detail, metres."""
MIN_TRIANGLES = 200
"""Meshes with fewer triangles than this are not simplified."""
MAX_PASSES = 40
MIN_REMOVED_SHARE = 0.004
"""A pass that removes less than this share of the vertices is the last one of its level."""
CACHE_VERSION = "3"
"""Cache version; increment when `simplify_by_quadrics` gives other results."""


@dataclass(frozen=True, eq=False)
class DetailLevels:
    """One mesh at several levels of detail, computed on first use and stored in the disk cache.

    points: (V, N), each vertex's positions in all poses that count (3 x poses columns), then any attributes
    to be preserved, scaled so that a difference of 1 weighs as much as a metre. triangles: int32 (F, 3).
    known: the `collapses`, where they are stored elsewhere.
    """

    points: Float32
    poses: int
    triangles: Int32
    known: tuple[Int32, Int32] | None = None

    def triangles_within(self, tolerance: float) -> Int32 | None:
        """Return int32 (F, 3): the coarsest triangles with at most this error (m); None for all."""
        if tolerance < TOLERANCES[0] or len(self.triangles) < MIN_TRIANGLES or not is_compiled():
            return None
        return _without_flat(self.targets_within(tolerance)[self.triangles])

    def targets_within(self, tolerance: float) -> Int32:
        """Return int32 (V,): the vertex onto which each has collapsed with at most this error (m)."""
        level = int(np.searchsorted(TOLERANCES, tolerance, side="right")) - 1
        target = np.arange(len(self.points), dtype=np.int32)
        if level < 0 or len(self.triangles) < MIN_TRIANGLES or not is_compiled():
            return target
        onto, first = self.collapses
        collapses = first <= level
        for _ in range(MAX_PASSES * len(TOLERANCES)):  # no more steps than passes were made
            if not collapses[target].any():
                break
            target = np.where(collapses[target], onto[target], target)
        return target

    @cached_property
    def collapses(self) -> tuple[Int32, Int32]:
        """What `simplify_by_quadrics` returns: int32 (V,) twice."""
        count = len(self.points)
        if self.known is not None and len(self.known[0]) == count:
            return self.known

        def make() -> list[Int32]:
            return list(simplify_by_quadrics(self.points.astype(np.float64), self.poses, self.triangles))

        key = make_key("coarse", CACHE_VERSION, self.points, self.triangles)
        onto, first = load_or_make(key, ((count,), (count,)), make, np.int32)
        if (onto < 0).any() or (onto >= count).any():
            onto, first = make()
        return onto, first


def simplify_by_quadrics(
    points: Float64, poses: int, triangles: Int32, tolerances: Sequence[float] = TOLERANCES
) -> tuple[Int32, Int32]:
    """Return the vertex that each vertex collapses onto, and the level at which it does: int32 (V,) twice.

    The level is an index into tolerances (m, rising), or their number for a vertex that stays. points, poses,
    triangles: as in `DetailLevels`. Borders keep their course; vertices that share a position stay.
    ValueError for triangles that name other vertices, and for more poses than the points hold.
    """
    from fba.mesh.simplify import _quadric_loops as loops

    count, size = points.shape
    left = np.ascontiguousarray(triangles, dtype=np.int32).copy()
    if left.size and not 0 <= left.min() <= left.max() < count:
        raise ValueError(f"triangles name vertices beyond the {count} that exist")
    if not 0 <= 3 * poses <= size:
        raise ValueError(f"points of {size} coordinates cannot hold {poses} poses")
    start = np.zeros(count + 1, dtype=np.int64)
    owners = np.empty(3 * len(left), dtype=np.int32)
    loops.around(left, count, start, owners)
    fans = loops.Fans(left, start, owners)
    border = np.zeros(count, dtype=bool)
    loops.borders(fans, border)
    a, b = np.zeros((count, size, size)), np.zeros((count, size))
    sums = loops.Quadrics(a, b, c=np.zeros(count), w=np.zeros(count))
    loops.add_quadrics(points, fans, sums)
    locked = _share_positions(points[:, :3])
    goal, cost = np.empty(count, dtype=np.int32), np.empty(count)
    touched = np.empty(count, dtype=bool)
    onto = np.arange(count, dtype=np.int32)
    first = np.full(count, len(tolerances), dtype=np.int32)
    for level, tolerance in enumerate(tolerances):
        fixed = loops.Fixed(border, locked, tolerance**2)
        for _ in range(MAX_PASSES):
            if not loops.candidates(points, poses, fans, fixed, sums, goal, cost):
                break
            movable = np.flatnonzero(goal >= 0)
            order = movable[np.argsort(cost[movable], kind="stable")]
            done = loops.collapse(order, goal, fans, touched, onto, sums)
            first[(onto != np.arange(count)) & (first == len(tolerances))] = level
            fans = loops.Fans(_without_flat(fans.triangles), start, owners)
            loops.around(fans.triangles, count, start, owners)
            if done < MIN_REMOVED_SHARE * len(fans.triangles):
                break
    return onto, first


def _without_flat(triangles: Int32) -> Int32:
    """Return the triangles (F, 3) with three different corners."""
    a, b, c = triangles.T
    return np.ascontiguousarray(triangles[(a != b) & (b != c) & (c != a)])


def _share_positions(positions: Float64) -> Bool:
    """Return bool (V,): whether another vertex has the same position, as along a seam, which would gape."""
    rounded = np.ascontiguousarray(np.round(positions * 1e6).astype(np.int64))
    _, inverse, counts = np.unique(rounded, axis=0, return_inverse=True, return_counts=True)
    return np.asarray(counts[inverse.ravel()] > 1)

"""Displacements of one FAP at chosen values, eased around folds, and their conversion to FaceDefTables."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fba.arrays import Bool, Float64, Intp
from fba.face._tables import FaceDefMesh, FaceDefTables, FaceDefTransform
from fba.face.authoring.surface._fold_limits import Limiter
from fba.face.authoring.surface.surface import Surface, positions_in, positions_in_rows
from fba.mesh import connected
from fba.parameters import faps

UNMOVED_DISTANCE = 2e-6
"""Vertices that move by at most this (m) are left out of the tables."""
RINGS = 3
"""Vertices up to this many edges away from folded triangles may be eased."""
STAGES = (0.4, 0.7, 1.0)
"""Shares of a goal in the order in which they are tried: early folds are the worst."""
DENSE_MAX = 150
"""Systems of at most this many vertices are solved faster as dense ones."""
ROUNDS = 2
"""Number of passes: easing some triangles may fold their neighbours."""


@dataclass(frozen=True, eq=False)
class Motion:
    """Displacements of vertices at several values of a FAP.

    values: (K,) rising FAP values, one of them 0. vertices: (N,). shifts: (K, N, 3), metres from the
    neutral face at each value, all zero where the value is 0.
    """

    values: Float64
    vertices: Intp
    shifts: Float64

    def shifts_at(self, value: float) -> Float64:
        """Return (N, 3) shifts at a value, metres; constant beyond the outermost values."""
        x = float(np.clip(value, self.values[0], self.values[-1]))
        k = int(np.clip(np.searchsorted(self.values, x) - 1, 0, len(self.values) - 2))
        share = (x - self.values[k]) / (self.values[k + 1] - self.values[k])
        return np.asarray(self.shifts[k] * (1 - share) + self.shifts[k + 1] * share)


def including(motion: Motion, more: Intp) -> Motion:
    """Return the same motion with further vertices, which stay where they are."""
    vertices = np.union1d(motion.vertices, more)
    shifts = np.zeros((len(motion.values), len(vertices), 3))
    shifts[:, np.searchsorted(vertices, motion.vertices)] = motion.shifts
    return Motion(motion.values, vertices, shifts)


def fap_limits(fap: int) -> tuple[float, float]:
    """Return the smallest and largest value that a stream can carry with the finest quantiser step."""
    entry = faps()[fap - 1]
    assert entry.i_limits is not None
    low, high = entry.i_limits
    return float(low * entry.step), float(high * entry.step)


def split_by_part(surface: Surface, motion: Motion) -> dict[str, Motion]:
    """Return a motion of the surface as motions of its parts, by name of the part."""
    row = positions_in(motion.vertices, len(surface))
    result = {}
    for name, number in surface.members.items():
        own = np.flatnonzero(row[number] >= 0)
        if len(own):
            result[name] = Motion(motion.values, own, motion.shifts[:, row[number[own]]])
    return result


def build_tables(
    fap: int, unit: float, motions: Mapping[str, Motion], transforms: Iterable[FaceDefTransform] = ()
) -> FaceDefTables:
    """Return the FaceDefTables of one FAP. unit: metres a step. motions: by name of the part."""
    meshes = [mesh for name, motion in motions.items() if (mesh := _mesh(name, motion, unit)) is not None]
    return FaceDefTables(fap, tuple(meshes), tuple(transforms))


def _mesh(part: str, motion: Motion, unit: float) -> FaceDefMesh | None:
    moving = (
        (np.abs(motion.shifts).max(axis=(0, 2)) > UNMOVED_DISTANCE)
        if len(motion.vertices)
        else np.zeros(0, bool)
    )
    if not moving.any():
        return None
    borders = np.round(motion.values).astype(np.int64)
    slopes = np.diff(motion.shifts[:, moving], axis=0) / np.diff(borders)[:, None, None] / unit
    # constant beyond the outermost values, whatever a stream asks for
    flat = np.zeros((1, *slopes.shape[1:]))
    borders = np.concatenate([[borders[0] - 1], borders, [borders[-1] + 1]])
    slopes = np.concatenate([flat, slopes, flat])
    return FaceDefMesh(
        part,
        borders.astype(np.int32),
        motion.vertices[moving].astype(np.int32),
        slopes.swapaxes(0, 1).astype(np.float32),
    )


def unfold(surface: Surface, limiter: Limiter, motion: Motion, pinned: Bool, turning: bool) -> Motion:
    """Return the motion with the surroundings of folded triangles stretched evenly.

    pinned: (N,) mask of vertices whose shifts must not change. turning: as in `Patch.soundness`. Folds
    remain where this does not help.
    """
    shifts = np.stack([limiter.spread(motion.vertices, step) for step in motion.shifts])
    moved = surface.mask(motion.vertices)
    patch = limiter.patch(np.flatnonzero(moved))
    zero = int(np.flatnonzero(motion.values == 0)[0])
    for side in (range(zero + 1, len(shifts)), range(zero - 1, -1, -1)):
        for k in side:
            for _ in range(ROUNDS):
                folded = patch.triangles[~patch.soundness(shifts[k], turning=turning)]
                if not len(folded):
                    break
                for group in _connected_groups(folded):
                    shifts[k] = _ease_around(surface, limiter, shifts[k], group, pinned, turning)
                also = shifts[k].any(axis=1) & ~moved
                if also.any():
                    moved |= also
                    patch = limiter.patch(np.flatnonzero(moved))
            else:
                if not patch.is_sound(shifts[k], turning=turning):
                    break  # further out it only gets worse, and there the motion will stop
    vertices = np.flatnonzero(moved)
    return Motion(motion.values, vertices, shifts[:, vertices])


def ease_field(
    surface: Surface, limiter: Limiter, field: Float64, goals: Sequence[float], pinned: Bool
) -> Float64:
    """Return a linear motion (N, 3) per unit of value, eased to reach the goals without folds if possible.

    What helps one goal can harm the other: that which is reached least counts first.
    """
    result = field
    reached = _reachable_shares(limiter, field, goals)
    for share in STAGES:
        for k, goal in enumerate(goals):
            if reached[k] >= share:
                continue
            moving = np.flatnonzero(result.any(axis=1))
            moves = result[moving] * goal * share
            motion = Motion(np.array([0.0, 1.0]), moving, np.stack([0 * moves, moves]))
            unfolded = unfold(surface, limiter, motion, pinned, False)
            trial = limiter.spread(unfolded.vertices, unfolded.shifts[1] / (goal * share))
            now = _reachable_shares(limiter, trial, goals)
            if sorted(now) > sorted(reached):
                result, reached = trial, now
    return result


def _reachable_shares(limiter: Limiter, field: Float64, goals: Sequence[float]) -> list[float]:
    """Return the shares of some values that a linear motion (N, 3) reaches without folds, at most 1."""
    patch = limiter.patch(np.flatnonzero(field.any(axis=1)))
    return [min(patch.least_reach(field * goal), 1.0) for goal in goals]


def _connected_groups(triangles: Intp) -> list[Intp]:
    """Return the triangles (M, 3) in groups that share vertices."""
    if not len(triangles):
        return []
    vertices, local = np.unique(triangles, return_inverse=True)
    local = local.reshape(-1, 3)
    ends = np.concatenate([local[:, :2], local[:, 1:]])
    labels = connected(ends, len(vertices))[local[:, 0]]
    return [triangles[labels == k] for k in range(int(labels.max()) + 1)]


def _ease_around(
    surface: Surface, limiter: Limiter, shifts: Float64, folded: Intp, pinned: Bool, turning: bool
) -> Float64:
    """Return the shifts (N, 3) eased about folded triangles (M, 3), in the smallest region that helps."""
    best, fewest = shifts, len(folded)
    core = np.unique(folded)
    # second start: the triangles move as one, with their pinned vertices if there are any
    fixed = core[pinned[core]]
    core = core[~pinned[core]]
    as_one = shifts.copy()
    if len(core):
        as_one[core] = shifts[fixed if len(fixed) else core].mean(axis=0)
    region = core
    for _ in range(RINGS):
        region = surface.neighbours(region)
        patch = limiter.patch(region)
        free_region = region[~pinned[region]]
        for start in (shifts, as_one):
            free = free_region if start is shifts else np.setdiff1d(free_region, core, assume_unique=True)
            trial = _solve_harmonic(surface, start, free)
            left = int((~patch.soundness(trial, turning=turning)).sum())
            if not left:
                return trial
            if left < fewest:
                best, fewest = trial, left
    return best


def _solve_harmonic(surface: Surface, shifts: Float64, free: Intp) -> Float64:
    """Return the shifts (N, 3), those of `free` vertices interpolated harmonically from the others."""
    if not len(free):
        return shifts
    size = len(free)
    position = positions_in(free, len(surface))
    # The entries of scipy's matrices, picked by hand: there are thousands of small systems.
    rows = surface.laplacian[0]
    entries, count = positions_in_rows(rows.indptr, free)
    row, column, weights = np.repeat(np.arange(size), count), rows.indices[entries], rows.data[entries]
    local = position[column]
    inside = local >= 0
    known = weights[~inside, None] * shifts[column[~inside]]
    sums = [np.bincount(row[~inside], known[:, axis], size) for axis in range(3)]
    right = np.stack(sums, axis=1, dtype=np.float64)
    solve = _solve_dense if size <= DENSE_MAX else _solve_sparse
    solved = solve(row[inside], local[inside], weights[inside], -right)
    if solved is None:  # a piece without fixed vertices
        return shifts
    result = shifts.copy()
    result[free] = solved if np.isfinite(solved).all() else np.nan_to_num(solved)
    return result


def _solve_dense(rows: Intp, columns: Intp, values: Float64, right: Float64) -> Float64 | None:
    """Return the solution (N, 3) of the system with these entries, each once; None if it is singular."""
    system = np.zeros((len(right), len(right)))
    system[rows, columns] = values
    try:
        return np.asarray(np.linalg.solve(system, right), dtype=np.float64)
    except np.linalg.LinAlgError:
        return None


def _solve_sparse(rows: Intp, columns: Intp, values: Float64, right: Float64) -> Float64 | None:
    """Return what `_solve_dense` returns, for large systems."""
    from scipy.sparse import csc_array
    from scipy.sparse.linalg import splu

    try:
        return np.asarray(splu(csc_array((values, (rows, columns)))).solve(right), dtype=np.float64)
    except RuntimeError:
        return None

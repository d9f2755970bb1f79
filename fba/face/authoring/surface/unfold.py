"""Eases motions around triangles that would fold."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fba.arrays import Bool, Float64, Intp
from fba.face.authoring.surface.fold_limits import Limiter
from fba.face.authoring.surface.motion import Motion
from fba.face.authoring.surface.surface import Surface

RINGS = 3
"""Vertices up to this many edges away from folded triangles may be eased."""
STAGES = (0.4, 0.7, 1.0)
"""Shares of a goal in the order in which they are tried: early folds are the worst."""
LEAST_RETAINED = 0.88
"""Least share of what one goal reached that easing towards another must leave."""
ROUNDS = 2
"""Number of passes: easing some triangles may fold their neighbours."""


def unfold(surface: Surface, limiter: Limiter, motion: Motion, pinned: Bool, turning: bool) -> Motion:
    """The motion with the surroundings of folded triangles stretched evenly.

    pinned: (N,) mask of vertices whose shifts must not change. turning: as in `Limiter.soundness`. Folds
    remain where this does not help.
    """
    shifts = np.stack([limiter.spread(motion.vertices, step) for step in motion.shifts])
    moved = surface.mask(motion.vertices)
    zero = int(np.flatnonzero(motion.values == 0)[0])
    for side in (range(zero + 1, len(shifts)), range(zero - 1, -1, -1)):
        for k in side:
            for _ in range(ROUNDS):
                triangles = limiter.triangles_touching(np.flatnonzero(moved))
                folded = triangles[~limiter.soundness(shifts[k], triangles, turning=turning)]
                for group in _connected_groups(folded):
                    shifts[k] = _ease_around(surface, limiter, shifts[k], group, pinned, turning)
                if not len(folded):
                    break
                moved |= shifts[k].any(axis=1)
            triangles = limiter.triangles_touching(np.flatnonzero(moved))
            if not limiter.is_sound(shifts[k], triangles, turning=turning):
                break  # further out it only gets worse, and there the motion will stop
    vertices = np.flatnonzero(moved)
    return Motion(motion.values, vertices, shifts[:, vertices])


def ease_field(
    surface: Surface, limiter: Limiter, field: Float64, goals: Sequence[float], pinned: Bool
) -> Float64:
    """A linear motion (N, 3) per unit of value, eased to reach the goals without folds if possible."""
    result = field
    reached = [_reachable_share(limiter, field, goal) for goal in goals]
    for share in STAGES:
        for k, goal in enumerate(goals):
            if reached[k] >= share:
                continue
            moving = np.flatnonzero(result.any(axis=1))
            moves = result[moving] * goal * share
            motion = Motion(np.array([0.0, 1.0]), moving, np.stack([0 * moves, moves]))
            unfolded = unfold(surface, limiter, motion, pinned, False)
            trial = limiter.spread(unfolded.vertices, unfolded.shifts[1] / (goal * share))
            now = [_reachable_share(limiter, trial, each) for each in goals]
            if now[k] > reached[k] and all(
                new >= LEAST_RETAINED * old for new, old in zip(now, reached, strict=True)
            ):
                result, reached = trial, now
    return result


def _reachable_share(limiter: Limiter, field: Float64, goal: float) -> float:
    """Share of a value that a linear motion reaches without folds, at most 1."""
    triangles = limiter.triangles_touching(np.flatnonzero(field.any(axis=1)))
    return min(float(limiter.reach(field * goal, triangles).min(initial=np.inf)), 1.0)


def _connected_groups(triangles: Intp) -> list[Intp]:
    """Triangles (M, 3) in groups that share vertices."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import connected_components

    if not len(triangles):
        return []
    vertices, local = np.unique(triangles, return_inverse=True)
    local = local.reshape(-1, 3)
    ends = np.concatenate([local[:, :2], local[:, 1:]])
    graph = csr_array((np.ones(len(ends)), tuple(ends.T)), shape=(len(vertices),) * 2)
    labels = connected_components(graph, directed=False)[1][local[:, 0]]
    return [triangles[labels == k] for k in range(int(labels.max()) + 1)]


def _ease_around(
    surface: Surface, limiter: Limiter, shifts: Float64, folded: Intp, pinned: Bool, turning: bool
) -> Float64:
    """Shifts (N, 3) eased about folded triangles (M, 3), in the smallest region that unfolds most of them."""
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
        region = np.unique(surface.graph[region].indices) if len(region) else region
        touched = limiter.triangles_touching(region)
        free_region = region[~pinned[region]]
        for start, free in ((shifts, free_region), (as_one, np.setdiff1d(free_region, core))):
            trial = _solve_harmonic(surface, start, free)
            left = int((~limiter.soundness(trial, touched, turning=turning)).sum())
            if left < fewest:
                best, fewest = trial, left
        if not fewest:
            break
    return best


def _solve_harmonic(surface: Surface, shifts: Float64, free: Intp) -> Float64:
    """Shifts (N, 3) with those of `free` vertices replaced by the harmonic interpolation of the others."""
    from scipy.sparse.linalg import splu

    result = shifts.copy()
    if len(free):
        rows = surface.laplacian[0][free]
        known = shifts.copy()
        known[free] = 0.0
        try:
            result[free] = np.nan_to_num(splu(rows[:, free].tocsc()).solve(-(rows @ known)))
        except RuntimeError:  # a piece without fixed vertices
            return shifts
    return result

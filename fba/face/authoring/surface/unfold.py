"""Motions that fold a few triangles, eased there so that they do not."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fba.arrays import Bool, Float64, Intp
from fba.face.authoring.surface.fold_limits import Limiter
from fba.face.authoring.surface.motion import Motion
from fba.face.authoring.surface.surface import Surface

RINGS = 3
"""So many edges around folded triangles may be eased."""
STAGES = (0.4, 0.7, 1.0)
"""Nearer goals are seen to first: what folds there is most in the way."""
KEPT = 0.88
"""Easing the way to one goal may not cost more than this of the way to another."""
ROUNDS = 2
"""Easing one place may fold its neighbours; so many times this is looked after."""


def relaxed(surface: Surface, limiter: Limiter, motion: Motion, pinned: Bool, turning: bool) -> Motion:
    """The same motion with the surroundings of folded triangles stretched evenly.

    pinned: (N,) vertices that must go where they go. turning: as in `Limiter.soundness`. Where nothing
    helps, the folds stay.
    """
    whole = np.zeros((len(motion.values), len(surface), 3))
    whole[:, motion.vertices] = motion.shifts
    moved = np.zeros(len(surface), dtype=bool)
    moved[motion.vertices] = True
    zero = int(np.flatnonzero(motion.values == 0)[0])
    for side in (range(zero + 1, len(whole)), range(zero - 1, -1, -1)):
        for k in side:
            for _ in range(ROUNDS):
                triangles = limiter.touched(np.flatnonzero(moved))
                bad = triangles[~limiter.soundness(whole[k], triangles, turning=turning)]
                for cluster in _clusters(bad):
                    whole[k] = _eased(surface, limiter, whole[k], cluster, pinned, turning)
                if not len(bad):
                    break
                moved |= whole[k].any(axis=1)
            if not limiter.sound(whole[k], limiter.touched(np.flatnonzero(moved)), turning=turning):
                break  # further out it only gets worse, and there the motion will stop
    vertices = np.flatnonzero(moved)
    return Motion(motion.values, vertices, whole[:, vertices])


def eased_field(
    surface: Surface, limiter: Limiter, field: Float64, goals: Sequence[float], pinned: Bool
) -> Float64:
    """A straight motion (N, 3) per step, eased so that some values can be reached without folds."""
    result = field
    reached = [_reached(limiter, field, goal) for goal in goals]
    for share in STAGES:
        for k, goal in enumerate(goals):
            if reached[k] >= share:
                continue
            moving = np.flatnonzero(result.any(axis=1))
            moves = result[moving] * goal * share
            motion = Motion(np.array([0.0, 1.0]), moving, np.stack([0 * moves, moves]))
            again = relaxed(surface, limiter, motion, pinned, False)
            trial = np.zeros_like(field)
            trial[again.vertices] = again.shifts[1] / (goal * share)
            now = [_reached(limiter, trial, each) for each in goals]
            if now[k] > reached[k] and all(new >= KEPT * old for new, old in zip(now, reached, strict=True)):
                result, reached = trial, now
    return result


def _reached(limiter: Limiter, field: Float64, goal: float) -> float:
    """Which share of a value a straight motion reaches without folds, at most 1."""
    triangles = limiter.touched(np.flatnonzero(field.any(axis=1)))
    return min(float(limiter.reach(field * goal, triangles).min(initial=np.inf)), 1.0)


def _clusters(bad: Intp) -> list[Intp]:
    """Triangles (M, 3) in groups that hang together."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import connected_components

    if not len(bad):
        return []
    vertices, local = np.unique(bad, return_inverse=True)
    local = local.reshape(-1, 3)
    ends = np.concatenate([local[:, :2], local[:, 1:]])
    graph = csr_array((np.ones(len(ends)), tuple(ends.T)), shape=(len(vertices),) * 2)
    labels = connected_components(graph, directed=False)[1][local[:, 0]]
    return [bad[labels == k] for k in range(int(labels.max()) + 1)]


def _eased(
    surface: Surface, limiter: Limiter, shifts: Float64, bad: Intp, pinned: Bool, turning: bool
) -> Float64:
    """Shifts (N, 3) after easing around some triangles as little as is enough, or as helps most."""
    best, fewest = shifts, len(bad)
    core = np.unique(bad)
    # as one with what must not be touched, where there is such among them
    held = core[pinned[core]]
    core = core[~pinned[core]]
    as_one = shifts.copy()
    if len(core):
        as_one[core] = shifts[held if len(held) else core].mean(axis=0)
    region = core
    for _ in range(RINGS):
        region = np.unique(surface.graph[region].indices) if len(region) else region
        touched = limiter.touched(region)
        free_region = region[~pinned[region]]
        for start, free in ((shifts, free_region), (as_one, np.setdiff1d(free_region, core))):
            trial = _harmonic(surface, start, free)
            left = int((~limiter.soundness(trial, touched, turning=turning)).sum())
            if left < fewest:
                best, fewest = trial, left
        if not fewest:
            break
    return best


def _harmonic(surface: Surface, shifts: Float64, free: Intp) -> Float64:
    """Shifts with those of some vertices replaced by what a stretched cloth would do."""
    from scipy.sparse.linalg import splu

    result = shifts.copy()
    if len(free):
        rows = surface.laplacian[0][free]
        known = shifts.copy()
        known[free] = 0.0
        try:
            result[free] = np.nan_to_num(splu(rows[:, free].tocsc()).solve(-(rows @ known)))
        except RuntimeError:  # a piece that hangs on nothing
            return shifts
    return result

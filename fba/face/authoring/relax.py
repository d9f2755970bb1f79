"""Motions that fold a few triangles, eased there so that they do not."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from fba.face.authoring.extremes import LEAST_AREA, Limiter
from fba.face.authoring.motion import Motion
from fba.face.authoring.surface import Surface

Float64 = npt.NDArray[np.float64]
Int = npt.NDArray[np.intp]
Bool = npt.NDArray[np.bool_]

RINGS = (1, 2, 3, 4, 6, 8)
"""How many edges around folded triangles may be eased, one after the other."""
ROUNDS = 3
"""Easing one place may fold its neighbours; so many times this is looked after."""


def relaxed(surface: Surface, limiter: Limiter, motion: Motion, pinned: Bool, least: float) -> Motion:
    """The same motion with the surroundings of folded triangles stretched evenly.

    pinned: (N,) vertices that must go where they go. least: share of its area that a triangle keeps.
    Where even that does not help, the folds stay.
    """
    whole = np.zeros((len(motion.values), len(surface), 3))
    whole[:, motion.vertices] = motion.shifts
    triangles = limiter.touched(motion.vertices)
    moved = np.zeros(len(surface), dtype=bool)
    moved[motion.vertices] = True
    for k in range(len(motion.values)):
        for _ in range(ROUNDS):
            bad = triangles[~limiter.soundness(whole[k], triangles, least)]
            if not len(bad):
                break
            whole[k] = _eased(surface, limiter, whole[k], bad, pinned, least)
            moved |= whole[k].any(axis=1)
            triangles = limiter.touched(np.flatnonzero(moved))
    vertices = np.flatnonzero(moved)
    return Motion(motion.values, vertices, whole[:, vertices])


def eased_field(
    surface: Surface, limiter: Limiter, field: Float64, goals: Sequence[float], pinned: Bool
) -> Float64:
    """A straight motion (N, 3) per step, eased so that some values can be reached without folds."""
    result = field
    for goal in goals:
        moving = np.flatnonzero(result.any(axis=1))
        motion = Motion(np.array([0.0, 1.0]), moving, np.stack([0 * result[moving], result[moving] * goal]))
        again = relaxed(surface, limiter, motion, pinned, LEAST_AREA)
        trial = np.zeros_like(field)
        trial[again.vertices] = again.shifts[1] / goal
        if _worst(limiter, trial, goals) > _worst(limiter, result, goals):
            result = trial
    return result


def _worst(limiter: Limiter, field: Float64, goals: Sequence[float]) -> float:
    """Smallest share of the goals that a straight motion reaches without folds."""
    triangles = limiter.touched(np.flatnonzero(field.any(axis=1)))
    reached = [float(limiter.reach(field * goal, triangles).min(initial=np.inf)) for goal in goals]
    return min(*reached, 1.0)


def _eased(
    surface: Surface, limiter: Limiter, shifts: Float64, bad: Int, pinned: Bool, least: float
) -> Float64:
    """Shifts (N, 3) after easing around some triangles as little as is enough, or as helps most."""
    best, fewest = shifts, len(bad)
    core = np.zeros(len(surface), dtype=bool)
    core[bad] = True
    core &= ~pinned
    as_one = _as_one(surface, shifts, bad, core)
    region, done = core.copy(), 0
    for rings in RINGS:
        for _ in range(rings - done):
            region |= (surface.graph @ region.astype(np.float64)) > 0
        done = rings
        touched = limiter.touched(np.flatnonzero(region))
        for start, held in ((shifts, pinned), (as_one, pinned | core)):
            trial = _harmonic(surface, start, region & ~held)
            left = int((~limiter.soundness(trial, touched, least)).sum())
            if left < fewest:
                best, fewest = trial, left
        if not fewest:
            break
    return best


def _as_one(surface: Surface, shifts: Float64, bad: Int, core: Bool) -> Float64:
    """Shifts where the vertices of folded triangles that hang together go together."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import connected_components

    ends = np.concatenate([bad[:, :2], bad[:, 1:]])
    graph = csr_array((np.ones(len(ends)), tuple(ends.T)), shape=(len(surface),) * 2)
    labels = connected_components(graph, directed=False)[1]
    count = np.bincount(labels[core], minlength=labels.max() + 1)
    result = shifts.copy()
    for axis in range(3):
        total = np.bincount(labels[core], shifts[core, axis], minlength=len(count))
        result[core, axis] = (total / np.maximum(count, 1))[labels[core]]
    return result


def _harmonic(surface: Surface, shifts: Float64, free: Bool) -> Float64:
    """Shifts with those of the free vertices replaced by what a stretched cloth would do."""
    from scipy.sparse.linalg import splu

    laplacian = surface.laplacian[0]
    inside = np.flatnonzero(free)
    result = shifts.copy()
    if len(inside) and not free.all():
        rows = laplacian[inside]
        right = -(rows @ np.where(free[:, None], 0.0, shifts))
        try:
            result[inside] = np.nan_to_num(splu(rows[:, inside].tocsc()).solve(right))
        except RuntimeError:  # a piece that hangs on nothing
            return shifts
    return result

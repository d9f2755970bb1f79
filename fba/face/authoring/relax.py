"""Motions that fold a few triangles, eased there so that they do not."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fba.face.authoring.extremes import Limiter
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


def _eased(
    surface: Surface, limiter: Limiter, shifts: Float64, bad: Int, pinned: Bool, least: float
) -> Float64:
    """Shifts (N, 3) after easing around some triangles as little as is enough, or as helps most."""
    best, fewest = shifts, len(bad)
    region = np.zeros(len(surface), dtype=bool)
    region[bad] = True
    done = 0
    for rings in RINGS:
        for _ in range(rings - done):
            region |= (surface.graph @ region.astype(np.float64)) > 0
        done = rings
        free = region & ~pinned
        trial = _harmonic(surface, shifts, free)
        touched = limiter.touched(np.flatnonzero(region))
        left = int((~limiter.soundness(trial, touched, least)).sum())
        if left < fewest:
            best, fewest = trial, left
        if not left:
            break
    return best


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

"""Measures how far a motion can go before triangles fold over or tear."""

from __future__ import annotations

from copy import copy
from functools import cached_property

import numpy as np

from fba.arrays import Bool, Float64, Intp

LEAST_AREA = 0.12
"""A triangle seen along its neutral normal keeps this share of its area."""
MOST_STRETCH = 5.0
"""No edge gets longer than this many times its neutral length..."""
TINY_EDGE = 0.25
"""... or, for short edges, of this share of the typical edge length of what moves."""
FOLDED = -0.3
"""A triangle whose normal has this cosine with that of its neighbours lies folded on them."""
SPECK = 0.0015
"""Share of the moving surface that may lie folded where skin closes on itself."""
FEW_VERTICES = 0.1
"""Up to this share of all vertices, their triangles are looked up one vertex at a time."""
DEGENERATE = 1e-5
"""Triangles of less than this share of the typical area have no front to turn."""


class Limiter:
    """Measures how far motions of a mesh can go.

    vertices: (N, 3), neutral, metres. triangles: (F, 3).
    """

    def __init__(self, vertices: Float64, triangles: Intp) -> None:
        self._vertices = vertices
        first, second = (vertices[triangles[:, k]] - vertices[triangles[:, 0]] for k in (1, 2))
        areas = np.linalg.norm(np.cross(first, second), axis=1)
        typical = float(np.median(areas)) if len(areas) else 0.0
        self._triangles = triangles[areas > DEGENERATE * typical]

    def without(self, vertices: Intp) -> Limiter:
        """A limiter that ignores the triangles around the given vertices."""
        other = copy(self)
        other.__dict__.pop("_fans", None)
        other._triangles = self._triangles[~np.isin(self._triangles, vertices).any(axis=1)]
        return other

    def __len__(self) -> int:
        return len(self._vertices)

    @cached_property
    def _fans(self) -> tuple[Intp, Intp]:
        """(starts, triangles): for each vertex the triangles about it."""
        order = np.argsort(self._triangles.ravel(), kind="stable")
        count = np.bincount(self._triangles.ravel(), minlength=len(self._vertices))
        return np.concatenate([[0], np.cumsum(count)]), order // 3

    def triangles_touching(self, vertices: Intp) -> Intp:
        """(M, 3) triangles with a vertex among those given."""
        starts, fans = self._fans
        touched: Intp
        if len(vertices) > FEW_VERTICES * len(self._vertices):
            moving = np.zeros(len(self._vertices), dtype=bool)
            moving[vertices] = True
            touched = self._triangles[moving[self._triangles].any(axis=1)]
            return touched
        count = starts[vertices + 1] - starts[vertices]
        place = np.repeat(starts[vertices] - np.cumsum(count) + count, count) + np.arange(int(count.sum()))
        touched = self._triangles[np.unique(fans[place])]
        return touched

    def reach(self, field: Float64, triangles: Intp) -> Float64:
        """(M,) for each triangle the largest s at which vertices + s * field (N, 3) keeps it unfolded."""
        p, d = self._vertices, field
        e1, e2 = (p[triangles[:, k]] - p[triangles[:, 0]] for k in (1, 2))
        d1, d2 = (d[triangles[:, k]] - d[triangles[:, 0]] for k in (1, 2))
        normal = np.cross(e1, e2)
        area = (normal**2).sum(axis=1)
        linear = ((np.cross(e1, d2) + np.cross(d1, e2)) * normal).sum(axis=1) / area
        square = (np.cross(d1, d2) * normal).sum(axis=1) / area
        result = _first_root(square, linear, np.full(len(area), 1 - LEAST_AREA))
        lengths = np.stack([np.linalg.norm(e, axis=1) for e in (e1, e2, e2 - e1)])
        typical = float(np.median(lengths)) if lengths.size else 0.0
        for edge, move in ((e1, d1), (e2, d2), (e2 - e1, d2 - d1)):
            base = (edge**2).sum(axis=1)
            longest = MOST_STRETCH**2 * np.maximum(base, (TINY_EDGE * typical) ** 2)
            stretch = _first_root(-(move**2).sum(axis=1), -2 * (edge * move).sum(axis=1), longest - base)
            result = np.minimum(result, stretch)
        return result

    def is_sound(self, shifts: Float64, triangles: Intp, *, turning: bool = False) -> bool:
        """Whether no triangle folds or tears at vertices + shifts (N, 3).

        turning: as in `soundness`; then tiny folds (`SPECK`) in the corners of eyes and mouth are allowed.
        """
        fine = self.soundness(shifts, triangles, turning=turning)
        if not turning or fine.all():
            return bool(fine.all())
        corners = self._vertices[triangles]
        areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        return float(areas[~fine].sum()) <= SPECK * float(areas.sum())

    def soundness(self, shifts: Float64, triangles: Intp, *, turning: bool = False) -> Bool:
        """(M,) which triangles neither fold nor tear under shifts (N, 3).

        turning: the skin may rotate, as a lid does about the eyeball; then a triangle has folded where it
        faces away from its neighbours, not where it faces away from its neutral direction.
        """
        p = self._vertices[triangles]
        q = p + shifts[triangles]
        e1, e2 = p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]
        f1, f2 = q[:, 1] - q[:, 0], q[:, 2] - q[:, 0]
        before, after = np.cross(e1, e2), np.cross(f1, f2)
        if turning:
            around = _Around(triangles)
            fine: Bool = (around.facing(after) >= FOLDED) | (around.facing(before) <= 0)
        else:
            fine = (before * after).sum(axis=1) >= 0.8 * LEAST_AREA * (before**2).sum(axis=1)
        lengths = np.linalg.norm(np.stack([e1, e2, e2 - e1]), axis=2)
        typical = float(np.median(lengths)) if lengths.size else 0.0
        now = np.linalg.norm(np.stack([f1, f2, f2 - f1]), axis=2)
        fine &= (now <= 1.1 * MOST_STRETCH * np.maximum(lengths, TINY_EDGE * typical)).all(axis=0)
        return fine


class _Around:
    """Neighbours of triangles (M, 3): those that share a vertex."""

    def __init__(self, triangles: Intp) -> None:
        from scipy.sparse import csr_array

        vertices, local = np.unique(triangles, return_inverse=True)
        shape = (len(vertices), len(triangles))
        fans = (np.ones(triangles.size), (local.ravel(), np.repeat(np.arange(len(triangles)), 3)))
        self._fans = csr_array(fans, shape=shape)

    def facing(self, normals: Float64) -> Float64:
        """(M,) cosine between the normal (M, 3) of each triangle and that of its neighbours without it."""
        around = self._fans.T @ (self._fans @ normals) - 3 * normals
        product = np.linalg.norm(around, axis=1) * np.linalg.norm(normals, axis=1)
        result: Float64 = (around * normals).sum(axis=1) / np.maximum(product, 1e-30)
        result[product < 1e-30] = 1.0
        return result


def _first_root(square: Float64, linear: Float64, constant: Float64) -> Float64:
    """Smallest positive x with square x² + linear x + constant = 0, inf where there is none; constant > 0."""
    with np.errstate(divide="ignore", invalid="ignore"):
        below = linear**2 - 4 * square * constant
        root = np.sqrt(np.maximum(below, 0.0))
        # the numerically stable pair of roots
        q = -0.5 * (linear + np.where(linear >= 0, root, -root))
        roots = np.stack([q / square, constant / q])
    roots[:, below < 0] = np.inf
    roots[~(roots > 0)] = np.inf
    result: Float64 = roots.min(axis=0)
    return result

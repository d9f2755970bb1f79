"""Measures how far a motion can go before triangles fold over or tear."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from fba.arrays import Bool, Float64, Intp

LEAST_AREA = 0.12
"""Least share of its area that a triangle keeps, seen along its neutral normal."""
MOST_STRETCH = 5.0
"""Largest length of an edge, in multiples of its neutral length..."""
TINY_EDGE = 0.25
"""... or, for short edges, of this share of the typical edge length among the moving triangles."""
FOLDED = -0.3
"""A triangle is folded if its normal has a smaller cosine than this with that of its neighbours."""
SPECK = 0.0015
"""Share of the moving area that may be folded where skin closes on itself."""
FEW_VERTICES = 0.1
"""Up to this share of all vertices, triangles are looked up vertex by vertex, which is faster."""
DEGENERATE = 1e-5
"""Triangles of less than this share of the typical area count as lines, which cannot fold."""


@dataclass(frozen=True, eq=False)
class Limiter:
    """Measures how far motions of a mesh can go; made by `from_mesh`.

    vertices: (N, 3), neutral, metres. triangles: (F, 3), those that can fold.
    """

    vertices: Float64
    triangles: Intp

    @classmethod
    def from_mesh(cls, vertices: Float64, triangles: Intp) -> Limiter:
        """The limiter of a mesh; triangles without area are left out: they cannot fold."""
        areas = np.linalg.norm(np.cross(*_two_edges(vertices, triangles)), axis=1)
        typical = float(np.median(areas)) if len(areas) else 0.0
        return cls(vertices, triangles[areas > DEGENERATE * typical])

    def without(self, vertices: Intp) -> Limiter:
        """A limiter that ignores the triangles around the given vertices."""
        return Limiter(self.vertices, self.triangles[~np.isin(self.triangles, vertices).any(axis=1)])

    def spread(self, vertices: Intp, shifts: Float64) -> Float64:
        """(N, 3) shifts of all vertices: the given ones (M, 3) at some vertices (M,), 0 elsewhere."""
        result = np.zeros((len(self.vertices), 3))
        result[vertices] = shifts
        return result

    @cached_property
    def _fans(self) -> tuple[Intp, Intp]:
        """(starts, triangles): those of vertex v are triangles[starts[v] : starts[v + 1]]."""
        order = np.argsort(self.triangles.ravel(), kind="stable")
        count = np.bincount(self.triangles.ravel(), minlength=len(self.vertices))
        return np.concatenate([[0], np.cumsum(count)]), order // 3

    def triangles_touching(self, vertices: Intp) -> Intp:
        """(M, 3) triangles with a vertex among those given."""
        touched: Intp
        if len(vertices) > FEW_VERTICES * len(self.vertices):
            moving = np.zeros(len(self.vertices), dtype=bool)
            moving[vertices] = True
            touched = self.triangles[moving[self.triangles].any(axis=1)]
            return touched
        starts, fans = self._fans
        count = starts[vertices + 1] - starts[vertices]
        rows = np.repeat(starts[vertices] - np.cumsum(count) + count, count) + np.arange(int(count.sum()))
        touched = self.triangles[np.unique(fans[rows])]
        return touched

    def reach(self, field: Float64, triangles: Intp) -> Float64:
        """(M,) for each triangle the largest s at which vertices + s * field (N, 3) keeps it unfolded."""
        e1, e2 = _two_edges(self.vertices, triangles)
        d1, d2 = _two_edges(field, triangles)
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
        areas = np.linalg.norm(np.cross(*_two_edges(self.vertices, triangles)), axis=1)
        return float(areas[~fine].sum()) <= SPECK * float(areas.sum())

    def soundness(self, shifts: Float64, triangles: Intp, *, turning: bool = False) -> Bool:
        """(M,) mask of the triangles that neither fold nor tear under shifts (N, 3).

        turning: the skin may rotate, as a lid does about the eyeball; then a triangle counts as folded if it
        faces away from its neighbours, not if it faces away from its neutral direction.
        """
        e1, e2 = _two_edges(self.vertices, triangles)
        f1, f2 = _two_edges(self.vertices + shifts, triangles)
        before, after = np.cross(e1, e2), np.cross(f1, f2)
        if turning:
            fans = _vertex_fans(triangles)
            fine: Bool = (_facing_neighbours(fans, after) >= FOLDED) | (_facing_neighbours(fans, before) <= 0)
        else:
            fine = (before * after).sum(axis=1) >= 0.8 * LEAST_AREA * (before**2).sum(axis=1)
        lengths = np.linalg.norm(np.stack([e1, e2, e2 - e1]), axis=2)
        typical = float(np.median(lengths)) if lengths.size else 0.0
        now = np.linalg.norm(np.stack([f1, f2, f2 - f1]), axis=2)
        fine &= (now <= 1.1 * MOST_STRETCH * np.maximum(lengths, TINY_EDGE * typical)).all(axis=0)
        return fine


def _two_edges(vertices: Float64, triangles: Intp) -> tuple[Float64, Float64]:
    """The edges (M, 3) from the first corner of each triangle to the second and the third."""
    first = vertices[triangles[:, 0]]
    return vertices[triangles[:, 1]] - first, vertices[triangles[:, 2]] - first


def _vertex_fans(triangles: Intp) -> Any:
    """Sparse matrix (K, M), 1 where a vertex is a corner of a triangle (M, 3); K: the vertices that are."""
    from scipy.sparse import csr_array

    vertices, local = np.unique(triangles, return_inverse=True)
    entries = (np.ones(triangles.size), (local.ravel(), np.repeat(np.arange(len(triangles)), 3)))
    return csr_array(entries, shape=(len(vertices), len(triangles)))


def _facing_neighbours(fans: Any, normals: Float64) -> Float64:
    """(M,) cosine between the normal (M, 3) of each triangle and that of its neighbours by any vertex."""
    around = fans.T @ (fans @ normals) - 3 * normals
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

"""Measures how far a motion can go before triangles fold over or tear."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fba.arrays import Bool, Float64, Intp
from fba.face.authoring.surface.surface import positions_in_rows
from fba.rotations import cross, dot, lengths

LEAST_AREA = 0.12
"""Least share of its area that a triangle keeps, seen along its neutral normal."""
MOST_STRETCH = 5.0
"""Largest length of an edge, in multiples of its neutral length."""
TINY_EDGE = 0.25
"""Share of the typical edge length among the moving triangles, which stands for shorter neutral lengths
there."""
FOLDED_COSINE = -0.3
"""A triangle is folded if its normal has a smaller cosine than this with that of its neighbours."""
MAX_FOLDED_SHARE = 0.0015
"""Share of the moving area that may be folded where skin closes on itself."""
FEW_VERTICES = 0.1
"""Up to this share of all vertices, triangles are looked up vertex by vertex, which is faster."""
DEGENERATE_AREA = 1e-5
"""Triangles of less than this share of the typical area count as lines, which cannot fold."""


@dataclass(frozen=True, eq=False)
class Limiter:
    """Measures how far motions of a mesh can go: vertices (N, 3), metres, and triangles that can fold."""

    vertices: Float64
    triangles: Intp

    @classmethod
    def from_mesh(cls, vertices: Float64, triangles: Intp) -> Limiter:
        """Return the limiter of a mesh; triangles without area are left out: they cannot fold."""
        areas = Patch(vertices, triangles).areas
        typical = float(np.median(areas)) if len(areas) else 0.0
        return cls(vertices, triangles[areas > DEGENERATE_AREA * typical])

    def without(self, vertices: Intp) -> Limiter:
        """Return a limiter that ignores the triangles around the given vertices."""
        return Limiter(self.vertices, self.triangles[~np.isin(self.triangles, vertices).any(axis=1)])

    def spread(self, vertices: Intp, shifts: Float64) -> Float64:
        """Return (N, 3) shifts of all vertices: the given ones (M, 3) at some vertices (M,), 0 elsewhere."""
        result = np.zeros((len(self.vertices), 3))
        result[vertices] = shifts
        return result

    @cached_property
    def _fans(self) -> tuple[Intp, Intp]:
        """(starts, triangles): those of vertex v are triangles[starts[v] : starts[v + 1]]."""
        order = np.argsort(self.triangles.ravel(), kind="stable")
        count = np.bincount(self.triangles.ravel(), minlength=len(self.vertices))
        return np.concatenate([[0], np.cumsum(count)]), order // 3

    def patch(self, vertices: Intp) -> Patch:
        """Return the triangles with a vertex among those given (K,)."""
        if len(vertices) > FEW_VERTICES * len(self.vertices):
            moving = np.zeros(len(self.vertices), dtype=bool)
            moving[vertices] = True
            a, b, c = self.triangles.T
            return Patch(self.vertices, self.triangles[moving[a] | moving[b] | moving[c]])
        starts, fans = self._fans
        touched = np.unique(fans[positions_in_rows(starts, vertices)[0]])
        return Patch(self.vertices, self.triangles[touched])


@dataclass(frozen=True, eq=False)
class Patch:
    """Triangles (M, 3) of a mesh of vertices (N, 3), metres, measured once for all motions to try."""

    vertices: Float64
    triangles: Intp

    @cached_property
    def _corners(self) -> tuple[Float64, Float64, Float64]:
        """The corners (M, 3) of the triangles, neutral."""
        a, b, c = self.triangles.T
        return self.vertices[a], self.vertices[b], self.vertices[c]

    @cached_property
    def _edges(self) -> tuple[Float64, Float64, Float64]:
        """The edges (M, 3) from the first corner to the second and the third, and between these."""
        first, second, third = self._corners
        e1, e2 = second - first, third - first
        return e1, e2, e2 - e1

    @cached_property
    def _normals(self) -> Float64:
        """(M, 3) normals, twice as long as the triangles are large."""
        e1, e2, _ = self._edges
        return cross(e1, e2)

    @cached_property
    def areas(self) -> Float64:
        """(M,) twice the areas of the triangles, m²."""
        return lengths(self._normals)

    @cached_property
    def _square_areas(self) -> Float64:
        return dot(self._normals, self._normals)

    @cached_property
    def _edge_lengths(self) -> tuple[Float64, ...]:
        return tuple(lengths(edge) for edge in self._edges)

    @cached_property
    def _typical_length(self) -> float:
        edges = np.concatenate(self._edge_lengths)
        if not len(edges):
            return 0.0
        middle = [(len(edges) - 1) // 2, len(edges) // 2]
        return float(np.partition(edges, middle)[middle].mean())  # the median, four times as fast

    @cached_property
    def _most_lengths(self) -> tuple[Float64, ...]:
        """Lengths of the edges above which they count as torn."""
        shortest = TINY_EDGE * self._typical_length
        return tuple(1.1 * MOST_STRETCH * np.maximum(length, shortest) for length in self._edge_lengths)

    @cached_property
    def _local_corners(self) -> Intp:
        """(M, 3) the corners of the triangles, counted through the vertices of this patch."""
        return np.unique(self.triangles, return_inverse=True)[1].reshape(-1, 3)

    def _facing_neighbours(self, normals: Float64) -> Float64:
        """Return (M,) cosine between each triangle's normal (M, 3) and that of those around it."""
        around = self._sum_around(normals) - 3 * normals
        product = lengths(around) * lengths(normals)
        result: Float64 = dot(around, normals) / np.maximum(product, 1e-30)
        result[product < 1e-30] = 1.0
        return result

    def _sum_around(self, normals: Float64) -> Float64:
        """Return (M, 3) sums of the normals (M, 3) of all triangles at the corners of each, itself thrice."""
        corners = self._local_corners
        if not len(corners):
            return np.zeros((0, 3))
        sums = np.stack([np.bincount(corners.ravel(), np.repeat(axis, 3)) for axis in normals.T], axis=1)
        low, middle, high = np.sort(corners, axis=1).T
        return np.asarray(sums[low] + sums[middle] + sums[high])

    @cached_property
    def _folded_before(self) -> Bool:
        """(M,) mask of the triangles that face away from their neighbours in the neutral face."""
        return self._facing_neighbours(self._normals) <= 0

    @cached_property
    def _stretching(self) -> tuple[tuple[Float64, Float64], ...]:
        """For each edge its squared length, and by how much that may grow."""
        shortest = (TINY_EDGE * self._typical_length) ** 2
        squares = (dot(edge, edge) for edge in self._edges)
        return tuple((square, MOST_STRETCH**2 * np.maximum(square, shortest) - square) for square in squares)

    def reach(self, field: Float64) -> Float64:
        """Return (M,) the largest s at which vertices + s * field (N, 3) keeps each triangle unfolded."""
        a, b, c = self.triangles.T
        first = field[a]
        d1, d2 = field[b] - first, field[c] - first
        e1, e2, _ = self._edges
        normal, area = self._normals, self._square_areas
        linear = dot(cross(e1, d2) + cross(d1, e2), normal) / area
        square = dot(cross(d1, d2), normal) / area
        result = _first_root(square, linear, np.full(len(area), 1 - LEAST_AREA))
        for edge, move, (_, growth) in zip(self._edges, (d1, d2, d2 - d1), self._stretching, strict=True):
            stretch = _first_root(-dot(move, move), -2 * dot(edge, move), growth)
            result = np.minimum(result, stretch)
        return result

    def least_reach(self, field: Float64) -> float:
        """Return the largest s at which vertices + s * field (N, 3) folds no triangle; inf without any."""
        return float(self.reach(field).min(initial=np.inf))

    def is_sound(self, shifts: Float64, *, turning: bool = False) -> bool:
        """Return whether no triangle folds or tears under shifts (N, 3), but for tiny folds if `turning`."""
        fine = self.soundness(shifts, turning=turning)
        if not turning or fine.all():
            return bool(fine.all())
        return float(self.areas[~fine].sum()) <= MAX_FOLDED_SHARE * float(self.areas.sum())

    def soundness(self, shifts: Float64, *, turning: bool = False) -> Bool:
        """Return (M,) mask of the triangles that neither fold nor tear under shifts (N, 3).

        turning: the skin may rotate, as a lid does about the eyeball; then a triangle counts as folded if it
        faces away from its neighbours, not if it faces away from its neutral direction.
        """
        first, second, third = (
            corner + shifts[own] for corner, own in zip(self._corners, self.triangles.T, strict=True)
        )
        f1, f2 = second - first, third - first
        after = cross(f1, f2)
        if turning:
            fine: Bool = (self._facing_neighbours(after) >= FOLDED_COSINE) | self._folded_before
        else:
            fine = dot(self._normals, after) >= 0.8 * LEAST_AREA * self._square_areas
        for edge, most in zip((f1, f2, f2 - f1), self._most_lengths, strict=True):
            fine &= lengths(edge) <= most
        return fine


def _first_root(square: Float64, linear: Float64, constant: Float64) -> Float64:
    """Return the smallest x > 0 with square x² + linear x + constant = 0, else inf. constant > 0."""
    with np.errstate(divide="ignore", invalid="ignore"):
        below = linear**2 - 4 * square * constant
        root = np.sqrt(np.maximum(below, 0.0))
        # the numerically stable pair of roots
        q = -0.5 * (linear + np.where(linear >= 0, root, -root))
        roots = np.stack([q / square, constant / q])
    roots[:, below < 0] = np.inf
    roots[~(roots > 0)] = np.inf
    return np.asarray(roots.min(axis=0))

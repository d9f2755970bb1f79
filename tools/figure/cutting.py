"""Triangle meshes with values at their vertices, cut exactly along the line where a function is 0."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fba.arrays import Bool, Float64, Int64
from tools.figure.meshes import average_with_neighbours, open_edges, unique_edges

MIDLINE = 1e-6
"""Vertices within this many metres of the plane of symmetry are on it."""
SNAP = 0.28
"""A corner nearer to the line than this share of an edge is moved onto it, to avoid slivers."""


@dataclass(frozen=True, eq=False)
class Cloth:
    """A mesh with weights and values at its vertices.

    vertices, normals: (V, 3). weights: (V, J). values: (V, K), any others. triangles: (F, 3).
    """

    vertices: Float64
    normals: Float64
    weights: Float64
    values: Float64
    triangles: Int64

    @property
    def edges(self) -> Int64:
        """(E, 2) each edge once."""
        return unique_edges(self.triangles)

    @property
    def border(self) -> Int64:
        """(E, 2) open edges, in the direction of their triangles."""
        return open_edges(self.triangles)

    def select(self, faces: Bool) -> Cloth:
        """Return the mesh of some triangles (mask (F,)) and the vertices that they use."""
        used, triangles = np.unique(self.triangles[faces], return_inverse=True)
        return replace(self._rows(used), triangles=triangles.reshape(-1, 3))

    def _rows(self, rows: Int64) -> Cloth:
        return replace(
            self,
            vertices=self.vertices[rows],
            normals=self.normals[rows],
            weights=self.weights[rows],
            values=self.values[rows],
        )

    def interpolate_rows(self, first: Int64, second: Int64, share: Float64) -> tuple[Float64, ...]:
        """Return vertices, normals, weights, values interpolated between pairs of vertices by shares (N,)."""
        part = share[:, None]
        return tuple(
            array[first] * (1 - part) + array[second] * part
            for array in (self.vertices, self.normals, self.weights, self.values)
        )

    def split(self, height: Float64) -> tuple[Cloth, Float64]:
        """Return the cloth with vertices along the line where height (V,) is 0, and the new heights."""
        height = height.copy()
        arrays = [self.vertices.copy(), self.normals.copy(), self.weights.copy(), self.values.copy()]
        edges = self.edges
        a, b = edges[height[edges[:, 0]] * height[edges[:, 1]] < 0].T
        share = height[a] / (height[a] - height[b])
        # Each corner near the line goes to its nearest crossing.
        best = np.full(len(height), SNAP)
        for corner, distance in ((a, share), (b, 1 - share)):
            np.minimum.at(best, corner, distance)
        moved = self.interpolate_rows(a, b, share)
        for corner, distance in ((a, share), (b, 1 - share)):
            nearest = distance == best[corner]
            for array, rows in zip(arrays, moved, strict=True):
                array[corner[nearest]] = rows[nearest]
            height[corner[nearest]] = 0.0
        for array in arrays[:2]:  # vertices on the midline stay on it
            array[np.abs(self.vertices[:, 0]) < MIDLINE, 0] = 0.0
        on_line = Cloth(arrays[0], arrays[1], arrays[2], arrays[3], self.triangles)
        a, b = edges[height[edges[:, 0]] * height[edges[:, 1]] < 0].T
        fresh = on_line.interpolate_rows(a, b, height[a] / (height[a] - height[b]))
        number = {pair: len(height) + k for k, pair in enumerate(zip(a.tolist(), b.tolist(), strict=True))}
        triangles: list[list[int]] = []
        for corners in self.triangles.tolist():
            triangles += _cut(corners, height, number)
        joined = [np.concatenate([old, new]) for old, new in zip(arrays, fresh, strict=True)]
        cloth = Cloth(joined[0], joined[1], joined[2], joined[3], np.array(triangles))
        return cloth, np.concatenate([height, np.zeros(len(a))])

    def cut_above(self, height: Float64) -> Cloth:
        """Return the part where height (V,) is positive, cut along the line where it is 0."""
        cloth, level = self.split(height)
        corners = level[cloth.triangles]
        return cloth.select((corners >= 0).all(axis=1) & (corners > 0).any(axis=1))

    def refine(self, longest: float) -> Cloth:
        """Return the cloth with all edges longer than `longest` (m) halved, once.

        Middles lie on the curve between both ends that their normals give, so that outlines get rounder.
        """
        edges = self.edges
        a, b = edges.T
        way = self.vertices[b] - self.vertices[a]
        long = np.linalg.norm(way, axis=1) > longest
        a, b, way = a[long], b[long], way[long]
        halves = list(self.interpolate_rows(a, b, np.full(len(a), 0.5)))
        for end, sign in ((a, -1.0), (b, 1.0)):
            normal = self.normals[end]
            halves[0] += sign * (way * normal).sum(axis=1, keepdims=True) * normal / 8
        halves[1] /= np.linalg.norm(halves[1], axis=1, keepdims=True)
        count = len(self.vertices)
        number = {pair: count + k for k, pair in enumerate(zip(a.tolist(), b.tolist(), strict=True))}
        triangles: list[list[int]] = []
        for corners in self.triangles.tolist():
            sides = ((corners[k], corners[(k + 1) % 3]) for k in range(3))
            middles = [number.get((min(side), max(side))) for side in sides]
            triangles += _halve(corners, middles)
        arrays = (self.vertices, self.normals, self.weights, self.values)
        joined = [np.concatenate([old, new]) for old, new in zip(arrays, halves, strict=True)]
        return Cloth(joined[0], joined[1], joined[2], joined[3], np.array(triangles))

    def smooth_rows(self, array: Float64, free: Float64, rounds: int) -> Float64:
        """Return rows (V, N) moved to their neighbours' mean by shares free (V,), `rounds` times."""
        edges = self.edges
        for _ in range(rounds):
            array = array + (average_with_neighbours(array, edges) - array) * free[:, None]
        return array


def _cut(corners: list[int], height: Float64, number: dict[tuple[int, int], int]) -> list[list[int]]:
    """Return the one to three triangles into which the line cuts a triangle."""
    for turn in range(3):
        a, b, c = corners[turn:] + corners[:turn]
        one, other = (number.get((min(pair), max(pair))) for pair in ((a, b), (c, a)))
        if one is not None and other is not None:
            return [[a, one, other], [one, b, c], [one, c, other]]
    for turn in range(3):
        a, b, c = corners[turn:] + corners[:turn]
        middle = number.get((min(b, c), max(b, c)))
        if middle is not None:
            return [[a, b, middle], [a, middle, c]]
    return [corners]


def _halve(corners: list[int], middles: list[int | None]) -> list[list[int]]:
    """Return the one to four triangles of a triangle with middles of its sides; None: not halved."""
    for turn in range(3):
        a, b, c = corners[turn:] + corners[:turn]
        ab, bc, ca = middles[turn:] + middles[:turn]
        if ab is None:
            continue
        if bc is not None and ca is not None:
            return [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        if ca is not None:
            return [[a, ab, ca], [ab, b, c], [ab, c, ca]]
        if bc is None:
            return [[a, ab, c], [ab, b, c]]
    return [corners]


def triangulate(vertices: Float64, quads: Int64) -> Int64:
    """Return two triangles of each quad, along its shorter diagonal: the same on both sides of a figure."""
    first = np.linalg.norm(vertices[quads[:, 0]] - vertices[quads[:, 2]], axis=1)
    second = np.linalg.norm(vertices[quads[:, 1]] - vertices[quads[:, 3]], axis=1)
    turned = np.where((first > second + 1e-9)[:, None], np.roll(quads, -1, axis=1), quads)
    return np.concatenate([turned[:, [0, 1, 2]], turned[:, [0, 2, 3]]])

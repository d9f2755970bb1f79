"""The skin as one welded surface: neighbours, walking distances, paths, differential operators."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from fba.arrays import Bool, Float64, Intp
from fba.face.model import Part
from fba.mesh.meshes import vertex_normals

WELD = 1e-6
"""Vertices on open edges this close together, as a share of the surface's extent, are one: a seam."""
RIM = 0.4
"""Share of its length that a step along an open edge costs."""
SMALLEST_COTANGENT = 0.02
"""Obtuse triangles would give negative weights, and with them folds."""


class Surface:
    """Several parts (skin, inner mouth) as one surface, vertices at seams joined.

    vertices: (N, 3), metres. triangles: (F, 3). number: (V,), for each vertex counted through the parts,
    the vertex of the surface. members: for each part its name and its slice of number.
    """

    def __init__(self, parts: Sequence[Part], sides: Intp | None = None) -> None:
        """sides: (V,) of the vertices counted through the parts: those of different sides stay unjoined."""
        vertices = np.concatenate([part.vertices for part in parts]).astype(np.float64)
        starts = np.cumsum([0, *(len(part.vertices) for part in parts)])
        triangles = np.concatenate(
            [part.triangles.astype(np.intp) + start for part, start in zip(parts, starts, strict=False)]
        )
        joined = _weld(vertices, triangles, sides)
        first, number = np.unique(joined, return_inverse=True)
        self.vertices: Float64 = vertices[first]
        joined_triangles = number[triangles]
        a, b, c = joined_triangles.T
        self.triangles: Intp = joined_triangles[(a != b) & (b != c) & (c != a)]
        self.members = [
            (part.name, number[start : start + len(part.vertices)])
            for part, start in zip(parts, starts, strict=False)
        ]
        self.number: Intp = number

    def __len__(self) -> int:
        return len(self.vertices)

    @cached_property
    def _edge_counts(self) -> tuple[Intp, Intp]:
        return _edges(self.triangles)

    @property
    def edges(self) -> Intp:
        """(E, 2) each edge once."""
        return self._edge_counts[0]

    @cached_property
    def graph(self) -> Any:
        """(N, N) sparse matrix of edge lengths."""
        from scipy.sparse import csr_array

        a, b = self.edges.T
        length = np.maximum(np.linalg.norm(self.vertices[a] - self.vertices[b], axis=1), 1e-12)
        shape = (len(self), len(self))
        return csr_array((np.tile(length, 2), (np.r_[a, b], np.r_[b, a])), shape=shape)

    @cached_property
    def rim_graph(self) -> Any:
        """(N, N) sparse matrix of edge lengths, open edges shortened so that paths keep to the rim."""
        from scipy.sparse import csr_array

        edges, count = self._edge_counts
        a, b = edges.T
        length = np.maximum(np.linalg.norm(self.vertices[a] - self.vertices[b], axis=1), 1e-12)
        length[count == 1] *= RIM
        return csr_array((np.tile(length, 2), (np.r_[a, b], np.r_[b, a])), shape=(len(self), len(self)))

    @cached_property
    def component(self) -> Intp:
        """(N,) number of the connected piece that each vertex belongs to."""
        from scipy.sparse.csgraph import connected_components

        labels: Intp = connected_components(self.graph, directed=False)[1]
        return labels

    @cached_property
    def normals(self) -> Float64:
        """(N, 3) unit normals."""
        return vertex_normals(self.vertices, self.triangles).astype(np.float64)

    @cached_property
    def open_edge(self) -> Bool:
        """(N,) mask of the vertices on open edges, the rim of the surface."""
        edges, count = self._edge_counts
        rim = np.zeros(len(self), dtype=bool)
        rim[edges[count == 1]] = True
        return rim

    def distances(self, sources: npt.ArrayLike, limit: float = np.inf) -> Float64:
        """(N,) distance along edges from the nearest source, metres; inf beyond the limit."""
        from scipy.sparse.csgraph import dijkstra

        start = np.unique(np.asarray(sources, dtype=np.intp))
        if not len(start):
            return np.full(len(self), np.inf)
        found: Float64 = dijkstra(self.graph, directed=False, indices=start, limit=limit, min_only=True)
        return found

    def path(self, start: int, end: int, *, rim: bool = False) -> Intp:
        """The vertices of the shortest path along edges, both ends included; empty where there is none.

        rim: prefer open edges, as of a mouth that is a slit or eyes that are holes.
        """
        from scipy.sparse.csgraph import dijkstra

        away = float(np.linalg.norm(self.vertices[start] - self.vertices[end]))
        for limit in (3 * away + 1e-9, np.inf):
            length, before = dijkstra(
                self.rim_graph if rim else self.graph,
                directed=False,
                indices=start,
                limit=limit,
                return_predecessors=True,
            )
            if np.isfinite(length[end]):
                break
        else:
            return np.zeros(0, dtype=np.intp)
        walk = [end]
        while walk[-1] != start:
            walk.append(int(before[walk[-1]]))
        return np.array(walk[::-1], dtype=np.intp)

    def pieces_without(self, removed: Intp) -> Intp:
        """(N,) number of the connected piece of each vertex once some are removed; -1 for those."""
        from scipy.sparse.csgraph import connected_components

        rest = np.setdiff1d(np.arange(len(self)), removed)
        labels = np.full(len(self), -1, dtype=np.intp)
        labels[rest] = connected_components(self.graph[rest][:, rest], directed=False)[1]
        return labels

    @cached_property
    def laplacian(self) -> tuple[Any, Float64]:
        """(L, areas): the cotangent Laplacian, positive semi-definite, and each vertex's area."""
        from scipy.sparse import csr_array, diags_array

        corners = self.vertices[self.triangles]
        size = len(self)
        rows, columns, weights = [], [], []
        for k in range(3):
            i, j = (k + 1) % 3, (k + 2) % 3
            u, v = corners[:, i] - corners[:, k], corners[:, j] - corners[:, k]
            sine = np.linalg.norm(np.cross(u, v), axis=1)
            cotangent = (u * v).sum(axis=1) / np.maximum(sine, 1e-30)
            weight = np.clip(cotangent, SMALLEST_COTANGENT, 1 / SMALLEST_COTANGENT) / 2
            rows += [self.triangles[:, i], self.triangles[:, j]]
            columns += [self.triangles[:, j], self.triangles[:, i]]
            weights += [weight, weight]
        where = (np.concatenate(rows), np.concatenate(columns))
        between = csr_array((np.concatenate(weights), where), shape=(size, size))
        doubled = np.linalg.norm(
            np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
        )
        areas = np.bincount(self.triangles.ravel(), np.repeat(doubled / 6, 3), minlength=size)
        typical = float(np.median(areas[areas > 0])) if (areas > 0).any() else 1.0
        return diags_array(between.sum(axis=1)) - between, np.maximum(areas, 1e-3 * typical)


def _edges(triangles: Intp) -> tuple[Intp, Intp]:
    """((E, 2) each edge once, lower vertex first, in rising order; (E,) how many triangles share it)."""
    sides = triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2).astype(np.int64)
    size = int(sides.max(initial=0)) + 1
    # One number an edge: rows of two numbers take np.unique thirty times as long.
    keys, count = np.unique(sides.min(axis=1) * size + sides.max(axis=1), return_counts=True)
    return np.stack(np.divmod(keys, size), axis=1).astype(np.intp), count


def _weld(vertices: Float64, triangles: Intp, sides: Intp | None) -> Intp:
    """(N,) for each vertex the lowest number of those that it is joined with."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    edges, count = _edges(triangles)
    rim = np.unique(edges[count == 1])
    first = np.arange(len(vertices))
    if not len(rim):
        return first
    extent = float(np.ptp(vertices, axis=0).max())
    pairs = cKDTree(vertices[rim]).query_pairs(WELD * extent, output_type="ndarray")
    if sides is not None:
        pairs = pairs[sides[rim[pairs[:, 0]]] == sides[rim[pairs[:, 1]]]]
    shape = (len(rim), len(rim))
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=shape)
    labels = connected_components(graph, directed=False)[1]
    lowest = np.full(labels.max() + 1, len(vertices))
    np.minimum.at(lowest, labels, rim)
    first[rim] = lowest[labels]
    return first

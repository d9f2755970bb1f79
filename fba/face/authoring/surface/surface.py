"""The skin as one welded surface: neighbours, distances and paths along edges, its Laplacian."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from fba.arrays import Bool, Float64, Integer, Intp
from fba.face.model import PART_KINDS, Part
from fba.mesh import connected, vertex_normals

WELD = 1e-6
"""Vertices on open edges this close together, as a share of the surface's extent, are one: a seam."""
RIM = 0.4
"""Share of its length that a step along an open edge costs."""
SMALLEST_COTANGENT = 0.02
"""Obtuse triangles would give negative weights, and with them folds."""


@dataclass(frozen=True, eq=False)
class Surface:
    """Parts of a face (skin, inner mouth) as one surface, vertices at seams joined; made by `weld_parts`.

    vertices: (N, 3), metres. triangles: (F, 3). pool: (V,), the vertices that it was made of, counted through
    all parts of the face. number: (V,), the vertex of the surface that each of these became. members: the
    slice of `number` that belongs to each part, by name.
    """

    vertices: Float64
    triangles: Intp
    pool: Intp
    number: Intp
    members: Mapping[str, Intp]

    def __len__(self) -> int:
        return len(self.vertices)

    def find(self, vertices: Integer) -> Intp:
        """Return (M,) the surface's vertices for vertices counted through all parts; -1 for others."""
        table = np.full(int(max(self.pool.max(initial=-1), vertices.max(initial=-1))) + 2, -1, dtype=np.intp)
        table[self.pool] = self.number
        return table[vertices]

    def of_all(self, field: Float64) -> Float64:
        """Return (N, 3) values of the surface's vertices, of those (V, 3) of all vertices of the face."""
        result = np.zeros((len(self), 3))
        result[self.number] = field[self.pool]
        return result

    def mask(self, vertices: npt.ArrayLike) -> Bool:
        """Return (N,) mask of the given vertices."""
        mask = np.zeros(len(self), dtype=bool)
        mask[np.asarray(vertices, dtype=np.intp)] = True
        return mask

    @cached_property
    def _edge_counts(self) -> tuple[Intp, Intp]:
        return _count_edges(self.triangles)

    @property
    def edges(self) -> Intp:
        """(E, 2) each edge once."""
        return self._edge_counts[0]

    @property
    def open_edges(self) -> Intp:
        """(E, 2) each edge of one triangle only."""
        edges, count = self._edge_counts
        return np.asarray(edges[count == 1])

    @cached_property
    def graph(self) -> Any:
        """(N, N) sparse matrix of edge lengths."""
        return self._edge_matrix(open_edges=1.0)

    def neighbours(self, vertices: Intp) -> Intp:
        """Return the vertices at the other ends of the edges of some vertices (M,), in rising order."""
        positions, _ = positions_in_rows(self.graph.indptr, vertices)
        return np.unique(self.graph.indices[positions])

    @cached_property
    def rim_graph(self) -> Any:
        """(N, N) sparse matrix of edge lengths, open edges shortened so that paths keep to the rim."""
        return self._edge_matrix(open_edges=RIM)

    def _edge_matrix(self, open_edges: float) -> Any:
        from scipy.sparse import csr_array

        edges, count = self._edge_counts
        a, b = edges.T
        length = np.maximum(np.linalg.norm(self.vertices[a] - self.vertices[b], axis=1), 1e-12)
        length[count == 1] *= open_edges
        return csr_array((np.tile(length, 2), (np.r_[a, b], np.r_[b, a])), shape=(len(self), len(self)))

    @cached_property
    def component(self) -> Intp:
        """(N,) number of the connected piece that each vertex belongs to."""
        from scipy.sparse.csgraph import connected_components

        return np.asarray(connected_components(self.graph, directed=False)[1])

    @cached_property
    def normals(self) -> Float64:
        """(N, 3) unit normals."""
        return vertex_normals(self.vertices, self.triangles).astype(np.float64)

    @cached_property
    def open_edge(self) -> Bool:
        """(N,) mask of the vertices on open edges, the rim of the surface."""
        edges, count = self._edge_counts
        return self.mask(edges[count == 1])

    def distances(self, sources: npt.ArrayLike, limit: float = np.inf) -> Float64:
        """Return (N,) distance along edges from the nearest source, metres; inf beyond the limit."""
        from scipy.sparse.csgraph import dijkstra

        start = np.unique(np.asarray(sources, dtype=np.intp))
        if not len(start):
            return np.full(len(self), np.inf)
        return np.asarray(dijkstra(self.graph, directed=False, indices=start, limit=limit, min_only=True))

    def path(self, start: int, end: int, *, rim: bool = False, costs: Float64 | None = None) -> Intp:
        """Return the vertices of the shortest path along edges, with both ends; empty without a path.

        rim: prefer open edges, as of a mouth that is a slit or eyes that are holes. costs: (N,), factors of
        the lengths of edges at each vertex, 1 or more; the larger one of both ends counts.
        """
        from scipy.sparse import csr_array
        from scipy.sparse.csgraph import dijkstra

        away = float(np.linalg.norm(self.vertices[start] - self.vertices[end]))
        graph = self.rim_graph if rim else self.graph
        if costs is not None and (costs > 1).any():
            graph = graph.tocoo()
            a, b = graph.coords
            graph = csr_array((graph.data * np.maximum(costs[a], costs[b]), (a, b)), shape=graph.shape)
        for limit in (3 * away + 1e-9, np.inf):
            length, before = dijkstra(
                graph, directed=False, indices=start, limit=limit, return_predecessors=True
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
        """Return (N,) number of the connected piece of each vertex once some are removed; -1 for those."""
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


def vertices_of_kinds(parts: Sequence[Part], kinds: Sequence[str]) -> Intp:
    """Return (V,) vertices of the parts of some kinds, counted through all parts."""
    mine = np.repeat([part.kind in kinds for part in parts], [len(part.vertices) for part in parts])
    return np.flatnonzero(mine)


def weld_parts(
    parts: Sequence[Part], kinds: Sequence[str] = PART_KINDS, *, sides: Intp | None = None
) -> Surface:
    """Return parts as one surface, coinciding open edges joined but for vertices of other `sides` (V,)."""
    pool = vertices_of_kinds(parts, kinds)
    welded = [part for part in parts if part.kind in kinds]
    vertices = np.concatenate([part.vertices for part in welded]).astype(np.float64)
    starts = np.cumsum([0, *(len(part.vertices) for part in welded)])
    triangles = np.concatenate(
        [part.triangles.astype(np.intp) + start for part, start in zip(welded, starts, strict=False)]
    )
    first, number = np.unique(_join_seams(vertices, triangles, sides), return_inverse=True)
    joined = number[triangles]
    a, b, c = joined.T
    members = zip(welded, np.split(number, starts[1:-1]), strict=True)
    return Surface(
        vertices[first],
        joined[(a != b) & (b != c) & (c != a)],
        pool,
        number,
        {part.name: own for part, own in members},
    )


def positions_in(vertices: Intp, count: int) -> Intp:
    """Return (count,) position of each vertex in a list of vertices; -1 for those not in it."""
    result = np.full(count, -1)
    result[vertices] = np.arange(len(vertices))
    return result


def positions_in_rows(starts: Integer, rows: Intp) -> tuple[Intp, Intp]:
    """Return ((K,) positions of the entries of some rows (M,), row by row; (M,) how many each row has).

    starts: (N + 1,) where each row begins in the list of all entries, as in a sparse matrix.
    """
    begin = starts[rows]
    count = starts[rows + 1] - begin
    ends = np.cumsum(count)
    total = int(ends[-1]) if len(ends) else 0
    return np.repeat(begin - ends + count, count) + np.arange(total), count


def _count_edges(triangles: Intp) -> tuple[Intp, Intp]:
    """Return (E, 2) each edge once, lower vertex first, rising, and (E,) how many triangles share it."""
    sides = triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2).astype(np.int64)
    size = int(sides.max(initial=0)) + 1
    # One number an edge: rows of two numbers take np.unique thirty times as long.
    keys, count = np.unique(sides.min(axis=1) * size + sides.max(axis=1), return_counts=True)
    return np.stack(np.divmod(keys, size), axis=1).astype(np.intp), count


def _join_seams(vertices: Float64, triangles: Intp, sides: Intp | None) -> Intp:
    """Return (N,) for each vertex the lowest number of those that it is joined with."""
    from scipy.spatial import cKDTree

    edges, count = _count_edges(triangles)
    rim = np.unique(edges[count == 1])
    first = np.arange(len(vertices))
    if not len(rim):
        return first
    extent = float(np.ptp(vertices, axis=0).max())
    pairs = cKDTree(vertices[rim]).query_pairs(WELD * extent, output_type="ndarray")
    if sides is not None:
        pairs = pairs[sides[rim[pairs[:, 0]]] == sides[rim[pairs[:, 1]]]]
    labels = connected(pairs, len(rim))
    lowest = np.full(labels.max() + 1, len(vertices))
    np.minimum.at(lowest, labels, rim)
    first[rim] = lowest[labels]
    return first

"""Lines on the skin of a face through its feature points, which move with the skin."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from fba.arrays import Float32, Float64, Intp
from fba.face import FaceModel
from fba.parameters import point_rows
from fba.text_files import packaged_rows

STEPS_BETWEEN_POINTS = 8
"""Number of steps between two feature points."""
RINGS = 3
"""Rings of triangles around the shortest path along edges in which a line lies: lips stay apart."""


@dataclass(frozen=True, eq=False)
class SkinLine:
    """A line of points on triangles.

    kind: what it outlines. corners: (N, 3), vertices of the model. shares: (N, 3), their weights.
    """

    kind: str
    corners: Intp
    shares: Float64

    def positions(self, vertices: Float32) -> Float64:
        """Return float64 (N, 3): the line's points on moved vertices (V, 3)."""
        return np.asarray(np.einsum("nk,nkc->nc", self.shares, vertices[self.corners].astype(np.float64)))


def skin_lines(model: FaceModel) -> list[SkinLine]:
    """Return the lines of `skin_lines.csv` whose feature points lie on the skin."""
    rows = [(row["kind"], row["points"].split()) for row in packaged_rows(__package__, "skin_lines.csv")]
    skin = _build_skin_graph(model)
    lines = []
    for kind, names in rows:
        bound = [int(model.bound[point_rows()[name]]) for name in names]
        on_skin = [vertex for vertex in bound if vertex in skin.used]
        if len(on_skin) >= 2:
            line = skin.line(on_skin)
            if line is not None:
                lines.append(SkinLine(kind, *line))
    return lines


@dataclass(frozen=True, eq=False)
class _SkinGraph:
    """The skin as a graph of its edges, in which vertices at the same position are one.

    vertices: (V, 3) of the model. triangles: (F, 3), those of the skin. node: (V,), the node of each vertex.
    edges: a sparse matrix of lengths between nodes. used: the vertices of the triangles.
    """

    vertices: Float64
    triangles: Intp
    node: Intp
    edges: Any
    used: frozenset[int]

    def line(self, through: list[int]) -> tuple[Intp, Float64] | None:
        """Return corners (N, 3) and weights (N, 3) of a smooth line through vertices; None if unconnected."""
        from scipy.interpolate import CubicSpline

        knots = self.vertices[through]
        gaps = np.sqrt(np.linalg.norm(np.diff(knots, axis=0), axis=1))
        if (gaps == 0).any():
            return None
        at = np.concatenate([[0.0], np.cumsum(gaps)])
        curve = CubicSpline(at, knots, bc_type="natural") if len(at) > 2 else None
        corners, shares = [np.full(3, through[0])], [np.array([1.0, 0.0, 0.0])]
        for number in range(len(through) - 1):
            near = self._triangles_along(through[number], through[number + 1])
            if near is None:
                return None
            part = np.linspace(0, 1, STEPS_BETWEEN_POINTS + 1)[1:-1]
            if curve is None:
                points = knots[number] + part[:, None] * (knots[number + 1] - knots[number])
            else:
                points = curve(at[number] + part * gaps[number])
            for point in points:
                triangle, share = _nearest(point, self.vertices[near])
                corners.append(near[triangle])
                shares.append(share)
            corners.append(np.full(3, through[number + 1]))
            shares.append(np.array([1.0, 0.0, 0.0]))
        return np.array(corners, dtype=np.intp), np.array(shares)

    def _triangles_along(self, start: int, end: int) -> Intp | None:
        """Return the triangles (F, 3) along the shortest path between two vertices; None without a path."""
        from scipy.sparse.csgraph import dijkstra

        first, last = int(self.node[start]), int(self.node[end])
        straight = float(np.linalg.norm(self.vertices[start] - self.vertices[end]))
        _, before = dijkstra(self.edges, indices=first, return_predecessors=True, limit=4 * straight + 1e-6)
        path = [last]
        while path[-1] != first:
            if before[path[-1]] < 0:
                return None
            path.append(int(before[path[-1]]))
        reached = np.zeros(self.edges.shape[0], dtype=bool)
        reached[path] = True
        nodes = self.node[self.triangles]
        for _ in range(RINGS):
            touching = reached[nodes].any(axis=1)
            reached[nodes[touching]] = True
        return self.triangles[touching]


def _build_skin_graph(model: FaceModel) -> _SkinGraph:
    from scipy.sparse import csr_matrix

    vertices = model.vertices.astype(np.float64)
    parts = model.of_kind("skin") or model.parts
    triangles = np.concatenate([part.triangles.astype(np.intp) + model.starts[part.name] for part in parts])
    _, node = np.unique(np.round(vertices, 7), axis=0, return_inverse=True)
    node = node.ravel()
    edges = node[triangles][:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    edges = np.unique(np.sort(edges[edges[:, 0] != edges[:, 1]], axis=1), axis=0)
    count = int(node.max()) + 1
    vertex_of = np.zeros(count, dtype=np.intp)
    vertex_of[node] = np.arange(len(node))
    length = np.linalg.norm(vertices[vertex_of[edges[:, 0]]] - vertices[vertex_of[edges[:, 1]]], axis=1)
    graph = csr_matrix((np.maximum(length, 1e-9), (edges[:, 0], edges[:, 1])), (count, count))
    used = frozenset(np.unique(triangles).tolist())
    return _SkinGraph(vertices, triangles, node, graph + graph.T, used)


def _nearest(point: Float64, triangles: Float64) -> tuple[int, Float64]:
    """Return the index of the triangle (F, 3, 3) nearest to a point, and the weights (3,) of its corners."""
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    ab, ac, ap = b - a, c - a, point - a
    d1, d2 = (ab * ap).sum(1), (ac * ap).sum(1)
    aa, bb, mixed = (ab * ab).sum(1), (ac * ac).sum(1), (ab * ac).sum(1)
    area = np.maximum(aa * bb - mixed * mixed, 1e-30)
    inner_v, inner_w = (bb * d1 - mixed * d2) / area, (aa * d2 - mixed * d1) / area
    on_ab = np.clip(d1 / np.maximum(aa, 1e-30), 0, 1)
    on_ac = np.clip(d2 / np.maximum(bb, 1e-30), 0, 1)
    bc = c - b
    on_bc = np.clip((bc * (point - b)).sum(1) / np.maximum((bc * bc).sum(1), 1e-30), 0, 1)
    none = np.zeros(len(a))
    v, w = np.stack([inner_v, on_ab, none, 1 - on_bc]), np.stack([inner_w, none, on_ac, on_bc])
    away = np.linalg.norm(a + ab * v[..., None] + ac * w[..., None] - point, axis=2)
    away[0, (inner_v < 0) | (inner_w < 0) | (inner_v + inner_w > 1)] = np.inf
    place, nearest = np.unravel_index(int(away.argmin()), away.shape)
    share = v[place, nearest], w[place, nearest]
    return int(nearest), np.array([1 - share[0] - share[1], *share])

"""Lines on the skin of a face through its feature points, which move with the skin."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from importlib.resources import files

import numpy as np

from fba.arrays import Float32, Float64, Intp
from fba.face.model import FaceModel, point_row

Indices = Intp

FINER = 8
"""Number of steps between two feature points."""
RINGS = 3
"""Distance (m) of a line's triangles from the shortest path along edges, so that lips stay apart."""


@dataclass(frozen=True, eq=False)
class SkinLine:
    """A line of points on triangles. kind: what it outlines. corners: (N, 3), vertices of the model. shares:
    (N, 3), their weights."""

    kind: str
    corners: Indices
    shares: Float64

    def places(self, vertices: Float32) -> Float64:
        """float64 (N, 3): the line's points on moved vertices (V, 3)."""
        placed: Float64 = np.einsum("nk,nkc->nc", self.shares, vertices[self.corners].astype(np.float64))
        return placed


def skin_lines(model: FaceModel) -> list[SkinLine]:
    """The lines of `skin_lines.csv` whose feature points lie on the skin."""
    with (files(__package__) / "skin_lines.csv").open(encoding="utf-8") as file:
        rows = [(row["kind"], row["points"].split()) for row in csv.DictReader(file)]
    surface = _Surface(model)
    lines = []
    for kind, names in rows:
        bound = [int(model.bound[point_row(name)]) for name in names]
        kept = [vertex for vertex in bound if vertex in surface]
        if len(kept) >= 2:
            found = surface.line(kept)
            if found is not None:
                lines.append(SkinLine(kind, *found))
    return lines


class _Surface:
    """The skin as a graph of its edges, in which vertices at the same position are one."""

    def __init__(self, model: FaceModel) -> None:
        from scipy.sparse import csr_matrix

        self._vertices = model.vertices.astype(np.float64)
        parts = model.of_kind("skin") or model.parts
        rows = [part.triangles.astype(np.intp) + model.starts[part.name] for part in parts]
        self._triangles = np.concatenate(rows)
        _, self._welded = np.unique(np.round(self._vertices, 7), axis=0, return_inverse=True)
        self._welded = self._welded.ravel()
        edges = self._welded[self._triangles][:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
        edges = np.unique(np.sort(edges[edges[:, 0] != edges[:, 1]], axis=1), axis=0)
        count = int(self._welded.max()) + 1
        first = np.zeros(count, dtype=np.intp)
        first[self._welded] = np.arange(len(self._welded))
        length = np.linalg.norm(
            self._vertices[first[edges[:, 0]]] - self._vertices[first[edges[:, 1]]], axis=1
        )
        self._graph = csr_matrix((np.maximum(length, 1e-9), (edges[:, 0], edges[:, 1])), (count, count))
        self._graph = self._graph + self._graph.T
        self._on = set(np.unique(self._triangles).tolist())

    def __contains__(self, vertex: int) -> bool:
        return vertex in self._on

    def line(self, through: list[int]) -> tuple[Indices, Float64] | None:
        """Corners (N, 3) and weights (N, 3) of a smooth line through vertices; None if unconnected."""
        from scipy.interpolate import CubicSpline

        knots = self._vertices[through]
        gaps = np.sqrt(np.linalg.norm(np.diff(knots, axis=0), axis=1))
        if (gaps == 0).any():
            return None
        at = np.concatenate([[0.0], np.cumsum(gaps)])
        curve = CubicSpline(at, knots, bc_type="natural") if len(at) > 2 else None
        corners, shares = [np.full(3, through[0])], [np.array([1.0, 0.0, 0.0])]
        for number in range(len(through) - 1):
            near = self._near(through[number], through[number + 1])
            if near is None:
                return None
            part = np.linspace(0, 1, FINER + 1)[1:-1]
            times = at[number] + part * gaps[number]
            wanted = knots[number] + part[:, None] * (knots[number + 1] - knots[number])
            if curve is not None:
                wanted = curve(times)
            for place in wanted:
                triangle, share = _nearest(place, self._vertices[near])
                corners.append(near[triangle])
                shares.append(share)
            corners.append(np.full(3, through[number + 1]))
            shares.append(np.array([1.0, 0.0, 0.0]))
        return np.array(corners, dtype=np.intp), np.array(shares)

    def _near(self, start: int, end: int) -> Indices | None:
        """Triangles (F, 3) along the shortest path between two vertices; None if there is none."""
        from scipy.sparse.csgraph import dijkstra

        one, other = int(self._welded[start]), int(self._welded[end])
        straight = float(np.linalg.norm(self._vertices[start] - self._vertices[end]))
        _, before = dijkstra(self._graph, indices=one, return_predecessors=True, limit=4 * straight + 1e-6)
        way = [other]
        while way[-1] != one:
            if before[way[-1]] < 0:
                return None
            way.append(int(before[way[-1]]))
        chosen = np.zeros(self._graph.shape[0], dtype=bool)
        chosen[way] = True
        welded = self._welded[self._triangles]
        for _ in range(RINGS):
            touching = chosen[welded].any(axis=1)
            chosen[welded[touching]] = True
        return self._triangles[touching]


def _nearest(place: Float64, triangles: Float64) -> tuple[int, Float64]:
    """Index of the triangle (F, 3, 3) nearest to a point, and the weights (3,) of its corners there."""
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    ab, ac, ap = b - a, c - a, place - a
    d1, d2 = (ab * ap).sum(1), (ac * ap).sum(1)
    aa, bb, mixed = (ab * ab).sum(1), (ac * ac).sum(1), (ab * ac).sum(1)
    area = np.maximum(aa * bb - mixed * mixed, 1e-30)
    v, w = (bb * d1 - mixed * d2) / area, (aa * d2 - mixed * d1) / area
    inside = (v >= 0) & (w >= 0) & (v + w <= 1)
    options = [np.stack([v, w], axis=1)]
    along = np.clip(d1 / np.maximum(aa, 1e-30), 0, 1)
    options.append(np.stack([along, np.zeros_like(along)], axis=1))
    along = np.clip(d2 / np.maximum(bb, 1e-30), 0, 1)
    options.append(np.stack([np.zeros_like(along), along], axis=1))
    bc = c - b
    along = np.clip((bc * (place - b)).sum(1) / np.maximum((bc * bc).sum(1), 1e-30), 0, 1)
    options.append(np.stack([1 - along, along], axis=1))
    best, chosen, share = np.inf, 0, np.zeros(2)
    for number, option in enumerate(options):
        found = a + ab * option[:, :1] + ac * option[:, 1:]
        away = np.linalg.norm(found - place, axis=1)
        if number == 0:
            away = np.where(inside, away, np.inf)
        row = int(away.argmin())
        if away[row] < best:
            best, chosen, share = float(away[row]), row, option[row]
    return chosen, np.array([1 - share[0] - share[1], share[0], share[1]])

"""Catmull-Clark subdivision of chosen faces of a surface; the others stay as they are.

The control cage is first adjusted so that the smooth surface passes through the original vertices; otherwise
the form would shrink. Faces beside subdivided ones are cut into triangles to the midpoints of shared edges.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.arrays import Bool, Float64, Int64
from tools.figure.figure import Surface
from tools.figure.meshes import sides


@dataclass(frozen=True, eq=False)
class Refined:
    """A refined surface and its relation to the coarse one.

    vertices: (V, 3). triangles: (F, 3). corners: (F, 3), rows of uvs. uvs: (U, 2). quads: (F,), the quad
    of the coarse surface that each triangle lies in. blend: sparse (V, coarse vertices), weights that
    interpolate values of the coarse vertices to the fine ones.
    """

    vertices: Float64
    triangles: Int64
    corners: Int64
    uvs: Float64
    quads: Int64
    blend: object


def refine(surface: Surface, chosen: Bool, fit: int = 4) -> Refined:
    """Return the surface with the chosen quads subdivided once.

    chosen: bool (F,). fit: rounds in which the cage is adjusted so that the result passes through the
    vertices of the surface.
    """
    from scipy.sparse import csr_matrix, eye, vstack

    count = len(surface.vertices)
    scheme = _make_scheme(surface)
    cage = surface.vertices.copy()
    for _ in range(fit):
        cage += 0.9 * (surface.vertices - scheme.vertex_points(cage))
    uses_edge = np.zeros(len(scheme.edges), dtype=bool)
    uses_edge[scheme.face_edges[chosen]] = True
    edge_row = np.full(len(scheme.edges), -1)
    edge_row[uses_edge] = count + np.arange(uses_edge.sum())
    face_row = np.full(len(surface.quads), -1)
    face_row[chosen] = count + uses_edge.sum() + np.arange(chosen.sum())
    vertices = np.concatenate([
        scheme.vertex_points(cage), scheme.edge_points(cage)[uses_edge], scheme.face_points(cage)[chosen],
    ])  # fmt: skip
    averages = [eye(count, format="csr")]
    for corners in (scheme.edges[uses_edge], surface.quads[chosen]):
        number, size = corners.shape
        rows = np.repeat(np.arange(number), size)
        averages.append(csr_matrix((np.full(len(rows), 1 / size), (rows, corners.ravel())), (number, count)))
    blend = vstack(averages, format="csr")
    triangles, corners, uvs, source_quads = _cut(surface, scheme, chosen, edge_row, face_row, vertices)
    return Refined(vertices, triangles, corners, uvs, source_quads, blend)


@dataclass(frozen=True, eq=False)
class _Scheme:
    """Catmull-Clark averages, with creases along open borders; made by `_make_scheme`.

    quads: (F, 4). edges: (E, 2). face_edges: (F, 4), edges of each quad. uses: (E,) quads at each edge.
    """

    quads: Int64
    edges: Int64
    face_edges: Int64
    uses: Int64

    def face_points(self, cage: Float64) -> Float64:
        return cage[self.quads].mean(axis=1)

    def edge_points(self, cage: Float64) -> Float64:
        total, _ = _sum_at(self.face_edges, self.face_points(cage), len(self.edges))
        middle = cage[self.edges].mean(axis=1)
        inner = (total / np.maximum(self.uses, 1)[:, None] + middle) / 2
        return np.where((self.uses == 1)[:, None], middle, inner)

    def vertex_points(self, cage: Float64) -> Float64:
        count = len(cage)
        faces, valence = _sum_at(self.quads, self.face_points(cage), count)
        middles = cage[self.edges].mean(axis=1)
        edge_sums, edges = _sum_at(self.edges, middles, count)
        n = np.maximum(valence, 1)
        inner = (faces / n + 2 * edge_sums / np.maximum(edges, 1) + (n - 3) * cage) / n
        is_open = self.uses == 1
        rim, rims = _sum_at(self.edges[is_open], middles[is_open], count)
        return np.where(rims > 0, rim / np.maximum(rims, 1) / 2 + cage / 2, inner)


def _sum_at(rows: Int64, values: Float64, count: int) -> tuple[Float64, Float64]:
    """Return sums (count, 3) of values (N, 3), added to their rows (N, K), and the numbers of summands."""
    total, number = np.zeros((count, 3)), np.zeros((count, 1))
    for k in range(rows.shape[1]):
        np.add.at(total, rows[:, k], values)
        np.add.at(number, rows[:, k], 1)
    return total, number


def _make_scheme(surface: Surface) -> _Scheme:
    key = {tuple(edge): row for row, edge in enumerate(surface.edges.tolist())}
    pairs = np.sort(sides(surface.quads), axis=1).tolist()
    face_edges = np.array([key[a, b] for a, b in pairs]).reshape(-1, 4)
    uses = np.bincount(face_edges.ravel(), minlength=len(surface.edges))
    return _Scheme(surface.quads, surface.edges, face_edges, uses)


def _cut(
    surface: Surface,
    scheme: _Scheme,
    chosen: Bool,
    edge_row: Int64,
    face_row: Int64,
    vertices: Float64,
) -> tuple[Int64, Int64, Float64, Int64]:
    """Return triangles of all faces, their texture corners, uvs, and the quad that each came from."""
    triangles: list[list[int]] = []
    corners: list[list[int]] = []
    source_quads: list[int] = []
    uvs = surface.uvs.tolist()
    midpoint_rows: dict[tuple[int, int], int] = {}

    def uv_midpoint(*rows: int) -> int:
        key = tuple(sorted(rows))
        if key not in midpoint_rows:
            midpoint_rows[key] = len(uvs)  # type: ignore[index]
            uvs.append(np.mean([uvs[row] for row in rows], axis=0).tolist())
        return midpoint_rows[key]  # type: ignore[index]

    for face, (quad, uv, edges) in enumerate(
        zip(surface.quads.tolist(), surface.corners.tolist(), scheme.face_edges.tolist(), strict=True)
    ):
        middles = [int(edge_row[edge]) for edge in edges]
        uv_middles = [uv_midpoint(uv[k], uv[(k + 1) % 4]) if middles[k] >= 0 else -1 for k in range(4)]
        # polygons of pairs (vertex, uv)
        own, middle = list(zip(quad, uv, strict=True)), list(zip(middles, uv_middles, strict=True))
        if chosen[face]:
            centre = (int(face_row[face]), uv_midpoint(*uv))
            polygons = [[own[k], middle[k], centre, middle[k - 1]] for k in range(4)]
        else:
            pairs = (pair for k in range(4) for pair in (own[k], middle[k]))
            polygons = [[pair for pair in pairs if pair[0] >= 0]]
        for polygon in polygons:
            ring = [vertex for vertex, _ in polygon]
            is_midpoint = [not chosen[face] and vertex in middles for vertex in ring]
            for triangle in _triangulate(ring, vertices, is_midpoint):
                triangles.append([polygon[k][0] for k in triangle])
                corners.append([polygon[k][1] for k in triangle])
                source_quads.append(face)
    return np.array(triangles), np.array(corners), np.array(uvs), np.array(source_quads)


def _triangulate(ring: list[int], vertices: Float64, is_midpoint: list[bool]) -> list[tuple[int, int, int]]:
    """Return triangles of a polygon, cut along its shortest diagonals; ties are broken symmetrically.

    is_midpoint: mask of corners in the middle of a side; cutting these off would leave slivers.
    """
    remaining = list(range(len(ring)))
    triangles = []

    def diagonal(k: int) -> float:
        ends = vertices[ring[remaining[k - 1]]], vertices[ring[remaining[(k + 1) % len(remaining)]]]
        return round(float(np.linalg.norm(ends[0] - ends[1])), 9)

    while len(remaining) > 3:
        candidates = [k for k in range(len(remaining)) if not is_midpoint[remaining[k]]] or range(
            len(remaining)
        )
        best = min(candidates, key=diagonal)
        triangles.append((remaining[best - 1], remaining[best], remaining[(best + 1) % len(remaining)]))
        remaining.pop(best)
    return [*triangles, (remaining[0], remaining[1], remaining[2])]

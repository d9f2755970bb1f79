"""Catmull-Clark subdivision of some faces of a surface, the others left as they are.

The cage is first adjusted so that the smooth surface passes through its vertices: a sculpted form keeps
its size. Faces beside finer ones are cut into triangles to the midpoints of the shared edges.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from figure import Surface

Float64 = npt.NDArray[np.float64]
Int64 = npt.NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Refined:
    """A refined surface and its relation to the coarse one.

    vertices: (V, 3). triangles: (F, 3). corners: (F, 3), rows of uvs. uvs: (U, 2). quads: (F,), the quad
    of the coarse surface that each triangle lies in. blend: sparse (V, coarse vertices), averages that
    interpolate any value of the coarse vertices to the fine ones.
    """

    vertices: Float64
    triangles: Int64
    corners: Int64
    uvs: Float64
    quads: Int64
    blend: object


def refine(surface: Surface, chosen: npt.NDArray[np.bool_], fit: int = 4) -> Refined:
    """The surface with the chosen quads (mask (F,)) subdivided once.

    fit: rounds of adjusting the cage so that the result passes through the surface's vertices.
    """
    from scipy.sparse import csr_matrix, eye

    count = len(surface.vertices)
    scheme = _Scheme(surface)
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
    pairs = scheme.edges[uses_edge]
    rows = np.repeat(np.arange(len(pairs)), 2)
    halves = csr_matrix((np.full(len(rows), 0.5), (rows, pairs.ravel())), (len(pairs), count))
    faces = surface.quads[chosen]
    rows = np.repeat(np.arange(len(faces)), 4)
    quarters = csr_matrix((np.full(len(rows), 0.25), (rows, faces.ravel())), (len(faces), count))
    from scipy.sparse import vstack

    blend = vstack([eye(count, format="csr"), halves, quarters], format="csr")
    triangles, corners, uvs, owner = _cut(surface, scheme, chosen, edge_row, face_row, vertices)
    return Refined(vertices, triangles, corners, uvs, owner, blend)


class _Scheme:
    """The masks of Catmull and Clark, with creases along open borders."""

    def __init__(self, surface: Surface) -> None:
        self.quads = surface.quads
        self.edges = surface.edges
        count = len(surface.vertices)
        key = {tuple(edge): row for row, edge in enumerate(self.edges.tolist())}
        sides = np.stack([self.quads, np.roll(self.quads, -1, axis=1)], axis=-1)
        self.face_edges = np.array([[key[min(a, b), max(a, b)] for a, b in face] for face in sides.tolist()])
        self.uses = np.bincount(self.face_edges.ravel(), minlength=len(self.edges))
        self.open = self.uses == 1
        self.border = np.zeros(count, dtype=bool)
        self.border[self.edges[self.open]] = True
        self.valence = np.bincount(self.quads.ravel(), minlength=count)

    def face_points(self, cage: Float64) -> Float64:
        return cage[self.quads].mean(axis=1)

    def edge_points(self, cage: Float64) -> Float64:
        total = np.zeros((len(self.edges), 3))
        faces = self.face_points(cage)
        for side in range(4):
            np.add.at(total, self.face_edges[:, side], faces)
        middle = cage[self.edges].mean(axis=1)
        inner = (total / np.maximum(self.uses, 1)[:, None] + middle) / 2
        return np.where(self.open[:, None], middle, inner)

    def vertex_points(self, cage: Float64) -> Float64:
        count = len(cage)
        n = np.maximum(self.valence, 1)[:, None]
        faces = np.zeros((count, 3))
        for side in range(4):
            np.add.at(faces, self.quads[:, side], self.face_points(cage))
        middles = np.zeros((count, 3))
        number = np.zeros((count, 1))
        middle = cage[self.edges].mean(axis=1)
        for end in range(2):
            np.add.at(middles, self.edges[:, end], middle)
            np.add.at(number, self.edges[:, end], 1)
        inner = (faces / n + 2 * middles / np.maximum(number, 1) + (n - 3) * cage) / n
        rim = np.zeros((count, 3))
        rims = np.zeros((count, 1))
        for end in range(2):
            np.add.at(rim, self.edges[self.open, end], middle[self.open])
            np.add.at(rims, self.edges[self.open, end], 1)
        edge = rim / np.maximum(rims, 1) / 2 + cage / 2
        return np.where(self.border[:, None], edge, inner)


def _cut(
    surface: Surface,
    scheme: _Scheme,
    chosen: npt.NDArray[np.bool_],
    edge_row: Int64,
    face_row: Int64,
    vertices: Float64,
) -> tuple[Int64, Int64, Float64, Int64]:
    """(triangles of all faces, their texture corners, uvs, the quad that each came from)."""
    triangles: list[list[int]] = []
    corners: list[list[int]] = []
    owner: list[int] = []
    uvs = surface.uvs.tolist()
    between: dict[tuple[int, int], int] = {}

    def uv_between(*rows: int) -> int:
        key = tuple(sorted(rows))
        if key not in between:
            between[key] = len(uvs)  # type: ignore[index]
            uvs.append(np.mean([uvs[row] for row in rows], axis=0).tolist())
        return between[key]  # type: ignore[index]

    for face, (quad, uv, sides) in enumerate(
        zip(surface.quads.tolist(), surface.corners.tolist(), scheme.face_edges.tolist(), strict=True)
    ):
        middles = [int(edge_row[side]) for side in sides]
        mid_uvs = [uv_between(uv[k], uv[(k + 1) % 4]) if middles[k] >= 0 else -1 for k in range(4)]
        polygons: list[tuple[list[int], list[int]]]
        if chosen[face]:
            centre, centre_uv = int(face_row[face]), uv_between(*uv)
            polygons = [
                (
                    [quad[k], middles[k], centre, middles[k - 1]],
                    [uv[k], mid_uvs[k], centre_uv, mid_uvs[k - 1]],
                )
                for k in range(4)
            ]
        else:
            ring, ring_uv = [], []
            for k in range(4):
                ring.append(quad[k])
                ring_uv.append(uv[k])
                if middles[k] >= 0:
                    ring.append(middles[k])
                    ring_uv.append(mid_uvs[k])
            polygons = [(ring, ring_uv)]
        for ring, ring_uv in polygons:
            straight = [not chosen[face] and vertex in middles for vertex in ring]
            for a, b, c in _triangulate(ring, vertices, straight):
                triangles.append([ring[a], ring[b], ring[c]])
                corners.append([ring_uv[a], ring_uv[b], ring_uv[c]])
                owner.append(face)
    return np.array(triangles), np.array(corners), np.array(uvs), np.array(owner)


def _triangulate(ring: list[int], vertices: Float64, straight: list[bool]) -> list[tuple[int, int, int]]:
    """Triangles of a polygon, cut along its shortest diagonals; ties are broken symmetrically.

    straight: corners in the middle of a side; cutting these off would leave slivers.
    """
    left = list(range(len(ring)))
    found = []
    while len(left) > 3:
        best = min(
            [k for k in range(len(left)) if not straight[left[k]]] or range(len(left)),
            key=lambda k: round(
                float(
                    np.linalg.norm(vertices[ring[left[k - 1]]] - vertices[ring[left[(k + 1) % len(left)]]])
                ),
                9,
            ),
        )
        found.append((left[best - 1], left[best], left[(best + 1) % len(left)]))
        left.pop(best)
    found.append((left[0], left[1], left[2]))
    return found

"""Edges and normals of a view's meshes, as lines."""

from __future__ import annotations

from functools import cache
from weakref import WeakKeyDictionary

import numpy as np

from fba.arrays import Float32, Float64, Int32, Intp
from fba_player._mesh.primitives import sphere_mesh
from fba_player.view._geometry import transform, world_normals, world_positions
from fba_player.view._view import Colour, Eye, FaceMesh, FaceShape, Lines, Mesh, MeshShape

WIRE: Colour = (0.03, 0.05, 0.08, 0.8)
WIRE_LIFT = 0.0012
"""Depth (m) of skin through which lines show, on an adult's face."""
NORMAL_LENGTH = 0.007
"""Metres, on an adult's face."""
NORMAL_CELL = 0.0045
"""One normal is drawn in each cube of this size (m)."""
NORMAL_OPACITY = (0.95, 0.55)
"""At its foot and at its tip."""
RINGS = (14, 20)
"""Of an eyeball, which has no mesh of its own."""


class Wireframe:
    """Lines along edges and normals; the edges of each shape are cached."""

    def __init__(self) -> None:
        self._edges: WeakKeyDictionary[FaceShape | MeshShape, Int32] = WeakKeyDictionary()
        self._thinned: WeakKeyDictionary[FaceShape, Intp] = WeakKeyDictionary()

    def edges(self, faces: list[FaceMesh], meshes: list[Mesh], eyes: list[Eye], scale: float) -> Lines:
        """Return all edges, each once. scale: size of the face, 1 for an adult's."""
        ends: list[Float32 | Float64] = [np.zeros((0, 2, 3), dtype=np.float32)]
        ends += [world_positions(mesh)[self._unique_edges(mesh.shape)] for mesh in faces]
        ends += [transform(mesh.positions, mesh.matrix)[self._unique_edges(mesh.shape)] for mesh in meshes]
        ends += [transform(_eyeball_edges(), eye.matrix) for eye in eyes]
        return Lines(np.concatenate(ends).astype(np.float32), WIRE, 1.0, WIRE_LIFT * scale)

    def normals(self, faces: list[FaceMesh], scale: float) -> Lines:
        """Return a line at each vertex, or at some of many; red, green and blue stand for x, y and z."""
        ends, colours = [np.zeros((0, 2, 3), np.float32)], [np.zeros((0, 2, 4), np.float32)]
        for mesh in faces:
            if mesh.shape not in self._thinned:
                self._thinned[mesh.shape] = _thinned(mesh, NORMAL_CELL * scale)
            rows = self._thinned[mesh.shape]
            foot, normal = world_positions(mesh)[rows], world_normals(mesh)[rows]
            ends.append(np.stack([foot, foot + normal * np.float32(NORMAL_LENGTH * scale)], axis=1))
            shade = np.ones((len(rows), 2, 4), dtype=np.float32)
            shade[..., :3] = (normal * 0.5 + 0.5)[:, None]
            shade[..., 3] = NORMAL_OPACITY
            colours.append(shade)
        return Lines(np.concatenate(ends), np.concatenate(colours), 1.2, WIRE_LIFT * scale)

    def _unique_edges(self, shape: FaceShape | MeshShape) -> Int32:
        if shape not in self._edges:
            self._edges[shape] = unique_edges(shape.triangles)
        return self._edges[shape]


def unique_edges(triangles: Int32) -> Int32:
    """Return int32 (E, 2): the edges of triangles (F, 3), each once, the smaller index first."""
    edges = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    return np.unique(edges, axis=0).astype(np.int32)


@cache
def _eyeball_edges() -> Float32:
    """Return float32 (E, 2, 3): the ends of the edges of a unit sphere."""
    vertices, triangles = sphere_mesh(*RINGS)
    return vertices[unique_edges(triangles)]


def _thinned(mesh: FaceMesh, cell: float) -> Intp:
    """Return the indices (N,) of the first vertex used by triangles in each cell of this size (m)."""
    used = np.unique(mesh.shape.triangles)
    cells = np.floor(mesh.positions[used] / max(cell, 1e-9)).astype(np.int64)
    first: Intp = np.unique(cells, axis=0, return_index=True)[1]
    return used[np.sort(first)].astype(np.intp)

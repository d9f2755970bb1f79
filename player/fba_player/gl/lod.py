"""As many triangles as can be seen: parts that are small on the screen are drawn coarser."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass, replace
from weakref import WeakKeyDictionary

import numpy as np
import numpy.typing as npt

from fba.arrays import Float32, Float64, Int32, Intp
from fba.compiled import compiled
from fba_player.mesh.simplify import TOLERANCES
from fba_player.view.view import FaceMesh, FaceShape

PIXELS = 1.3
"""How far the coarser mesh may be off, in pixels."""
SAMPLED = 24
"""Vertices from which the distance to the camera is taken."""


@dataclass(eq=False)
class _Level:
    """A coarser shape, the vertices (V,) that it has left, and their light as it was last seen."""

    shape: FaceShape
    rows: Intp
    light: tuple[Float32, Float32] | None = None


class Details:
    """Chooses levels; remembers the shapes that it has seen."""

    def __init__(self) -> None:
        self._levels: WeakKeyDictionary[FaceShape, dict[int, _Level | None]] = WeakKeyDictionary()

    def suited(self, meshes: list[FaceMesh], eye: npt.ArrayLike, pixel: float) -> list[FaceMesh]:
        """The meshes as they are best drawn for a camera at `eye` (3,), whose pixels have the size `pixel`
        at a distance of 1."""
        place = np.asarray(eye, dtype=np.float64)
        return [self._suited(mesh, place, pixel) for mesh in meshes]

    def _suited(self, mesh: FaceMesh, eye: Float64, pixel: float) -> FaceMesh:
        coarser = mesh.shape.coarser
        if coarser is None or not len(mesh.positions):
            return mesh
        away = distance(mesh, eye)
        level = self._level(mesh.shape, bisect_right(TOLERANCES, PIXELS * pixel * away))
        if level is None:
            return mesh
        if level.light is None or not same(level.light[0], mesh.light):
            level.light = (mesh.light, mesh.light.take(level.rows, axis=0))
        return replace(
            mesh,
            shape=level.shape,
            positions=mesh.positions.take(level.rows, axis=0),
            normals=mesh.normals.take(level.rows, axis=0),
            light=level.light[1],
            away=away,
        )

    def _level(self, shape: FaceShape, number: int) -> _Level | None:
        levels = self._levels.setdefault(shape, {})
        if number not in levels:
            assert shape.coarser is not None
            triangles = shape.coarser.within(TOLERANCES[number - 1]) if number else None
            levels[number] = None if triangles is None else _left(shape, triangles)
        return levels[number]


def _left(shape: FaceShape, triangles: Int32) -> _Level:
    rows, corners = np.unique(triangles, return_inverse=True)
    kept = replace(
        shape,
        triangles=np.ascontiguousarray(corners.reshape(-1, 3), dtype=np.int32),
        colours=np.ascontiguousarray(shape.colours[rows]),
        sway=np.ascontiguousarray(shape.sway[rows]),
        texcoords=None if shape.texcoords is None else np.ascontiguousarray(shape.texcoords[rows]),
        coarser=None,
    )
    return _Level(kept, rows.astype(np.intp))


def distance(mesh: FaceMesh, eye: Float64) -> float:
    """From an eye (3,) to the nearest of some vertices, in the mesh's own unit."""
    sample = mesh.positions[:: max(len(mesh.positions) // SAMPLED, 1)]
    return float(_nearest(sample, mesh.matrix, eye))


@compiled
def _nearest(positions: Float32, matrix: Float64, eye: Float64) -> float:
    least = np.inf
    for i in range(len(positions)):
        squared = 0.0
        for k in range(3):
            away = matrix[k, 3] - eye[k]
            for j in range(3):
                away += matrix[k, j] * positions[i, j]
            squared += away * away
        least = min(least, squared)
    scale = 0.0
    for k in range(3):
        scale += matrix[k, 0] * matrix[k, 0]
    return np.sqrt(least / scale) if least < np.inf and scale > 0.0 else 0.0


def same(one: Float32, other: Float32) -> bool:
    """Whether two arrays, both of them kept alive, are the same numbers in the same place."""
    if one is other:
        return True
    return (
        one.base is not None
        and one.base is other.base
        and one.shape == other.shape
        and one.__array_interface__["data"] == other.__array_interface__["data"]
        and one.strides == other.strides
    )

"""Level of detail: parts that are small on the screen are drawn with fewer triangles."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass, replace
from weakref import WeakKeyDictionary

import numpy as np
import numpy.typing as npt

from fba.arrays import Float32, Float64, Int32, Intp
from fba.compiled import compiled
from fba.mesh.simplify import TOLERANCES
from fba_player.view._view import FaceMesh, FaceShape

MAX_ERROR_PIXELS = 1.3
"""Largest error of a coarser mesh, in pixels."""
SAMPLED_VERTICES = 24
"""Number of vertices from which the distance to the camera is taken."""


@dataclass(eq=False)
class _Level:
    """A coarser shape, its vertices as rows (N,) of the full one, and the last light of all and of these."""

    shape: FaceShape
    rows: Intp
    light: tuple[Float32, Float32] | None = None


class Details:
    """Chooses levels of detail; caches the coarser shapes."""

    def __init__(self) -> None:
        self._levels: WeakKeyDictionary[FaceShape, dict[int, _Level | None]] = WeakKeyDictionary()

    def choose(self, meshes: list[FaceMesh], eye: npt.ArrayLike, pixel: float) -> list[FaceMesh]:
        """Return the meshes at levels of detail for a camera at `eye` (3,). pixel: its size at distance 1."""
        position = np.asarray(eye, dtype=np.float64)
        return [self._choose(mesh, position, pixel) for mesh in meshes]

    def _choose(self, mesh: FaceMesh, eye: Float64, pixel: float) -> FaceMesh:
        coarser = mesh.shape.coarser
        if coarser is None or not len(mesh.positions):
            return mesh
        away = distance(mesh, eye)
        level = self._level(mesh.shape, bisect_right(TOLERANCES, MAX_ERROR_PIXELS * pixel * away))
        if level is None:
            return mesh
        if level.light is None or not share_memory(level.light[0], mesh.light):
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
            triangles = shape.coarser.triangles_within(TOLERANCES[number - 1]) if number else None
            levels[number] = None if triangles is None else _make_level(shape, triangles)
        return levels[number]


def _make_level(shape: FaceShape, triangles: Int32) -> _Level:
    rows, corners = np.unique(triangles, return_inverse=True)
    texcoords, places = (
        None if array is None else np.ascontiguousarray(array[rows])
        for array in (shape.texcoords, shape.wrinkle_places)
    )
    coarser = replace(
        shape,
        triangles=np.ascontiguousarray(corners.reshape(-1, 3), dtype=np.int32),
        colours=np.ascontiguousarray(shape.colours[rows]),
        sway=np.ascontiguousarray(shape.sway[rows]),
        texcoords=texcoords,
        wrinkle_places=places,
        coarser=None,
    )
    return _Level(coarser, rows.astype(np.intp))


def distance(mesh: FaceMesh, eye: Float64) -> float:
    """Return the distance from an eye (3,) to the nearest of some vertices, in the mesh's own unit."""
    sample = mesh.positions[:: max(len(mesh.positions) // SAMPLED_VERTICES, 1)]
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


def share_memory(one: Float32, other: Float32) -> bool:
    """Return whether two arrays are equal views of the same memory; both must be alive."""
    if one is other:
        return True
    return (
        one.base is not None
        and one.base is other.base
        and one.shape == other.shape
        and one.__array_interface__["data"] == other.__array_interface__["data"]
        and one.strides == other.strides
    )

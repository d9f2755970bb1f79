"""Level of detail: parts that are small on the screen are drawn with fewer triangles.

Bounds: rows of a level are vertices of its full part (`place_on_full`), whose arrays are all as long.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from weakref import WeakKeyDictionary

import numpy as np
import numpy.typing as npt

from fba.arrays import Float32, Float64, Int32, Intp
from fba.compiled import compiled
from fba.mesh.simplify import TOLERANCES
from fba_player._figure.detail import choose_level, level_triangles, sampled
from fba_player.view._view import FaceMesh, FaceShape

MORPH_SECONDS = 0.5
"""Seconds in which the vertices of a face move from one level of detail to another."""
FULL = ("full", "0")


@dataclass(eq=False)
class _Level:
    """A coarser shape, its vertices as rows (N,) of the full one, and the last light of all and of these."""

    shape: FaceShape
    rows: Intp
    light: tuple[Float32, Float32] | None = None


@dataclass
class _Shown:
    """The level of detail at which a face is shown, and the one that it is changing to since a time (s)."""

    level: int
    goal: int
    since: float = 0.0

    def change(self, wanted: int, now: float | None) -> float:
        """Return the share, 0..1, of the change from `level` to `goal`, which without a clock is at once."""
        if now is None:
            self.level = self.goal = wanted
            return 0.0
        share = (now - self.since) / MORPH_SECONDS
        if self.level != self.goal and share >= 1.0:
            self.level = self.goal
        if self.level == self.goal:
            self.goal, self.since, share = wanted, now, 0.0
        return max(share, 0.0)


class Details:
    """Chooses levels of detail; caches the coarser shapes.

    morphing: whether, in the last choice, a face was on its way from one level to another.
    """

    def __init__(self) -> None:
        self._levels: WeakKeyDictionary[FaceShape, dict[int, _Level | None]] = WeakKeyDictionary()
        self._shown: WeakKeyDictionary[FaceShape, dict[int, _Shown]] = WeakKeyDictionary()
        self._lights: WeakKeyDictionary[FaceShape, tuple[Float32, Float32]] = WeakKeyDictionary()
        self.morphing = False

    def choose(
        self,
        meshes: list[FaceMesh],
        eye: npt.ArrayLike,
        pixel: float,
        lod: str = "auto",
        now: float | None = None,
    ) -> list[FaceMesh]:
        """Return the meshes at levels of detail for a camera at `eye` (3,). pixel: its size at distance 1.

        All parts of a face have the same level. lod: "auto" by size, or the level of faces, "0" for all
        triangles. now: seconds, to change the level of a face gradually; None to change it at once.
        """
        position = np.asarray(eye, dtype=np.float64)
        self.morphing = False
        chosen, count = list(meshes), dict[FaceShape, int]()
        for face in _faces(meshes):
            parts = [meshes[number] for number in face]
            away = distance(max(parts, key=lambda mesh: len(mesh.positions)), position)
            first = parts[0].shape
            wanted = choose_level(first, pixel * away)
            if lod != "auto":
                wanted = 0 if lod in FULL else min(int(lod), len(first.levels))
            count[first] = count.get(first, -1) + 1
            shown = self._shown.setdefault(first, {}).setdefault(count[first], _Shown(wanted, wanted))
            shown.level, shown.goal = max(shown.level, parts[0].finest), max(shown.goal, parts[0].finest)
            share = shown.change(wanted, now)
            self.morphing |= shown.level != shown.goal
            for number, mesh in zip(face, parts, strict=True):
                chosen[number] = self._between(mesh, shown.level, shown.goal, share, away)
        if lod not in FULL:
            chosen = [self._choose(mesh, position, pixel) for mesh in chosen]
        return chosen

    def _between(self, mesh: FaceMesh, level: int, goal: int, share: float, away: float) -> FaceMesh:
        """Return a part of a face on the way from one level to another."""
        if level == goal:
            return self._carry(mesh, level, away)
        fine, coarse = min(level, goal), max(level, goal)
        levels = mesh.shape.levels
        parents = levels[coarse - 1].parents
        if fine:
            parents = parents[levels[fine - 1].first]
        one, other = self._carry(mesh, fine, away), self._carry(mesh, coarse, away)
        moved = np.float32(share if goal == coarse else 1 - share)
        arrays = [
            before + moved * (after[parents] - before)
            for before, after in (
                (one.positions, other.positions),
                (one.normals, other.normals),
                (one.light, other.light),
                (one.shape.looks, other.shape.looks),
            )
        ]
        return one._replace(positions=arrays[0], normals=arrays[1], light=arrays[2], looks=arrays[3])

    def _carry(self, mesh: FaceMesh, number: int, away: float) -> FaceMesh:
        """Return a part of a face at a level of detail, moved by the vertices of the full one."""
        if not number:
            return mesh._replace(away=away)
        level = mesh.shape.levels[number - 1]
        before = self._lights.get(level.shape)
        if before is None or not share_memory(before[0], mesh.light):
            before = mesh.light, _mean(mesh.light, level.rows, level.weights)
            self._lights[level.shape] = before
        positions, normals = (np.zeros((len(level.rows), 3), dtype=np.float32) for _ in range(2))
        _place(mesh.positions, mesh.normals, level.rows, level.weights, level.heights, positions, normals)
        return mesh._replace(
            shape=level.shape, positions=positions, normals=normals, light=before[1], away=away
        )

    def _choose(self, mesh: FaceMesh, eye: Float64, pixel: float) -> FaceMesh:
        if (mesh.shape.coarser is None and mesh.shape.across is None) or not len(mesh.positions):
            return mesh
        away = distance(mesh, eye)
        level = self._level(mesh.shape, choose_level(mesh.shape, pixel * away))
        if level is None:
            return mesh
        if level.light is None or not share_memory(level.light[0], mesh.light):
            level.light = (mesh.light, mesh.light.take(level.rows, axis=0))
        return mesh._replace(
            shape=level.shape,
            positions=mesh.positions.take(level.rows, axis=0),
            normals=mesh.normals.take(level.rows, axis=0),
            light=level.light[1],
            away=away,
        )

    def _level(self, shape: FaceShape, number: int) -> _Level | None:
        levels = self._levels.setdefault(shape, {})
        if number not in levels:
            triangles = level_triangles(shape, number)
            levels[number] = None if triangles is None else _make_level(shape, triangles)
        return levels[number]


def _make_level(shape: FaceShape, triangles: Int32) -> _Level:
    rows, corners = np.unique(triangles, return_inverse=True)
    texcoords, places, across = (
        None if array is None else np.ascontiguousarray(array[rows])
        for array in (shape.texcoords, shape.wrinkle_places, shape.across)
    )
    outer = None if shape.coarser is None else shape.coarser.triangles_within(TOLERANCES[-1])
    if outer is not None:
        number = np.full(len(shape.sway), -1, dtype=np.int32)
        number[rows] = np.arange(len(rows))
        outer = number[outer]
        outer = np.ascontiguousarray(outer) if outer.min(initial=0) >= 0 else None
    coarser = replace(
        shape,
        outer=outer,
        points=None if shape.coarser is None else shape.coarser.points[rows, :3],
        triangles=np.ascontiguousarray(corners.reshape(-1, 3), dtype=np.int32),
        colours=np.ascontiguousarray(shape.colours[rows]),
        sway=np.ascontiguousarray(shape.sway[rows]),
        texcoords=texcoords,
        wrinkle_places=places,
        across=across,
        coarser=None,
    )
    return _Level(coarser, rows.astype(np.intp))


def _faces(meshes: list[FaceMesh]) -> list[list[int]]:
    """Return, for each face with levels of detail, the numbers of its parts among the meshes."""
    faces: list[list[int]] = []
    whole, names = None, set[str]()
    for number, mesh in enumerate(meshes):
        if not mesh.shape.levels or not len(mesh.positions):
            continue
        level = mesh.shape.levels[0].whole
        if level is not whole or mesh.shape.name in names:  # another face, or the same once more
            faces.append([])
            whole, names = level, set()
        names.add(mesh.shape.name)
        faces[-1].append(number)
    return faces


def _mean(values: Float32, rows: Int32, weights: Float32) -> Float32:
    """Return the weighted means (M, C) of rows (M, 3) of values (V, C)."""
    means = np.zeros((len(rows), values.shape[1]), dtype=np.float32)
    _add_means(values, rows, weights, means)
    return means


@compiled
def _place(
    positions: Float32,
    normals: Float32,
    rows: Int32,
    weights: Float32,
    heights: Float32,
    placed: Float32,
    turned: Float32,
) -> None:
    """Add to (M, 3) positions and normals, 0 before, those of a level; see `CoarseShape`."""
    _add_means(normals, rows, weights, turned)
    _add_means(positions, rows, weights, placed)
    for i in range(len(rows)):
        for column in range(3):
            placed[i, column] += heights[i] * turned[i, column]


@compiled
def _add_means(values: Float32, rows: Int32, weights: Float32, means: Float32) -> None:
    for i in range(len(rows)):
        for k in range(3):
            row, weight = rows[i, k], weights[i, k]
            for column in range(values.shape[1]):
                means[i, column] += weight * values[row, column]


def distance(mesh: FaceMesh, eye: Float64) -> float:
    """Return the distance from an eye (3,) to the nearest of some vertices, in the mesh's own unit."""
    return math.sqrt(_least_square(mesh.positions, sampled(len(mesh.positions)).step, eye, mesh.matrix))


@compiled
def _least_square(positions: Float32, step: int, eye: Float64, matrix: Float64) -> float:
    """Return the square of the least distance from an eye (3,) to every `step`th position (N, 3), in the unit
    of these; 0 if none is finite. matrix: (4, 4), theirs into the world: rotation, shift and scale."""
    seen, squared, least = np.zeros(3), 0.0, np.inf
    for row in range(3):
        squared += matrix[row, 0] * matrix[row, 0]  # of the scale
        for axis in range(3):
            seen[axis] += (eye[row] - matrix[row, 3]) * matrix[row, axis]
    for i in range(0, len(positions) if squared > 0.0 else 0, step):
        square = 0.0
        for axis in range(3):
            away = positions[i, axis] - seen[axis] / squared
            square += away * away
        least = min(least, square)
    return least if np.isfinite(least) else 0.0


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

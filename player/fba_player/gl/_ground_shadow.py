"""The shadow of a body on the ground, from a large key light and the sky, on a grid of a few centimetres.

Points spread evenly over the surface are projected onto the ground along several rays of each light, where
each covers as much ground as its piece of surface hides from that direction.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from fba.arrays import Float32, Float64, Int32, UInt8
from fba.compiled import compiled, is_compiled
from fba_player._figure.face_light import KEY_DIRECTION
from fba_player.view._view import FaceMesh, FaceShape

CELLS = 96
"""Number of cells of the grid along each side."""
CELL = 0.05
"""Size of a cell, metres."""
SPACING = 0.036
"""Distance between the points, metres."""
INNER_KINDS = ("teeth", "tongue", "mouth", "eye")
"""Kinds of parts that lie inside others and cast no shadow."""
SAMPLING_ERROR = 0.0032
"""Error (m) up to which bodies are simplified before points are spread over them."""
KEY_RAYS = 12
"""Number of rays of the key light."""
KEY_RADIUS = 0.11
"""Angular radius of the key light, radians."""
SKY_RAYS = 8
"""Number of rays of the sky."""
HIGHEST_SINE = 0.97
"""Sine of the elevation of the steepest ray of the sky."""
LOWEST_SINE = 0.62
"""Sine of the elevation of the flattest ray of the sky."""
KEY_SHARE = 0.62
"""Darkness of the ground where all of the key light is hidden."""
SKY_SHARE = 0.85
"""Darkness of the ground where all of the sky is hidden."""
KEY_BLUR = 1
SKY_BLUR = 4
"""Radius, in cells, of the two passes of blur of each shadow."""
MIN_DARKNESS = 3
"""Fainter darkness, of 255, is not drawn."""


@dataclass(frozen=True, eq=False)
class CastShadow:
    """darkness: uint8 (H, W), rows along z, columns along x; low, high: (x, z) of its corners (m)."""

    darkness: UInt8
    low: tuple[float, float]
    high: tuple[float, float]


class Points(NamedTuple):
    """Points on triangles.

    corners: int32 (N, 3). shares: float32 (N, 3), weights of the corners. area: float32 (N,), m².
    """

    corners: Int32
    shares: Float32
    area: Float32


class ShadowCaster:
    """Computes shadows; caches the points on each shape."""

    def __init__(self) -> None:
        self._points: WeakKeyDictionary[FaceShape, Points | None] = WeakKeyDictionary()
        self._rows = np.empty((0, 6), dtype=np.float32)
        self._darkness = np.zeros((CELLS, CELLS), dtype=np.uint8)

    def cast(self, meshes: list[FaceMesh], middle: tuple[float, float]) -> CastShadow | None:
        """Return the shadow of meshes on the ground y = 0 around `middle` (x, z).

        None without a visible shadow, and without numba.
        """
        if not is_compiled():
            return None
        ahead = 0.9 / KEY_DIRECTION[1]  # shadows fall away from the key light
        corner = (np.floor((middle - ahead * np.array(KEY_DIRECTION[::2])) / CELL) - CELLS / 2) * CELL
        low = (float(corner[0]), float(corner[1]))
        count = 0
        for mesh in meshes:
            points = self._points_of(mesh.shape)
            if points is None or mesh.turn.any():
                continue
            if count + len(points.area) > len(self._rows):
                more = np.empty((2 * len(points.area), 6), dtype=np.float32)
                self._rows = np.concatenate([self._rows, more])
            count = _place_points(mesh.positions, mesh.matrix, points, low, self._rows, count)
        left, bottom, right, top = _cast_shadow(self._rows[:count], _rays(), self._darkness)
        if right <= left:
            return None
        return CastShadow(
            self._darkness[bottom:top, left:right].copy(),
            (low[0] + left * CELL, low[1] + bottom * CELL),
            (low[0] + right * CELL, low[1] + top * CELL),
        )

    def _points_of(self, shape: FaceShape) -> Points | None:
        if shape not in self._points:
            self._points[shape] = _spread(shape)
        return self._points[shape]


def _spread(shape: FaceShape) -> Points | None:
    """Return points spread over a shape's surface at rest; None for a shape that casts no shadow."""
    if shape.rest is None or shape.kind in INNER_KINDS:
        return None
    coarse = None if shape.coarser is None else shape.coarser.triangles_within(SAMPLING_ERROR)
    triangles = shape.triangles if coarse is None else coarse
    if not len(triangles):
        return None
    a, b, c = (shape.rest[triangles[:, k]].astype(np.float64) for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    ends = np.cumsum(area)
    count = int(ends[-1] / SPACING**2) + 1
    steps = np.arange(count)
    owner = np.minimum(np.searchsorted(ends, (steps + 0.5) * ends[-1] / count), len(triangles) - 1)
    # A low-discrepancy sequence in the unit square, folded onto the triangles.
    u, v = (0.5 + steps * 0.7548776662) % 1, (0.5 + steps * 0.5698402910) % 1
    over = u + v > 1
    u, v = np.where(over, 1 - u, u), np.where(over, 1 - v, v)
    return Points(
        np.ascontiguousarray(triangles[owner], dtype=np.int32),
        np.stack([1 - u - v, u, v], axis=1).astype(np.float32),
        np.full(count, ends[-1] / count, dtype=np.float32),
    )


@cache
def _rays() -> Float64:
    """Return float64 (N, 3): unit vectors towards the key light, then towards the sky."""
    key = np.array(KEY_DIRECTION) / np.linalg.norm(KEY_DIRECTION)
    aside = np.cross(key, (0.0, 1.0, 0.0))
    aside /= np.linalg.norm(aside)
    up = np.cross(aside, key)
    golden = np.pi * (3 - 5**0.5)
    rays = []
    for k in range(KEY_RAYS):
        reach = KEY_RADIUS * np.sqrt((k + 0.5) / KEY_RAYS)
        rays.append(key + reach * (np.cos(golden * k) * aside + np.sin(golden * k) * up))
    for k in range(SKY_RAYS):
        high = HIGHEST_SINE - (HIGHEST_SINE - LOWEST_SINE) * (k + 0.5) / SKY_RAYS
        flat = np.sqrt(1 - high * high)
        rays.append(np.array([flat * np.cos(golden * k + 1), high, flat * np.sin(golden * k + 1)]))
    unit: Float64 = np.array(rays) / np.linalg.norm(rays, axis=1, keepdims=True)
    return unit


@compiled
def _place_points(
    positions: Float32, matrix: Float64, points: Points, low: tuple[float, float], rows: Float32, count: int
) -> int:
    """Write points from row `count` on: column, height (m), row; normal, as long as the area in cells.

    Returns the number of rows written so far. IndexError if rows have no room for all points, or a point
    names a vertex that does not exist.
    """
    if count + len(points.corners) > len(rows):
        raise IndexError("no room for the points of a shadow")
    corners, shares, area = points
    p = np.empty((3, 3))
    for i in range(len(corners)):
        for k in range(3):
            if corners[i, k] >= len(positions):
                raise IndexError("a point names a vertex that does not exist")
            x, y, z = positions[corners[i, k], 0], positions[corners[i, k], 1], positions[corners[i, k], 2]
            for axis in range(3):
                p[k, axis] = matrix[axis, 0] * x + matrix[axis, 1] * y + matrix[axis, 2] * z + matrix[axis, 3]
        ux, uy, uz = p[1, 0] - p[0, 0], p[1, 1] - p[0, 1], p[1, 2] - p[0, 2]
        vx, vy, vz = p[2, 0] - p[0, 0], p[2, 1] - p[0, 1], p[2, 2] - p[0, 2]
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        length = np.sqrt(nx * nx + ny * ny + nz * nz)
        if not length > 1e-12:
            continue
        a, b, c = shares[i, 0], shares[i, 1], shares[i, 2]
        piece = area[i] / (CELL * CELL) / length
        rows[count, 0] = (a * p[0, 0] + b * p[1, 0] + c * p[2, 0] - low[0]) / CELL - 0.5
        rows[count, 1] = max(a * p[0, 1] + b * p[1, 1] + c * p[2, 1], 0.0)
        rows[count, 2] = (a * p[0, 2] + b * p[1, 2] + c * p[2, 2] - low[1]) / CELL - 0.5
        rows[count, 3], rows[count, 4], rows[count, 5] = piece * nx, piece * ny, piece * nz
        count += 1
    return count


@compiled
def _cast_shadow(rows: Float32, rays: Float64, darkness: UInt8) -> tuple[int, int, int, int]:
    """Write the darkness of each cell; return the bounds of the shadow: left, bottom, right, top.

    Bounds: darkness and all layers, made here, are squares of the same size.
    """
    cells = len(darkness)
    key, sky = np.zeros((cells, cells), dtype=np.float32), np.zeros((cells, cells), dtype=np.float32)
    layer = np.empty((cells, cells), dtype=np.float32)  # one ray at a time: it stays in the cache
    for ray in range(len(rays)):
        layer[:] = np.float32(0.0)
        _cover(rows, rays[ray, 0], rays[ray, 1], rays[ray, 2], layer)
        grid = key if ray < KEY_RAYS else sky
        for row in range(cells):
            for column in range(cells):
                grid[row, column] += min(layer[row, column], np.float32(1.0))
    _blur(key, KEY_BLUR, layer)
    _blur(sky, SKY_BLUR, layer)
    return _darken(key, sky, darkness)


@compiled
def _cover(rows: Float32, rx: float, ry: float, rz: float, layer: Float32) -> None:
    """Add to a layer the share of each cell that the points cover along a ray.

    Bounds: only points from 1 to below cells - 2 are used, which excludes numbers that are not finite, so the
    three cells around each are within the layer.
    """
    cells = len(layer)
    limit, half, quarters = np.float32(cells - 2), np.float32(0.5), np.float32(0.75)
    longer = 1.0 / ry
    x, y, z = np.float32(rx * longer), np.float32(1.0), np.float32(rz * longer)
    aside, ahead = np.float32(rx * longer / CELL), np.float32(rz * longer / CELL)
    for i in range(len(rows)):
        amount = rows[i, 3] * x + rows[i, 4] * y + rows[i, 5] * z
        column = rows[i, 0] - aside * rows[i, 1]
        row = rows[i, 2] - ahead * rows[i, 1]
        if not (amount > np.float32(0.0) and 1.0 <= column < limit and 1.0 <= row < limit):
            continue
        # Spread over three cells each way by a quadratic spline, as the points are not quite even.
        middle, centre = int(column + half), int(row + half)
        fx, fy = column - np.float32(middle), row - np.float32(centre)
        across = half * (half - fx) * (half - fx), quarters - fx * fx, half * (half + fx) * (half + fx)
        down = half * (half - fy) * (half - fy), quarters - fy * fy, half * (half + fy) * (half + fy)
        for j in range(3):
            for k in range(3):
                layer[centre - 1 + j, middle - 1 + k] += amount * down[j] * across[k]


@compiled
def _blur(grid: Float32, reach: int, room: Float32) -> None:
    """Blur by the mean over 2 reach + 1 cells along rows and columns, twice.

    Bounds: grid and room are squares of the same size; cells outside are left out.
    """
    cells = len(grid)
    per = np.float32(1.0 / (2 * reach + 1))
    for _ in range(2):
        for row in range(cells):
            total = np.float32(0.0)
            for column in range(min(reach, cells)):
                total += grid[row, column]
            for column in range(cells):
                if column + reach < cells:
                    total += grid[row, column + reach]
                if column - reach - 1 >= 0:
                    total -= grid[row, column - reach - 1]
                room[row, column] = total * per
        running = np.zeros(cells, dtype=np.float32)
        for row in range(min(reach, cells)):
            for column in range(cells):
                running[column] += room[row, column]
        for row in range(cells):
            for column in range(cells):
                if row + reach < cells:
                    running[column] += room[row + reach, column]
                if row - reach - 1 >= 0:
                    running[column] -= room[row - reach - 1, column]
                grid[row, column] = running[column] * per


@compiled
def _darken(key: Float32, sky: Float32, darkness: UInt8) -> tuple[int, int, int, int]:
    """Write the darkness of each cell from the hidden rays of both lights; return as `_cast_shadow`.

    Bounds: three squares of the same size.
    """
    cells = len(darkness)
    left, bottom, right, top = cells, cells, 0, 0
    for row in range(cells):
        for column in range(cells):
            lit = 1.0 - KEY_SHARE * key[row, column] / KEY_RAYS
            lit *= 1.0 - SKY_SHARE * sky[row, column] / SKY_RAYS
            edge = min(row, cells - 1 - row, column, cells - 1 - column)
            dark = 255.0 * (1.0 - lit) * min(edge / 8.0, 1.0)
            darkness[row, column] = np.uint8(min(max(dark, 0.0), 255.0))
            if dark >= MIN_DARKNESS:
                left, right = min(left, column), max(right, column + 1)
                bottom, top = min(bottom, row), max(top, row + 1)
    return max(left - 1, 0), max(bottom - 1, 0), min(right + 1, cells), min(top + 1, cells)

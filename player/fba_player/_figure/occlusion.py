"""How much of the light from any direction reaches each vertex of a mesh past the rest of the mesh.

Computed once for a pose, from depth maps of the mesh from many directions, and stored as spherical harmonics:
soft shadows of large lights then cost a few products for each vertex, whichever way the head turns.
"""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import numpy as np

from fba.arrays import Bool, Float32, Float64, Int32, Intp
from fba.compiled import compiled, is_compiled

DIRECTIONS = 72
"""Number of directions from which the mesh is rendered."""
PIXEL_SIZE = 0.0014
"""Size of a depth map's pixel, metres: finer than the folds that are to be shaded."""
MAX_DEPTH_PIXELS = 400
"""Largest width of a depth map, pixels."""
FACTORS = np.repeat((1.0, 0.92, 0.72, 0.46), (1, 3, 5, 7))
"""Factor for each harmonic, by its band, for a light some 40 degrees wide."""
SKIN_DEPTH = 0.0045
"""Depth (m) at which light through skin has faded to 1/e."""
HARMONICS = 16
CACHE_VERSION = "1"
"""Cache version; increment when `bake` gives other results."""


class Visibility(NamedTuple):
    """Light that reaches each vertex.

    light: float32 (V, 16), harmonics of the visibility of each direction, 1 if free. through: float32
    (V, 16), harmonics of the light through the skin from behind. open: float32 (V,), the unobstructed share
    of the hemisphere above each vertex, weighted by the cosine.
    """

    light: Float32
    through: Float32
    open: Float32


def bake(vertices: Float32, normals: Float32, triangles: Int32, within: Bool | None = None) -> Visibility:
    """Return the visibility of every vertex (V, 3) of a mesh; takes about half a second for 20,000 vertices.

    within: bool (V,), the vertices whose visibility is computed, all by default; others may count as free.
    Without numba, which would take minutes, all vertices count as free.
    """
    count = len(vertices)
    directions = _directions()
    visible = np.ones((count, len(directions)), dtype=np.float32)
    through = np.zeros_like(visible)
    if is_compiled() and count:
        # Copies: read-only arrays, as a model's, are another type, for which loops would be compiled again.
        normals, triangles = normals.copy(), triangles.copy()
        rows = np.arange(count) if within is None or not within.any() else np.flatnonzero(within)
        baked = vertices[rows]
        centre = (baked.min(axis=0) + baked.max(axis=0)) / 2
        reach = float(np.linalg.norm(baked - centre, axis=1).max()) * 1.01
        size = int(np.clip(2 * reach / PIXEL_SIZE, 16, MAX_DEPTH_PIXELS))
        depth = np.empty((size, size), dtype=np.float32)
        for column, direction in enumerate(directions):
            frame = _frame(direction).astype(np.float32)
            seen = ((vertices - centre) @ frame.T / reach).astype(np.float32)
            facing = (normals @ direction).astype(np.float32)
            _draw_depths(seen, triangles, depth)
            _read_depths(seen, facing, rows, depth, reach, visible[:, column], through[:, column])
        _mirror(visible, normals, directions.astype(np.float32))
    above = np.maximum(normals.astype(np.float32) @ directions.T.astype(np.float32), 0)
    free = (above * visible).sum(axis=1) / np.maximum(above.sum(axis=1), 1e-9)
    basis = (harmonics(directions) * (4 * np.pi / len(directions))).astype(np.float32)
    return Visibility(visible @ basis, through @ basis, free.astype(np.float32))


def harmonics(directions: Float64) -> Float64:
    """Return float64 (N, 16): real spherical harmonics up to the third band at unit vectors (N, 3)."""
    return np.stack(np.broadcast_arrays(*harmonics_at(*directions.T)), axis=1)


def weights(directions: Float64) -> Float64:
    """Return float64 (N, 16): weights for rows of `Visibility`, for few large lights in directions (N, 3)."""
    values = [harmonics_at(*direction) for direction in directions.tolist()]
    return np.asarray(np.array(values) * FACTORS)


def harmonics_at(x: Any, y: Any, z: Any) -> tuple[Any, ...]:
    """Return the harmonics in a direction, or in many, of arrays: for few these take much longer."""
    return (
        0.282095,
        0.488603 * y,
        0.488603 * z,
        0.488603 * x,
        1.092548 * x * y,
        1.092548 * y * z,
        0.315392 * (3 * z * z - 1),
        1.092548 * x * z,
        0.546274 * (x * x - y * y),
        0.590044 * y * (3 * x * x - y * y),
        2.890611 * x * y * z,
        0.457046 * y * (5 * z * z - 1),
        0.373176 * z * (5 * z * z - 3),
        0.457046 * x * (5 * z * z - 1),
        1.445306 * z * (x * x - y * y),
        0.590044 * x * (x * x - 3 * y * y),
    )


@cache
def _directions() -> Float64:
    """Return float64 (N, 3): unit vectors spread evenly over the sphere."""
    k = np.arange(DIRECTIONS) + 0.5
    z = 1 - 2 * k / DIRECTIONS
    around = np.pi * (1 + 5**0.5) * k
    flat = np.sqrt(1 - z * z)
    return np.stack([flat * np.cos(around), z, flat * np.sin(around)], axis=1)


def _frame(direction: Float64) -> Float64:
    """Return float64 (3, 3), as rows: right, up and towards the viewer, who looks from this direction."""
    aside = np.cross(direction, (0.0, 1.0, 0.0) if abs(direction[1]) < 0.9 else (1.0, 0.0, 0.0))
    aside /= np.linalg.norm(aside)
    return np.stack([aside, np.cross(direction, aside), direction])


@compiled
def _mirror(visible: Float32, normals: Float32, directions: Float32) -> None:
    """Replace visibility below each vertex's horizon by that of the direction mirrored at the horizon.

    There the surface hides itself, which shading by the normal accounts for already. Bounds: visible has a
    row for each normal and a column for each direction, see `bake`.
    """
    count = len(directions)
    for i in range(len(visible)):
        for k in range(count):
            x, y, z = directions[k, 0], directions[k, 1], directions[k, 2]
            down = x * normals[i, 0] + y * normals[i, 1] + z * normals[i, 2]
            if down >= 0.0:
                continue
            x -= 2.0 * down * normals[i, 0]
            y -= 2.0 * down * normals[i, 1]
            z -= 2.0 * down * normals[i, 2]
            best, mirrored = -2.0, 0
            for other in range(count):
                near = x * directions[other, 0] + y * directions[other, 1] + z * directions[other, 2]
                if near > best:
                    best, mirrored = near, other
            visible[i, k] = visible[i, mirrored]


@compiled
def _draw_depths(seen: Float32, triangles: Int32, depth: Float32) -> None:
    """Draw the depths of front-facing triangles. seen: (V, 3), x and y in -1..1, z towards the viewer.

    Bounds: pixels are clamped to the map after conversion to integers, whatever they were before; corners are
    vertices of the mesh, which `bake` gets from a checked model.
    """
    size = depth.shape[0]
    depth[:] = -10.0
    half = 0.5 * size
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        ax, ay = (seen[a, 0] + 1.0) * half - 0.5, (seen[a, 1] + 1.0) * half - 0.5
        bx, by = (seen[b, 0] + 1.0) * half - 0.5, (seen[b, 1] + 1.0) * half - 0.5
        cx, cy = (seen[c, 0] + 1.0) * half - 0.5, (seen[c, 1] + 1.0) * half - 0.5
        area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
        if area <= 1e-9:
            continue
        x0, x1 = max(int(np.ceil(min(ax, bx, cx))), 0), min(int(np.floor(max(ax, bx, cx))), size - 1)
        y0, y1 = max(int(np.ceil(min(ay, by, cy))), 0), min(int(np.floor(max(ay, by, cy))), size - 1)
        if x0 > x1 or y0 > y1:
            continue
        per = 1.0 / area
        za, zb, zc = seen[a, 2], seen[b, 2], seen[c, 2]
        du, dv = (by - cy) * per, (cy - ay) * per
        for row in range(y0, y1 + 1):
            u = ((bx - x0) * (cy - row) - (cx - x0) * (by - row)) * per
            v = ((cx - x0) * (ay - row) - (ax - x0) * (cy - row)) * per
            for column in range(x0, x1 + 1):
                w = 1.0 - u - v
                if u >= -1e-5 and v >= -1e-5 and w >= -1e-5:
                    depth[row, column] = max(depth[row, column], u * za + v * zb + w * zc)
                u += du
                v += dv


@compiled
def _read_depths(
    seen: Float32,
    facing: Float32,
    rows: Intp,
    depth: Float32,
    reach: float,
    visible: Float32,
    through: Float32,
) -> None:
    """Write for vertices `rows` their visibility in a depth map, and the light that comes through to them.

    Bounds: rows are vertices, and all arrays have a row for each. Pixels are clamped as in `_draw_depths`,
    and have neighbours: a map has 16 or more.
    """
    size = depth.shape[0]
    half = 0.5 * size
    pixel = 2.0 * reach / size
    for i in rows:
        x, y = (seen[i, 0] + 1.0) * half - 0.5, (seen[i, 1] + 1.0) * half - 0.5
        column, row = min(max(int(x), 0), size - 2), min(max(int(y), 0), size - 2)
        fx, fy = min(max(x - column, 0.0), 1.0), min(max(y - row, 0.0), 1.0)
        free, behind = 0.0, 0.0
        # The depth of a slanted surface changes within a pixel.
        slant = pixel * (1.2 + 1.5 / max(abs(facing[i]), 0.15))
        for k in range(4):
            down, right = k // 2, k % 2
            weight = (fx if right else 1.0 - fx) * (fy if down else 1.0 - fy)
            gap = (depth[row + down, column + right] - seen[i, 2]) * reach
            free += weight * min(max(2.0 - gap / slant, 0.0), 1.0)
            behind += weight * (np.exp(-gap / SKIN_DEPTH) if gap > 0.5 * pixel else 1.0)
        visible[i] = free
        if facing[i] < 0.1:
            through[i] = behind * min(1.0, (0.1 - facing[i]) * 4.0)

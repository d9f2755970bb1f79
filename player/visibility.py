"""How much of the light from any direction reaches each vertex of a mesh, past the rest of it.

Worked out once for a pose, by looking at the mesh from many directions, and kept as spherical
harmonics: soft shadows of large lights then cost a few products a vertex, whichever way the head turns.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
import numpy.typing as npt

from fba.compiled import compiled, is_compiled

Float32 = npt.NDArray[np.float32]
Float64 = npt.NDArray[np.float64]

DIRECTIONS = 80
"""From so many sides the mesh is looked at."""
RESOLUTION = 224
"""Pixels of each such look, across the mesh."""
SOFTNESS = (1.0, 0.92, 0.72, 0.46)
"""What is left of each band of the harmonics: a light of some 40 degrees across."""
SKIN_DEPTH = 0.0045
"""Metres after which light through skin has faded to 1/e."""
HARMONICS = 16


@dataclass(frozen=True, eq=False)
class Visibility:
    """light: float32 (V, 16), harmonics of what is seen of each direction, 1 where it is free.
    through: float32 (V, 16), harmonics of what comes through the skin from behind. open: float32 (V,),
    how much of the hemisphere above the vertex is free, weighted by the cosine."""

    light: Float32
    through: Float32
    open: Float32

    def towards(self, direction: npt.ArrayLike) -> tuple[Float32, Float32]:
        """What reaches each vertex from a direction (3,), and what comes through: float32 (V,), 0..1."""
        basis = (harmonics(np.asarray(direction, dtype=np.float64)[None])[0] * _bands()).astype(np.float32)
        return tuple(np.clip(np.einsum("ij,j->i", table, basis), 0, 1) for table in (self.light, self.through))  # type: ignore[return-value]


def bake(vertices: Float32, normals: Float32, triangles: npt.NDArray[np.int32]) -> Visibility:
    """The visibility of every vertex (V, 3) in a mesh; about 0.3 s for 15,000 of them.

    Without numba it would take minutes: everything then counts as free.
    """
    count = len(vertices)
    directions = _directions()
    visible = np.ones((count, len(directions)), dtype=np.float32)
    through = np.zeros_like(visible)
    if is_compiled() and count:
        centre = (vertices.min(axis=0) + vertices.max(axis=0)) / 2
        reach = float(np.linalg.norm(vertices - centre, axis=1).max()) * 1.01
        depth = np.empty((RESOLUTION, RESOLUTION), dtype=np.float32)
        for column, direction in enumerate(directions):
            frame = _frame(direction).astype(np.float32)
            seen = ((vertices - centre) @ frame.T / reach).astype(np.float32)
            facing = (normals @ direction).astype(np.float32)
            _look(seen, facing, triangles, depth, reach, visible[:, column], through[:, column])
    facing64 = normals.astype(np.float64) @ directions.T
    above = np.maximum(facing64, 0)
    free = (above * visible).sum(axis=1) / np.maximum(above.sum(axis=1), 1e-9)
    # Below a vertex's horizon its own surface hides it, which the shading itself accounts for.
    mirrored = _mirrored(normals, directions)
    below = facing64 < 0
    visible = np.where(below, np.take_along_axis(visible, mirrored, axis=1), visible)
    basis = harmonics(directions) * (4 * np.pi / len(directions))
    return Visibility(
        (visible @ basis).astype(np.float32), (through @ basis).astype(np.float32), free.astype(np.float32)
    )


def harmonics(directions: Float64) -> Float64:
    """(N, 16) real spherical harmonics up to the third band, for unit vectors (N, 3)."""
    x, y, z = directions.T
    one = np.ones_like(x)
    found = [
        0.282095 * one,
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
    ]
    return np.stack(found, axis=1)


@cache
def _bands() -> Float64:
    return np.repeat(SOFTNESS, [1, 3, 5, 7])


@cache
def _directions() -> Float64:
    """(N, 3) unit vectors spread evenly over the sphere."""
    k = np.arange(DIRECTIONS) + 0.5
    z = 1 - 2 * k / DIRECTIONS
    around = np.pi * (1 + 5**0.5) * k
    flat = np.sqrt(1 - z * z)
    return np.stack([flat * np.cos(around), z, flat * np.sin(around)], axis=1)


def _frame(direction: Float64) -> Float64:
    """Rows: across, up and towards the looker."""
    aside = np.cross(direction, (0.0, 1.0, 0.0) if abs(direction[1]) < 0.9 else (1.0, 0.0, 0.0))
    aside /= np.linalg.norm(aside)
    return np.stack([aside, np.cross(direction, aside), direction])


def _mirrored(normals: Float32, directions: Float64) -> npt.NDArray[np.intp]:
    """(V, D) the direction nearest to each one mirrored at the vertex's horizon."""
    found = np.empty((len(normals), len(directions)), dtype=np.intp)
    for start in range(0, len(normals), 2048):
        n = normals[start : start + 2048].astype(np.float32)
        d = directions.astype(np.float32)
        facing = n @ d.T
        # (d - 2 (n.d) n) . e, without the array of mirrored directions
        near = (d @ d.T)[None] - 2 * facing[:, :, None] * facing[:, None, :]
        found[start : start + 2048] = near.argmax(axis=2)
    return found


@compiled
def _look(
    seen: Float32,
    facing: Float32,
    triangles: npt.NDArray[np.int32],
    depth: Float32,
    reach: float,
    visible: Float32,
    through: Float32,
) -> None:
    """Draw the depth of a mesh seen from one side (V, 3: x, y in -1..1, z towards the looker), and look
    up which vertices lie in front."""
    size = depth.shape[0]
    depth[:] = -10.0
    half = 0.5 * size
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        ax, ay = (seen[a, 0] + 1.0) * half, (seen[a, 1] + 1.0) * half
        bx, by = (seen[b, 0] + 1.0) * half, (seen[b, 1] + 1.0) * half
        cx, cy = (seen[c, 0] + 1.0) * half, (seen[c, 1] + 1.0) * half
        area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
        if abs(area) < 1e-9:
            continue
        x0, x1 = max(int(min(ax, bx, cx)), 0), min(int(max(ax, bx, cx)) + 1, size - 1)
        y0, y1 = max(int(min(ay, by, cy)), 0), min(int(max(ay, by, cy)) + 1, size - 1)
        for row in range(y0, y1 + 1):
            y = row + 0.5
            for column in range(x0, x1 + 1):
                x = column + 0.5
                u = ((bx - x) * (cy - y) - (cx - x) * (by - y)) / area
                v = ((cx - x) * (ay - y) - (ax - x) * (cy - y)) / area
                w = 1.0 - u - v
                if u < -1e-4 or v < -1e-4 or w < -1e-4:
                    continue
                z = u * seen[a, 2] + v * seen[b, 2] + w * seen[c, 2]
                if z > depth[row, column]:
                    depth[row, column] = z
    pixel = 2.0 * reach / size
    for i in range(len(seen)):
        x, y = (seen[i, 0] + 1.0) * half - 0.5, (seen[i, 1] + 1.0) * half - 0.5
        column, row = min(max(int(x), 0), size - 2), min(max(int(y), 0), size - 2)
        fx, fy = min(max(x - column, 0.0), 1.0), min(max(y - row, 0.0), 1.0)
        free, behind = 0.0, 0.0
        # A surface seen at a slant changes its depth within a pixel.
        slant = pixel * (1.2 + 1.5 / max(abs(facing[i]), 0.15))
        for k in range(4):
            down, right = k // 2, k % 2
            weight = (fx if right else 1.0 - fx) * (fy if down else 1.0 - fy)
            gap = (depth[row + down, column + right] - seen[i, 2]) * reach
            free += weight * min(max(2.0 - gap / slant, 0.0), 1.0)
            if gap > 0.5 * pixel:
                behind += weight * np.exp(-gap / SKIN_DEPTH)
            else:
                behind += weight
        visible[i] = free
        if facing[i] < 0.1:
            through[i] = behind * min(1.0, (0.1 - facing[i]) * 4.0)

"""Finds where outlines of meshes run in a picture: only there must edges be smoothed.

Software OpenGL takes as long to search a whole picture for edges as to draw a face.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fba.arrays import Float32, Float64, Int32, UInt8
from fba.compiled import compiled
from fba_player.gl._resources import RecentlyUsed
from fba_player.view._view import FaceMesh, FaceShape

TILE = 8
"""Size (pixels) of the tiles that are smoothed if an outline runs through them."""
OUTLINE_MARGIN = 1.5
"""Pixels on each side of an outline that may need smoothing."""
CACHED_SHAPES = 512
"""Number of shapes whose edges are cached."""


class Edges(NamedTuple):
    """The edges of a triangulation.

    triangles: (F, 3). ends: (E, 2), vertices. sides: (E, 2), the triangles on both sides, -1 for none.
    """

    triangles: Int32
    ends: Int32
    sides: Int32


def find_edges(triangles: Int32) -> Edges:
    corners = triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    owner = np.repeat(np.arange(len(triangles), dtype=np.int32), 3)
    ordered = np.sort(corners, axis=1)
    order = np.lexsort((ordered[:, 1], ordered[:, 0]))
    ordered, owner = ordered[order], owner[order]
    first = np.ones(len(ordered), dtype=bool)
    first[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    start = np.flatnonzero(first)
    sides = np.full((len(start), 2), -1, dtype=np.int32)
    sides[:, 0] = owner[start]
    uses = np.diff(np.append(start, len(ordered)))
    sides[uses == 2, 1] = owner[start[uses == 2] + 1]
    ends = np.ascontiguousarray(ordered[start], dtype=np.int32)
    # A copy: read-only arrays are another type, for which the loops would be compiled again.
    return Edges(np.array(triangles, dtype=np.int32, order="C"), ends, sides)


def _find_constants(shape: FaceShape) -> tuple[Edges, Float32]:
    """Return the edges of a shape, and a copy of its sway, as of its triangles."""
    triangles = shape.triangles
    if shape.points is not None:  # seams of its picture are no edges of the surface
        _, first, same = np.unique(shape.points, axis=0, return_index=True, return_inverse=True)
        triangles = first[same.ravel()][triangles].astype(np.int32)
    return find_edges(triangles), np.array(shape.sway, dtype=np.float32, order="C")


class Outliner:
    """Finds outlines; caches the edges of shapes.

    `begin` a picture, `add` meshes, and take its `tiles`.
    """

    def __init__(self) -> None:
        self._edges = RecentlyUsed[tuple[Edges, Float32]](CACHED_SHAPES, lambda _: None)
        self._size = (1, 1)
        self._marked = np.zeros((1, 1), dtype=np.uint8)

    def begin(self, size: tuple[int, int]) -> None:
        """Start with an empty picture of this width and height in pixels."""
        shape = (-(-size[1] // TILE), -(-size[0] // TILE))
        if self._marked.shape != shape:
            self._marked = np.zeros(shape, dtype=np.uint8)
        self._marked[:] = 0
        self._size = size

    def add(self, mesh: FaceMesh, matrix: Float64) -> None:
        """Mark the outlines of a mesh. matrix: (4, 4), world to clip space."""
        if not len(mesh.positions):
            return
        if len(mesh.positions) != len(mesh.shape.sway):  # the loops use one index for both
            raise ValueError(
                f"{len(mesh.positions)} positions for a shape of {len(mesh.shape.sway)} vertices"
            )
        edges, sway = self._edges.get(mesh.shape, lambda: _find_constants(mesh.shape))
        _mark(
            np.ascontiguousarray(mesh.positions, dtype=np.float32),
            sway,
            np.asarray(mesh.turn, dtype=np.float64),
            np.asarray(mesh.centre, dtype=np.float64),
            np.ascontiguousarray(matrix @ mesh.matrix, dtype=np.float64),
            self._size,
            edges,
            self._marked,
        )

    def tiles(self) -> Float32:
        """Return float32 (N, 2): middles of all tiles with outlines, -1..1 across the picture."""
        middles = (np.argwhere(self._marked)[:, ::-1] + 0.5) * (2.0 * TILE) / self._size - 1.0
        return np.minimum(middles, 1.0).astype(np.float32)  # OpenGL drops points outside the picture


@compiled
def _project(
    positions: Float32, sway: Float32, turn: Float64, centre: Float64, clip: Float64, size: tuple[int, int]
) -> Float32:
    """Return pixels x, y of vertices (V, 3), turned as in face.vert, and a number below 0 if behind it.

    Bounds: `Outliner.add` checks that there are as many `sway` as positions.
    """
    seen = np.empty((len(positions), 3), dtype=np.float32)
    angle = np.sqrt(turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2])
    axis = turn / max(angle, 1e-12)
    half_wide, half_high = 0.5 * size[0], 0.5 * size[1]
    whole_sine, whole_cosine = np.sin(angle), np.cos(angle)
    for i in range(len(positions)):
        x, y, z = float(positions[i, 0]), float(positions[i, 1]), float(positions[i, 2])
        if angle > 1e-6:
            sine, cosine = whole_sine, whole_cosine
            if sway[i] != 1.0:  # few vertices: sines take longer than everything else
                sine, cosine = np.sin(angle * sway[i]), np.cos(angle * sway[i])
            x, y, z = x - centre[0], y - centre[1], z - centre[2]
            along = (x * axis[0] + y * axis[1] + z * axis[2]) * (1.0 - cosine)
            cross_x = axis[1] * z - axis[2] * y
            cross_y = axis[2] * x - axis[0] * z
            cross_z = axis[0] * y - axis[1] * x
            x = x * cosine + cross_x * sine + axis[0] * along + centre[0]
            y = y * cosine + cross_y * sine + axis[1] * along + centre[1]
            z = z * cosine + cross_z * sine + axis[2] * along + centre[2]
        w = clip[3, 0] * x + clip[3, 1] * y + clip[3, 2] * z + clip[3, 3]
        across = clip[0, 0] * x + clip[0, 1] * y + clip[0, 2] * z + clip[0, 3]
        up = clip[1, 0] * x + clip[1, 1] * y + clip[1, 2] * z + clip[1, 3]
        if not w > 1e-4:
            seen[i, 2] = -1.0
            continue
        seen[i, 0] = half_wide * (1.0 + across / w)
        seen[i, 1] = half_high * (1.0 + up / w)
        seen[i, 2] = 1.0
    return seen


@compiled
def _mark(
    positions: Float32,
    sway: Float32,
    turn: Float64,
    centre: Float64,
    clip: Float64,
    size: tuple[int, int],
    edges: Edges,
    marked: UInt8,
) -> None:
    """Mark the tiles along borders and along edges between a front-facing and a back-facing triangle.

    Bounds: ends and corners are vertices of the shape, of which there are as many as positions; sides are
    its triangles (`find_edges`). `marked` has a tile for each TILE pixels begun, as `begin` makes it. Pixels
    are clamped to 0..size - 1 before they become tiles; edges with pixels that are not finite are skipped
    before: no comparison with a limit holds for them.
    """
    seen = _project(positions, sway, turn, centre, clip, size)
    triangles, ends, sides = edges
    facing = np.empty(len(triangles), dtype=np.int8)
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        ax, ay = seen[a, 0], seen[a, 1]
        area = (seen[b, 0] - ax) * (seen[c, 1] - ay) - (seen[c, 0] - ax) * (seen[b, 1] - ay)
        facing[t] = 2 if abs(area) < 1e-6 else (1 if area > 0.0 else 0)  # 2: edge on, faces neither way
    wide, high, margin = float(size[0]), float(size[1]), OUTLINE_MARGIN
    for e in range(len(ends)):
        a, b = ends[e, 0], ends[e, 1]
        one = facing[sides[e, 0]]
        if one == 2 or (sides[e, 1] >= 0 and (facing[sides[e, 1]] == one or facing[sides[e, 1]] == 2)):
            continue
        if seen[a, 2] < 0.0 or seen[b, 2] < 0.0:
            continue
        ax, ay = float(seen[a, 0]), float(seen[a, 1])
        bx, by = float(seen[b, 0]), float(seen[b, 1])
        outside = (
            max(ax, bx) < -margin
            or max(ay, by) < -margin
            or min(ax, bx) > wide + margin
            or min(ay, by) > high + margin
        )
        length = max(abs(bx - ax), abs(by - ay))
        near = abs(bx - ax) + abs(by - ay) < 8.0 * (wide + high)
        if outside or not (near and length < 4.0 * (wide + high)):
            continue
        left, right = int(max(min(ax, bx) - margin, 0.0)), int(min(max(ax, bx) + margin, wide - 1.0))
        low, top = int(max(min(ay, by) - margin, 0.0)), int(min(max(ay, by) + margin, high - 1.0))
        if right // TILE - left // TILE <= 1 and top // TILE - low // TILE <= 1:  # short, as most edges are
            for row in range(low // TILE, top // TILE + 1):
                for column in range(left // TILE, right // TILE + 1):
                    marked[row, column] = 1
            continue
        steps = int(length / margin) + 1
        for step in range(steps + 1):
            x, y = ax + (bx - ax) * step / steps, ay + (by - ay) * step / steps
            left, right = int(max(x - margin, 0.0)) // TILE, int(min(x + margin, wide - 1.0)) // TILE
            low, top = int(max(y - margin, 0.0)) // TILE, int(min(y + margin, high - 1.0)) // TILE
            for row in range(low, top + 1):
                for column in range(left, right + 1):
                    marked[row, column] = 1

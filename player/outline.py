"""Where the outlines of meshes run in a picture: there, and only there, steps are to be smoothed.

Software OpenGL spends as long on looking for steps in a whole picture as on drawing a face.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fba.compiled import compiled, inlined
from player.shapes import FaceMesh

Float32 = npt.NDArray[np.float32]
Float64 = npt.NDArray[np.float64]
Int32 = npt.NDArray[np.int32]

HALF_WIDTH = 2.0
"""Pixels on each side of an outline."""


class Edges:
    """The edges of a triangulation: ends (E, 2), and the triangles on both sides (E, 2), -1 for none."""

    def __init__(self, triangles: Int32) -> None:
        corners = triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
        owner = np.repeat(np.arange(len(triangles), dtype=np.int32), 3)
        ordered = np.sort(corners, axis=1)
        order = np.lexsort((ordered[:, 1], ordered[:, 0]))
        ordered, owner = ordered[order], owner[order]
        first = np.ones(len(ordered), dtype=bool)
        first[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
        start = np.flatnonzero(first)
        self.ends = np.ascontiguousarray(ordered[start], dtype=np.int32)
        self.sides = np.full((len(start), 2), -1, dtype=np.int32)
        self.sides[:, 0] = owner[start]
        uses = np.diff(np.append(start, len(ordered)))
        self.sides[uses == 2, 1] = owner[start[uses == 2] + 1]
        self.triangles = np.ascontiguousarray(triangles, dtype=np.int32)


class Outliner:
    """Finds outlines; remembers the edges of the shapes that it has seen."""

    MOST_SHAPES = 64

    def __init__(self) -> None:
        self._edges: dict[int, tuple[object, Edges]] = {}

    def outlines(self, meshes: list[FaceMesh], matrix: Float64, size: tuple[int, int]) -> Float32:
        """(N, 2) corners of triangles along all outlines, -1..1 across the picture.

        matrix: (4, 4), world to clip space. size: of the picture in pixels.
        """
        found = []
        for mesh in meshes:
            edges = self._edges_of(mesh)
            angle = float(np.linalg.norm(mesh.turn))
            axis = np.asarray(mesh.turn, dtype=np.float64) / max(angle, 1e-12)
            seen = np.empty((len(mesh.positions), 3), dtype=np.float32)
            clip = np.ascontiguousarray(matrix @ mesh.matrix, dtype=np.float64)
            sway = np.ascontiguousarray(mesh.shape.sway, dtype=np.float32)
            places = np.ascontiguousarray(mesh.positions, dtype=np.float32)
            _project(places, sway, axis, angle, np.asarray(mesh.centre, dtype=np.float64), clip, size, seen)
            facing = np.empty(len(edges.triangles), dtype=np.int8)
            bands = np.empty((len(edges.ends) * 6, 2), dtype=np.float32)
            count = _outline(seen, edges.triangles, edges.ends, edges.sides, size, HALF_WIDTH, facing, bands)
            found.append(bands[:count])
        return np.concatenate(found) if found else np.zeros((0, 2), dtype=np.float32)

    def _edges_of(self, mesh: FaceMesh) -> Edges:
        key = id(mesh.shape)
        if key in self._edges:
            self._edges[key] = self._edges.pop(key)  # now the latest used
        else:
            while len(self._edges) >= self.MOST_SHAPES:
                del self._edges[next(iter(self._edges))]
            self._edges[key] = (mesh.shape, Edges(mesh.shape.triangles))
        return self._edges[key][1]


@compiled
def _project(
    positions: Float32,
    sway: Float32,
    axis: Float64,
    angle: float,
    centre: Float64,
    clip: Float64,
    size: tuple[int, int],
    seen: Float32,
) -> None:
    """Pixels x, y of vertices (V, 3), and w, below 0 behind the camera; turned as face.vert does."""
    half_wide, half_high = 0.5 * size[0], 0.5 * size[1]
    for i in range(len(positions)):
        x, y, z = float(positions[i, 0]), float(positions[i, 1]), float(positions[i, 2])
        if angle > 1e-6:
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


@inlined
def _corner(bands: Float32, at: int, x: float, y: float, size: tuple[int, int]) -> None:
    bands[at, 0] = 2.0 * x / size[0] - 1.0
    bands[at, 1] = 2.0 * y / size[1] - 1.0


@compiled
def _outline(
    seen: Float32,
    triangles: Int32,
    ends: Int32,
    sides: Int32,
    size: tuple[int, int],
    half: float,
    facing: npt.NDArray[np.int8],
    bands: Float32,
) -> int:
    """A band of two triangles along every edge between what faces the camera and what does not, and along
    borders; how many corners."""
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        ax, ay = seen[a, 0], seen[a, 1]
        area = (seen[b, 0] - ax) * (seen[c, 1] - ay) - (seen[c, 0] - ax) * (seen[b, 1] - ay)
        facing[t] = 2 if abs(area) < 1e-6 else (1 if area > 0.0 else 0)  # 2: edge on, faces neither way
    count = 0
    wide, high = float(size[0]), float(size[1])
    for e in range(len(ends)):
        a, b = ends[e, 0], ends[e, 1]
        one = facing[sides[e, 0]]
        if one == 2 or (sides[e, 1] >= 0 and (facing[sides[e, 1]] == one or facing[sides[e, 1]] == 2)):
            continue
        if seen[a, 2] < 0.0 or seen[b, 2] < 0.0:
            continue
        ax, ay = float(seen[a, 0]), float(seen[a, 1])
        bx, by = float(seen[b, 0]), float(seen[b, 1])
        if (
            max(ax, bx) < -half
            or max(ay, by) < -half
            or min(ax, bx) > wide + half
            or min(ay, by) > high + half
        ):
            continue
        dx, dy = bx - ax, by - ay
        length = np.sqrt(dx * dx + dy * dy)
        if not length < 4.0 * (wide + high):
            continue
        if length < 1e-6:
            dx, dy, length = 1.0, 0.0, 1.0
        dx, dy = dx / length * half, dy / length * half
        ax, ay, bx, by = ax - dx, ay - dy, bx + dx, by + dy
        _corner(bands, count, ax - dy, ay + dx, size)
        _corner(bands, count + 1, ax + dy, ay - dx, size)
        _corner(bands, count + 2, bx - dy, by + dx, size)
        _corner(bands, count + 3, bx - dy, by + dx, size)
        _corner(bands, count + 4, ax + dy, ay - dx, size)
        _corner(bands, count + 5, bx + dy, by - dx, size)
        count += 6
    return count

"""A face shown as its feature points: a sphere at each, and thin lines through those that belong together.

Behind them the face itself is drawn in one dull colour, which hides points on its far side.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fba.arrays import Bool, Float32, Float64
from fba.parameters import point_rows
from fba.rotations import unit
from fba_player._figure.face import FaceFigure
from fba_player._mesh.primitives import tube_mesh
from fba_player.scene._skin_lines import SkinLine, skin_lines
from fba_player.view._geometry import transform
from fba_player.view._view import FaceMesh, FaceShape, Mesh, MeshShape, spheres, srgb

POINT = (*srgb("#f0a04b"), 0.3)
POINT_RADIUS = 0.00125
PUPIL_RADIUS = 0.0008
DULL = (*srgb("#8b929c"), 0.12)
EYEBALL = (*srgb("#c9cdd2"), 0.35)
LEFT_OUT = ("lash", "brow", "hair")
INSET = 0.0003
"""Distance of the rims of iris and pupil from the eyeball, metres."""
RAISED = 0.003
AROUND = 8
COLOURS = {
    "lip": srgb("#e0685f"),
    "brow": srgb("#2f2a28"),
    "lid": srgb("#1f3d5c"),
    "fold": srgb("#54708c"),
    "plain": srgb("#d3d8de"),
    "iris": srgb("#2f6f8f"),
    "pupil": srgb("#101418"),
}
RADII = {"lip": 0.0007, "brow": 0.0011, "lid": 0.0006, "fold": 0.0004, "plain": 0.0005, "iris": 0.0005,
         "pupil": 0.0003}  # fmt: skip
RING = 24
"""Number of points on the rim of an iris."""


class PointView:
    """Draws a face's feature points for FAPs (68,) and a matrix (4, 4) into the world."""

    def __init__(self, figure: FaceFigure) -> None:
        self._figure = figure
        self._known: Bool = np.asarray(np.isfinite(figure.model.points).all(axis=1))
        self._dull_shapes: dict[int, FaceShape] = {}

    @cached_property
    def _radii(self) -> Float64:
        """Radii of the feature points that the face has, metres."""
        radii = np.full(len(self._known), POINT_RADIUS)
        radii[[point_rows()["3.5"], point_rows()["3.6"]]] = PUPIL_RADIUS
        return radii[self._known] * self._figure.scale

    @cached_property
    def _lines(self) -> list[SkinLine]:
        return skin_lines(self._figure.model)

    @cached_property
    def _tubes(self) -> _Tubes:
        return _make_tubes([(line.kind, len(line.corners)) for line in self._lines], RAISED)

    @cached_property
    def _rims(self) -> _Tubes:
        return _make_tubes([(kind, RING + 1) for _ in self._figure.eyeballs for kind in ("iris", "pupil")])

    def marks(self, faps: Float32, matrix: Float64) -> Float32:
        """Return float32 (N, 16): capsules, a sphere at each feature point that the face has."""
        return spheres(self._figure.points(faps, matrix)[self._known], self._radii, POINT)

    def eyeballs(self, faps: Float32, matrix: Float64) -> Float32:
        """Return float32 (E, 16): capsules, plain eyeballs."""
        frames = np.array([eye.matrix for eye in self._figure.eyes(faps, matrix)]).reshape(-1, 4, 4)
        return spheres(frames[:, :3, 3], np.linalg.norm(frames[:, :3, 0], axis=1), EYEBALL)

    def dull_face(self, faps: Float32, matrix: Float64, *, on_body: bool = False) -> list[FaceMesh]:
        """Return the face in one dull colour."""
        meshes = []
        for mesh in self._figure.meshes(faps, matrix, on_body=on_body, without=LEFT_OUT):
            if id(mesh.shape) not in self._dull_shapes:
                levels = tuple(replace(level, shape=_dull(level.shape)) for level in mesh.shape.levels)
                self._dull_shapes[id(mesh.shape)] = replace(_dull(mesh.shape), levels=levels)
            meshes.append(mesh._replace(shape=self._dull_shapes[id(mesh.shape)]))
        return meshes

    def meshes(self, faps: Float32, matrix: Float64) -> list[Mesh]:
        """Return the lines, and the rims of irises and pupils."""
        pose = self._figure.pose(faps)
        meshes = []
        if self._lines:
            points = np.concatenate([line.positions(pose.positions) for line in self._lines])
            inside = points.mean(axis=0)
            inside[2] = points[:, 2].min()
            meshes.append(self._tubes.mesh(points, inside, matrix @ pose.turn))
        rings, middle = self._rings(faps, matrix)
        if rings:
            meshes.append(self._rims.mesh(np.concatenate(rings), middle, np.eye(4)))
        return meshes

    def _rings(self, faps: Float32, matrix: Float64) -> tuple[list[Float64], Float64]:
        """Return the rims of irises and pupils in the world, (RING + 1, 3) each, and a point behind them."""
        turn = np.linspace(0, 2 * np.pi, RING + 1)
        rings, behind = [], np.zeros(3)
        for eye in self._figure.eyes(faps, matrix):
            radius = float(np.linalg.norm(eye.matrix[:3, 0]))
            behind = eye.matrix[:3, 3] - eye.axes[:, 2]
            for share in (eye.iris, eye.pupil):
                ring = [np.cos(turn) * share, np.sin(turn) * share, np.full(len(turn), np.sqrt(1 - share**2))]
                local = np.stack(ring, axis=1) * (1 + INSET / radius)
                rings.append(transform(local, eye.matrix))
        return rings, behind


@dataclass(frozen=True, eq=False)
class _Tubes:
    """Tubes along lines. lengths: points of each line. radii: (N,), at all points. shape: of all."""

    lengths: tuple[int, ...]
    radii: Float64
    shape: MeshShape

    def mesh(self, points: Float64, inside: Float64, matrix: Float64) -> Mesh:
        """Return the tubes along the points (N, 3) of all lines in turn. inside: a point deep in the head."""
        along = np.concatenate([
            np.gradient(line, axis=0) for line in np.split(points, np.cumsum(self.lengths)[:-1])
        ])  # fmt: skip
        # Lines lie on the head, so the direction out of it is never along one.
        aside = unit(np.cross(along, points - inside))
        out = unit(np.cross(aside, along))
        turn = np.linspace(0, 2 * np.pi, AROUND, endpoint=False)
        normals = aside[:, None] * np.cos(turn)[:, None] + out[:, None] * np.sin(turn)[:, None]
        positions = points[:, None] + normals * self.radii[:, None, None]
        flat = [part.reshape(-1, 3).astype(np.float32) for part in (positions, normals)]
        return Mesh(self.shape, flat[0], flat[1], matrix)


def _make_tubes(lines: list[tuple[str, int]], raised: float = 0.0) -> _Tubes:
    """Return the tubes for lines, given as (kind, number of points). raised: as in `MeshShape`."""
    lengths = tuple(count for _, count in lines)
    radii = np.concatenate([np.zeros(0), *(np.full(count, RADII[kind]) for kind, count in lines)])
    colours = [np.tile([*COLOURS[kind], 0.0], (count * AROUND, 1)) for kind, count in lines]
    starts = np.cumsum([0, *lengths[:-1]]) * AROUND
    triangles = [tube_mesh(n, AROUND) + start for n, start in zip(lengths, starts, strict=False)]
    shape = MeshShape(
        np.concatenate([np.zeros((0, 3)), *triangles]).astype(np.int32),
        np.concatenate([np.zeros((0, 4)), *colours]).astype(np.float32),
        two_sided=True,
        raised=raised,
    )
    return _Tubes(lengths, radii, shape)


def _dull(shape: FaceShape) -> FaceShape:
    """Return the shape in one dull colour."""
    colours = np.tile(np.array(DULL, dtype=np.float32), (len(shape.colours), 1))
    return replace(shape, colours=colours, picture=None, scatter=0.0, fine=(0.0, 1.0))

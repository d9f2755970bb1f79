"""Vertices of face meshes in the world, as the shader `face.vert` computes them; rotations, shifts, rays."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from fba.arrays import Float32, Float64, Floating
from fba.rotations import quaternions, unit
from fba_player.view._camera import Camera
from fba_player.view._view import FaceMesh

Box = tuple[float, float, float, float]
"""Left, top, right and bottom of an upright rectangle."""


def world_positions(mesh: FaceMesh) -> Float32:
    """Return float32 (V, 3): the mesh's positions in the world."""
    turned = turn_partly(mesh.positions, mesh.shape.sway, mesh.turn, mesh.centre)
    return transform(turned, mesh.matrix).astype(np.float32)


def world_normals(mesh: FaceMesh) -> Float32:
    """Return float32 (V, 3): the mesh's unit normals in the world."""
    turned = turn_partly(mesh.normals, mesh.shape.sway, mesh.turn, np.zeros(3)) @ mesh.matrix[:3, :3].T
    return unit(turned).astype(np.float32)


def transform(points: Floating, matrix: Float64) -> Float64:
    """Return points (..., 3), moved by a matrix (4, 4)."""
    moved: Float64 = points @ matrix[:3, :3].T + matrix[:3, 3]
    return moved


def turn_partly(positions: Floating, sway: Floating, turn: Float64, centre: Float64) -> Float64:
    """Return float64 (V, 3): positions turned about `centre` (3,), each by its share `sway` (V,) of `turn`.

    turn: (3,), the axis of a rotation times its angle.
    """
    start = positions.astype(np.float64)
    angle = float(np.linalg.norm(turn))
    if angle < 1e-6:
        return start
    axis, arm = turn / angle, start - centre
    angles = angle * sway.astype(np.float64)[:, None]
    along = (arm @ axis)[:, None] * axis
    turned: Float64 = (
        arm * np.cos(angles) + np.cross(axis, arm) * np.sin(angles) + along * (1 - np.cos(angles)) + centre
    )
    return turned


def rotation_vector(matrix: Float64) -> Float64:
    """Return (3,): the axis of a rotation matrix (3, 3) times its angle, 0..pi."""
    q = quaternions(matrix)  # exact near half a turn, too
    sine = float(np.linalg.norm(q[1:]))
    if sine < 1e-12:
        return np.zeros(3)
    angle = 2 * np.arctan2(sine, abs(q[0])) * (1 if q[0] >= 0 else -1)
    vector: Float64 = q[1:] / sine * angle
    return vector


def translation(offset: npt.ArrayLike) -> Float64:
    """Return (4, 4) matrix of a translation by (3,)."""
    matrix = np.eye(4)
    matrix[:3, 3] = offset
    return matrix


def project(points: Float64, matrix: Float64, size: tuple[int, int]) -> tuple[Float64, Float64]:
    """Return pixels (N, 2) from the upper left, and depths (N,), 0..1, of points (N, 3).

    Points behind the camera get NaN. matrix: (4, 4), world to clip space. size: of the picture in pixels.
    """
    clip = np.column_stack([points, np.ones(len(points))]) @ matrix.T
    clip[clip[:, 3] < 1e-6] = np.nan
    flat = clip[:, :3] / clip[:, 3:]
    return (flat[:, :2] * (0.5, -0.5) + 0.5) * size, flat[:, 2] * 0.5 + 0.5


def ray_through(camera: Camera, x: float, y: float, size: tuple[int, int]) -> tuple[Float64, Float64]:
    """Return (origin (3,), unit direction (3,)) of the ray through a pixel, in the world.

    x, y: in pixels from the upper left corner of a picture of this size.
    """
    tall = math.tan(math.radians(camera.field_of_view) / 2)
    right = (2 * x / size[0] - 1) * tall * size[0] / size[1]
    up = (1 - 2 * y / size[1]) * tall
    direction = np.array([right, up, -1.0]) @ camera.view_matrix()[:3, :3]
    return camera.eye, direction / np.linalg.norm(direction)


def overlap(first: Box, second: Box) -> float:
    """Return the area that two boxes share."""
    wide = min(first[2], second[2]) - max(first[0], second[0])
    high = min(first[3], second[3]) - max(first[1], second[1])
    return max(wide, 0.0) * max(high, 0.0)


def first_hit(origin: Float64, direction: Float64, corners: Float64) -> tuple[int, Float64] | None:
    """Return (number of the first triangle that a ray meets, the shares (3,) of its corners there), or None.

    corners: float64 (F, 3, 3). Both sides of a triangle count. After Moeller and Trumbore (1997).
    """
    start = corners[:, 0]
    first, second = corners[:, 1] - start, corners[:, 2] - start
    across = np.cross(direction, second)
    volume = np.einsum("ij,ij->i", first, across)
    with np.errstate(divide="ignore", invalid="ignore"):
        inverse = 1.0 / volume
        arm = origin - start
        u = np.einsum("ij,ij->i", arm, across) * inverse
        aside = np.cross(arm, first)
        v = (aside @ direction) * inverse
        away = np.einsum("ij,ij->i", second, aside) * inverse
        met = (u >= 0) & (v >= 0) & (u + v <= 1) & (away > 0) & np.isfinite(away)
    if not met.any():
        return None
    hit = int(np.where(met, away, np.inf).argmin())
    return hit, np.array([1.0 - u[hit] - v[hit], u[hit], v[hit]])

"""Where the vertices of a face stand in the world, as the shader `face.vert` puts them there."""

from __future__ import annotations

import numpy as np

from fba.arrays import Float32, Float64
from fba_player.view.view import FaceMesh


def places(mesh: FaceMesh) -> Float32:
    """(V, 3) positions in the world."""
    at = swayed(mesh.positions, mesh.shape.sway, mesh.turn, mesh.centre)
    world: Float32 = (at @ mesh.matrix[:3, :3].T + mesh.matrix[:3, 3]).astype(np.float32)
    return world


def directions(mesh: FaceMesh) -> Float32:
    """(V, 3) unit normals in the world."""
    turned = swayed(mesh.normals, mesh.shape.sway, mesh.turn, np.zeros(3)) @ mesh.matrix[:3, :3].T
    length = np.linalg.norm(turned, axis=1, keepdims=True)
    unit: Float32 = (turned / np.maximum(length, 1e-20)).astype(np.float32)
    return unit


def swayed(positions: Float32, sway: Float32, turn: Float64, centre: Float64) -> Float64:
    """(V, 3) turned about the centre by share (V,) of a rotation, given as its axis times its angle."""
    at = positions.astype(np.float64)
    angle = float(np.linalg.norm(turn))
    if angle < 1e-6:
        return at
    axis, arm = turn / angle, at - centre
    angles = angle * sway.astype(np.float64)[:, None]
    along = (arm @ axis)[:, None] * axis
    turned: Float64 = (
        arm * np.cos(angles) + np.cross(axis, arm) * np.sin(angles) + along * (1 - np.cos(angles)) + centre
    )
    return turned

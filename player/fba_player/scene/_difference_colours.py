"""Colours figures by how far they are from another one that makes the same performance."""

from __future__ import annotations

import math
from collections.abc import Sequence
from weakref import WeakKeyDictionary

import numpy as np

from fba.arrays import Float32, Float64
from fba_player._mesh.textures import linear_light
from fba_player.scene._fap_heatmap import GLOSS, heat_colours, plain_colours
from fba_player.view._geometry import transform, turn_partly
from fba_player.view._view import FaceMesh, FaceShape

LEAST = 1e-5
"""The last colour stands for at least this distance (m)."""


class DifferenceColours:
    """Paints the parts of a figure by their distance from the same parts of another.

    Parts that the other does not have, by name and number of vertices, have the colour of 0.
    """

    def __init__(self) -> None:
        self._shapes: WeakKeyDictionary[FaceShape, FaceShape] = WeakKeyDictionary()

    def paint(
        self, meshes: Sequence[FaceMesh], others: Sequence[FaceMesh], offset: Float64, most: float
    ) -> list[FaceMesh]:
        """Return the meshes in colours.

        offset: (3,), added to the others' places, metres. most: the distance of the last colour, metres.
        """
        painted = []
        for mesh, away in zip(meshes, distances(meshes, others, offset), strict=True):
            if mesh.shape not in self._shapes:
                grey = np.full((len(mesh.positions), 4), GLOSS, dtype=np.float32)
                self._shapes[mesh.shape] = plain_colours(mesh.shape, grey)
            shape = self._shapes[mesh.shape]
            looks = shape.looks.copy()
            looks[:, :3] = linear_light(heat_colours(np.minimum(away / most, 1.0)))
            painted.append(mesh._replace(shape=shape, looks=looks))
        return painted


def distances(meshes: Sequence[FaceMesh], others: Sequence[FaceMesh], offset: Float64) -> list[Float32]:
    """Return how far the vertices (V,) of each mesh are from those of the same part, metres; 0 without."""
    parts = {(mesh.shape.name, mesh.shape.kind, len(mesh.positions)): mesh for mesh in others}
    result = []
    for mesh in meshes:
        other = parts.get((mesh.shape.name, mesh.shape.kind, len(mesh.positions)))
        away = np.zeros(len(mesh.positions))
        if other is not None:
            away = np.linalg.norm(_places(mesh) - _places(other) - offset, axis=1)
        result.append(away.astype(np.float32))
    return result


def round_up(distance: float) -> float:
    """Return the next of 1, 2, 5, 10... times a power of ten, metres."""
    power = 10.0 ** math.floor(math.log10(max(distance, LEAST)))
    return next(step * power for step in (1, 2, 5, 10) if step * power >= max(distance, LEAST) * 0.999)


def _places(mesh: FaceMesh) -> Float64:
    turned = turn_partly(mesh.positions, mesh.shape.sway, mesh.turn, mesh.centre)
    return transform(turned, mesh.matrix)

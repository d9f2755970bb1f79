"""The base figure from `figure.npz`, which `extract.py` makes, and its head."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from fba.arrays import Bool, Float64, Int64, Integer
from tools.figure.meshes import unique_edges

FILE = Path(__file__).parent / "data" / "figure.npz"
EYE_LEVEL = 1.65
"""Metres above the ground: the origin of the figure's head while it is worked on."""


@dataclass(frozen=True, eq=False)
class Surface:
    """Quads over vertices, with texture coordinates for every corner.

    vertices: (V, 3), metres. quads: (F, 4). corners: (F, 4), rows of uvs. uvs: (U, 2), origin at the
    bottom left; the whole-number part of u is the texture: 0 head, 1 inside of mouth and eyes.
    """

    vertices: Float64
    quads: Int64
    corners: Int64
    uvs: Float64

    @cached_property
    def tile(self) -> Int64:
        """(F,) the texture that each quad is on."""
        return np.floor(self.uvs[self.corners].mean(axis=1)[:, 0]).astype(np.int64)

    @cached_property
    def edges(self) -> Int64:
        """(E, 2) the edges, each once, smaller vertex first."""
        return unique_edges(self.quads)

    def select(self, faces: Bool) -> Surface:
        """Return the surface of some faces (mask (F,)) and the vertices that they use."""
        used, quads = np.unique(self.quads[faces], return_inverse=True)
        used_uvs, corners = np.unique(self.corners[faces], return_inverse=True)
        return Surface(self.vertices[used], quads.reshape(-1, 4), corners.reshape(-1, 4), self.uvs[used_uvs])

    def rings(self, start: Integer, most: int) -> Int64:
        """Return (V,) number of edges from the start vertices, -1 beyond `most`."""
        distance = np.full(len(self.vertices), -1, dtype=np.int64)
        distance[start] = 0
        front = np.zeros(len(self.vertices), dtype=bool)
        front[start] = True
        for ring in range(1, most + 1):
            touched = np.zeros_like(front)
            touched[self.edges[front[self.edges[:, 0]], 1]] = True
            touched[self.edges[front[self.edges[:, 1]], 0]] = True
            front = touched & (distance < 0)
            distance[front] = ring
        return distance

    def vertices_of(self, faces: Bool) -> Bool:
        """Return (V,) mask of the vertices that any of the faces uses."""
        used = np.zeros(len(self.vertices), dtype=bool)
        used[self.quads[faces]] = True
        return used


def load() -> tuple[Surface, dict[str, np.ndarray]]:
    """Return the figure, 1.76 m tall, standing on y = 0, and its joints and weights by name."""
    data = dict(np.load(FILE))
    surface = Surface(
        data.pop("vertices").astype(np.float64),
        data.pop("quads").astype(np.int64),
        data.pop("corners").astype(np.int64),
        data.pop("uvs").astype(np.float64),
    )
    return surface, data


def head() -> Surface:
    """Return head, neck and the top of the shoulders, with the inside of mouth and eye sockets.

    Origin on the midline at `EYE_LEVEL`.
    """
    figure, _ = load()
    high = (figure.vertices[figure.quads][:, :, 1] > EYE_LEVEL - 0.12).all(axis=1)
    head = figure.select((figure.tile == 0) | ((figure.tile == 1) & high))
    return replace(head, vertices=head.vertices - (0.0, EYE_LEVEL, 0.0))

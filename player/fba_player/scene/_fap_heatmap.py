"""Colours a face by how far a FAP moves each vertex."""

from __future__ import annotations

from dataclasses import replace
from functools import cache, cached_property
from weakref import WeakKeyDictionary

import numpy as np

from fba.arrays import Float32, Float64, Floating
from fba.parameters import FAP_COUNT, faps
from fba.text_files import packaged_rows
from fba_player._figure.face import FaceFigure
from fba_player._mesh.primitives import sphere_mesh
from fba_player._mesh.textures import linear_light
from fba_player.view._geometry import rotation_vector, turn_partly
from fba_player.view._view import Eye, FaceMesh, FaceShape, Legend, Mesh, MeshShape

MEASURED_STEPS = 100
"""Value of a FAP with a unit of length: about a tenth of the unit."""
MEASURED_ANGLE = 10_000
"""Value of a FAP that is an angle: 0.1 rad."""
GLOSS = 0.15
"""Of painted surfaces."""
SHADES = 33
"""Number of colours in the legend."""
MIN_MOVEMENT = 1e-6
"""Movements smaller than this (m) count as 0."""


class FapHeatmap:
    """The movement of a face's vertices by one FAP. number: 3..68, measured at `value`, which is positive."""

    def __init__(self, figure: FaceFigure, number: int) -> None:
        self._figure = figure
        self.fap = faps()[number - 1]
        self.value = MEASURED_ANGLE if self.fap.unit == "AU" else MEASURED_STEPS
        self._values = np.zeros(FAP_COUNT, dtype=np.float32)
        self._values[number - 1] = self.value
        self._shapes: WeakKeyDictionary[FaceShape, FaceShape] = WeakKeyDictionary()
        self._balls: dict[int, MeshShape] = {}

    @property
    def legend(self) -> Legend:
        """A legend of the colours in millimetres."""
        unit = "0.1 rad" if self.fap.unit == "AU" else f"+{self.value} steps of {self.fap.unit}/1024"
        moved = f"mm moved by {unit}" if self.most > MIN_MOVEMENT else "moves no vertex of this face"
        return heat_legend(self.fap.label, moved, self.most * 1000)

    def paint(self, meshes: list[FaceMesh]) -> list[FaceMesh]:
        """Return the meshes in these colours; parts that are not the face's get the colour of 0."""
        return [mesh._replace(shape=self._shape(mesh)) for mesh in meshes]

    def eyes(self, eyes: list[Eye]) -> list[Mesh]:
        """Return the eyeballs as meshes in these colours."""
        vertices, _ = sphere_mesh()
        meshes = []
        for number, eye in enumerate(eyes):
            if number not in self._balls:
                self._balls[number] = self._ball(number, vertices)
            meshes.append(Mesh(self._balls[number], vertices, vertices, eye.matrix))
        return meshes

    @cached_property
    def most(self) -> float:
        """The largest movement, metres."""
        return float(self.distances.max(initial=0.0))

    @cached_property
    def distances(self) -> Float32:
        """float32 (V,): metres between the neutral face and the face with the FAP, with the neck bent."""
        figure = self._figure
        neutral, moved = figure.pose(np.zeros_like(self._values)).positions, figure.pose(self._values)
        turn = rotation_vector(moved.turn[:3, :3])
        turned = turn_partly(moved.positions, figure.sway, turn, figure.centre)
        return np.asarray(np.linalg.norm(turned - neutral, axis=1), dtype=np.float32)

    def _shape(self, mesh: FaceMesh) -> FaceShape:
        shape = mesh.shape
        if shape not in self._shapes:
            colours = np.full((len(mesh.positions), 4), GLOSS, dtype=np.float32)
            colours[:, :3] = self._colours(self._part_distances(shape, len(mesh.positions)))
            self._shapes[shape] = plain_colours(shape, colours)
        return self._shapes[shape]

    def _part_distances(self, shape: FaceShape, count: int) -> Float32:
        """Return float32 (count,): the movement of a part's vertices; 0 for a part that is not the face's."""
        if shape.name not in self._figure.model.starts:
            return np.zeros(count, dtype=np.float32)
        distances = self.distances[self._figure.rows(shape.name)]
        return distances if len(distances) == count else np.zeros(count, dtype=np.float32)

    def _ball(self, number: int, vertices: Float32) -> MeshShape:
        """Return an eyeball coloured by the movement of its points."""
        still = self._figure.eyes(np.zeros_like(self._values), np.eye(4))[number].matrix
        moved = self._figure.eyes(self._values, np.eye(4))[number].matrix
        away = np.linalg.norm(vertices @ (moved - still)[:3, :3].T + (moved - still)[:3, 3], axis=1)
        colours = np.full((len(vertices), 4), GLOSS, dtype=np.float32)
        colours[:, :3] = self._colours(away.astype(np.float32))
        return MeshShape(sphere_mesh()[1], colours, two_sided=True)

    def _colours(self, distances: Float32) -> Float64:
        share = distances / max(self.most, MIN_MOVEMENT)
        share[distances <= MIN_MOVEMENT] = 0.0
        return linear_light(heat_colours(share))


def plain_colours(shape: FaceShape, colours: Float32) -> FaceShape:
    """Return the shape in these colours alone, without picture, relief and levels of detail."""
    return replace(
        shape,
        colours=colours,
        picture=None,
        scatter=0.0,
        fine=(0.0, 1.0),
        across=None,
        coarser=None,
        levels=(),
    )


def heat_legend(title: str, unit: str, most: float) -> Legend:
    """Return the legend of heat colours for values from 0 to `most`."""
    return Legend(title, unit, most, tuple(map(tuple, heat_colours(np.linspace(0, 1, SHADES)).tolist())))


def heat_colours(shares: Floating) -> Float64:
    """Return float64 (N, 3): colours (sRGB, 0..1) for shares 0..1 of the largest movement."""
    table = _table()
    columns = [np.interp(shares, table[:, 0], table[:, column]) for column in (1, 2, 3)]
    return np.stack(columns, axis=-1)


@cache
def _table() -> Float64:
    rows = packaged_rows(__package__, "influence.csv")
    return np.array([list(row.values()) for row in rows], dtype=np.float64)

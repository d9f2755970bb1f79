"""A face model as the player shows it: turns FAPs into meshes, eyes and feature points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from fba.arrays import Float32, Float64
from fba.face import Deformer, FaceModel, Part
from fba.face.model import point_row
from fba.parameters import FAP_COUNT
from fba_player._figure._eyeball import Eyeball, find_eyeball
from fba_player._figure._face_parts import (
    compute_sway,
    detail_levels,
    known_middle,
    make_shape,
    part_rows,
    with_triangles,
)
from fba_player._figure.face_light import MOUTH_OPEN, FaceLight
from fba_player._figure.model_units import EYES_APART
from fba_player._figure.wrinkles import place_wrinkles, wrinkle_strengths
from fba_player.view._geometry import rotation_vector, transform
from fba_player.view._view import Eye, FaceMesh, FaceShape
from fba_player.view.camera import Subject

MIN_SWAY_ON_BODY = 0.45
"""On a body, vertices that turn with the head by less than this share are left out: the body has a neck."""

GRIMACE = {19: 1024, 20: 1024, 31: 300, 32: 300, 35: 200, 36: 200, 12: 300, 13: 300, 59: 300, 60: 300,
           6: 200, 7: 200, 53: 200, 54: 200}  # fmt: skip
"""FAPs that close the eyes, raise the brows and widen the mouth: a pose that levels of detail preserve."""


@dataclass(frozen=True, eq=False)
class Pose:
    """The face for FAPs (68,): positions and normals, float32 (V, 3), without the head's turn (4, 4)."""

    faps: Float32
    positions: Float32
    normals: Float32
    turn: Float64


@dataclass(eq=False)
class FaceFigure:
    """A face model ready to be shown; see `build_figure`.

    sway: float32 (V,), how far each vertex turns with the head, whose rotation is about `centre` (3,).
    shapes: all parts but the eyeballs, by name.
    """

    model: FaceModel
    deformer: Deformer
    sway: Float32
    centre: Float64
    shapes: dict[str, FaceShape]
    eyeballs: list[tuple[Part, Eyeball]]
    light: FaceLight
    _pose: Pose | None = field(default=None, init=False)

    @property
    def scale(self) -> float:
        """Size of the face: 1 if the eyes are as far apart as an adult's."""
        return self.model.fapu.ES * 1024 / EYES_APART

    @cached_property
    def between_eyes(self) -> Float64:
        """(3,) the point between the pupils, metres, in the frame of the model."""
        return np.asarray(self.model.points[[point_row("3.5"), point_row("3.6")]].mean(axis=0))

    @cached_property
    def subject(self) -> Subject:
        """What a camera should have in view: the head from its top to the upper chest."""
        model = self.model
        head = np.concatenate([part.vertices for part in model.of_kind("skin") or model.parts])
        chin = known_middle(model, ("2.10", "2.1"))
        tall = model.fapu.ENS * 1024 * 5.2
        top = float(head[:, 1].max())
        low = float(chin[1]) if chin is not None else top - tall
        if not 0.5 * tall < top - low < 2 * tall:  # high hair, a hat, or a body below
            top = low + tall
        x, _, z = self.between_eyes
        centre = (float(x), (top + low) / 2 - 0.07 * (top - low), float(z) - 0.3 * (top - low))
        return Subject(centre, 0.71 * (top - low), 0.60 * (top - low))

    def pose(self, faps: Float32) -> Pose:
        """Return the face for FAPs (68,); the last one is cached."""
        if self._pose is None or not np.array_equal(self._pose.faps, faps):
            self._pose = self._posed(faps.copy())
        return self._pose

    def _posed(self, faps: Float32) -> Pose:
        normals = np.empty((len(self.model.vertices), 3), dtype=np.float32)
        positions = self.deformer.local(faps, out=np.empty_like(normals), normals=normals)
        return Pose(faps, positions, normals, self.deformer.head_matrices(faps))

    def meshes(
        self, faps: Float32, matrix: Float64, *, on_body: bool = False, without: Sequence[str] = ()
    ) -> list[FaceMesh]:
        """Return all parts but the eyeballs for FAPs (68,); matrix: (4, 4), into the world.

        on_body: whether to leave out the lower neck and shoulders. without: kinds of parts to leave out.
        """
        pose = self.pose(faps)
        light = self.light.shade(pose.positions, pose.turn[:3, :3], matrix[:3, :3])
        axis = rotation_vector(pose.turn[:3, :3])
        wrinkles = wrinkle_strengths(faps)
        meshes = []
        for name, shape in (self._shapes_on_body if on_body else self.shapes).items():
            if self.model.part(name).kind in without or not len(shape.triangles):
                continue
            rows = self.rows(name)
            part = pose.positions[rows], pose.normals[rows], light[rows]
            meshes.append(FaceMesh(shape, *part, matrix, axis, self.centre, wrinkles=wrinkles))
        return meshes

    def rows(self, name: str) -> slice:
        """Return the slice of a part's vertices in the arrays of the model; KeyError for an unknown name."""
        return part_rows(self.model, name)

    def shade(self, faps: Float32, frame: Float64) -> Float32:
        """Return float32 (V, 4), the light that reaches the model's vertices, as in `FaceMesh.light`.

        frame: (4, 4), the turned head's frame into the world.
        """
        return self.light.shade(self.pose(faps).positions, np.eye(3), frame[:3, :3])

    def eyes(self, faps: Float32, matrix: Float64, *, turned: bool = False) -> list[Eye]:
        """Return the eyeballs for FAPs (68,); matrix: (4, 4), into the world.

        turned: whether the matrix contains the head's turn already.
        """
        pose = self.pose(faps)
        placed = matrix if turned else matrix @ pose.turn
        return [
            ball.pose(pose.positions[self.rows(part.name)], pose.positions, faps, placed)
            for part, ball in self.eyeballs
        ]

    def points(self, faps: Float32, matrix: Float64) -> Float64:
        """Return float64 (84, 3): feature points in the world for FAPs (68,); NaN for missing ones."""
        return transform(self.deformer.feature_points(faps), matrix)

    @cached_property
    def _shapes_on_body(self) -> dict[str, FaceShape]:
        """The parts without the lower neck and shoulders."""
        shapes = {}
        for name, shape in self.shapes.items():
            above = (shape.sway[shape.triangles] > MIN_SWAY_ON_BODY).all(axis=1)
            if above.any():
                shapes[name] = with_triangles(shape, shape.triangles[above])
        return shapes


def build_figure(model: FaceModel) -> FaceFigure:
    """Return a figure of any face. Its occlusion is computed on first use, in about a second."""
    deformer, sway = Deformer(model), compute_sway(model)
    extremes = [_extreme_positions(deformer, faps) for faps in ({}, MOUTH_OPEN, GRIMACE)]
    shapes, eyeballs = {}, []
    for part in model.parts:
        eyeball = find_eyeball(part, model) if part.kind == "eye" else None
        if eyeball is not None:
            eyeballs.append((part, eyeball))
            continue
        rows = part_rows(model, part.name)
        shape = replace(make_shape(part, sway[rows]), wrinkle_places=place_wrinkles(model, part))
        if shape.across is None:  # single hairs are not simplified
            shape = replace(shape, coarser=detail_levels(part, [positions[rows] for positions in extremes]))
        shapes[part.name] = shape
    light = FaceLight(model, deformer, sway)
    return FaceFigure(model, deformer, sway, _head_centre(model), shapes, eyeballs, light)


def _extreme_positions(deformer: Deformer, faps: dict[int, int]) -> Float32:
    """Return float32 (V, 3): the face for values by FAP number, without the head's turn."""
    values = np.zeros(FAP_COUNT, dtype=np.float32)
    for number, value in faps.items():
        values[number - 1] = value
    return deformer.local(values)


def _head_centre(model: FaceModel) -> Float64:
    """Return (3,): the centre of the head's rotation in its tables; the origin if they do not turn it."""
    tables = [model.table_of[number] for number in (48, 49, 50) if number in model.table_of]
    for part in (one for table in tables for one in table.transforms):
        if part.kind == "rotation":
            return np.array(part.centre)
    return np.zeros(3)

"""A face model as the player shows it: turns FAPs into meshes, eyes and feature points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fba.arrays import Float32, Float64
from fba.face.deform.deformer import Deformer
from fba.face.model import FaceModel, Part, point_row
from fba.parameters import FAP_COUNT
from fba_player.figure._eyeball import Eyeball, find_eyeball
from fba_player.figure._face_parts import (
    compute_sway,
    detail_levels,
    known_middle,
    make_shape,
    with_triangles,
)
from fba_player.figure.face_light import MOUTH_OPEN, FaceLight
from fba_player.view.camera import Subject
from fba_player.view.geometry import rotation_vector
from fba_player.view.view import Eye, FaceMesh, FaceShape

CUT = 0.45
"""On a body, what turns with the head by less than this is left out: the body has its own neck."""

GRIMACE = {19: 1024, 20: 1024, 31: 300, 32: 300, 35: 200, 36: 200, 12: 300, 13: 300, 59: 300, 60: 300,
           6: 200, 7: 200, 53: 200, 54: 200}  # fmt: skip
"""FAPs that close the eyes, raise the brows and widen the mouth: a pose that levels of detail preserve."""
EYES_APART = 0.062
"""Distance between an adult's pupils, metres."""


@dataclass(frozen=True, eq=False)
class Pose:
    """The face for one set of FAPs (68,): positions and normals, float32 (V, 3), without the head's turn
    (4, 4)."""

    faps: Float32
    positions: Float32
    normals: Float32
    turn: Float64


class FaceFigure:
    """A face model ready to be shown.

    model: any face. Its occlusion is computed on first use, in about a second. sway: float32 (V,), how far
    each vertex turns with the head, whose rotation is about `centre` (3,).
    """

    def __init__(self, model: FaceModel) -> None:
        self.model = model
        self.deformer = Deformer(model)
        self._pose: Pose | None = None
        self._ranges = {
            part.name: slice(model.starts[part.name], model.starts[part.name] + len(part.vertices))
            for part in model.parts
        }
        self._eyeballs: list[tuple[Part, Eyeball]] = []
        self._shapes: dict[str, FaceShape] = {}
        self._extremes: dict[tuple[int, ...], Float32] = {}
        sways = compute_sway(model)
        for part in model.parts:
            ball = find_eyeball(part, model) if part.kind == "eye" else None
            if ball is None:
                self._shapes[part.name] = self._shape(part, sways[self._ranges[part.name]])
            else:
                self._eyeballs.append((part, ball))
        self._extremes.clear()
        self._cut: dict[str, FaceShape] = {}
        self.sway = sways
        self.centre = _head_centre(model)
        self._light = FaceLight(model, self.deformer, sways)

    def _shape(self, part: Part, sways: Float32) -> FaceShape:
        shape = make_shape(part, sways)
        if shape.across is not None:  # single hairs are not simplified
            return shape
        rows = self._ranges[part.name]
        poses = [self._extreme(faps)[rows] for faps in ({}, MOUTH_OPEN, GRIMACE)]
        return replace(shape, coarser=detail_levels(part, poses))

    def _extreme(self, faps: dict[int, int]) -> Float32:
        """float32 (V, 3): the face for values by FAP number, without the head's turn."""
        key = tuple(faps)
        if key not in self._extremes:
            values = np.zeros(FAP_COUNT, dtype=np.float32)
            for number, value in faps.items():
                values[number - 1] = value
            self._extremes[key] = self.deformer.local(values)
        return self._extremes[key]

    @property
    def scale(self) -> float:
        """Size of the face: 1 if the eyes are as far apart as an adult's."""
        return self.model.fapu.ES * 1024 / EYES_APART

    @cached_property
    def between_eyes(self) -> Float64:
        """(3,) the point between the pupils, metres, in the frame of the model."""
        eyes = [self.model.points[point_row(name)] for name in ("3.5", "3.6")]
        middle: Float64 = np.mean(eyes, axis=0)
        return middle

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
        """The face for FAPs (68,); the last pose is kept."""
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
        """All parts but the eyeballs for FAPs (68,); matrix: (4, 4), into the world.

        on_body: whether to leave out the lower neck and shoulders. without: kinds of parts to leave out.
        """
        pose = self.pose(faps)
        light = self._light.shade(pose.positions, pose.turn[:3, :3], matrix[:3, :3])
        axis = rotation_vector(pose.turn[:3, :3])
        found = []
        for name, shape in (self._on_body() if on_body else self._shapes).items():
            if self.model.part(name).kind in without or not len(shape.triangles):
                continue
            rows = self._ranges[name]
            positions, normals = pose.positions[rows], pose.normals[rows]
            found.append(FaceMesh(shape, positions, normals, light[rows], matrix, axis, self.centre))
        return found

    @property
    def shapes(self) -> dict[str, FaceShape]:
        """All parts but the eyeballs, by name."""
        return self._shapes

    def rows(self, name: str) -> slice:
        """The slice of a part's vertices in the arrays of the model."""
        return self._ranges[name]

    def shade(self, faps: Float32, frame: Float64) -> Float32:
        """float32 (V, 4), the light that reaches the model's vertices, as in `FaceMesh.light`.

        frame: (4, 4), the turned head's frame into the world.
        """
        return self._light.shade(self.pose(faps).positions, np.eye(3), frame[:3, :3])

    def eyes(self, faps: Float32, matrix: Float64, *, turned: bool = False) -> list[Eye]:
        """The eyeballs for FAPs (68,); matrix: (4, 4), into the world.

        turned: whether the matrix contains the head's turn already.
        """
        pose = self.pose(faps)
        placed = matrix if turned else matrix @ pose.turn
        return [
            ball.pose(pose.positions[self._ranges[part.name]], pose.positions, faps, placed)
            for part, ball in self._eyeballs
        ]

    def points(self, faps: Float32, matrix: Float64) -> Float64:
        """float64 (84, 3): feature points in the world for FAPs (68,); NaN for those that the face lacks."""
        places = self.deformer.feature_points(faps)
        moved: Float64 = places @ matrix[:3, :3].T + matrix[:3, 3]
        return moved

    def _on_body(self) -> dict[str, FaceShape]:
        if not self._cut:
            for name, shape in self._shapes.items():
                kept = (shape.sway[shape.triangles] > CUT).all(axis=1)
                if kept.any():
                    self._cut[name] = with_triangles(shape, shape.triangles[kept])
        return self._cut


def _head_centre(model: FaceModel) -> Float64:
    """(3,): the centre of the head's rotation in its tables; the origin if there is none."""
    for number in (48, 49, 50):
        table = model.table_of.get(number)
        for transform in table.transforms if table is not None else ():
            if transform.kind == "rotation":
                return np.array(transform.centre)
    return np.zeros(3)

"""A person: a body model with a face model on it, as one skin."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, cast

import numpy as np
import numpy.typing as npt

from fba.body.head_attachment import HeadOnBody
from fba.body.model import BodyModel, BodyPart
from fba.face.model import Part, point_row
from fba_player.figure._face_parts import coarser_part, part_shape, with_triangles
from fba_player.figure.body_light import BodyLight
from fba_player.figure.face import FaceFigure, Pose
from fba_player.mesh.lazy_vertices import Places, Probe, SomeRows, Whole
from fba_player.view.view import Eye, FaceMesh, FaceShape

if TYPE_CHECKING:
    from fba.body.skin.skinning import JointMotion
    from fba_player.gl.gpu.tables import BodyTables, CarriedBody, CarriedFace, LightTables

Float32 = npt.NDArray[np.float32]
Float64 = npt.NDArray[np.float64]
Rows = npt.NDArray[np.intp]

SCATTER = {"skin": 1.0, "neck": 1.0}
SEEN_WEIGHTS, BEND = 6, 0.02
"""How a coarser body keeps its joints: what a vertex carried by the wrong one counts in metres."""
WORLD, NOWHERE = np.eye(4), np.zeros(3)
CARRIED = ("skin", "mouth", "hair", "other")
"""Kinds of parts of a face that the neck may bend; eyes, teeth and tongue go with the skull."""


class Person:
    """Body and face, moved by joint matrices and FAPs.

    body: a model with a place for pupils. figure: the face to be put there. What of the face lies under the
    clothes is left out, and so are parts of kind "other" that lie wholly below the chin: the body is dressed.
    """

    def __init__(self, body: BodyModel, figure: FaceFigure) -> None:
        self.body = body
        self.figure = figure
        model = figure.model
        skull = np.concatenate([np.full(len(p.vertices), p.kind not in CARRIED) for p in model.parts])
        eyes = model.points[[point_row("3.5"), point_row("3.6")]]
        self.head = HeadOnBody(body, model.vertices, eyes, skull)
        self._face = self._face_shapes()
        left_out = ("head", "neck") if self.head.brings_neck else ("head",)
        self._parts = [part for part in body.parts if part.kind not in left_out]
        self._rows = {
            part.name: slice(start, start + len(part.vertices))
            for part, start in zip(body.parts, body.starts.values(), strict=True)
        }
        self._shapes = {part.name: _shape(part, len(body.skeleton)) for part in self._parts}
        coarser = [self._shapes[part.name].coarser if part in self._parts else None for part in body.parts]
        self._light = BodyLight(body, coarser)
        self._places, self._normals = np.empty_like(body.vertices), np.empty_like(body.vertices)
        self._skin, self._upright = np.empty_like(model.vertices), np.empty_like(model.vertices)
        self._moved: tuple[Float64, JointMotion] | None = None
        self._probe = Probe(len(body.vertices), self._some_of_body)
        self._lit = Probe(len(body.vertices), self._some_lit, normals=True)
        self._face_probe = Probe(len(model.vertices), self._some_of_face)

    def joints(self, faps: Float32, matrices: Float64) -> Float64:
        """Joint matrices (J, 4, 4) with the head turned by FAPs (68,) on its skull base."""
        return self.head.matrices(matrices, self.figure.pose(faps).turn)

    def frame(self, joints: Float64) -> Float64:
        """(4, 4): frame of the face model into the world."""
        return self.head.frame(joints)

    def meshes(self, faps: Float32, joints: Float64) -> list[FaceMesh]:
        """Everything but the eyeballs, for FAPs (68,) and joint matrices with the head's turn."""
        body = self._body_whole(joints)

        def reached(rows: SomeRows) -> tuple[Float32, Float32]:
            places, normals = body.arrays if body.is_made else self._lit.at(joints, rows)
            return places, normals

        reaching = self._light.lit_at(reached, joints)
        found = [
            _placed(self._shapes[part.name], body, self._rows[part.name], reaching.of(self._rows[part.name]))
            for part in self._parts
        ]
        face = self._face_whole(self.figure.pose(faps), joints)
        light = self.figure.light(faps, self.frame(joints))
        for name, shape in self._face.items():
            rows = self.figure.rows(name)
            found.append(_placed(shape, face, rows, light.of(rows)))
        return found

    def _body_whole(self, joints: Float64) -> Whole:
        """The body's vertices."""

        def make() -> tuple[Float32, Float32]:
            return self.body.skin(joints, self._places, self._normals), self._normals

        def motion() -> CarriedBody:
            from fba_player.gl.gpu.tables import CarriedBody

            light = None if self._light.is_free else self._light_tables
            return CarriedBody(self._tables, self._motion(joints), light)

        return Whole(len(self._places), make, lambda rows: self._probe.at(joints, rows)[0], motion)

    def _face_whole(self, pose: Pose, joints: Float64) -> Whole:
        """The face's, on the body."""

        def make() -> tuple[Float32, Float32]:
            upright = self._upright
            return self.head.skin(
                pose.positions, joints, self._skin, upright=pose.normals, normals=upright
            ), upright

        def motion() -> CarriedFace:
            from fba_player.gl.gpu.tables import CarriedFace

            head = self.head
            return CarriedFace(pose.whole, self._face_tables, self._motion(joints), head.size, head.shift)

        posed = (pose, joints)
        return Whole(len(self._skin), make, lambda rows: self._face_probe.at(posed, rows)[0], motion)

    def _motion(self, joints: Float64) -> JointMotion:
        """What joints do to body and head alike; worked out once for both."""
        if self._moved is None or self._moved[0] is not joints:
            self._moved = (joints, self.body.skinner.motion(joints))
        return self._moved[1]

    @cached_property
    def _tables(self) -> BodyTables:
        """For a graphics card that deforms the body."""
        from fba_player.gl.gpu.tables import BodyTables

        return BodyTables(self.body.skinner)

    @cached_property
    def _light_tables(self) -> LightTables:
        """And of the light on it."""
        from fba_player.gl.gpu.tables import LightTables

        return LightTables(self._tables.rows, self._light.prepared)

    @cached_property
    def _face_tables(self) -> BodyTables:
        """The same of the face on it."""
        from fba_player.gl.gpu.tables import BodyTables

        return BodyTables(self.head.skinner)

    def _some_of_body(self, rows: Rows) -> Callable[[Float64, Float32], None]:
        """What writes the places of some of the body's vertices (N,)."""
        skinner, room = self.body.skinner.chosen(rows), np.empty((len(rows), 3), dtype=np.float32)

        def write(joints: Float64, places: Float32) -> None:
            places[rows] = skinner.skin(joints, room)

        return write

    def _some_lit(self, rows: Rows) -> Callable[[Float64, Float32, Float32], None]:
        """The same with their normals."""
        all_ = self.body.skinner.with_neighbours(rows)
        skinner = self.body.skinner.chosen(all_)
        room, upright = (np.empty((len(all_), 3), dtype=np.float32) for _ in range(2))

        def write(joints: Float64, places: Float32, normals: Float32) -> None:
            places[all_] = skinner.skin(joints, room, upright)
            normals[all_] = upright

        return write

    def _some_of_face(self, rows: Rows) -> Callable[[tuple[Pose, Float64], Float32], None]:
        """What writes the places of some of the face's vertices (N,)."""
        head, room = self.head.chosen(rows), np.empty((len(rows), 3), dtype=np.float32)

        def write(posed: tuple[Pose, Float64], places: Float32) -> None:
            pose, joints = posed
            places[rows] = head.skin(pose.whole.at(rows).take(rows, axis=0), joints, room)

        return write

    def eyes(self, faps: Float32, joints: Float64) -> list[Eye]:
        """The eyeballs, likewise."""
        return self.figure.eyes(faps, self.frame(joints), turned=True)

    def _face_shapes(self) -> dict[str, FaceShape]:
        """The face's parts without what the clothes hide."""
        model, found = self.figure.model, {}
        chin = model.points[point_row("2.1")][1]
        for name, shape in self.figure.shapes.items():
            part = model.part(name)
            if part.kind == "other" and part.vertices[:, 1].max() < chin:
                continue
            hidden = self.head.hidden[self.figure.rows(name)]
            kept = ~hidden[shape.triangles].all(axis=1)
            if kept.any():
                found[name] = with_triangles(shape, shape.triangles[kept])
        return found


def _shape(part: BodyPart, joints: int) -> FaceShape:
    shape = part_shape(cast(Part, part), np.ones(len(part.vertices), dtype=np.float32))
    # Where joints bend it there is to be something to bend: weights, seen from a few fixed sides.
    random = np.random.default_rng(7).standard_normal((joints, SEEN_WEIGHTS)) / SEEN_WEIGHTS**0.5
    carried = np.einsum("vk,vkn->vn", part.weights, random[part.joints]) * BEND
    coarser = coarser_part(part, [part.vertices], carried.astype(np.float32))
    kept = replace(shape, scatter=SCATTER.get(part.kind, 0.0), two_sided=False, closed=True, name="")
    return replace(kept, coarser=coarser)


def _placed(shape: FaceShape, whole: Whole, rows: slice, light: Callable[[Rows | None], Float32]) -> FaceMesh:
    places = Places(whole, rows.start, rows.stop - rows.start)
    return FaceMesh(shape, places, light, WORLD, NOWHERE, NOWHERE)

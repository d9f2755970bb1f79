"""A person: a body model with a face model on it, as one skin."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple, cast

import numpy as np

from fba.arrays import Bool, Float32, Float64, Intp
from fba.body import AttachedHead, BodyModel, BodyPart, attach_head
from fba.body.head_attachment import skull_of
from fba.body.skin.skinning import Skinner
from fba.face import Deformer, FaceModel, Part
from fba.parameters import point_rows
from fba_player._figure._face_parts import cast_coarsely, detail_levels, keep_triangles, make_shape, part_rows
from fba_player._figure.baked_shapes import load_baked
from fba_player._figure.body_light import BodyLight, build_body_light
from fba_player._figure.detail import choose_level, needed_vertices
from fba_player._figure.face import FaceFigure
from fba_player._figure.face_light import FaceLight
from fba_player._figure.far_head import add_far_level
from fba_player._figure.wrinkles import wrinkle_strengths
from fba_player.view._view import Eye, FaceMesh, FaceShape, Seen

SCATTERING_KINDS = ("skin", "neck")
"""Kinds of a body's parts below whose surface light scatters."""
WEIGHT_PROJECTIONS = 6
"""Number of random projections of the skin weights that simplification preserves."""
WEIGHT_SCALE = 0.02
"""Metres as which a skin weight of 1 counts in simplification."""
HEAD_SHARE = 0.3
"""A part of a body with its own head is drawn in full detail if more than this share of it is on the head."""
WORLD = np.eye(4)
NO_TURN = np.zeros(3)
REACH_MARGIN = 1.1
"""How much further from joints vertices may get than they are as modelled."""
NEARER = 1.5
"""A face's levels of detail are at hand this many times nearer than they are drawn: they change gradually."""
MOST_MOVERS = 8
"""How many choices of vertices are kept, a few megabytes each."""
WITHIN_LIPS, SHUT_PIXELS = ("teeth", "tongue"), 1.0
"""Kinds of a face's parts that are left out where its lips are closer than this number of pixels."""
SMALL = 0.005
"""Width (m) of a pixel on a head from which hardly anything is seen of lashes and wrinkles: it has none."""
CARRIED = ("skin", "mouth", "hair", "other")
"""Kinds of a face's parts that the neck may bend; eyes, teeth and tongue move with the skull."""


class Movers(NamedTuple):
    """What moves and lights those vertices that levels of detail from some on are made of.

    finest: the first level of the face.
    """

    body: Skinner
    face: Deformer
    head: AttachedHead | None
    light: FaceLight
    finest: int


@dataclass(frozen=True, eq=False)
class Person:
    """Body and face, moved by joint matrices and FAPs; see `build_person`.

    head: the face on the body, or None for a body with a head of its own. body_shapes, face_shapes: the parts
    that are drawn, by name. light: that on the body.
    """

    body: BodyModel
    figure: FaceFigure
    head: AttachedHead | None
    body_shapes: dict[str, FaceShape]
    face_shapes: dict[str, FaceShape]
    light: BodyLight
    _movers: dict[tuple[int, ...], Movers] = field(default_factory=dict, init=False)

    @property
    def headroom(self) -> float:
        """Metres from the joint that carries the head to the top of the body's own head; 0 without one."""
        rows = head_rows(self.body)
        if self.head is not None or not rows.any():
            return 0.0
        skull = self.body.bind[skull_of(self.body)]
        return float(1.1 * ((self.body.vertices[rows] - skull[:3, 3]) @ skull[:3, :3])[:, 1].max())

    def joints(self, faps: Float32, matrices: Float64) -> Float64:
        """Return the joint matrices (J, 4, 4) with the head turned on the skull base by FAPs (68,)."""
        turn = self.figure.deformer.head_matrices(faps)
        if self.head is None:
            return turn_own_head(self.body, matrices, turn)
        return self.head.matrices(matrices, turn)

    def frame(self, joints: Float64) -> Float64:
        """Return (4, 4): from the face model's frame into the world."""
        if self.head is not None:
            return self.head.frame(joints)
        skull = skull_of(self.body)
        place = np.eye(4)
        place[:3, 3] = head_middle(self.body) - np.array(self.figure.subject.centre)
        frame: Float64 = joints[skull] @ np.linalg.inv(self.body.bind[skull]) @ place
        return frame

    def meshes(self, faps: Float32, joints: Float64, seen: Seen | None = None) -> list[FaceMesh]:
        """Return all parts but the eyeballs for FAPs (68,) and joint matrices as `joints` returns them.

        seen: where from; then only those vertices are moved that levels of detail chosen there consist of.
        """
        movers = self._choose_movers(joints, seen)
        positions, normals = np.empty_like(self.body.vertices), np.empty_like(self.body.vertices)
        own_head = self.body.own_head if self.head is None else None
        if own_head is None:
            movers.body.skin(joints, positions, normals)
        else:
            moved = own_head.move(self.body.vertices, faps)
            movers.body.skin_vertices(moved, self.body.normals, joints, positions, normals)
        light, limbs = self.light.light, self.light.limbs(joints)
        meshes = [
            _mesh_in_world(shape, part_rows(self.body, name), positions, normals, light, limbs=limbs)
            for name, shape in self.body_shapes.items()
        ]
        if movers.head is None:
            return meshes
        away = 0.0 if seen is None else np.linalg.norm(joints[skull_of(self.body), :3, 3] - seen.eye)
        pixel = 0.0 if seen is None else float(seen.pixel * away)  # its width on the head, m
        pose = self.figure.pose(faps, movers.face, SHUT_PIXELS * pixel)
        positions, normals = np.empty_like(pose.positions), np.empty_like(pose.positions)
        movers.head.skin(pose.positions, joints, positions, local_normals=pose.normals, normals=normals)
        light = movers.light.shade(pose.positions, np.eye(3), self.frame(joints)[:3, :3])
        wrinkles = wrinkle_strengths(faps) if pixel < SMALL else None
        for name, shape in self.face_shapes.items():
            if (pose.shut and shape.kind in WITHIN_LIPS) or (pixel >= SMALL and shape.kind == "lash"):
                continue
            rows = self.figure.rows(name)
            more = {"wrinkles": wrinkles, "finest": movers.finest}
            meshes.append(_mesh_in_world(shape, rows, positions, normals, light, **more))
        return meshes

    def _choose_movers(self, joints: Float64, seen: Seen | None) -> Movers:
        """Return what moves the vertices of all levels of detail that may be drawn from there."""
        shapes = [*self.body_shapes.values(), *self.face_shapes.values()]
        levels = (0,) * len(shapes)
        if seen is not None:
            apart = np.linalg.norm(joints[:, :3, 3] - seen.eye, axis=1).min()
            pixel = seen.pixel * max(float(apart) - self._reach, 0.0)
            levels = tuple(choose_level(s, pixel / NEARER if s.levels else pixel) for s in shapes)
        if levels not in self._movers:
            if len(self._movers) > MOST_MOVERS:
                self._movers.clear()
            self._movers[levels] = self._make_movers(levels)
        return self._movers[levels]

    def _make_movers(self, levels: tuple[int, ...]) -> Movers:
        head, light, deformer = self.head, self.figure.light, self.figure.deformer
        if not any(levels):
            return Movers(self.body.skinner, deformer, head, light, 0)
        of_face = levels[len(self.body_shapes) :]
        body = _needed(self.body_shapes, levels[: len(self.body_shapes)], self.body)
        face = _needed(self.face_shapes, of_face, self.figure.model)
        if head is not None:
            head, light = replace(head, skinner=head.skinner.restrict(face)), light.restrict(face)
            deformer = self.figure.restrict(face)
        faces = zip(of_face, self.face_shapes.values(), strict=True)
        finest = max((level for level, shape in faces if shape.levels), default=0)
        return Movers(self.body.skinner.restrict(body), deformer, head, light, finest)

    @cached_property
    def _reach(self) -> float:
        """The largest distance (m) of a vertex from the joint that carries it most."""
        skinners = [self.body.skinner] if self.head is None else [self.body.skinner, self.head.skinner]
        away = [s.vertices - self.body.bind[s.joints[:, 0], :3, 3] for s in skinners]
        return REACH_MARGIN * max(float(np.linalg.norm(a, axis=1).max(initial=0.0)) for a in away)

    def eyes(self, faps: Float32, joints: Float64) -> list[Eye]:
        """Return the eyeballs for FAPs (68,) and joint matrices as `joints` returns them."""
        return [] if self.head is None else self.figure.eyes(faps, self.frame(joints), turned=True)


def build_person(body: BodyModel, figure: FaceFigure) -> Person:
    """Return a person of a body and a face, placed where the body says that the pupils are.

    Triangles of the face under the body's clothes are left out, and so are parts of kind "other" that lie
    wholly below the chin. A body without such a place keeps its own head, which FAPs turn.
    """
    model = figure.model
    head, face_shapes, left_out = None, dict[str, FaceShape](), tuple[str, ...]()
    if body.eyes is not None:
        skull = np.concatenate([np.full(len(p.vertices), p.kind not in CARRIED) for p in model.parts])
        eyes = model.points[[point_rows()["3.5"], point_rows()["3.6"]]]
        head = attach_head(body, model.vertices, eyes, skull)
        face_shapes = _face_shapes(figure, head)
        left_out = ("head", "neck") if head.brings_neck else ("head",)
    stored, joints = load_baked(body.parts), len(body.skeleton)
    shapes = {part.name: body_shape(part, joints, stored) for part in body.parts if part.kind not in left_out}
    if head is None:
        rows = head_rows(body)
        for name, shape in shapes.items():  # a coarser face would let its teeth and eyes through
            if rows[part_rows(body, name)].mean() > HEAD_SHARE:
                shapes[name] = replace(shape, coarser=None)
    return Person(body, figure, head, shapes, face_shapes, build_body_light(body))


def head_rows(body: BodyModel) -> Bool:
    """Return the mask (V,) of the body's vertices that its skull carries more than any other joint."""
    below = body.skeleton.descendants(skull_of(body))
    return np.asarray(np.isin(body.joints[:, 0], below) & (body.weights[:, 0] > 0))


def head_middle(body: BodyModel) -> Float64:
    """Return the middle (3,) of the body's own head, as modelled; else of the joint that carries heads."""
    of_head = body.vertices[head_rows(body)].astype(np.float64)
    if not len(of_head):
        return np.asarray(body.bind[skull_of(body), :3, 3])
    return np.asarray((of_head.min(axis=0) + of_head.max(axis=0)) / 2)


def turn_own_head(body: BodyModel, matrices: Float64, turn: Float64) -> Float64:
    """Return the joint matrices (J, 4, 4) with the head turned about the joint that carries it.

    turn: (4, 4), what FAPs do to a face.
    """
    if np.array_equal(turn, np.eye(4)):
        return matrices
    skull = skull_of(body)
    bind, within = body.bind[skull], np.eye(4)
    within[:3, :3] = turn[:3, :3]
    within[:3, 3] = bind[:3, 3] - turn[:3, :3] @ bind[:3, 3]
    motion = matrices[skull] @ np.linalg.inv(bind) @ within @ bind @ np.linalg.inv(matrices[skull])
    turned = matrices.copy()
    below = body.skeleton.descendants(skull)
    turned[below] = motion @ turned[below]
    return turned


def _face_shapes(figure: FaceFigure, head: AttachedHead) -> dict[str, FaceShape]:
    """Return the face's parts by name, without the triangles that clothes hide."""
    model, shapes = figure.model, {}
    stored = load_baked(model.parts)
    chin = model.points[point_rows()["2.1"]][1]
    for name, shape in figure.shapes.items():
        part = model.part(name)
        if part.kind == "other" and part.vertices[:, 1].max() < chin:
            continue
        coarse = add_far_level(figure, part, cast_coarsely(shape, part, stored), stored)
        visible = keep_triangles(coarse, ~head.hidden[figure.rows(name)], whole=False)
        if len(visible.triangles):
            whole = head.brings_neck and part.kind == "skin"
            levels = tuple(replace(n, shape=replace(n.shape, closed=whole)) for n in visible.levels)
            shapes[name] = replace(visible, levels=levels)
    return shapes


def body_shape(part: BodyPart, joints: int, stored: dict[str, Any]) -> FaceShape:
    """Return the constant data of a part of a body. joints: their number. stored: of `load_baked`."""
    shape = make_shape(cast(Part, part), np.ones(len(part.vertices), dtype=np.float32))
    # Vertices must remain where joints bend the body: preserve the weights, in a few fixed projections.
    random = np.random.default_rng(7).standard_normal((joints, WEIGHT_PROJECTIONS)) / WEIGHT_PROJECTIONS**0.5
    carried = np.einsum("vk,vkn->vn", part.weights, random[part.joints]) * WEIGHT_SCALE
    open_surface = part.material.two_sided
    return replace(
        shape, scatter=float(part.kind in SCATTERING_KINDS), folds=bool(stored) and part.kind == "cloth",
        two_sided=open_surface, closed=not open_surface, name="",
        coarser=detail_levels(part, carried.astype(np.float32), stored), casts=True,
    )  # fmt: skip


def _needed(shapes: Mapping[str, FaceShape], levels: tuple[int, ...], model: FaceModel | BodyModel) -> Intp:
    """Return the numbers (N,) of a model's vertices that its shapes need from these levels of detail on."""
    needed = np.zeros(len(model.vertices), dtype=bool)
    for (name, shape), level in zip(shapes.items(), levels, strict=True):
        needed[part_rows(model, name)] = needed_vertices(shape, level)
    return np.flatnonzero(needed)


def _mesh_in_world(
    shape: FaceShape, rows: slice, positions: Float32, normals: Float32, light: Float32, **more: Any
) -> FaceMesh:
    """Return a part, cut from its model's arrays (V, 3), (V, 3), (V, 4) in the world. more: other fields."""
    return FaceMesh(shape, positions[rows], normals[rows], light[rows], WORLD, NO_TURN, NO_TURN, **more)

"""A figure that moves: the vertices of a person, or of a head alone, at any frame of an animation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.animation import Animation
from fba.arrays import Array, Float32, Float64, Int32
from fba.body import AttachedHead, BapSolver, BodyModel, attach_head
from fba.face import Deformer, FaceModel, resolve
from fba.parameters import BAP_COUNT, FAP_COUNT, point_rows
from fba.tracks import hold

BENDING = ("skin", "mouth", "hair", "other")
"""Kinds of parts of a face that the neck may bend; eyes, teeth and tongue move with the skull."""


@dataclass(frozen=True, eq=False)
class Poses:
    """Poses of a figure. faps: int32 (T, 68), all low-level FAPs that are shown. baps: int32 (T, 296)."""

    faps: Int32
    baps: Int32


def read_poses(animation: Animation, model: FaceModel) -> Poses:
    """Return what an animation shows at each frame. model: the face, whose rules fill FAPs in."""
    count = len(animation)
    faps: Array = np.zeros((count, FAP_COUNT), dtype=np.int32)
    baps: Array = np.zeros((count, BAP_COUNT), dtype=np.int32)
    if animation.face is not None:
        faps = np.rint(resolve(animation.face, model)).astype(np.int32)
    if animation.body is not None:
        baps = hold(animation.body.values, animation.body.mask, np.zeros(BAP_COUNT, dtype=np.int32))
    return Poses(faps, baps)


class Figure:
    """A body with a face on it, or a head alone, whose vertices FAPs and BAPs move.

    body: None for a head alone. A body without a place for a face keeps its own head. triangles: int32
    (F, 3), of all parts that are shown, over their vertices. joints: int32 (V,), the joint of the body that
    carries each vertex most; zeros for a head alone.
    """

    def __init__(self, model: FaceModel, body: BodyModel | None) -> None:
        self.model, self.body = model, body
        self._deformer = Deformer(model)
        self._solver = None if body is None else BapSolver(body.skeleton)
        self._head = None if body is None or body.eyes is None else _attach(model, body)
        triangles, joints = _surface(model, body, self._head)
        self._rows, corners = np.unique(triangles, return_inverse=True)
        self.triangles: Int32 = corners.reshape(-1, 3).astype(np.int32)
        self.joints: Int32 = joints[self._rows]

    def vertices(self, faps: Int32, baps: Int32) -> Float32:
        """Return the vertices (V, 3), metres, for FAPs (68,), all of them low-level, and BAPs (296,)."""
        if self.body is None or self._solver is None:
            return self._deformer(faps)[self._rows]
        matrices: Float64 = self._solver.pose(baps)
        if self._head is None:
            return self.body.skin(matrices)[self._rows]
        turned = self._head.matrices(matrices, self._deformer.head_matrices(faps))
        face = self._head.skin(self._deformer.local(faps), turned)
        return np.concatenate([self.body.skin(turned), face])[self._rows]


def _attach(model: FaceModel, body: BodyModel) -> AttachedHead:
    skull = np.concatenate([np.full(len(part.vertices), part.kind not in BENDING) for part in model.parts])
    eyes = model.points[[point_rows()["3.5"], point_rows()["3.6"]]]
    return attach_head(body, model.vertices, eyes, skull)


def _surface(model: FaceModel, body: BodyModel | None, head: AttachedHead | None) -> tuple[Int32, Int32]:
    """Return the triangles that are shown, and the joint of each vertex, as of `Figure`."""
    if body is None:
        return model.triangles, np.zeros(len(model.vertices), dtype=np.int32)
    left_out = () if head is None else ("head", "neck") if head.brings_neck else ("head",)
    triangles, first = [], 0
    for part in body.parts:
        if part.kind not in left_out:
            triangles.append(part.triangles + first)
        first += len(part.vertices)
    carried = [np.concatenate([part.joints[:, 0] for part in body.parts])]
    if head is not None:
        visible = ~head.hidden[model.triangles].all(axis=1)
        triangles.append(model.triangles[visible] + first)
        carried.append(head.joints[:, 0])
    return np.concatenate(triangles).astype(np.int32), np.concatenate(carried).astype(np.int32)

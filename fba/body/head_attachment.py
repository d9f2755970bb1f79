"""A face on a body: neck and skull move its vertices, so that face and body share a skin."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fba.arrays import Bool, Float32, Float64, Int32
from fba.body._neck_blending import blend_with_neck
from fba.body.model import BodyModel
from fba.body.skin._skinning import Skinner, build_skinner
from fba.body.skin.skin_weights import INFLUENCES, checked_weights
from fba.choices import SkinMethod
from fba.errors import ModelError
from fba.mesh import checked_rows

SKULL = "skullbase"
"""The joint that carries the head, and that FAP 48 to 50 turn it on (ISO/IEC 14496-2, annex C)."""
SAME_SIZE = 0.005
"""Difference from size 1 up to which a face keeps its size."""


@dataclass(frozen=True, eq=False)
class AttachedHead:
    """A face on a body, moved with the body's joints; `attach_head` makes it.

    place: float64 (4, 4), from the face's frame into the body's, as modelled; its scale is size, its shift
    float32 (3,) metres. joints: int32 (V, 4), weights: float32 (V, 4), by which the body moves the face's
    vertices. hidden: (V,) mask of vertices beyond the lower edge of the body's neck, which its clothes hide.
    brings_neck: whether the face has a neck that meets the body; the body's own must then not be shown.
    skull: number of the joint that carries the head. below: numbers of that joint and its descendants.
    skull_bind: float64 (4, 4), that joint as modelled. skinner: moves the vertices.
    """

    place: Float64
    size: float
    shift: Float32
    joints: Int32
    weights: Float32
    hidden: Bool
    brings_neck: bool
    skull: int
    below: tuple[int, ...]
    skull_bind: Float64
    skinner: Skinner

    def matrices(self, matrices: npt.ArrayLike, turn: npt.ArrayLike) -> Float64:
        """Return joint matrices (J, 4, 4) of the body with the head turned on its skull base.

        turn: (4, 4), as `fba.face.Deformer.head_matrices` returns it, in the face's frame. FAPs turn the head
        relative to the pose that BAPs give the skull base.
        """
        turned: Float64 = np.array(matrices, dtype=np.float64)
        within = self.place @ np.asarray(turn, dtype=np.float64) @ np.linalg.inv(self.place)
        if np.array_equal(within, np.eye(4)):
            return turned
        skull, below = turned[self.skull], list(self.below)
        motion = skull @ np.linalg.inv(self.skull_bind) @ within @ self.skull_bind @ np.linalg.inv(skull)
        turned[below] = motion @ turned[below]
        return turned

    def frame(self, matrices: npt.ArrayLike) -> Float64:
        """Return the matrix (4, 4) from the face's frame to the world, for parts that move with the skull."""
        skull = np.asarray(matrices, dtype=np.float64)[self.skull]
        frame: Float64 = skull @ np.linalg.inv(self.skull_bind) @ self.place
        return frame

    def skin(
        self,
        local: Float32,
        matrices: npt.ArrayLike,
        out: Float32 | None = None,
        *,
        local_normals: Float32 | None = None,
        normals: Float32 | None = None,
        method: SkinMethod = "dual",
    ) -> Float32:
        """Return the face on the body: float32 (V, 3), metres.

        local: float32 (V, 3), the face moved by its FAPs in its own frame without the head's turn
        (`Deformer.local`). matrices: (J, 4, 4), with the head's turn (`matrices`). out: written to and
        returned. local_normals: float32 (V, 3), normals of the face in its own frame; normals: filled with
        those on the body. method: see `BodyModel.skin`. ValueError for arrays of other shapes.
        """
        from fba.body.skin._loops import scale_and_shift

        if local.shape != self.skinner.vertices.shape:
            raise ValueError(f"vertices must have shape {self.skinner.vertices.shape}, not {local.shape}")
        placed = np.empty(local.shape, dtype=np.float32)
        scale_and_shift(local, self.size, self.shift, placed)
        return self.skinner.skin_vertices(placed, local_normals, matrices, out, normals, method)


def attach_head(
    body: BodyModel, vertices: npt.ArrayLike, eyes: npt.ArrayLike, skull: Bool | None = None
) -> AttachedHead:
    """Return a face set between the pupils of a body, sized by their distance.

    body: a model with positions of pupils. vertices: (V, 3), the neutral face, in its own frame and unit.
    eyes: (2, 3), its pupils, feature points 3.5 and 3.6. skull: (V,) mask of vertices that always move with
    the skull alone (eyes, teeth, tongue), none by default. Vertices near the body's neck (its part of kind
    "neck", as modelled) take that neck's weights, others move with the skull.

    ModelError for a body without pupils or a face whose eyes coincide.
    """
    points = checked_rows(vertices, (-1, 3), "a face on a body: vertices")
    place, number = placement(body, eyes), skull_of(body)
    size = float(place[0, 0])
    placed = points.astype(np.float64) * size + place[:3, 3]
    joints = np.zeros((len(points), INFLUENCES), dtype=np.int32)
    weights = np.zeros((len(points), INFLUENCES), dtype=np.float32)
    joints[:, 0], weights[:, 0] = number, 1.0
    hidden, brings_neck = np.zeros(len(points), dtype=bool), True
    neck = [part for part in body.parts if part.kind == "neck" and len(part.vertices)]
    if neck:
        free = np.ones(len(points), dtype=bool) if skull is None else ~np.asarray(skull)
        blend = blend_with_neck(neck, len(body.skeleton), number, placed, free)
        place[:3, 3] += blend.offset
        placed += blend.offset
        joints[free], weights[free] = blend.joints, blend.weights
        hidden, brings_neck = blend.hidden, blend.brings_neck
    joints, weights = checked_weights("a face on a body", joints, weights, len(points))
    forward = np.tile(np.array([0, 0, 1], dtype=np.float32), (len(points), 1))
    skinner = build_skinner(placed.astype(np.float32), forward, joints, weights, body.bind, body.skeleton)
    below = tuple(body.skeleton.descendants(number))
    return AttachedHead(
        place, size, place[:3, 3].astype(np.float32), joints, weights, hidden, brings_neck, number, below,
        body.bind[number], skinner,
    )  # fmt: skip


def skull_of(body: BodyModel) -> int:
    """Return the number of the joint that carries the head: the skull base, else the highest joint."""
    if SKULL in body.skeleton:
        return body.skeleton.number(SKULL)
    return int(body.bind[:, 1, 3].argmax())


def placement(body: BodyModel, eyes: npt.ArrayLike) -> Float64:
    """Return float64 (4, 4), from a face's frame to the body's as modelled. eyes: (2, 3), its pupils."""
    if body.eyes is None:
        raise ModelError(f"the body {body.name!r} has no pupils, so no face can be attached to it")
    given = np.array(eyes, dtype=np.float64)
    if given.shape != (2, 3) or not np.isfinite(given).all():
        raise ModelError(
            f"a face on a body needs the positions of both pupils (points 3.5 and 3.6), not {given.tolist()}"
        )
    apart = float(np.linalg.norm(given[1] - given[0]))
    if not apart > 1e-9:
        raise ModelError("both pupils of the face have the same position")
    size = float(np.linalg.norm(body.eyes[1] - body.eyes[0])) / apart
    if abs(size - 1) < SAME_SIZE:
        size = 1.0
    place = np.diag([size, size, size, 1.0])
    place[:3, 3] = body.eyes.mean(axis=0) - size * given.mean(axis=0)
    return place

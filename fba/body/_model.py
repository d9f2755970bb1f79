"""A body: meshes, the skeleton that moves them, and the weight of each joint for each vertex."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from fba.arrays import Float32, Float64, Int32
from fba.body._skeleton import Skeleton
from fba.body.skin.skin_weights import checked_weights
from fba.choices import SkinMethod
from fba.errors import ModelError
from fba.limits import DEFAULT_LIMITS, Limits
from fba.mesh import Material, Meshes, join_rows, mesh_arrays

if TYPE_CHECKING:
    from fba.body.own_head import OwnHead
    from fba.body.skin.skinning import Skinner

__all__ = ["BODY_PART_KINDS", "BodyModel", "BodyPart", "Material"]


BODY_PART_KINDS = ("skin", "neck", "head", "cloth", "shoe", "hair", "other")
"""Kinds of parts. "neck": neck and shoulders under the clothes, shown only if the face on the body has none.
"head": the body's own head, left out if a face is put on it."""
RIGID_TOLERANCE = 1e-6


@dataclass(frozen=True, eq=False)
class BodyPart:
    """One mesh of a body, as it is modelled.

    name: unique in its model. kind: one of `BODY_PART_KINDS`. vertices: float32 (V, 3), metres. triangles:
    int32 (F, 3), counter-clockwise from outside. joints: int32 (V, 4), numbers of joints in the model's
    skeleton. weights: float32 (V, 4), how far each carries the vertex, 0..1, with a sum of 1. normals,
    texcoords, colours, material: as those of `fba.face.Part`.

    Arrays are read-only copies. ModelError for other shapes, indices out of range, numbers not finite,
    negative weights, or a sum that is not 1.
    """

    name: str
    kind: str
    vertices: Float32
    triangles: Int32
    joints: Int32
    weights: Float32
    normals: Float32 | None = None
    texcoords: Float32 | None = None
    colours: Float32 | None = None
    material: Material = field(default_factory=Material)

    def __post_init__(self) -> None:
        where = f"part {self.name!r}"
        if not self.name:
            raise ModelError("a part of a body needs a name")
        if self.kind not in BODY_PART_KINDS:
            raise ModelError(f"{where}: its kind {self.kind!r} is not one of {', '.join(BODY_PART_KINDS)}")
        arrays: dict[str, Any] = dict(
            mesh_arrays(where, self.vertices, self.triangles, self.normals, self.texcoords, self.colours)
        )
        arrays["joints"], arrays["weights"] = checked_weights(
            where, self.joints, self.weights, len(arrays["vertices"])
        )
        for name, array in arrays.items():
            object.__setattr__(self, name, array)


@dataclass(frozen=True, eq=False)
class BodyModel(Meshes[BodyPart]):
    """A body that joint matrices move.

    parts: its meshes; vertices of the whole model are numbered through them in order. skeleton: its joints in
    the default posture, with the standard's names where BAPs move them. bind: float64 (J, 4, 4), the joints
    as the meshes are modelled, relative to the default posture, as `BapSolver.pose` returns them. eyes:
    float64 (2, 3), positions of the pupils of a face on this body as modelled (feature points 3.5 and 3.6),
    or None if it cannot carry a face. notes: origin, licence and the like.

    Axes: +x the subject's left, +y up, +z forward; metres. Raises ModelError naming the part or joint
    that is wrong.
    """

    parts: tuple[BodyPart, ...]
    skeleton: Skeleton
    bind: Float64
    eyes: Float64 | None = None
    name: str = ""
    notes: Mapping[str, str] = field(default_factory=dict)
    own_head: OwnHead | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "parts", tuple(self.parts))
        object.__setattr__(self, "notes", dict(self.notes))
        if not self.parts:
            raise ModelError("a body needs at least one part")
        names = [part.name for part in self.parts]
        for name in names:
            if names.count(name) > 1:
                raise ModelError(f"two parts of the body are named {name!r}")
        count = len(self.skeleton)
        for part in self.parts:
            if len(part.joints) and int(part.joints.max()) >= count:
                raise ModelError(
                    f"part {part.name!r}: names joint {part.joints.max()}, but the skeleton has {count}"
                )
        bind = np.array(self.bind, dtype=np.float64)
        if bind.shape != (count, 4, 4):
            raise ModelError(f"bind matrices must have shape ({count}, 4, 4), not {bind.shape}")
        for number, matrix in enumerate(bind):
            if not is_rigid(matrix):
                raise ModelError(
                    f"the bind matrix of {self.skeleton.names[number]!r} must be a rotation and a "
                    "position, not "
                    f"{np.round(matrix, 4).tolist()}"
                )
        bind.flags.writeable = False
        object.__setattr__(self, "bind", bind)
        if self.eyes is not None:
            eyes = np.array(self.eyes, dtype=np.float64)
            if eyes.shape != (2, 3) or not np.isfinite(eyes).all() or np.allclose(eyes[0], eyes[1]):
                raise ModelError(f"the pupils must be two finite positions, (2, 3), not {eyes.tolist()}")
            eyes.flags.writeable = False
            object.__setattr__(self, "eyes", eyes)

    @staticmethod
    def default() -> BodyModel:
        """Return the built-in person, dressed, without the head; one shared instance."""
        from fba.body.builtin import default

        return default()

    @classmethod
    def load(cls, path: str | os.PathLike[str], *, limits: Limits = DEFAULT_LIMITS) -> BodyModel:
        """Return a body from a glTF 2.0 file as `save` writes it.

        Raises FormatError where the file cannot be opened; ModelError, with the position in it, where it is
        damaged, contradicts itself, or lacks the extension FBA_body; LimitError where it takes more memory
        than the limits allow.
        """
        from fba.body._storage import load

        return load(path, limits)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the body as a skinned glTF 2.0 mesh (.glb): whole or not at all.

        Raises ModelError where glTF cannot hold it, FormatError where the file cannot be written.
        """
        from fba.body._storage import save

        save(path, self)

    def skin(
        self,
        matrices: npt.ArrayLike,
        out: Float32 | None = None,
        normals: Float32 | None = None,
        method: SkinMethod = "dual",
    ) -> Float32:
        """Return the body in a pose: float32 (V, 3) for joint matrices (J, 4, 4), (T, V, 3) for (T, J, 4, 4).

        matrices: as `BapSolver(model.skeleton).pose` returns them. out: written to and
        returned. normals: filled with the unit normals. Both float32, C-contiguous, of the result's shape.
        method: "dual" blends dual quaternions, which keep a twisted limb's girth; "linear" blends
        matrices, as most viewers do.

        Raises ValueError for other shapes, numbers that are not finite, or another method.
        """
        return self.skinner.skin(matrices, out, normals, method)

    @cached_property
    def skinner(self) -> Skinner:
        """The `Skinner` that `skin` uses; made on first use."""
        from fba.body.skin.skinning import build_skinner

        return build_skinner(
            self.vertices, self.normals, self.joints, self.weights, self.bind, self.skeleton, self.triangles
        )

    @cached_property
    def joints(self) -> Int32:
        """int32 (V, 4): the joints that carry each vertex; read-only."""
        return join_rows([part.joints for part in self.parts])

    @cached_property
    def weights(self) -> Float32:
        """float32 (V, 4): weights of those joints; read-only."""
        return join_rows([part.weights for part in self.parts])


def is_rigid(matrix: Float64) -> bool:
    """Whether a matrix (4, 4) is finite and combines a rotation and a translation only."""
    if not np.isfinite(matrix).all() or not np.array_equal(matrix[3], (0, 0, 0, 1)):
        return False
    turn = matrix[:3, :3]
    return bool(np.abs(turn @ turn.T - np.eye(3)).max() < RIGID_TOLERANCE and np.linalg.det(turn) > 0)

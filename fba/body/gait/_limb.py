"""Limbs of two bones and a hinge, solved in closed form, and the joint angles of rotations."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fba.arrays import Float64
from fba.rotations import apply, axis_matrices

KNEE = 1.0
"""Sense in which a knee bends: about +x, backward."""
ELBOW = -1.0
"""Sense in which an elbow bends: about -x, forward."""


@dataclass(frozen=True, eq=False)
class Limb:
    """A limb of two bones.

    upper, lower: float64 (3,), the bones in the default posture, metres. sense: `KNEE` or `ELBOW`.
    """

    upper: Float64
    lower: Float64
    sense: float

    def _hinge(self) -> tuple[float, float, float]:
        """Return constant, m, straight: the squared reach at a bend b is constant + 2 m cos(b - straight)."""
        u, w = self.upper, self.lower
        along, across = u[1] * w[1] + u[2] * w[2], u[2] * w[1] - u[1] * w[2]
        constant = float(u @ u + w @ w + 2.0 * u[0] * w[0])
        return constant, float(np.hypot(along, across)), float(np.arctan2(across, along))

    @property
    def reach(self) -> float:
        """Length of the straight limb from end to end, metres."""
        constant, m, _ = self._hinge()
        return float(np.sqrt(constant + 2.0 * m))

    def length(self, bend: npt.ArrayLike) -> Float64:
        """Return metres from end to end at a bend, radians (the rotation about x, times `sense`)."""
        constant, m, straight = self._hinge()
        result: Float64 = np.sqrt(
            constant + 2.0 * m * np.cos(self.sense * np.asarray(bend, dtype=np.float64) - straight)
        )
        return result

    def bend(self, length: npt.ArrayLike) -> Float64:
        """Return the bend, radians, at which the ends are `length` metres apart, or as nearly as possible."""
        constant, m, straight = self._hinge()
        cosine = (np.square(np.asarray(length, dtype=np.float64)) - constant) / (2.0 * m)
        result: Float64 = self.sense * straight + np.arccos(np.clip(cosine, -1.0, 1.0))
        return result

    def solve(self, target: Float64, twist: npt.ArrayLike) -> tuple[Float64, Float64]:
        """Return rotations (..., 3, 3) of the upper bone, and bends (...), that bring the end to a target.

        target: (..., 3), from the limb's root, in the frame of its parent. twist: angle about the upper bone
        itself, the innermost of its rotations (abduction, then flexion follow). The limb points at a target
        that is out of reach.
        """
        twist = np.asarray(twist, dtype=np.float64)
        bend = self.bend(np.linalg.norm(target, axis=-1))
        end = self.upper + apply(axis_matrices(0, self.sense * bend), self.lower)
        end = apply(axis_matrices(1, twist), end)
        scale = np.linalg.norm(end, axis=-1) / np.linalg.norm(target, axis=-1)
        wanted = target * scale[..., None]
        flat = np.hypot(end[..., 0], end[..., 1])
        abduction = -np.arccos(np.clip(wanted[..., 0] / flat, -1.0, 1.0)) - np.arctan2(
            end[..., 1], end[..., 0]
        )
        abducted = apply(axis_matrices(2, abduction), end)
        flexion = np.arctan2(wanted[..., 2], wanted[..., 1]) - np.arctan2(abducted[..., 2], abducted[..., 1])
        return axis_matrices(0, flexion) @ axis_matrices(2, abduction) @ axis_matrices(1, twist), bend


def limb_angles(rotation: Float64) -> tuple[Float64, Float64, Float64]:
    """Return angles x, y, z in radians of rotations (..., 3, 3) = Rx . Rz . Ry, the order of a limb's joint.

    Flexion is outermost, twisting innermost.
    """
    z = np.arcsin(np.clip(-rotation[..., 0, 1], -1.0, 1.0))
    x = np.arctan2(rotation[..., 2, 1], rotation[..., 1, 1])
    y = np.arctan2(rotation[..., 0, 2], rotation[..., 0, 0])
    return x, y, z


def foot_angles(rotation: Float64) -> tuple[Float64, Float64, Float64]:
    """Return angles x, y, z in radians of rotations (..., 3, 3) = Rx . Ry . Rz, the order of a foot.

    These are the ankle's flexion and twisting, then the subtalar joint's roll.
    """
    y = np.arcsin(np.clip(rotation[..., 0, 2], -1.0, 1.0))
    x = np.arctan2(-rotation[..., 1, 2], rotation[..., 2, 2])
    z = np.arctan2(-rotation[..., 0, 1], rotation[..., 0, 0])
    return x, y, z

"""Limbs of two bones and a hinge, solved in closed form, and the joint angles of rotations."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fba.arrays import Float64
from fba.rotations import apply, axis_matrices

KNEE, ELBOW = 1.0, -1.0
"""Which way a hinge bends: about +x a knee (backward), about -x an elbow (forward)."""


@dataclass(frozen=True, eq=False)
class Limb:
    """Upper and lower: float64 (3,), the bones in the default posture, metres. way: `KNEE` or `ELBOW`."""

    upper: Float64
    lower: Float64
    way: float

    def _hinge(self) -> tuple[float, float, float]:
        """Return constant, m, straight: the squared reach at a bend b is constant + 2 m cos(b - straight)."""
        u, w = self.upper, self.lower
        along, across = u[1] * w[1] + u[2] * w[2], u[2] * w[1] - u[1] * w[2]
        constant = float(u @ u + w @ w + 2.0 * u[0] * w[0])
        return constant, float(np.hypot(along, across)), float(np.arctan2(across, along))

    @property
    def reach(self) -> float:
        """Metres from end to end where the limb is straight."""
        constant, m, _ = self._hinge()
        return float(np.sqrt(constant + 2.0 * m))

    def length(self, bend: npt.ArrayLike) -> Float64:
        """Return metres from end to end at a bend, radians (the rotation about x, times `way`)."""
        constant, m, straight = self._hinge()
        result: Float64 = np.sqrt(
            constant + 2.0 * m * np.cos(self.way * np.asarray(bend, dtype=np.float64) - straight)
        )
        return result

    def bend(self, length: npt.ArrayLike) -> Float64:
        """Return the bend in radians at which the ends are length metres apart, or the closest possible."""
        constant, m, straight = self._hinge()
        cosine = (np.square(np.asarray(length, dtype=np.float64)) - constant) / (2.0 * m)
        result: Float64 = self.way * straight + np.arccos(np.clip(cosine, -1.0, 1.0))
        return result

    def solve(self, target: Float64, twist: npt.ArrayLike) -> tuple[Float64, Float64]:
        """Return rotations (..., 3, 3) of the upper bone, and bends (...), that take the end to a target.

        target: (..., 3), from the root of the limb, in its parent. twist: about the upper bone's own length,
        the innermost of its turns (abduction, then flexion follow). Out of reach, the limb points at it.
        """
        twist = np.asarray(twist, dtype=np.float64)
        bend = self.bend(np.linalg.norm(target, axis=-1))
        end = self.upper + apply(axis_matrices(0, self.way * bend), self.lower)
        end = apply(axis_matrices(1, twist), end)
        size = np.linalg.norm(end, axis=-1) / np.linalg.norm(target, axis=-1)
        wanted = target * size[..., None]
        flat = np.hypot(end[..., 0], end[..., 1])
        aside = -np.arccos(np.clip(wanted[..., 0] / flat, -1.0, 1.0)) - np.arctan2(end[..., 1], end[..., 0])
        leant = apply(axis_matrices(2, aside), end)
        forward = np.arctan2(wanted[..., 2], wanted[..., 1]) - np.arctan2(leant[..., 2], leant[..., 1])
        return axis_matrices(0, forward) @ axis_matrices(2, aside) @ axis_matrices(1, twist), bend


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

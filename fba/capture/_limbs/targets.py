"""`Targets`: the target rotations of the body's joints while a motion is retargeted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.arrays import Float64, Int64
from fba.body import BapSolver, Skeleton
from fba.body.solve.solver_loops import joint_angles
from fba.capture.motion import MappedMotion


@dataclass(frozen=True, eq=False)
class Targets:
    """Target rotations of the body's joints, and the captured motion that they follow.

    aims: joint -> the joint at the other end of its bone, where the source has both.
    rotations: joint -> (T, 3, 3), target in world axes; the limbs' functions replace its entries one by one.
    feet: side "l" or "r" -> (T, 3, 3), target of the whole foot, which ankle and subtalar joint share.
    """

    solver: BapSolver
    source: MappedMotion
    aims: dict[str, str]
    rotations: dict[str, Float64]
    feet: dict[str, Float64]

    @property
    def skeleton(self) -> Skeleton:
        """The body's skeleton."""
        return self.solver.skeleton

    def bone(self, joint: str, aim: str) -> Float64:
        """Return the unit vector (3,) from one joint of the resting body to another."""
        vector = self.skeleton.bone(joint, aim)
        unit: Float64 = vector / np.linalg.norm(vector)
        return unit

    def direction(self, joint: str) -> Float64:
        """Return the target directions, unit (T, 3), of the bone that begins at a joint."""
        return self.rotations[joint] @ self.bone(joint, self.aims[joint])

    def axes(self, joint: str) -> tuple[Float64, Int64, Float64]:
        """Return signed axes (K, 3) of a joint, outermost first, and their numbers (3,) and signs (3,)."""
        rules = self.solver.convention
        row = rules.joints.index(joint)
        count = len(rules.freedoms(joint))
        axes = np.eye(3)[rules.axis[row]] * rules.sign[row][:, None]
        return axes[:count], rules.axis[row], rules.sign[row]

    def parent_rotation(self, joint: str) -> Float64:
        """Return the target (T, 3, 3) of the closest joint above that has one."""
        number = self.skeleton.number(joint)
        while (number := int(self.skeleton.parents[number])) >= 0:
            if self.skeleton.names[number] in self.rotations:
                return self.rotations[self.skeleton.names[number]]
        return np.broadcast_to(np.eye(3), (len(self.source.motion), 3, 3))

    def closest_angles(self, joint: str, local: Float64) -> Float64:
        """Return the angles (T, K) about a joint's axes closest to the rotations local (T, 3, 3)."""
        axes, numbers, signs = self.axes(joint)
        return joint_angles(np.moveaxis(local, 0, -1), len(axes), numbers[None], signs[None]).T

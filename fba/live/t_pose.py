"""Lengths of bones for senders that give none: those of the standard's own skeleton, in a T-pose."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fba import rotations
from fba.arrays import Float64
from fba.body import Skeleton
from fba.live.protocols import unity_bones


def standard_offsets(names: Sequence[str], parents: Sequence[int]) -> Float64:
    """Return offsets (J, 3) of bones from the bones above them, metres, y up, in a T-pose.

    names: of Unity's bones, the hips first. parents: number of the bone above each, -1 for the hips.
    """
    skeleton = Skeleton.default()

    def centre(bone: str) -> Float64:
        joint = unity_bones.joint_of(bone)
        assert joint is not None  # the caller takes bones of a body only
        result: Float64 = skeleton.centres[skeleton.number(joint)]
        return result

    raised = {
        side: rotations.between(
            centre(f"{side}LowerArm") - centre(f"{side}UpperArm"), np.array([way, 0.0, 0.0])
        )
        for side, way in (("Left", 1.0), ("Right", -1.0))
    }
    offsets = np.zeros((len(names), 3))
    for number, (name, parent) in enumerate(zip(names, parents, strict=True)):
        if parent < 0:
            continue
        offsets[number] = centre(name) - centre(names[parent])
        side = "Left" if name.startswith("Left") else "Right"
        if _below_arm(names[parent], side):
            offsets[number] = raised[side] @ offsets[number]
    return offsets


def _below_arm(bone: str, side: str) -> bool:
    """Whether a bone turns with the upper arm of a side, or is it."""
    while bone:
        if bone == f"{side}UpperArm":
            return True
        bone = unity_bones.parents()[bone]
    return False

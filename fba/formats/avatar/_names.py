"""What numbers of shapes and joints mean in streams that no container explains: profiles of this project."""

from __future__ import annotations

from functools import cache

import numpy as np

from fba.arrays import Float64, Int64
from fba.body import Skeleton

FACE_PROFILE = "arkit-face"
"""Shapes are ARKit's 52 in ARKit's order."""
BODY_PROFILE = "mpeg4-body"
"""Joints are those of `Skeleton.default()` in its order, in metres; behind them come `FACE_JOINTS`."""
FACE_JOINTS = ("head", "left_eye", "right_eye")
"""Joints in the place of skullbase, whose children they are, turned by FAPs 48 to 50 and 23 to 26."""


@cache
def joint_names() -> tuple[str, ...]:
    """Return the names of the joints of `BODY_PROFILE`."""
    return (*Skeleton.default().names, *FACE_JOINTS)


@cache
def joint_parents() -> Int64:
    """Return the numbers of their parents, -1 for the root."""
    skeleton = Skeleton.default()
    return np.append(skeleton.parents, [skeleton.number("skullbase")] * len(FACE_JOINTS))


@cache
def resting_joints() -> Float64:
    """Return float64 (J, 4, 4): the places of these joints in the world in the default posture, unturned."""
    centres = Skeleton.default().centres
    placed = np.tile(np.eye(4), (len(joint_names()), 1, 1))
    placed[: len(centres), :3, 3] = centres
    placed[len(centres) :, :3, 3] = centres[joint_parents()[-1]]
    return placed

"""Bend the toes of the retargeted body: as the source's, and up where the ground holds them.

A joint of toes has one axis, and many sources have none. Someone who rises over the ball of a foot leaves
the toes on the ground; stiff toes would stick centimetres into it.
"""

from __future__ import annotations

import numpy as np

from fba import rotations
from fba.arrays import Float64
from fba.body.footing import OUTLINE, TIP
from fba.capture.limbs.soles import joint_frames, lowest_edge
from fba.capture.limbs.targets import Targets

FARTHEST_UP = np.radians(60.0)
"""Bend of the toes beyond which the ground does not take them."""
HALVINGS = 12
"""Steps of the search for the angle: to a 4000th of the range."""


def source_bend(targets: Targets, side: str) -> Float64:
    """Return the bend (T,) of the source's toes in radians, upwards; 0 where it has none."""
    joint = f"{side}_metatarsal"
    if joint not in targets.rotations:
        return np.zeros(len(targets.motion))
    above = targets.parent_rotation(joint)
    return targets.closest_angles(joint, np.swapaxes(above, 1, 2) @ targets.rotations[joint])[:, 0]


def bend_toes(
    targets: Targets, side: str, root: Float64, bend: Float64, room: Float64, ground: Float64
) -> None:
    """Turn the toes by a bend (T,), and further up where they would be under the ground.

    root: (T, 3), positions of the root in metres. room: (T,), metres by which toes may be below the rest of
    the sole. ground: (T,), height of the ground, which they are not under, unless the rest of the sole is.
    """
    joint = f"{side}_metatarsal"
    frames = {
        name: (position, frame)
        for name, position, frame in joint_frames(targets.skeleton, targets.rotations, root, joint)
    }
    axis = targets.axes(joint)[0][0]
    above_it = targets.parent_rotation(joint)
    # heights of the tips: level + still + across cos(angle) + raised sin(angle)
    points = np.array([
        [x if side == "l" else -x, y - targets.skeleton.centres[targets.skeleton.number(joint)][1], z]
        for _, x, y, z in TIP
    ])  # fmt: skip
    up = above_it[:, 1]
    along = np.outer(points @ axis, axis)
    still, across, raised = (up @ part.T for part in (along, points - along, np.cross(axis, points)))
    level = frames[joint][0][:, 1]
    sole = lowest_edge(targets.skeleton, frames, side, OUTLINE)
    floor = np.maximum(sole - room, np.minimum(sole, ground))

    def lowest(angle: Float64) -> Float64:
        heights = still + across * np.cos(angle)[:, None] + raised * np.sin(angle)[:, None]
        result: Float64 = level + heights.min(axis=1)
        return result

    low, high = bend, np.maximum(bend, FARTHEST_UP)
    enough = lowest(bend) >= floor
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        fits = lowest(middle) >= floor
        low, high = np.where(fits, low, middle), np.where(fits, middle, high)
    angle = np.where(enough, bend, high)
    if joint in targets.rotations or angle.any():
        targets.rotations[joint] = above_it @ rotations.turn(axis, angle)

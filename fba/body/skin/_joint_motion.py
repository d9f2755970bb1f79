"""What joints do, before it comes to vertices: for those that carry these by other means. Compiled."""

from __future__ import annotations

from fba.arrays import Float32, Float64, Int64
from fba.body.skin._girdle_loops import Girdle, lift
from fba.body.skin.loops import Twisting, joint_duals, twist
from fba.compiled import compiled


@compiled
def motion_of_joints(
    matrices: Float64, inverse: Float64, parents: Int64, twists: Twisting, girdle: Girdle,
    duals: Float32, angles: Float32,
) -> None:  # fmt: skip
    """What `dual_frames` makes of a frame's joints, (J, 4, 4), before it comes to the vertices: duals (J, 8)
    with the girdles turned; angles (B, 2), by which the joints at both ends of a bone twist."""
    joint_duals(matrices, inverse, parents, duals)
    for bone in range(len(twists.joint)):
        angles[bone, 0] = twist(duals, parents, int(twists.joint[bone]), twists.axis[bone])
        angles[bone, 1] = twist(duals, parents, int(twists.child[bone]), twists.child_axis[bone])
    lift(duals, girdle)

"""Convert motion of the standard's own skeleton, which needs no retargeting, to BAPs.

Files that this project writes are of this kind, and so is motion of any H-Anim figure that rests in the
default posture. `retarget` would move the spine's rotations to other vertebrae, and turn clavicles and
forearms as other skeletons need it.
"""

from __future__ import annotations

import numpy as np

from fba import rotations
from fba.arrays import Float64
from fba.body import Skeleton
from fba.capture import _rest_alignment as rest_alignment
from fba.capture.motion import SkeletonMotion

SAME = np.cos(np.radians(1.0))
"""Least cosine between a limb at rest and in the default posture."""
EXACT = 1e-4
"""Share of its height by which a figure, scaled, may differ from the body to count as the same."""
LIMBS = tuple(
    (f"{side}_{upper}", f"{side}_{lower}")
    for side in "lr"
    for upper, lower in (("hip", "knee"), ("knee", "ankle"), ("shoulder", "elbow"), ("elbow", "wrist"))
)


def is_direct(motion: SkeletonMotion, skeleton: Skeleton) -> bool:
    """Whether the joints are the standard's, by name and hierarchy, and rest in the default posture.

    A motion without all limbs is not converted directly.
    """
    names = motion.names
    known = len(set(names)) == len(names) and all(name in skeleton for name in names)
    if not known or names[0] != skeleton.names[0]:
        return False
    for number in range(1, len(names)):
        above = int(skeleton.parents[skeleton.number(names[number])])
        while above >= 0 and skeleton.names[above] not in names:
            above = int(skeleton.parents[above])
        if above < 0 or names[motion.parents[number]] != skeleton.names[above]:
            return False
    if not all(upper in names and lower in names for upper, lower in LIMBS):
        return False
    for upper, lower in LIMBS:
        theirs = motion.offsets[names.index(lower)]
        ours = skeleton.centres[skeleton.number(lower)] - skeleton.centres[skeleton.number(upper)]
        if not theirs @ ours >= SAME * float(np.linalg.norm(theirs) * np.linalg.norm(ours)) > 0:
            return False
    return True


def direct_targets(
    motion: SkeletonMotion, skeleton: Skeleton, scale: float | None
) -> tuple[dict[str, Float64], Float64]:
    """Return targets of a motion that `is_direct`, as `fba.capture.retarget.find_targets` does.

    scale: as for `fba.capture.from_skeleton`.
    """
    numbers = [skeleton.number(name) for name in motion.names]
    rest, (turned, _) = motion.rest() - motion.offsets[0], motion.world()
    targets = {name: rotations.matrices(turned[:, column]) for column, name in enumerate(motion.names)}
    default = skeleton.centres[numbers] - skeleton.centres[0]
    metres = scale
    if metres is None:
        metres = float((rest * default).sum() / (rest * rest).sum())
        if float(np.abs(rest * metres - default).max()) >= EXACT * float(np.ptp(default[:, 1])):
            mapped = {name: column for column, name in enumerate(motion.names)}
            metres = rest_alignment.scale(motion, mapped, skeleton) or metres
    hips = [motion.names.index(f"{side}_hip") for side in "lr"]
    # a body of other proportions has its hips where the source has them
    shift = (rest[hips] * metres - default[hips]).mean(axis=0)
    return targets, motion.positions * metres + shift

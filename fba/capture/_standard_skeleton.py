"""Convert motion of the standard's own skeleton, which needs no retargeting, to BAPs.

Files that this project writes are of this kind, and so is motion of any H-Anim figure that rests in the
default posture. `retarget` would move the spine's rotations to other vertebrae, and turn clavicles and
forearms as other skeletons need it.
"""

from __future__ import annotations

import numpy as np

from fba import rotations
from fba.arrays import Int32
from fba.body import BapSolver, Skeleton, wrapped
from fba.capture import _rest_alignment as rest_alignment
from fba.capture.motion import SkeletonMotion
from fba.parameters import BAP_COUNT

CHUNK = 2048
"""Frames solved at once."""
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
    positions = motion.rest()
    if not all(upper in names and lower in names for upper, lower in LIMBS):
        return False
    for upper, lower in LIMBS:
        theirs = positions[names.index(lower)] - positions[names.index(upper)]
        ours = skeleton.centres[skeleton.number(lower)] - skeleton.centres[skeleton.number(upper)]
        if not theirs @ ours >= SAME * float(np.linalg.norm(theirs) * np.linalg.norm(ours)) > 0:
            return False
    return True


def values(motion: SkeletonMotion, solver: BapSolver, scale: float | None, origin: str) -> Int32:
    """Return BAPs, int32 (T, 296), of a motion that `is_direct`; scale, origin: as for `from_skeleton`."""
    skeleton = solver.skeleton
    numbers = [skeleton.number(name) for name in motion.names]
    metres = _metres(motion, skeleton, numbers) if scale is None else float(scale)
    if not (np.isfinite(metres) and metres > 0):
        raise ValueError(f"scale must be a positive number, not {scale}")
    hips = [motion.names.index(f"{side}_hip") for side in "lr"]
    theirs = motion.rest()[hips].mean(axis=0) - motion.offsets[0]
    ours = skeleton.centres[[numbers[hip] for hip in hips]].mean(axis=0) - skeleton.centres[0]
    # a body of other proportions has its hips where the source has them
    moved = motion.positions * metres + (theirs * metres - ours) - skeleton.centres[0]
    if origin != "source":
        away = moved[0] if origin == "start" else (moved.min(axis=0) + moved.max(axis=0)) / 2
        moved[:, [0, 2]] -= away[[0, 2]]
    result = np.zeros((len(motion), BAP_COUNT), dtype=np.int32)
    previous = None
    columns = {number: row for row, number in enumerate(numbers)}
    for begin in range(0, len(motion), CHUNK):
        end = min(begin + CHUNK, len(motion))
        local = rotations.matrices(motion.rotations[begin:end])
        frames = np.zeros((end - begin, len(skeleton), 4, 4))
        for joint, parent in enumerate(skeleton.parents):
            above = np.eye(3) if parent < 0 else frames[:, parent, :3, :3]
            frames[:, joint, :3, :3] = above @ local[:, columns[joint]] if joint in columns else above
        frames[:, :, 3, 3] = 1.0
        frames[:, 0, :3, 3] = moved[begin:end] + skeleton.centres[0]
        result[begin:end] = solver.solve(frames, joints=motion.names, previous=previous)
        previous = result[end - 1]
    return wrapped(result)


def _metres(motion: SkeletonMotion, skeleton: Skeleton, numbers: list[int]) -> float:
    """Return metres of the body for one unit: exact for the same body, else from the length of the legs."""
    theirs, ours = motion.rest() - motion.offsets[0], skeleton.centres[numbers] - skeleton.centres[0]
    metres = float((theirs * ours).sum() / (theirs * theirs).sum())
    if float(np.abs(theirs * metres - ours).max()) < EXACT * float(np.ptp(ours[:, 1])):
        return metres
    mapped = {name: row for row, name in enumerate(motion.names)}
    ratio = rest_alignment.scale(motion, mapped, skeleton)
    return metres if ratio is None else ratio

"""Align the source's rest pose with the default posture: one constant rotation for each joint.

A joint of the body is turned by W(t) . C: W(t) is the world rotation of the source joint that it was matched
with, and C turns the default posture's bone in the direction of the source's bone in the rest pose. So bones
point in the directions of the source's bones, whether its rest pose is a T, an A, or standing.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from itertools import pairwise

import numpy as np

from fba import rotations
from fba.arrays import Float64
from fba.body.skeleton import Skeleton
from fba.capture._spine import joints as spine_joints
from fba.capture.motion import SkeletonMotion
from fba.errors import ModelError

SHORT = 1e-6
"""Share of the skeleton's size below which a bone has no direction."""


@dataclass(frozen=True)
class Bone:
    """A row of bones.csv: how the bone that begins at a joint is aligned with the source's.

    base: joint whose alignment is rotated as little as possible, or "facing". aims: joints at the bone's
    other end, of which the first mapped one counts. tip: the default posture's joint that a source bone
    without a next joint points to. via: "down" if the rotation goes via a limb that hangs straight down, so
    that T, A and standing rest poses give the same twist.
    """

    joint: str
    base: str
    aims: tuple[str, ...]
    tip: str
    via: str


@cache
def bones() -> tuple[Bone, ...]:
    """Return the bones of the limbs, parents first, left then right."""
    text = (files(__package__) / "bones.csv").read_text(encoding="utf-8")
    return tuple(
        Bone(row["joint"], row["base"], tuple(row["aims"].split()), row["tip"], row["via"])
        for side in "lr"
        for row in csv.DictReader(text.replace("?", side).splitlines())
    )


@dataclass(frozen=True, eq=False)
class Alignment:
    """Alignment of a source with the body.

    upright: (3, 3), from the source's frame to y up. corrections: joint -> C (3, 3), for upright sources.
    aims: joint -> joint at the other end of its bone, if both are mapped.
    """

    upright: Float64
    corrections: dict[str, Float64]
    aims: dict[str, str]


def align(motion: SkeletonMotion, mapped: Mapping[str, int], skeleton: Skeleton) -> Alignment:
    """Return the corrections of all mapped joints. ModelError without size, or left and right."""
    rest = motion.rest()
    size = float(np.ptp(rest, axis=0).max())
    if size <= 0:
        raise ModelError("the source's joints all coincide in its rest pose; it has no bones")
    upright, facing = _facing(rest, mapped)
    rest = rest @ upright.T
    ends = motion.end_offsets @ upright.T
    short = SHORT * size

    def default_position(joint: str) -> Float64:
        position: Float64 = skeleton.centres[skeleton.number(joint)]
        return position

    corrections: dict[str, Float64] = {}
    aims: dict[str, str] = {}

    def align_bone(joint: str, aim: str, start: Float64, via: str = "") -> Float64:
        source = rest[mapped[aim]] - rest[mapped[joint]]
        if np.linalg.norm(source) <= short:
            return start
        aims[joint] = aim
        bone = start @ (default_position(aim) - default_position(joint))
        if via:
            down = np.array([0.0, -1.0, 0.0])
            return rotations.between(down, source) @ rotations.between(bone, down) @ start
        return rotations.between(bone, source) @ start

    spine = [joint for joint in spine_joints(skeleton) if joint in mapped]
    for joint, above in pairwise(spine):
        corrections[joint] = align_bone(joint, above, facing)
    corrections[spine[-1]] = facing
    corrections["sacroiliac"] = facing

    for bone in bones():
        if bone.joint not in mapped:
            continue
        start = corrections.get(bone.base, facing)
        aim = next((aim for aim in bone.aims if aim in mapped), None)
        if aim is not None:
            corrections[bone.joint] = align_bone(bone.joint, aim, start, bone.via)
            continue
        corrections[bone.joint] = start
        tips = ends[motion.end_parents == mapped[bone.joint]]
        if bone.tip and len(tips):
            source = tips.mean(axis=0)
            if np.linalg.norm(source) > short:
                turn = rotations.between(
                    start @ (default_position(bone.tip) - default_position(bone.joint)), source
                )
                corrections[bone.joint] = turn @ start
    return Alignment(upright, corrections, aims)


def scale(motion: SkeletonMotion, mapped: Mapping[str, int], skeleton: Skeleton) -> float | None:
    """Return the ratio of leg lengths of body and source, else of arm lengths; None without limbs."""
    positions = motion.rest()
    for chain in (("hip", "knee", "ankle"), ("shoulder", "elbow", "wrist")):
        ours = theirs = 0.0
        for side in "lr":
            names = [f"{side}_{part}" for part in chain]
            if not all(name in mapped and name in skeleton for name in names):
                continue
            for a, b in pairwise(names):
                ends = skeleton.centres[[skeleton.number(a), skeleton.number(b)]]
                ours += float(np.linalg.norm(ends[1] - ends[0]))
                theirs += float(np.linalg.norm(positions[mapped[b]] - positions[mapped[a]]))
        if theirs > 0:
            return ours / theirs
    return None


def _facing(rest: Float64, mapped: Mapping[str, int]) -> tuple[Float64, Float64]:
    """Return upright, and the rotation from the default posture's heading to that of the upright rest pose.

    Only the heading: a rest pose stands on its feet, so if its joints lean, that is due to its proportions.
    """
    left = np.zeros(3)
    for a, b in (("l_hip", "r_hip"), ("l_shoulder", "r_shoulder"), ("l_knee", "r_knee")):
        if a in mapped and b in mapped:
            left = rest[mapped[a]] - rest[mapped[b]]
            if np.linalg.norm(left) > 0:
                break
    if not np.linalg.norm(left) > 0:
        raise ModelError("the source has no pair of hips or shoulders apart, so left and right are unknown")
    low = [rest[mapped[j]] for j in ("l_ankle", "r_ankle", "l_knee", "r_knee") if j in mapped]
    high = [rest[mapped[j]] for j in ("skullbase", "vc7", "l_shoulder", "r_shoulder") if j in mapped]
    root = rest[mapped["HumanoidRoot"]]
    up = (np.mean(high, axis=0) if high else root) - (np.mean(low, axis=0) if low else root)
    up = up - left * (up @ left) / (left @ left)
    axis = np.zeros(3)
    strongest = int(np.argmax(np.abs(up)))
    axis[strongest] = np.sign(up[strongest]) or 1.0
    upright = rotations.between(axis, np.array([0.0, 1.0, 0.0]))
    side = upright @ left
    side[1] = 0.0
    side /= np.linalg.norm(side) or 1.0
    return upright, np.stack([side, [0.0, 1.0, 0.0], np.cross(side, [0.0, 1.0, 0.0])], axis=1)

"""The source's rest pose against the default posture: one constant rotation a joint, from geometry.

A joint of the body is turned by W(t) . C: W(t) is the world rotation of the source joint that it was
matched with, and C turns the default posture's bone into the direction that the source's bone has in
the rest pose. So bones point where the source's bones point, whether it rests in T, in A, or standing.
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
"""Bones shorter than this share of the skeleton's size have no direction."""


@dataclass(frozen=True)
class Bone:
    """A row of bones.csv: how the bone that begins at a joint is aligned with the source's.

    base: joint from whose alignment the smallest further rotation is taken, or "facing". aims: joints
    at the bone's other end, the first that is mapped counts. tip: the default posture's joint that a
    source bone without a next joint points to. via: "down" where the smallest rotation goes by way of a limb
    that hangs straight down, so that T, A and standing rest poses twist alike.
    """

    joint: str
    base: str
    aims: tuple[str, ...]
    tip: str
    via: str


@cache
def bones() -> tuple[Bone, ...]:
    """Bones of the limbs, parents first, left then right."""
    text = (files(__package__) / "bones.csv").read_text(encoding="utf-8")
    return tuple(
        Bone(row["joint"], row["base"], tuple(row["aims"].split()), row["tip"], row["via"])
        for side in "lr"
        for row in csv.DictReader(text.replace("?", side).splitlines())
    )


@dataclass(frozen=True, eq=False)
class Alignment:
    """upright: (3, 3), takes the source's frame to y up. corrections: joint -> C (3, 3), for sources
    that are turned upright. aims: joint -> joint at the other end of its bone, where both are mapped.
    """

    upright: Float64
    corrections: dict[str, Float64]
    aims: dict[str, str]


def align(motion: SkeletonMotion, mapped: Mapping[str, int], skeleton: Skeleton) -> Alignment:
    """Corrections of all mapped joints. ModelError where the rest pose has no size or no left and right."""
    rest = motion.rest()
    size = float(np.ptp(rest, axis=0).max())
    if size <= 0:
        raise ModelError("the source's joints all coincide in its rest pose; it has no bones")
    upright, facing = _facing(rest, mapped)
    rest = rest @ upright.T
    ends = motion.end_offsets @ upright.T
    short = SHORT * size

    def default(joint: str) -> Float64:
        place: Float64 = skeleton.centres[skeleton.number(joint)]
        return place

    corrections: dict[str, Float64] = {}
    aims: dict[str, str] = {}

    def aligned(joint: str, aim: str, start: Float64, via: str = "") -> Float64:
        source = rest[mapped[aim]] - rest[mapped[joint]]
        if np.linalg.norm(source) <= short:
            return start
        aims[joint] = aim
        bone = start @ (default(aim) - default(joint))
        if via:
            down = np.array([0.0, -1.0, 0.0])
            return rotations.between(down, source) @ rotations.between(bone, down) @ start
        return rotations.between(bone, source) @ start

    spine = [joint for joint in spine_joints(skeleton) if joint in mapped]
    for joint, above in pairwise(spine):
        corrections[joint] = aligned(joint, above, facing)
    if spine:
        corrections[spine[-1]] = facing
    corrections["sacroiliac"] = facing

    for bone in bones():
        if bone.joint not in mapped:
            continue
        start = corrections.get(bone.base, facing)
        aim = next((aim for aim in bone.aims if aim in mapped), None)
        if aim is not None:
            corrections[bone.joint] = aligned(bone.joint, aim, start, bone.via)
            continue
        corrections[bone.joint] = start
        at_joint = ends[motion.end_parents == mapped[bone.joint]]
        if bone.tip and len(at_joint):
            source = at_joint.mean(axis=0)
            if np.linalg.norm(source) > short:
                turn = rotations.between(start @ (default(bone.tip) - default(bone.joint)), source)
                corrections[bone.joint] = turn @ start
    return Alignment(upright, corrections, aims)


def scale(motion: SkeletonMotion, mapped: Mapping[str, int], skeleton: Skeleton) -> float | None:
    """Length of the body's legs over that of the source's, else of the arms; None where it has neither."""
    places = motion.rest()
    for chain in (("hip", "knee", "ankle"), ("shoulder", "elbow", "wrist")):
        ours = theirs = 0.0
        for side in "lr":
            names = [f"{side}_{part}" for part in chain]
            if not all(name in mapped and name in skeleton for name in names):
                continue
            for a, b in pairwise(names):
                ends = skeleton.centres[[skeleton.number(a), skeleton.number(b)]]
                ours += float(np.linalg.norm(ends[1] - ends[0]))
                theirs += float(np.linalg.norm(places[mapped[b]] - places[mapped[a]]))
        if theirs > 0:
            return ours / theirs
    return None


def _facing(rest: Float64, mapped: Mapping[str, int]) -> tuple[Float64, Float64]:
    """upright, and the rotation from the default posture's heading to that of the (upright) rest pose.

    Heading only: a rest pose stands on its feet, so a lean of its joints is its proportions.
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

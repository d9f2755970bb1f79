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
from fba.body import Skeleton
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
    that T, A and standing rest poses give the same twist; "palm" if the row of knuckles gives the twist;
    "neutral" if the bone of the rest pose counts as that of the default posture, wherever it points: each
    maker lets clavicles begin elsewhere; "flat" if only its heading counts, since soles are flat at rest.
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


@cache
def neutral_joints() -> frozenset[str]:
    """Return the joints whose bones count from where they are in the rest pose: clavicles and feet."""
    return frozenset(bone.joint for bone in bones() if bone.via in ("neutral", "flat"))


@dataclass(frozen=True, eq=False)
class Alignment:
    """Alignment of a source with the body.

    corrections: joint -> C (3, 3). aims: joint -> joint at the other end of its bone, if both are mapped.
    """

    corrections: dict[str, Float64]
    aims: dict[str, str]


def align(motion: SkeletonMotion, mapped: Mapping[str, int], skeleton: Skeleton) -> Alignment:
    """Return the corrections of all mapped joints. ModelError without size, or left and right."""
    rest = motion.rest()
    size = float(np.ptp(rest, axis=0).max())
    if size <= 0:
        raise ModelError("the source's joints all coincide in its rest pose; it has no bones")
    facing = _facing(rest, mapped)
    ends = motion.end_offsets
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
        if via == "down":
            down = np.array([0.0, -1.0, 0.0])
            return rotations.between(down, source) @ rotations.between(bone, down) @ start
        return rotations.between(bone, source) @ start

    def level_foot(joint: str, aim: str) -> Float64:
        theirs = rest[mapped[aim]] - rest[mapped[joint]]
        ours = facing @ (default_position(aim) - default_position(joint))
        if min(np.hypot(line[0], line[2]) for line in (theirs, ours)) <= short:
            return facing
        angle = np.arctan2(theirs[0], theirs[2]) - np.arctan2(ours[0], ours[2])
        return rotations.turn(np.array([0.0, 1.0, 0.0]), np.array(angle)) @ facing

    def turn_palm(joint: str, aim: str) -> None:
        side = joint[0]
        one, other = (
            f"{side}_index1",
            next((f"{side}_{finger}1" for finger in ("pinky", "ring") if f"{side}_{finger}1" in mapped), ""),
        )
        if one not in mapped or not other or joint not in aims:
            return
        along = rest[mapped[aim]] - rest[mapped[joint]]
        row = rest[mapped[other]] - rest[mapped[one]]
        own = corrections[joint] @ (default_position(other) - default_position(one))
        along = along / np.linalg.norm(along)
        row, own = row - along * (along @ row), own - along * (along @ own)
        if np.linalg.norm(row) <= short or np.linalg.norm(own) == 0:
            return
        angle = np.arctan2(np.cross(own, row) @ along, own @ row)
        corrections[joint] = rotations.turn(along, np.array(angle)) @ corrections[joint]

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
            if bone.via == "neutral":
                corrections[bone.joint] = facing
            elif bone.via == "flat":
                corrections[bone.joint] = level_foot(bone.joint, aim)
            elif bone.via == "palm":
                turn_palm(bone.joint, aim)
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
    return Alignment(corrections, aims)


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


def _facing(rest: Float64, mapped: Mapping[str, int]) -> Float64:
    """Return the rotation (3, 3) from the default posture's heading to that of the rest pose, y up.

    Only the heading: a rest pose stands on its feet, so if its joints lean, that is due to its proportions.
    """
    for a, b in (("l_hip", "r_hip"), ("l_shoulder", "r_shoulder"), ("l_knee", "r_knee")):
        if a in mapped and b in mapped:
            left = (rest[mapped[a]] - rest[mapped[b]]) * [1.0, 0.0, 1.0]
            length = float(np.linalg.norm(left))
            if length > 0:
                side = left / length
                return np.stack([side, [0.0, 1.0, 0.0], np.cross(side, [0.0, 1.0, 0.0])], axis=1)
    raise ModelError("the source has no pair of hips or shoulders apart, so left and right are unknown")

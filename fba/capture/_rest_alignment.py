"""Align the source's rest pose with the default posture: one constant rotation for each joint.

A joint of the body is turned by W(t) . C: W(t) is the world rotation of the source joint that it was matched
with, and C turns the default posture's bone in the direction of the source's bone in the rest pose. So bones
point in the directions of the source's bones, whether its rest pose is a T, an A, or standing.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from itertools import pairwise

import numpy as np

from fba import rotations
from fba.arrays import Float64
from fba.body import Skeleton
from fba.capture._spine import joints as spine_joints
from fba.capture.motion import MappedMotion
from fba.errors import ModelError
from fba.text_files import packaged_rows

MIN_BONE_LENGTH = 1e-6
"""Smallest length of a bone that has a direction, as a share of the skeleton's size."""


@dataclass(frozen=True)
class Bone:
    """A row of bones.csv: how the bone that begins at a joint is aligned with the source's.

    base: joint whose alignment is rotated as little as possible, or "facing". aims: joints at the bone's
    other end, of which the first that is mapped counts. tip: the default posture's joint to which a source
    bone without a next joint points. via: "down" if the rotation goes via a limb that hangs straight down, so
    that T, A and standing rest poses give the same twist; "palm" if the row of knuckles gives the twist;
    "neutral" if the bone at rest counts as that of the default posture, wherever it points, since clavicles
    begin at other places in each source; "flat" if only its heading counts, since soles are flat at rest.
    """

    joint: str
    base: str
    aims: tuple[str, ...]
    tip: str
    via: str


@cache
def bones() -> tuple[Bone, ...]:
    """Return the bones of the limbs, parents first, left then right."""
    rows = [
        {key: text.replace("?", side) for key, text in row.items()}
        for side in "lr"
        for row in packaged_rows(__package__, "bones.csv")
    ]
    return tuple(
        Bone(row["joint"], row["base"], tuple(row["aims"].split()), row["tip"], row["via"]) for row in rows
    )


@cache
def neutral_joints() -> frozenset[str]:
    """Return the joints whose bones at rest count as those of the default posture: clavicles and feet."""
    return frozenset(bone.joint for bone in bones() if bone.via in ("neutral", "flat"))


@dataclass(frozen=True, eq=False)
class Alignment:
    """Alignment of a source with the body.

    corrections: joint -> C (3, 3). aims: joint -> joint at the other end of its bone, if both are mapped.
    """

    corrections: dict[str, Float64]
    aims: dict[str, str]


def align(source: MappedMotion, skeleton: Skeleton) -> Alignment:
    """Return the corrections of all mapped joints. ModelError without size, or left and right."""
    aligner = _Aligner(source, skeleton)
    aligner.align_spine()
    for bone in bones():
        if bone.joint in source:
            aligner.align_limb(bone)
    return Alignment(aligner.corrections, aligner.aims)


class _Aligner:
    """Finds the corrections of joints one by one, parents first. `facing` is the correction of the pelvis."""

    def __init__(self, source: MappedMotion, skeleton: Skeleton) -> None:
        self.source, self.skeleton = source, skeleton
        size = float(np.ptp(source.motion.rest(), axis=0).max())
        if size <= 0:
            raise ModelError("the source's joints all coincide in its rest pose; it has no bones")
        self.shortest = MIN_BONE_LENGTH * size
        self.facing = _facing(source)
        self.corrections: dict[str, Float64] = {"sacroiliac": self.facing}
        self.aims: dict[str, str] = {}

    def align_spine(self) -> None:
        spine = [joint for joint in spine_joints(self.skeleton) if joint in self.source]
        for joint, above in pairwise(spine):
            self.corrections[joint] = self._align_bone(joint, above, self.facing)
        self.corrections[spine[-1]] = self.corrections["sacroiliac"] = self.facing

    def align_limb(self, bone: Bone) -> None:
        start = self.corrections.get(bone.base, self.facing)
        aim = next((aim for aim in bone.aims if aim in self.source), None)
        if aim is None:
            correction = self._align_last_bone(bone, start)
        else:
            correction = self._align_bone(bone.joint, aim, start, bone.via)
            if bone.via == "neutral":
                correction = self.facing
            elif bone.via == "flat":
                correction = self._level_foot(bone.joint, aim)
            elif bone.via == "palm":
                correction = self._turn_palm(bone.joint, aim, correction)
        self.corrections[bone.joint] = correction

    def _source_bone(self, joint: str, aim: str) -> Float64:
        bone: Float64 = self.source.rest[aim] - self.source.rest[joint]
        return bone

    def _align_bone(self, joint: str, aim: str, start: Float64, via: str = "") -> Float64:
        """Return the start, turned so that the body's bone points where the source's does."""
        source = self._source_bone(joint, aim)
        if np.linalg.norm(source) <= self.shortest:
            return start
        self.aims[joint] = aim
        bone = start @ self.skeleton.bone(joint, aim)
        if via == "down":
            down = np.array([0.0, -1.0, 0.0])
            return rotations.between(down, source) @ rotations.between(bone, down) @ start
        return rotations.between(bone, source) @ start

    def _align_last_bone(self, bone: Bone, start: Float64) -> Float64:
        """Return the start, turned so that a bone without a next joint points to the end of the source's."""
        motion = self.source.motion
        tips = motion.end_offsets[motion.end_parents == self.source.mapped[bone.joint]]
        if not bone.tip or not len(tips):
            return start
        source = tips.mean(axis=0)
        if np.linalg.norm(source) <= self.shortest:
            return start
        return rotations.between(start @ self.skeleton.bone(bone.joint, bone.tip), source) @ start

    def _level_foot(self, joint: str, aim: str) -> Float64:
        """Return the correction of a flat sole: only the heading of the foot counts."""
        source = self._source_bone(joint, aim)
        body = self.facing @ self.skeleton.bone(joint, aim)
        if min(np.hypot(bone[0], bone[2]) for bone in (source, body)) <= self.shortest:
            return self.facing
        angle = np.arctan2(source[0], source[2]) - np.arctan2(body[0], body[2])
        return rotations.turn(np.array([0.0, 1.0, 0.0]), np.array(angle)) @ self.facing

    def _turn_palm(self, joint: str, aim: str, correction: Float64) -> Float64:
        """Return the correction, turned about the hand's length so that the rows of knuckles agree."""
        side = joint[0]
        first = f"{side}_index1"
        lasts = (f"{side}_{finger}1" for finger in ("pinky", "ring"))
        last = next((knuckle for knuckle in lasts if knuckle in self.source), None)
        if first not in self.source or last is None or joint not in self.aims:
            return correction
        along = self._source_bone(joint, aim)
        along = along / np.linalg.norm(along)
        source, body = self._source_bone(first, last), correction @ self.skeleton.bone(first, last)
        source, body = source - along * (along @ source), body - along * (along @ body)
        if np.linalg.norm(source) <= self.shortest or np.linalg.norm(body) == 0:
            return correction
        angle = np.arctan2(np.cross(body, source) @ along, body @ source)
        return rotations.turn(along, np.array(angle)) @ correction


def scale(source: MappedMotion, skeleton: Skeleton) -> float | None:
    """Return the ratio of leg lengths of body and source, else of arm lengths; None without limbs."""
    for chain in (("hip", "knee", "ankle"), ("shoulder", "elbow", "wrist")):
        body = captured = 0.0
        for side in "lr":
            names = [f"{side}_{part}" for part in chain]
            if not all(name in source and name in skeleton for name in names):
                continue
            for a, b in pairwise(names):
                ends = skeleton.centres[[skeleton.number(a), skeleton.number(b)]]
                body += float(np.linalg.norm(ends[1] - ends[0]))
                captured += float(np.linalg.norm(source.rest[b] - source.rest[a]))
        if captured > 0:
            return body / captured
    return None


def _facing(source: MappedMotion) -> Float64:
    """Return the rotation (3, 3) from the default posture's heading to that of the rest pose, y up.

    Only the heading: a rest pose stands on its feet, so if its joints lean, that is due to its proportions.
    """
    for a, b in (("l_hip", "r_hip"), ("l_shoulder", "r_shoulder"), ("l_knee", "r_knee")):
        if a in source and b in source:
            left = (source.rest[a] - source.rest[b]) * [1.0, 0.0, 1.0]
            length = float(np.linalg.norm(left))
            if length > 0:
                side = left / length
                return np.stack([side, [0.0, 1.0, 0.0], np.cross(side, [0.0, 1.0, 0.0])], axis=1)
    raise ModelError("the source has no pair of hips or shoulders apart, so left and right are unknown")

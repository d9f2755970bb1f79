"""Which joint of a source is which joint of the body: by a family of names, or else word by word.

And whether the joints that a source calls left are on the person's left side: up and ahead give the left, and
toes and knees point ahead. They point backwards in a file whose names are swapped or that was mirrored, as by
a program with left-handed axes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fba.body import ROOT, Skeleton
from fba.capture import _named_bones as named_bones
from fba.capture import matching
from fba.capture.motion import SkeletonMotion
from fba.errors import ModelError, Remedy
from fba.rotations import unit

CORE = tuple(
    f"{side}_{joint}" for side in "lr" for joint in ("hip", "knee", "ankle", "shoulder", "elbow", "wrist")
)
"""Joints that a whole body has."""
ENDS = {"l_metatarsal": "l_ankle", "r_metatarsal": "r_ankle", "skullbase": ROOT}
"""Joints whose names differ within a family, and the joint that they hang on, directly or far below."""
LIMBS = tuple(
    tuple(f"{side}_{joint}" for joint in chain)
    for side in "lr"
    for chain in (("hip", "knee", "ankle"), ("shoulder", "elbow", "wrist"))
)
"""Joints of each limb: a source that has one of them should have all."""
MAX_BACKWARD_COSINE = -0.5
"""Largest mean cosine of the angle between ahead and knees that point backwards, or toes where knees hardly
bend. In real files it is 0.8 to 1 for knees, 0.15 to 1 for toes."""
MIN_KNEE_BEND = 0.12
"""Smallest distance of a bent knee from the line from hip to ankle, in leg lengths."""
MIN_BENT_FRAMES = 5
"""Smallest number of frames with a bent knee that show where knees point."""


@dataclass(frozen=True)
class Bones:
    """The joints of a source that are joints of the body.

    family: of the names. joints: joint of the body -> number of the source's. confidence: 0 to 1. reason: for
    people.
    """

    family: str
    joints: dict[str, int]
    confidence: float
    reason: str


def find_bones(motion: SkeletonMotion, joints: Mapping[str, str] | None, skeleton: Skeleton) -> Bones:
    """Return the bones of a motion. joints: as for `from_skeleton`.

    A family that names all limbs is taken as it is. Otherwise names are read word by word; where that finds
    more limbs, its joints are added to a family that names at least as many joints, and else replace it.
    ModelError where no bones are found.
    """
    given = motion.declared or None if joints is None else joints
    if given is not None:
        family, mapped = matching.map_joints(motion.names, given, skeleton)
        source = "given" if joints is not None else "the file says"
        return Bones(family, mapped, 1.0, f"{len(mapped)} joints as {source}")
    try:
        family, by_family = matching.map_joints(motion.names, None, skeleton)
        failure = None
    except ModelError as error:
        family, by_family, failure = "", {}, error
    core = _count_core(by_family, motion)
    lacks_ends = any(joint in skeleton and joint not in by_family for joint in ENDS)
    if failure is not None or core < len(CORE) or (lacks_ends and len(by_family) < len(motion.names)):
        by_words = named_bones.find(motion, skeleton)
        if _count_core(by_words, motion) > core:
            both = _fill_limbs(by_family, by_words)
            if len(by_family) >= len(by_words) and _count_core(both, motion) == _count_core(by_words, motion):
                by_family = both  # a family, in which somebody renamed a few joints
            else:
                family, by_family, failure = "words", by_words, None
        if family != "words":
            by_family = _fill_ends(by_family, by_words)
    if failure is not None:
        raise failure
    if count_limbs(by_family, motion) < 2:
        raise _unknown_bones(motion, by_family)
    missing = [joint for joint in CORE if joint not in by_family]
    sure = (1.0 if family != "words" else 0.9) - 0.03 * len(missing)
    names = "the words in their names" if family == "words" else f"names as of {family!r}"
    return Bones(family, by_family, sure, f"{len(by_family)} of {len(motion.names)} joints by {names}")


def _fill_limbs(mapped: Mapping[str, int], others: Mapping[str, int]) -> dict[str, int]:
    """Return joints, and those of limbs that are missing among them from others."""
    used = set(mapped.values())
    missing = {joint: number for joint, number in others.items() if joint in CORE and number not in used}
    return {**missing, **mapped}


def _fill_ends(mapped: Mapping[str, int], others: Mapping[str, int]) -> dict[str, int]:
    """Return joints, and missing ones of toes and head from others that agree on the joint above."""
    used = set(mapped.values())
    return dict(mapped) | {
        joint: others[joint]
        for joint, above in ENDS.items()
        if joint not in mapped
        and others.get(joint, -1) not in (used | {-1})
        and others.get(above) == mapped.get(above)
    }


def count_limbs(mapped: Mapping[str, int], motion: SkeletonMotion) -> int:
    """Return the number of arms and legs of whose upper bone both joints are mapped."""
    return sum(
        upper in mapped and lower in mapped and _is_below(motion, mapped[lower], mapped[upper])
        for upper, lower, _ in LIMBS
    )


def _count_core(mapped: Mapping[str, int], motion: SkeletonMotion) -> int:
    """Return the number of core joints that are mapped and hang where they should."""
    count = 0
    for limb in LIMBS:
        above = mapped.get(ROOT)
        for joint in limb:
            number = mapped.get(joint)
            if number is None:
                continue
            if above is not None and not _is_below(motion, number, above):
                continue
            count += 1
            above = number
    return count


def _is_below(motion: SkeletonMotion, joint: int, above: int) -> bool:
    while joint > above:
        joint = int(motion.parents[joint])
    return joint == above


def _unknown_bones(motion: SkeletonMotion, mapped: Mapping[str, int]) -> ModelError:
    found = ", ".join(f"{motion.names[number]} as {joint}" for joint, number in list(mapped.items())[:4])
    seen = f"; only {found} could be found" if found else ""
    return ModelError(
        f"no human skeleton is found: no arms or legs are among these {len(motion.names)} joint names: "
        f"{_listed(motion)}{seen}; {_sought()}"
    ).with_remedies(matching.GIVE_JOINTS)


def check_extent(motion: SkeletonMotion) -> None:
    """Raise ModelError for a motion whose joints coincide, as of a thing that moves as a whole."""
    if np.ptp(motion.rest(), axis=0).any():
        return
    count = len(motion.names)
    many = "is but one joint" if count == 1 else f"are {count} joints, all at one place"
    raise ModelError(
        f"no human skeleton is found: there {many} ({_listed(motion)}), as of a thing that moves as a whole; "
        f"{_sought()}; choose a file, or a clip, with a person's skeleton"
    )


def _listed(motion: SkeletonMotion) -> str:
    return ", ".join(motion.names[:8]) + (", ..." if len(motion.names) > 8 else "")


def _sought() -> str:
    """Return which names were looked for."""
    return (
        "looked for were hips, legs and arms by the names of many makers (Hips, LeftUpLeg, LeftArm; pelvis, "
        "thigh_l, upperarm_l; l_hip, l_shoulder) and by words in names"
    )


def refuse_swapped_sides(motion: SkeletonMotion, mapped: Mapping[str, int]) -> None:
    """Raise ModelError if toes and knees of a motion point backwards, so that joints called left are right.

    Motions in which neither is known pass, and so do those in which toes and knees disagree.
    """
    needed = [f"{side}_{joint}" for side in "lr" for joint in ("hip", "knee", "ankle")]
    if not all(joint in mapped for joint in needed):
        return
    positions = motion.world()[1]
    left = positions[:, mapped["l_hip"]] - positions[:, mapped["r_hip"]]
    toes: list[float] = []
    knees: list[float] = []
    for side in "lr":
        hip, knee, ankle = (positions[:, mapped[f"{side}_{joint}"]] for joint in ("hip", "knee", "ankle"))
        ahead = unit(np.cross(left, hip - ankle))  # as this leg sees it, however the trunk leans
        line, thigh = unit(ankle - hip), knee - hip
        off = thigh - line * (thigh * line).sum(axis=1, keepdims=True)
        reach = np.linalg.norm(thigh, axis=1) + np.linalg.norm(ankle - knee, axis=1)
        bent = np.linalg.norm(off, axis=1) > MIN_KNEE_BEND * reach
        knees += (unit(off[bent]) * ahead[bent]).sum(axis=1).tolist()
        if f"{side}_metatarsal" in mapped:
            toe_bone = unit(positions[:, mapped[f"{side}_metatarsal"]] - ankle)
            toes += (toe_bone * ahead).sum(axis=1).tolist()
    toe = float(np.mean(toes)) if toes else None
    cosine = float(np.mean(knees)) if len(knees) >= MIN_BENT_FRAMES else toe
    if cosine is None or cosine > MAX_BACKWARD_COSINE or (toe is not None and toe > 0):
        return
    raise ModelError(
        "left and right are swapped: toes and knees point backwards, seen from the joints that are called "
        "left and right; the file is mirrored, or its names are exchanged"
    ).with_remedies(
        Remedy("joints", "mirror it, or name joints of each side with {}", "{'LeftArm': 'r_shoulder', ...}")
    )

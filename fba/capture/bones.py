"""Which joint of a source is which joint of the body: by a family of names, or else word by word.

Of the families in joint_names.csv, a source "(Left|Right)Arm" stands for both sides, its joint "?_shoulder"
for l_shoulder and r_shoulder. The standard's own names are a family as well, "h-anim".

And whether the joints that a source calls left are on the person's left side: up and ahead give the left, and
toes and knees point ahead. They point backwards in a file whose names are swapped or that was mirrored, as by
a program with left-handed axes.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import islice

import numpy as np

from fba.body import ROOT, Skeleton
from fba.capture import _named_bones as named_bones
from fba.capture.motion import MappedMotion, SkeletonMotion
from fba.errors import ModelError, Remedy
from fba.name_maps import both_sides, simplify
from fba.parameters import joints as standard_joints
from fba.rotations import unit
from fba.text_files import packaged_rows

MIN_NAMES = 5
"""Smallest number of names by which a family fits."""
MAX_PREFIX_LENGTH = 100
"""Largest number of characters of a shared prefix: "Scene|Bob_Rig|mixamorig:"."""
MAX_PREFIX_MARKS = 8
"""Largest number of separators in a shared prefix."""
PREFIX_NAMES = 8
"""Number of first names that are tried as the beginning of the others: "Bip01", "Bip01 Pelvis"."""
GIVE_JOINTS = Remedy(
    "joints", "name each joint's counterpart in the standard with {}", "{'Pelvis': 'HumanoidRoot', ...}"
)
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
        family, mapped = map_joints(motion.names, given, skeleton)
        source = "given" if joints is not None else "the file says"
        return Bones(family, mapped, 1.0, f"{len(mapped)} joints as {source}")
    try:
        family, by_family = map_joints(motion.names, None, skeleton)
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


@cache
def families() -> dict[str, dict[str, str]]:
    """Return by family: simplified source name -> joint of the standard."""
    result: dict[str, dict[str, str]] = {}
    for row in packaged_rows(__package__, "joint_names.csv"):
        family = result.setdefault(row["family"], {})
        for side, source in both_sides(row["source"]):
            family[simplify(source)] = row["joint"].replace("?", side)
    result["h-anim"] = {simplify(joint.name): joint.name for joint in standard_joints()}
    return result


def match(names: Sequence[str]) -> tuple[str, dict[str, int]]:
    """Return the family that fits most names, and joint of the standard -> number of the source joint.

    Names are also tried without a prefix that most of them share ("Bob_Hips", "Bob_Spine"). Of several source
    joints with one name, the first counts. ModelError if no family fits.
    """
    best: tuple[str, dict[str, int]] = ("", {})
    for prefix in ("", *_shared_prefixes(names)):
        plain = [simplify(name[len(prefix) :]) for name in names]
        for family, table in families().items():
            mapped: dict[str, int] = {}
            for number, name in enumerate(plain):
                joint = table.get(name)
                if joint is not None:
                    mapped.setdefault(joint, number)
            if len(mapped) > len(best[1]) and ROOT in mapped:
                best = (family, mapped)
    if len(best[1]) < MIN_NAMES:
        first_names = ", ".join(names[:8]) + (", ..." if len(names) > 8 else "")
        raise ModelError(
            f"no known skeleton family fits these {len(names)} joint names: {first_names}"
        ).with_remedies(GIVE_JOINTS)
    return best


def _shared_prefixes(names: Sequence[str]) -> list[str]:
    """Return the prefixes that at least half of the names share: up to a separator, or a full name."""
    counts: Counter[str] = Counter()
    for name in names:
        marks = re.finditer(r"[_ .|-]+", name[:MAX_PREFIX_LENGTH])
        counts.update({name[: mark.end()] for mark in islice(marks, MAX_PREFIX_MARKS)})
    counts.update({name: sum(n.startswith(name) for n in names) for name in names[:PREFIX_NAMES]})
    many = [prefix for prefix, count in counts.items() if 2 * count >= len(names) > 1]
    return sorted(many, key=len)


def map_joints(
    names: Sequence[str], joints: Mapping[str, str] | None, skeleton: Skeleton
) -> tuple[str, dict[str, int]]:
    """Return the family of a source's names, and body joint -> number of the source's joint.

    joints: source's joint -> body's joint, for which the family is ""; None to match by name. Joints that the
    skeleton lacks are left out. ModelError where no family fits or the skeleton's root is not `ROOT`,
    ValueError for an unknown joint.
    """
    check_root(skeleton)
    if joints is None:
        family, mapped = match(names)
        return family, {joint: number for joint, number in mapped.items() if joint in skeleton}
    mapped = {}
    for source, joint in joints.items():
        if joint not in skeleton:
            raise ValueError(f"joints: the body has no joint {joint!r}")
        if source not in names:
            raise ValueError(f"joints: the motion has no joint {source!r}")
        mapped[joint] = names.index(source)
    if ROOT not in mapped:
        raise ValueError(f"joints: one source joint must be given for {ROOT}")
    return "", mapped


def check_root(skeleton: Skeleton) -> None:
    """Raise ModelError if the root of the body's skeleton is not `ROOT`."""
    if skeleton.names[0] != ROOT:
        raise ModelError(
            f"the root of the body's skeleton is {skeleton.names[0]!r}, but capture moves {ROOT!r}: "
            "rename the root, or put one above it"
        )


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
    ).with_remedies(GIVE_JOINTS)


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


def refuse_swapped_sides(source: MappedMotion) -> None:
    """Raise ModelError if toes and knees of a motion point backwards, so that joints called left are right.

    Motions in which neither is known pass, and so do those in which toes and knees disagree.
    """
    needed = [f"{side}_{joint}" for side in "lr" for joint in ("hip", "knee", "ankle")]
    if not all(joint in source for joint in needed):
        return
    positions = source.positions
    left = positions["l_hip"] - positions["r_hip"]
    toes: list[float] = []
    knees: list[float] = []
    for side in "lr":
        hip, knee, ankle = (positions[f"{side}_{joint}"] for joint in ("hip", "knee", "ankle"))
        ahead = unit(np.cross(left, hip - ankle))  # as this leg sees it, however the trunk leans
        line, thigh = unit(ankle - hip), knee - hip
        off = thigh - line * (thigh * line).sum(axis=1, keepdims=True)
        reach = np.linalg.norm(thigh, axis=1) + np.linalg.norm(ankle - knee, axis=1)
        bent = np.linalg.norm(off, axis=1) > MIN_KNEE_BEND * reach
        knees += (unit(off[bent]) * ahead[bent]).sum(axis=1).tolist()
        if f"{side}_metatarsal" in source:
            toe_bone = unit(positions[f"{side}_metatarsal"] - ankle)
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

"""Match source joints with joints of the standard by families of names, see joint_names.csv.

A source "(Left|Right)Arm" stands for both sides, its joint "?_shoulder" for l_shoulder and r_shoulder.
Besides the families of the file, the standard's own names are one, "h-anim".
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from functools import cache
from itertools import islice

from fba.body import ROOT, Skeleton
from fba.errors import ModelError, Remedy
from fba.name_maps import both_sides, simplify
from fba.parameters import joints
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


@cache
def families() -> dict[str, dict[str, str]]:
    """Return by family: simplified source name -> joint of the standard."""
    result: dict[str, dict[str, str]] = {}
    for row in packaged_rows(__package__, "joint_names.csv"):
        family = result.setdefault(row["family"], {})
        for side, source in both_sides(row["source"]):
            family[simplify(source)] = row["joint"].replace("?", side)
    result["h-anim"] = {simplify(joint.name): joint.name for joint in joints()}
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

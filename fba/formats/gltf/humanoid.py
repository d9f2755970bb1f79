"""Bones of people that a glTF file itself declares: VRM 0 and 1 (avatars) and VRMA (VRM's animations).

Sources: the extensions VRM (0.0), VRMC_vrm and VRMC_vrm_animation (1.0) of the VRM Consortium.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

from fba.gltf import Gltf, Value, optional_member
from fba.text_files import packaged_rows

EXTENSIONS = {"VRM": "VRM 0", "VRMC_vrm": "VRM 1", "VRMC_vrm_animation": "VRMA"}
MOST_BONES = 200
OLD_THUMB = {"ThumbIntermediate": "ThumbProximal", "ThumbProximal": "ThumbMetacarpal"}
"""VRM 1's names of bones by VRM 0's, without the side, where a name means another bone."""


@dataclass(frozen=True, eq=False)
class Humanoid:
    """The bones that a file declares.

    kind: "VRM 0", "VRM 1" or "VRMA". bones: VRM 1's names of bones ("leftUpperArm"), and their nodes.
    """

    kind: str
    bones: Mapping[str, int]

    @property
    def joints(self) -> dict[int, str]:
        """The node of each bone of the body, and the joint of the standard that begins there."""
        table = joints_of_bones()
        return {node: table[bone] for bone, node in self.bones.items() if bone in table}


@cache
def joints_of_bones() -> dict[str, str]:
    """Return joints of the standard by VRM 1's names of bones."""
    result: dict[str, str] = {}
    for row in packaged_rows(__package__, "humanoid_bones.csv"):
        bone, joint = row["bone"], row["joint"]
        sides = re.match(r"\((\w+)\|(\w+)\)", bone)
        for side, word in zip("lr", sides.groups(), strict=True) if sides else [("", "")]:
            result[bone.replace(sides[0], word) if sides else bone] = joint.replace("?", side)
    return result


def find_humanoid(gltf: Gltf) -> Humanoid | None:
    """Return the bones that a file declares; None if it has none of the extensions.

    ModelError if the extension names nodes that do not exist, or two bones at one node.
    """
    for name, kind in EXTENSIONS.items():
        content = optional_member(gltf.document.get("extensions"), name)
        people = optional_member(content, "humanoid")
        if people is None:
            continue
        listed = people.member("humanBones")
        bones: dict[str, int] = {}
        for bone, reference in _pairs(listed, kind):
            node = reference.integer(-1, 1 << 30)
            if node < 0:  # UniVRM's mark of a missing bone
                continue
            node = reference.index(len(gltf.nodes), "node")
            if node in bones.values():
                other = next(each for each, taken in bones.items() if taken == node)
                raise reference.error(f"bones {other!r} and {bone!r} are both node {node}")
            bones.setdefault(bone, node)
        return Humanoid(kind, bones)
    return None


def _pairs(listed: Value, kind: str) -> list[tuple[str, Value]]:
    """Return VRM 1's name and the node of each bone."""
    if kind != "VRM 0":
        return [(bone, entry.member("node")) for bone, entry in listed.members()]
    result = []
    for entry in listed.elements(MOST_BONES):
        name = entry.member("bone").text(100)
        side = re.match(r"left|right", name)
        start = side[0] if side else ""
        bone = name.removeprefix(start)
        result.append((start + OLD_THUMB.get(bone, bone), entry.member("node")))
    return result

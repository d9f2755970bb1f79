"""Unity's humanoid bones: their parents, the joints of the standard that they are, and Unity's axes."""

from __future__ import annotations

from functools import cache

import numpy as np

from fba.arrays import Float64
from fba.formats.gltf.humanoid import OLD_THUMB, joints_of_bones
from fba.text_files import packaged_rows

TO_OUR_AXES = np.array([-1.0, 1.0, 1.0])
"""Factors of a position: Unity's x points to the subject's right, ours to the left."""


@cache
def parents() -> dict[str, str]:
    """Return the parent of each bone, "" for the hips; parents come first."""
    result: dict[str, str] = {}
    for row in packaged_rows(__package__, "unity_bones.csv"):
        for side in ("Left", "Right") if "?" in row["bone"] else ("",):
            result[row["bone"].replace("?", side)] = row["parent"].replace("?", side)
    return result


def above(bone: str) -> list[str]:
    """Return the bones above a bone, the nearest first."""
    result = []
    while bone := parents()[bone]:
        result.append(bone)
    return result


@cache
def joint_of(bone: str) -> str | None:
    """Return the joint of the standard at the start of a bone; None for eyes and the jaw."""
    side = next((word for word in ("Left", "Right") if bone.startswith(word)), "")
    plain = bone.removeprefix(side)
    plain = OLD_THUMB.get(plain, plain)
    name = side.lower() + plain if side else plain[0].lower() + plain[1:]
    return joints_of_bones().get(name)


def position(numbers: Float64) -> Float64:
    """Return a position (3,) in our axes, y up and right-handed, for a position in Unity's."""
    result: Float64 = numbers * TO_OUR_AXES
    return result


def rotation(numbers: Float64) -> Float64 | None:
    """Return Unity's quaternion (x, y, z, w) as (w, x, y, z) in our axes; None if it is far from length 1."""
    length = float(np.linalg.norm(numbers))
    if not 0.5 < length < 2:
        return None
    x, y, z, w = (numbers / length).tolist()
    return np.array([w, x, -y, -z])

"""The animated skeleton: 1.75 m tall, resting in a T pose, facing +z, in centimetres (skeleton.csv)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from performance.curves import read_table

Float = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Joint:
    """A joint. offset: (3,) from the parent, cm. channels: its angles, such as "ZXY"; "" for an end."""

    name: str
    parent: str
    offset: Float
    has_position: bool
    channels: str


def joints() -> list[Joint]:
    """The joints, depth first as in BVH; a row with ? in the table stands for left (+x) and right."""
    table: list[Joint] = []
    for row in read_table("skeleton.csv"):
        kinds = row["channels"].split()
        for side, sign in (("Left", 1), ("Right", -1)):
            offset = np.array([float(row["x"]) * sign, float(row["y"]), float(row["z"])])
            name, parent = row["joint"].replace("?", side), row["parent"].replace("?", side)
            table.append(Joint(name, parent, offset, len(kinds) == 2, kinds[-1] if kinds else ""))
            if "?" not in row["joint"]:
                break
    result: list[Joint] = []
    waiting = [joint for joint in table if not joint.parent]
    while waiting:
        joint = waiting.pop()
        result.append(joint)
        waiting += reversed([child for child in table if child.parent == joint.name])
    return result


def offsets() -> dict[str, Float]:
    """Offsets (3,) from the parent by name, centimetres."""
    return {joint.name: joint.offset for joint in joints()}

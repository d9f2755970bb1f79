"""The skeleton that is animated: 1.75 m, at rest in a T, facing +z, in centimetres (skeleton.csv)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from performance.curves import rows

Float = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Joint:
    """offset: (3,) from the parent. channels: as "ZXY", the angles that its motion needs; "" for an end."""

    name: str
    parent: str
    offset: Float
    places: bool
    channels: str


def joints() -> list[Joint]:
    """Depth first, as BVH has them; a row with ? in the table stands for left (+x) and right."""
    table: list[Joint] = []
    for row in rows("skeleton.csv"):
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
    """Name -> offset from the parent, centimetres."""
    return {joint.name: joint.offset for joint in joints()}

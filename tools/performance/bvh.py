"""Writes BVH: a skeleton, then a line of numbers per frame, identical on every platform."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from performance.curves import RATE, Float
from performance.skeleton import Joint, joints

BODY_RATE = 60


def format_bvh(local: dict[str, Rotation], root: Float) -> str:
    """The text of a BVH file for rotations and root positions at RATE samples a second."""
    tree = joints()
    step = RATE // BODY_RATE
    columns = [root[::step].T] if tree[0].has_position else []
    columns += [_angles(local[joint.name][::step], joint.channels).T for joint in tree if joint.channels]
    numbers = np.concatenate(columns).T
    lines = ["HIERARCHY", *_hierarchy(tree, tree[0], 0), "MOTION", f"Frames: {len(numbers)}"]
    lines.append(f"Frame Time: {1 / BODY_RATE:.7f}")
    lines += [" ".join(_decimal(value) for value in row) for row in numbers]
    return "\n".join(lines) + "\n"


def _angles(turns: Rotation, channels: str) -> Float:
    """(T, channels) degrees, outermost first, without jumps by whole turns."""
    if len(channels) == 3:
        angles = turns.as_euler(channels)
    else:  # joints with fewer channels: their other angles are zero here
        order = channels + "".join(axis for axis in "ZXY" if axis not in channels)
        angles = turns.as_euler(order)[:, : len(channels)]
    result: Float = np.rad2deg(np.unwrap(angles, axis=0))
    return result


def _hierarchy(tree: list[Joint], joint: Joint, depth: int) -> list[str]:
    indent = "  " * depth
    offset = f"{indent}  OFFSET " + " ".join(_decimal(value) for value in joint.offset)
    if not joint.channels:
        return [f"{indent}End Site", f"{indent}{{", offset, f"{indent}}}"]
    names = [f"{axis}position" for axis in "XYZ"] if joint.has_position else []
    names += [f"{axis}rotation" for axis in joint.channels]
    lines = [f"{indent}{'JOINT' if joint.parent else 'ROOT'} {joint.name}", f"{indent}{{", offset]
    lines.append(f"{indent}  CHANNELS {len(names)} {' '.join(names)}")
    for child in tree:
        if child.parent == joint.name:
            lines += _hierarchy(tree, child, depth + 1)
    return [*lines, f"{indent}}}"]


def _decimal(value: float) -> str:
    """A number with at most two decimals: accurate to 0.05 mm, 0.005 degrees."""
    text = f"{value:.2f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text

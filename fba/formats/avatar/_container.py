"""Containers of the Avatar Representation Format as ZIP archives: names and rest pose of joints, shapes.

In streams that no container explains, numbers of shapes and joints have the meaning of `FACE_PROFILE` and
`BODY_PROFILE`, profiles of this project.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import PurePosixPath
from typing import Any

import numpy as np

from fba import rotations
from fba.arrays import Float64, Int64, to_float64
from fba.body import Skeleton
from fba.carriage.avatar_units import begins_stream
from fba.errors import FormatError
from fba.formats.zip_files import read_members
from fba.limits import Limits
from fba.source import Path

FACE_PROFILE = "arkit-face"
"""Shapes are ARKit's 52 in ARKit's order."""
BODY_PROFILE = "mpeg4-body"
"""Joints are those of `Skeleton.default()` in its order, in metres; behind them come `FACE_JOINTS`."""
FACE_JOINTS = ("head", "left_eye", "right_eye")
"""Joints in the place of skullbase, whose children they are, turned by FAPs 48 to 50 and 23 to 26."""
DOCUMENT = "arf.json"
FLOAT32 = 5126
"""Component type of dense tensors of floats, as in glTF."""
LARGEST, SMALLEST = 1e9, 1e-12
"""Bounds of numbers, and of determinants, of matrices that can be inverted."""


@dataclass(frozen=True, eq=False)
class Avatar:
    """What a container says of the numbers in its streams.

    shapes: name of each blendshape. joints: name of each joint, by number. parents: int64 (J,), -1 for roots.
    rest: float64 (J, 4, 4), to the world, in the bind pose or, without one, as the nodes rest.
    """

    shapes: tuple[str, ...]
    joints: tuple[str, ...]
    parents: Int64
    rest: Float64


def read_container(data: bytes, path: Path, limits: Limits) -> tuple[Avatar, list[bytes]]:
    """Return the avatar of a container, and its streams of animation units.

    Raises FormatError for an archive without arf.json, and for what contradicts itself in it; LimitError.
    """
    members = dict(read_members(data, path, limits, lambda name: not name.endswith((".glb", ".png", ".jpg"))))
    if DOCUMENT not in members:
        raise FormatError(
            f"is a ZIP archive without {DOCUMENT}; expected a container of ISO/IEC 23090-39", path=path
        )
    try:
        document = json.loads(members.pop(DOCUMENT))
        avatar = _read_avatar(document, members, path)
    except (json.JSONDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise FormatError(f"{DOCUMENT} is no complete JSON: {error}", path=path) from error
    except (TypeError, AttributeError, KeyError, IndexError, ValueError, OverflowError) as error:
        if isinstance(error, FormatError):
            raise
        text = f"{DOCUMENT} is not laid out as ISO/IEC 23090-39 says: {type(error).__name__}: {error}"
        raise FormatError(text, path=path) from error
    return avatar, [content for content in members.values() if begins_stream(content)]


def _read_avatar(document: Any, members: Mapping[str, bytes], path: Path) -> Avatar:
    signature = document["preamble"]["signature"]
    if signature != "ARF":
        raise FormatError(
            f"the preamble of {DOCUMENT} has another signature; expected 'ARF'", path=path, token=signature
        )
    components = document["components"]
    items = {item["id"]: item for item in document.get("data", [])}
    shape_sets = components.get("blendshapeSets") or [{}]
    shapes = [items[number] for number in shape_sets[0].get("shapes", [])]
    nodes = {node["id"]: node for node in components.get("nodes", [])}
    skeletons = components.get("skeletons") or [{}]
    joints = list(skeletons[0].get("joints", nodes))
    places = {number: place for place, number in enumerate(joints)}
    if len(places) != len(joints):
        raise FormatError("its skeleton lists a joint twice", path=path)
    parents = np.array([places.get(nodes[number].get("parent"), -1) for number in joints], dtype=np.int64)
    _check_tree(parents, path)
    bind = items.get(skeletons[0].get("inverseBindMatrix"))
    rest = (
        _bind_pose(members[bind["uri"]], len(joints), path) if bind else _nodes_rest(nodes, joints, parents)
    )
    if not (np.abs(rest) < LARGEST).all():
        raise FormatError("the rest pose of its skeleton has numbers that are too large", path=path)
    return Avatar(tuple(map(_item_name, shapes)), tuple(str(nodes[n]["name"]) for n in joints), parents, rest)


def _item_name(item: Mapping[str, Any]) -> str:
    return str(item.get("name") or PurePosixPath(item["uri"]).stem)


def _check_tree(parents: Int64, path: Path) -> None:
    """Raise FormatError where joints are their own ancestors."""
    reached = parents.copy()
    for _ in range(len(parents)):
        if (reached < 0).all():
            return
        reached = np.where(reached >= 0, parents[reached], -1)
    if (reached >= 0).any():
        raise FormatError("joints of its skeleton hang on each other in a circle", path=path)


def _bind_pose(tensor: bytes, joints: int, path: Path) -> Float64:
    """Return the bind matrices (J, 4, 4) of a dense tensor of their inverses: little-endian, row by row."""
    head = np.frombuffer(tensor, "<i4", min(4, len(tensor) // 4)).tolist()
    if head != [2, joints, 16, FLOAT32] or len(tensor) != 16 + 64 * joints:
        raise FormatError(f"its inverse bind matrices are no tensor of {joints} x 16 float32", path=path)
    inverse = to_float64(np.frombuffer(tensor, "<f4", offset=16)).reshape(joints, 4, 4)
    if not (np.abs(inverse) < LARGEST).all() or not (np.abs(np.linalg.det(inverse)) > SMALLEST).all():
        raise FormatError("an inverse bind matrix of its skeleton is singular or too large", path=path)
    bound: Float64 = np.linalg.inv(inverse).astype(np.float64)
    return bound


def _nodes_rest(nodes: Mapping[int, Any], joints: Sequence[int], parents: Int64) -> Float64:
    """Return the matrices (J, 4, 4) of nodes to the world."""
    local = np.array([_node_matrix(nodes[number]) for number in joints]).reshape(-1, 4, 4)
    world = local.copy()
    for joint in parents_first(parents):
        if parents[joint] >= 0:
            world[joint] = world[parents[joint]] @ local[joint]
    return world


def _node_matrix(node: Mapping[str, Any]) -> Float64:
    if "transform" in node:
        return np.array(node["transform"], dtype=np.float64).reshape(4, 4)
    matrix = np.eye(4)
    turn = np.roll(np.array(node.get("rotation", [0, 0, 0, 1]), dtype=np.float64).reshape(4), 1)
    matrix[:3, :3] = rotations.matrices(turn / np.linalg.norm(turn)) * np.array(
        node.get("scale", [1, 1, 1]), dtype=np.float64
    )
    matrix[:3, 3] = node.get("translation", [0, 0, 0])
    return matrix


def parents_first(parents: Int64) -> list[int]:
    """Return the numbers of joints in an order in which parents come before their children."""
    depth = np.zeros(len(parents), dtype=np.int64)
    reached = parents
    while (reached >= 0).any():
        depth += reached >= 0
        reached = np.where(reached >= 0, parents[reached], -1)
    order: list[int] = np.argsort(depth, kind="stable").tolist()
    return order


@cache
def joint_names() -> tuple[str, ...]:
    """Return the names of the joints of `BODY_PROFILE`."""
    return (*Skeleton.default().names, *FACE_JOINTS)


@cache
def joint_parents() -> Int64:
    """Return the numbers of their parents, -1 for the root."""
    skeleton = Skeleton.default()
    return np.append(skeleton.parents, [skeleton.number("skullbase")] * len(FACE_JOINTS))


@cache
def resting_joints() -> Float64:
    """Return float64 (J, 4, 4): the places of these joints in the world in the default posture, unturned."""
    centres = Skeleton.default().centres
    placed = np.tile(np.eye(4), (len(joint_names()), 1, 1))
    placed[: len(centres), :3, 3] = centres
    placed[len(centres) :, :3, 3] = centres[joint_parents()[-1]]
    return placed

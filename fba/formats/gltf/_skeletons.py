"""The skeleton of a person in a glTF file: the nodes that are its joints, and how they rest."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from fba import rotations
from fba.body.skeleton import ROOT
from fba.capture import SkeletonMotion, matching
from fba.errors import FbaWarning, ModelError
from fba.formats.gltf._pose import BindPose, find_bind_pose
from fba.formats.gltf.humanoid import Humanoid, find_humanoid
from fba.gltf import Gltf
from fba.mesh.names import UniqueNames

MAX_JOINTS = 4096


@dataclass(frozen=True, eq=False)
class Joints:
    """The joints of a person, as nodes of a file; `find_joints` makes it.

    nodes: those of the joints and of all above them, parents first. parents: position of each one's parent in
    nodes, -1 for the root. bind: how they rest. used: positions in nodes of the hips and all below them.
    humanoid: what the file declares, or None.
    """

    nodes: list[int]
    parents: list[int]
    bind: BindPose
    used: list[int]
    humanoid: Humanoid | None

    def resting(self, gltf: Gltf) -> SkeletonMotion:
        """Return the joints that are used, at rest: a motion without frames, at 1 frame/s."""
        row_of = {number: row for row, number in enumerate(self.used)}
        declared = {} if self.humanoid is None else self.humanoid.joints
        unique = UniqueNames()
        names = [unique(gltf.nodes[self.nodes[number]].name) for number in self.used]
        return SkeletonMotion(
            names=tuple(names),
            parents=np.array([row_of[self.parents[n]] if row else -1 for row, n in enumerate(self.used)]),
            offsets=self.bind.offsets()[self.used],
            rotations=np.zeros((0, len(self.used), 4)),
            positions=np.zeros((0, 3)),
            rate=Fraction(1),
            declared={
                name: declared[self.nodes[number]]
                for name, number in zip(names, self.used, strict=True)
                if self.nodes[number] in declared
            },
            axes=rotations.quaternions(self.bind.rotations[self.used]),
            up="+y",
            posed=not declared and not any(node in skin.joints for skin in gltf.skins for node in self.nodes),
        )


def find_joints(gltf: Gltf) -> Joints:
    """Return the joints of the person in a file: those it declares, else of the best-known skeleton.

    Raises ModelError if there is no skeleton, or one with too many joints; warns (FbaWarning) of other
    skeletons.
    """
    humanoid = find_humanoid(gltf)
    declared = {} if humanoid is None else humanoid.joints
    nodes = _declared_skeleton(gltf, declared) if declared else _skeleton(gltf)
    if len(nodes) > MAX_JOINTS:
        raise ModelError(f"{gltf.file}: the skeleton has {len(nodes)} joints, more than {MAX_JOINTS}")
    place = {node: number for number, node in enumerate(nodes)}
    parents = [-1 if (p := gltf.nodes[node].parent) is None else place.get(p, -1) for node in nodes]
    bind = find_bind_pose(gltf, nodes, parents, skins=not declared)  # a declared person rests in a T pose
    hips = [number for number, node in enumerate(nodes) if declared.get(node) == ROOT]
    root = hips[0] if hips else _find_root([gltf.nodes[node].name for node in nodes])
    return Joints(nodes, parents, bind, _descendants(parents, root), humanoid)


def _skeleton(gltf: Gltf) -> list[int]:
    """Return the nodes of the skeleton, parents first, with one root.

    They are the joints of skins, or else the animated nodes and their children, and all nodes above. Of
    several skeletons, the one with most known joints; warns (FbaWarning) of the others.
    """
    wanted = {joint for skin in gltf.skins for joint in skin.joints}
    if not wanted:
        wanted = {channel.node for clip in gltf.animations for channel in clip.channels}
        wanted |= {number for number, node in enumerate(gltf.nodes) if node.parent in wanted}
    if not wanted:
        raise ModelError(
            f"{gltf.file}: has neither a skin with joints nor an animation; there is no skeleton"
        )
    for number in reversed(gltf.order):  # with all nodes above, so that the joints are connected
        parent = gltf.nodes[number].parent
        if number in wanted and parent is not None:
            wanted.add(parent)
    trees: dict[int, list[int]] = {}
    root_of: dict[int, int] = {}
    for number in gltf.order:
        if number in wanted:
            parent = gltf.nodes[number].parent
            root = number if parent is None else root_of[parent]
            root_of[number] = root
            trees.setdefault(root, []).append(number)
    best = max(trees.values(), key=lambda tree: (_fit(gltf, tree), len(tree)))
    others = [gltf.nodes[root].name for root, tree in trees.items() if tree is not best]
    if others:
        warnings.warn(
            f"{gltf.file}: has several skeletons; {gltf.nodes[best[0]].name!r} is read, "
            f"the others are left out: {', '.join(others[:5])}{', ...' if len(others) > 5 else ''}",
            FbaWarning,
            stacklevel=5,
        )
    return best


def _declared_skeleton(gltf: Gltf, declared: Mapping[int, str]) -> list[int]:
    """Return the nodes of the bones that a file declares, and all above them, parents first.

    ModelError if they are not all connected.
    """
    inside = set(declared)
    for number in reversed(gltf.order):
        parent = gltf.nodes[number].parent
        if number in inside and parent is not None:
            inside.add(parent)
    nodes = [number for number in gltf.order if number in inside]
    roots = [gltf.nodes[number].name for number in nodes if gltf.nodes[number].parent is None]
    if len(roots) > 1:
        raise ModelError(
            f"{gltf.file}: the bones of the person hang on several nodes, {', '.join(roots[:5])}; "
            "expected one tree with the hips at its top"
        )
    return nodes


def _find_root(names: list[str]) -> int:
    """Return the position of the hips, or 0. Nodes above them (an armature, a game's root) only move all."""
    try:
        return matching.match(names)[1]["HumanoidRoot"]
    except ModelError:
        return 0


def _descendants(parents: list[int], root: int) -> list[int]:
    """Return a joint and all below it, parents first."""
    result = {root}
    for number, parent in enumerate(parents):
        if parent in result:
            result.add(number)
    return sorted(result)


def _fit(gltf: Gltf, tree: list[int]) -> int:
    """Return the number of nodes whose names are known."""
    try:
        return len(matching.match([gltf.nodes[number].name for number in tree])[1])
    except ModelError:
        return 0

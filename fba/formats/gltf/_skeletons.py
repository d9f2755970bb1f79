"""The skeleton of a person in a glTF file: the nodes that are its joints, and their rest pose."""

from __future__ import annotations

from collections.abc import Mapping, Set
from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np

from fba import rotations
from fba.body import ROOT, Skeleton
from fba.capture import SkeletonMotion
from fba.capture.bones import find_bones, match
from fba.errors import ModelError, warn
from fba.formats.gltf._pose import BindPose, find_bind_pose
from fba.formats.gltf.humanoid import Humanoid, find_humanoid
from fba.gltf import Gltf
from fba.mesh import UniqueNames

MAX_JOINTS = 4096
MIN_TURN = 1e-3
"""Change of a component of a quaternion above which a joint turns."""


@dataclass(frozen=True, eq=False)
class Joints:
    """The joints of a person, as nodes of a file; see `find_joints`.

    nodes: of the joints and of all above them, parents first. parents: position of each node's parent in
    nodes, -1 for the root. bind: their rest pose. used: positions in nodes of the hips and all below them.
    humanoid: the bones that the file declares, or None. posed: whether the rest pose is that of the nodes,
    which may be any pose.
    """

    nodes: list[int]
    parents: list[int]
    bind: BindPose
    used: list[int]
    humanoid: Humanoid | None
    posed: bool

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
            posed=self.posed,
        )


def find_joints(gltf: Gltf) -> Joints:
    """Return the joints of the person in a file: declared ones, else the best-known skeleton's.

    Raises ModelError if there is no skeleton, or it has too many joints. Warns (FbaWarning) of other
    skeletons.
    """
    humanoid = find_humanoid(gltf)
    declared = {} if humanoid is None else humanoid.joints
    nodes = _declared_skeleton(gltf, declared) if declared else _skeleton(gltf)
    if len(nodes) > MAX_JOINTS:
        raise ModelError(f"{gltf.file}: the skeleton has {len(nodes)} joints, more than {MAX_JOINTS}")
    place = {node: number for number, node in enumerate(nodes)}
    parents = [-1 if (p := gltf.nodes[node].parent) is None else place.get(p, -1) for node in nodes]
    # a declared person rests in a T pose
    skinned = not declared and not _turn_outside_skins(gltf, nodes, parents)
    bind = find_bind_pose(gltf, nodes, parents, skins=skinned)
    everything = Joints(
        nodes, parents, bind, list(range(len(nodes))), humanoid, posed=not declared and not skinned
    )
    hips = [number for number, node in enumerate(nodes) if declared.get(node) == ROOT]
    root = hips[0] if hips else _find_hips(everything.resting(gltf))
    return replace(everything, used=_descendants(parents, root))


def _skeleton(gltf: Gltf) -> list[int]:
    """Return the nodes of the skeleton, parents first, with one root.

    They are the joints of skins and the animated nodes among them, which a file with a skin of the head alone
    has; without skins, all animated nodes and their children; and all nodes above. Of several skeletons, that
    with most known joints is returned; warns (FbaWarning) of the others.
    """
    skinned = {joint for skin in gltf.skins for joint in skin.joints}
    moved = {channel.node for clip in gltf.animations for channel in clip.channels}
    if skinned:
        tops = {_find_top(gltf, joint, skinned | moved) for joint in skinned}
        inside: set[int] = set()
        for number in gltf.order:
            if number in tops or gltf.nodes[number].parent in inside:
                inside.add(number)
        wanted = skinned | (moved & inside)
    else:
        wanted = moved | {number for number, node in enumerate(gltf.nodes) if node.parent in moved}
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
        warn(
            f"{gltf.file}: has several skeletons; {gltf.nodes[best[0]].name!r} is read, "
            f"the others are left out: {', '.join(others[:5])}{', ...' if len(others) > 5 else ''}",
            stacklevel=5,
        )
    return best


def _turn_outside_skins(gltf: Gltf, nodes: list[int], parents: list[int]) -> bool:
    """Whether joints of the body turn that no skin has, so that skins do not tell the rest pose.

    The body begins where the nodes first fork; nodes above only move all of it.
    """
    skinned = {joint for skin in gltf.skins for joint in skin.joints}
    if skinned.isdisjoint(nodes):
        return True
    turning = {
        channel.node
        for clip in gltf.animations
        for channel in clip.channels
        if channel.path == "rotation" and np.ptp(channel.values, axis=0).max(initial=0) > MIN_TURN
    }
    children = np.bincount([parent for parent in parents if parent >= 0], minlength=len(nodes))
    body = next((number for number in range(len(nodes)) if children[number] != 1), 0)
    return any(
        nodes[number] in turning and nodes[number] not in skinned and children[number] > 0
        for number in _descendants(parents, body)
    )


def _find_top(gltf: Gltf, node: int, among: Set[int]) -> int:
    """Return the topmost node that is in `among`, of a node and all above it; else the node itself."""
    top, above = node, gltf.nodes[node].parent
    while above is not None:
        top, above = (above if above in among else top), gltf.nodes[above].parent
    return top


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


def _find_hips(motion: SkeletonMotion) -> int:
    """Return the joint of the hips that carry both legs, or 0.

    Joints above them (an armature, a game's root) only move all of the body. Some makers use the name of
    another maker's hips for the back.
    """
    try:
        mapped = find_bones(motion, None, Skeleton.default()).joints
    except ModelError:
        return 0
    hips = mapped.get(ROOT, 0)
    below = _descendants(motion.parents.tolist(), hips)
    return hips if all(mapped.get(f"{side}_hip") in below for side in "lr") else 0


def _descendants(parents: list[int], root: int) -> list[int]:
    """Return a joint and all below it, parents first."""
    result = {root}
    for number, parent in enumerate(parents):
        if parent in result:
            result.add(number)
    return sorted(result)


def _fit(gltf: Gltf, tree: list[int]) -> int:
    """Return the count of nodes with known names."""
    try:
        return len(match([gltf.nodes[number].name for number in tree])[1])
    except ModelError:
        return 0

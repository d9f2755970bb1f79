"""Write a face into a glTF file: parts with morph targets; eyes and head as joints."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from fba.arrays import Array, Float32, Float64
from fba.body import AttachedHead, BodyModel, attach_head
from fba.face import HEAD, Deformer, FaceModel, Part
from fba.formats.gltf._fap_joints import FapJoint
from fba.formats.gltf._joints import Clip, adopt, move
from fba.formats.gltf._morph_targets import Targets, make_targets
from fba.formats.gltf._pose import nearest_rotation
from fba.gltf import Builder, PartWriter
from fba.parameters import point_rows

HEAD_NODE = "head"
"""The joint that FAPs 48 to 50 turn; BAPs turn its parent, the skull base."""
BENDING_KINDS = ("skin", "mouth", "hair", "other")
"""Kinds of parts that the neck may bend; eyes, teeth and tongue move with the skull."""


@dataclass(eq=False)
class HeadParts:
    """Writer of a face into a document, which `start_head` returns.

    shown: float32 (T, 68), FAPs as `resolve` returns them. all_targets: of these FAPs. on: the face on a
    body; None for a face alone, in its own frame. place: (4, 4), from the face's frame to the body's. bound:
    new nodes that carry vertices, and their matrices (4, 4) in the bind pose. fap_joints: new nodes that FAPs
    move, and the FAPs (T,) that follow from their motion.
    """

    builder: Builder
    clip: Clip
    model: FaceModel
    deformer: Deformer
    shown: Float32
    all_targets: list[Targets]
    on: AttachedHead | None
    place: Float64
    bound: list[tuple[int, Float64]] = field(default_factory=list)
    fap_joints: list[tuple[FapJoint, dict[int, Float64]]] = field(default_factory=list)
    _written: set[str] = field(default_factory=set)

    @property
    def targets(self) -> list[Targets]:
        """Morph targets of the FAPs of which `add_meshes` wrote all targets."""
        return [group for group in self.all_targets if self._written.issuperset(group.names)]

    @property
    def is_turned(self) -> bool:
        """Whether FAPs turn the head in this animation."""
        moved = {table.fap for table in self.model.tables if any(t.part == HEAD for t in table.transforms)}
        return any(self.shown[:, fap - 1].any() for fap in moved)

    def add_head_node(self, parent: int | None, bind: Float64, always: bool = False) -> int:
        """Add the node that FAPs turn, animate it, and return it.

        parent: its parent joint. bind: (4, 4), the parent in the bind pose. always: add channels even if the
        node does not move.
        """
        node = self.builder.add("nodes", {"name": HEAD_NODE})
        if parent is not None:
            adopt(self.builder, parent, node)
        motion = self._to_body(self.deformer.head_matrices(self.shown))
        to_parent: Float64 = np.linalg.inv(bind).astype(np.float64)
        local = to_parent @ motion @ bind
        self._animate(HEAD, node, local, to_parent, np.eye(4), always)
        return node

    def _animate(
        self, part: str, node: int, local: Float64, to_parent: Float64, rest: Float64, always: bool = False
    ) -> None:
        """Animate a node that FAPs move.

        local: (T, 4, 4), its transforms. to_parent: (4, 4), from the body's frame to its parent's. rest:
        (4, 4), the node when all FAPs are 0.
        """
        turned = nearest_rotation(local[:, :3, :3])
        move(self.builder, self.clip, node, turned, local[:, :3, 3], always=always)
        joint = FapJoint.for_part(self.model, part, node, to_parent @ self.place, rest)
        if joint is not None:
            self.fap_joints.append((joint, joint.values(turned, local[:, :3, 3])))

    def add_joints(self, parent: int, bind: Float64) -> dict[str, int]:
        """Add a joint for each part with its own transforms, such as an eye; return nodes by part name.

        parent: the node of the head. bind: (4, 4), that node in the bind pose.
        """
        nodes: dict[str, int] = {}
        for part, matrices in zip(
            self.model.parts, np.moveaxis(self.deformer.part_matrices(self.shown), 1, 0), strict=True
        ):
            centre = self._centre(part)
            if centre is None:
                continue
            rest = np.eye(4)
            rest[:3, 3] = (self.place @ [*centre, 1.0])[:3]
            to_parent: Float64 = np.linalg.inv(bind).astype(np.float64)
            local = to_parent @ self._to_body(matrices) @ rest
            node = self.builder.add("nodes", {"name": f"{part.name}_joint"})
            adopt(self.builder, parent, node)
            self._animate(part.name, node, local, to_parent, to_parent @ rest)
            nodes[part.name] = node
            self.bound.append((node, rest))
        return nodes

    def add_meshes(
        self, slots: dict[str, int], materials: PartWriter, skin: bool, parents: dict[str, int]
    ) -> list[int]:
        """Add a mesh for each part; return the nodes without a parent.

        slots: part name -> position of its joint in the list of the skin. skin: whether skin 0 moves the
        parts; otherwise they are children of nodes. parents: part name -> its node, "" -> that of other
        parts.
        """
        roots = []
        taken = {node["name"] for node in self.builder.root["nodes"]}
        ends = np.cumsum([0, *(len(part.vertices) for part in self.model.parts)])
        for number, part in enumerate(self.model.parts):
            rows = slice(int(ends[number]), int(ends[number + 1]))
            shape = self._transform(part, rows, skin)
            if shape is None:
                continue
            primitive = materials.primitive(shape)
            if skin:
                joints, weights = self._weights(part, rows, slots)
                primitive["attributes"]["JOINTS_0"] = self.builder.attribute(joints)
                primitive["attributes"]["WEIGHTS_0"] = self.builder.attribute(weights)
            name = f"face_{part.name}" if part.name in taken else part.name
            mesh: dict[str, Any] = {"name": name, "primitives": [primitive]}
            weights_shown = self._add_morphs(primitive, mesh, rows)
            entry: dict[str, Any] = {"name": name, "mesh": self.builder.add("meshes", mesh)}
            if skin:
                entry["skin"] = 0
            node = self.builder.add("nodes", entry)
            if skin:
                roots.append(node)
            else:
                adopt(self.builder, parents.get(part.name, parents[""]), node)
            if weights_shown is not None:
                self.clip.animate(node, "weights", weights_shown)
        return roots

    def _transform(self, part: Part, rows: slice, skin: bool) -> Part | None:
        """Return the part in the frame of the body, or of its own joint; None if clothes hide all of it."""
        positions = part.vertices.astype(np.float64)
        triangles = part.triangles
        if skin and self.on is not None:
            positions = positions * self.place[0, 0] + self.place[:3, 3]
            chin = self.model.points[point_rows()["2.1"]][1]
            if part.kind == "other" and part.vertices[:, 1].max() < chin:
                return None
            triangles = triangles[~self.on.hidden[rows][triangles].all(axis=1)]
        elif (centre := self._centre(part)) is not None:
            positions = positions - centre
        if not len(triangles):
            return None
        return replace(part, vertices=positions.astype(np.float32), triangles=triangles)

    def _weights(self, part: Part, rows: slice, slots: dict[str, int]) -> tuple[Array, Float32]:
        """Return joints (V, 4), as positions in the skin's list, and weights (V, 4) of vertices."""
        assert self.on is not None
        joints, weights = self.on.joints[rows].copy(), self.on.weights[rows].copy()
        if part.name in slots:
            joints[:], weights[:] = 0, 0.0
            joints[:, 0], weights[:, 0] = slots[part.name], 1.0
        joints[weights == 0] = 0
        return joints.astype(np.uint16), weights

    def _add_morphs(self, primitive: dict[str, Any], mesh: dict[str, Any], rows: slice) -> Float32 | None:
        """Add the targets that move a part to its mesh; return their weights (T, K), or None."""
        moving: list[tuple[Targets, int]] = [
            (group, k)
            for group in self.all_targets
            for k in range(len(group.names))
            if group.shifts[k, rows].any()
        ]
        if not moving:
            return None
        size = np.float32(self.place[0, 0])
        primitive["targets"] = [
            {"POSITION": self.builder.displacements(group.shifts[k, rows] * size)} for group, k in moving
        ]
        self._written |= {group.names[k] for group, k in moving}
        weights = np.stack([group.weights[:, k] for group, k in moving], axis=1)
        mesh["weights"] = weights[0].tolist()
        mesh["extras"] = {"targetNames": [group.names[k] for group, k in moving]}
        return weights

    def _centre(self, part: Part) -> Float64 | None:
        """Return the centre (3,) of a part's rotations, in the face's frame; None without transforms."""
        transforms = [t for table in self.model.tables for t in table.transforms if t.part == part.name]
        if not transforms:
            return None
        turns = [t.centre for t in transforms if t.kind == "rotation"] or [t.centre for t in transforms]
        return np.array(turns[0], dtype=np.float64)

    def _to_body(self, matrices: Float64) -> Float64:
        """Convert motions (T, 4, 4) from the face's frame to the body's."""
        result: Float64 = self.place @ matrices @ np.linalg.inv(self.place)
        return result


def start_head(
    builder: Builder, clip: Clip, model: FaceModel, shown: Float32, body: BodyModel | None
) -> HeadParts:
    """Return the writer of a face. shown: see `HeadParts`. body: that carries it; None for a face alone."""
    on = None
    if body is not None:
        skull = np.concatenate([np.full(len(p.vertices), p.kind not in BENDING_KINDS) for p in model.parts])
        eyes = model.points[[point_rows()["3.5"], point_rows()["3.6"]]]
        on = attach_head(body, model.vertices, eyes, skull)
    place = np.eye(4) if on is None else on.place
    targets = list(make_targets(model, shown))
    return HeadParts(builder, clip, model, Deformer(model), shown, targets, on, place)

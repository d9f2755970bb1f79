"""A face in a glTF file: its parts with morph targets, its eyes and its turn as joints."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from fba.arrays import Array, Float32, Float64
from fba.body.head_attachment import HeadOnBody
from fba.body.model import BodyModel
from fba.face.deform.deformer import Deformer
from fba.face.model import FaceModel, Part, point_row
from fba.face.tables import HEAD
from fba.formats.gltf._fap_joints import FapJoint
from fba.formats.gltf._joints import Clip, adopt, move
from fba.formats.gltf._morph_targets import Targets, targets
from fba.formats.gltf._pose import nearest_rotation
from fba.gltf.part_materials import PartWriter
from fba.gltf.writer import Builder

HEAD_NODE = "head"
"""The joint that FAPs 48 to 50 turn; what BAPs turn is the skull base that it hangs on."""
CARRIED = ("skin", "mouth", "hair", "other")
"""Kinds of parts that the neck may bend; eyes, teeth and tongue go with the skull."""


class HeadParts:
    """Writes a face into a document.

    shown: float32 (T, 68), FAPs as `resolve` gives them. body: what it stands on, or None for a face by
    itself, in its own frame.
    """

    def __init__(
        self, builder: Builder, clip: Clip, model: FaceModel, shown: Float32, body: BodyModel | None
    ) -> None:
        self._builder, self._clip, self.model = builder, clip, model
        self._moves = Deformer(model)
        self._shown = shown
        self._targets = list(targets(model, shown))
        self.on: HeadOnBody | None = None
        self.place = np.eye(4)
        if body is not None:
            skull = np.concatenate([np.full(len(p.vertices), p.kind not in CARRIED) for p in model.parts])
            eyes = model.points[[point_row("3.5"), point_row("3.6")]]
            self.on = HeadOnBody(body, model.vertices, eyes, skull)
            self.place = self.on.place
        self.bound: list[tuple[int, Float64]] = []
        """Nodes made here that carry vertices, and the matrices that they were bound with."""
        self.fap_joints: list[tuple[FapJoint, dict[int, Float64]]] = []
        """Nodes made here that FAPs move, and the FAPs (T,) that their motion tells."""
        self._written: set[str] = set()

    @property
    def targets(self) -> list[Targets]:
        """The morph targets that `meshes` put into the file, those of a FAP all or none."""
        return [found for found in self._targets if self._written.issuperset(found.names)]

    @property
    def turns(self) -> bool:
        """Whether the head's own FAPs turn it in this animation."""
        moved = {table.fap for table in self.model.tables if any(t.part == HEAD for t in table.transforms)}
        return any(self._shown[:, fap - 1].any() for fap in moved)

    def turn(self, parent: int | None, bind: Float64, always: bool = False) -> int:
        """The node that the head's FAPs turn. bind: (4, 4), of its parent joint."""
        node = self._builder.add("nodes", {"name": HEAD_NODE})
        if parent is not None:
            adopt(self._builder, parent, node)
        motion = self._inside(self._moves.head_matrices(self._shown))
        back: Float64 = np.linalg.inv(bind).astype(np.float64)
        local = back @ motion @ bind
        self._move(HEAD, node, local, back, np.eye(4), always)
        return node

    def _move(
        self, part: str, node: int, local: Float64, back: Float64, rest: Float64, always: bool = False
    ) -> None:
        """Animate a node that FAPs move. local: (T, 4, 4). back: (4, 4), from the body's frame into that of
        the node's parent. rest: (4, 4), the node where no FAP moves it."""
        turned = nearest_rotation(local[:, :3, :3])
        move(self._builder, self._clip, node, turned, local[:, :3, 3], always=always)
        joint = FapJoint.of_part(self.model, part, node, back @ self.place, rest)
        if joint is not None:
            self.fap_joints.append((joint, joint.values(turned, local[:, :3, 3])))

    def joints(self, parent: int, bind: Float64) -> dict[str, int]:
        """A joint for each part that has transforms of its own, such as an eye; by name of the part.

        parent: the node of the head, and bind, (4, 4), how it was bound.
        """
        found: dict[str, int] = {}
        for part, matrices in zip(
            self.model.parts, np.moveaxis(self._moves.part_matrices(self._shown), 1, 0), strict=True
        ):
            centre = self._centre(part)
            if centre is None:
                continue
            at = np.eye(4)
            at[:3, 3] = (self.place @ [*centre, 1.0])[:3]
            back: Float64 = np.linalg.inv(bind).astype(np.float64)
            local = back @ self._inside(matrices) @ at
            node = self._builder.add("nodes", {"name": f"{part.name}_joint"})
            adopt(self._builder, parent, node)
            self._move(part.name, node, local, back, back @ at)
            found[part.name] = node
            self.bound.append((node, at))
        return found

    def meshes(self, slots: dict[str, int], looks: PartWriter, skin: bool, hang: dict[str, int]) -> list[int]:
        """The parts; the nodes that belong to the scene itself.

        slots: where in the skin's list the joints of parts of their own are. skin: whether the parts are
        carried by skin 0; otherwise they hang on nodes: hang, by name of the part, and "" for all others.
        """
        roots = []
        taken = {node["name"] for node in self._builder.root["nodes"]}
        ends = np.cumsum([0, *(len(part.vertices) for part in self.model.parts)])
        for number, part in enumerate(self.model.parts):
            rows = slice(int(ends[number]), int(ends[number + 1]))
            shape = self._placed(part, rows, hang, skin)
            if shape is None:
                continue
            primitive = looks.primitive(shape)
            if skin:
                joints, weights = self._weights(part, rows, slots)
                primitive["attributes"]["JOINTS_0"] = self._builder.attribute(joints)
                primitive["attributes"]["WEIGHTS_0"] = self._builder.attribute(weights)
            name = f"face_{part.name}" if part.name in taken else part.name
            mesh: dict[str, Any] = {"name": name, "primitives": [primitive]}
            weights_shown = self._morphs(primitive, mesh, rows)
            entry: dict[str, Any] = {"name": name, "mesh": self._builder.add("meshes", mesh)}
            if skin:
                entry["skin"] = 0
            node = self._builder.add("nodes", entry)
            if skin:
                roots.append(node)
            else:
                adopt(self._builder, hang.get(part.name, hang[""]), node)
            if weights_shown is not None:
                self._clip.animate(node, "weights", weights_shown)
        return roots

    def _placed(self, part: Part, rows: slice, hang: dict[str, int], skin: bool) -> Part | None:
        """The part in the body's frame, or in that of its own joint; None where clothes hide all of it."""
        places = part.vertices.astype(np.float64)
        triangles = part.triangles
        if skin and self.on is not None:
            places = places * self.place[0, 0] + self.place[:3, 3]
            chin = self.model.points[point_row("2.1")][1]
            if part.kind == "other" and part.vertices[:, 1].max() < chin:
                return None
            triangles = triangles[~self.on.hidden[rows][triangles].all(axis=1)]
        elif (centre := self._centre(part)) is not None:
            places = places - centre
        if not len(triangles):
            return None
        return replace(part, vertices=places.astype(np.float32), triangles=triangles)

    def _weights(self, part: Part, rows: slice, slots: dict[str, int]) -> tuple[Array, Float32]:
        assert self.on is not None
        joints, weights = self.on.joints[rows].copy(), self.on.weights[rows].copy()
        if part.name in slots:
            joints[:], weights[:] = 0, 0.0
            joints[:, 0], weights[:, 0] = slots[part.name], 1.0
        joints[weights == 0] = 0
        return joints.astype(np.uint16), weights

    def _morphs(self, primitive: dict[str, Any], mesh: dict[str, Any], rows: slice) -> Float32 | None:
        """Adds the targets that move a part; its weights over time, (T, K), or None where there are none."""
        own: list[tuple[Targets, int]] = [
            (found, k)
            for found in self._targets
            for k in range(len(found.names))
            if found.shifts[k, rows].any()
        ]
        if not own:
            return None
        size = np.float32(self.place[0, 0])
        primitive["targets"] = [
            {"POSITION": self._builder.displacements(found.shifts[k, rows] * size)} for found, k in own
        ]
        self._written |= {found.names[k] for found, k in own}
        weights = np.stack([found.weights[:, k] for found, k in own], axis=1)
        mesh["weights"] = weights[0].tolist()
        mesh["extras"] = {"targetNames": [found.names[k] for found, k in own]}
        return weights

    def _centre(self, part: Part) -> Float64 | None:
        """What a part turns about, in the face's frame; None for parts without transforms."""
        transforms = [t for table in self.model.tables for t in table.transforms if t.part == part.name]
        if not transforms:
            return None
        turns = [t.centre for t in transforms if t.kind == "rotation"] or [t.centre for t in transforms]
        return np.array(turns[0], dtype=np.float64)

    def _inside(self, matrices: Float64) -> Float64:
        """Motions (T, 4, 4) in the face's frame as motions in the body's."""
        result: Float64 = self.place @ matrices @ np.linalg.inv(self.place)
        return result

"""Body models in files: skinned glTF 2.0 with the extension FBA_body, described in docs/body-models.md.

The tree of joint nodes is the skeleton: a node's translation is its joint's offset in the default posture,
its rotation is that of the modelled pose relative to it. Without the rotations, the file shows the default
posture.
"""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from fba import rotations
from fba.arrays import Float32, Float64, Int32, Int64
from fba.body._model import BODY_PART_KINDS, BodyModel, BodyPart
from fba.body._skeleton import MAX_JOINTS, Skeleton
from fba.body.skin.skin_weights import INFLUENCES
from fba.errors import ModelError
from fba.gltf import (
    Builder,
    Document,
    Gltf,
    PartWriter,
    Primitive,
    Value,
    locating_errors,
    optional_member,
    read_material,
)
from fba.limits import DEFAULT_LIMITS, Limits
from fba.source import Path

NAME = "FBA_body"
VERSION = 1
MAX_PARTS = 1000
MAX_NOTES = 1000
MAX_COORDINATE = 1e6
"""Metres that a coordinate of a body may have at most."""
BIND_TOLERANCE = 1e-3
"""Metres and sines by which a file's inverse bind matrices may contradict its nodes."""


def save(path: Path, model: BodyModel) -> None:
    """Write a body as .glb, atomically; loading it gives an equal model."""
    if os.fspath(path).lower().endswith(".gltf"):
        raise ModelError(f"{os.fspath(path)}: body models are written in one file; name it .glb")
    build(model).save(path)


def build(model: BodyModel) -> Builder:
    """Return the glTF document of a model, its joints first among the nodes."""
    builder = Builder()
    skeleton = model.skeleton
    builder.root["extensionsUsed"] = [NAME]
    builder.root["scene"] = 0
    children: list[list[int]] = [[] for _ in skeleton.names]
    for joint, parent in enumerate(skeleton.parents.tolist()):
        if parent >= 0:
            children[parent].append(joint)
    turns = _quaternions(local_rotations(model))
    for joint, name in enumerate(skeleton.names):
        node: dict[str, Any] = {"name": name, "translation": skeleton.offsets[joint].tolist()}
        if not np.array_equal(turns[joint], (0, 0, 0, 1)):
            node["rotation"] = turns[joint].tolist()
        if children[joint]:
            node["children"] = children[joint]
        builder.add("nodes", node)
    inverse = np.linalg.inv(model.bind)
    inverse[:, 3] = (0, 0, 0, 1)
    columns = inverse.transpose(0, 2, 1).reshape(-1, 16)
    skin = {"joints": list(range(len(skeleton))), "skeleton": 0, "inverseBindMatrices": builder.data(columns)}
    builder.add("skins", skin)
    materials = PartWriter(builder)
    parts = []
    for part in model.parts:
        primitive = materials.primitive(part)
        small = np.uint8 if len(skeleton) <= 256 else np.uint16
        primitive["attributes"]["JOINTS_0"] = builder.attribute(part.joints.astype(small))
        primitive["attributes"]["WEIGHTS_0"] = builder.attribute(part.weights)
        mesh = builder.add("meshes", {"name": part.name, "primitives": [primitive]})
        entry: dict[str, Any] = {
            "node": builder.add("nodes", {"name": part.name, "mesh": mesh, "skin": 0}),
            "kind": part.kind,
        }
        if part.colours is not None:
            entry["colour"] = [float(value) for value in part.material.colour]
        parts.append(entry)
    builder.add("scenes", {"nodes": [0, *(entry["node"] for entry in parts)]})
    content: dict[str, Any] = {
        "version": VERSION,
        "name": model.name,
        "notes": dict(model.notes),
        "skin": 0,
        "parts": parts,
    }
    if model.eyes is not None:
        content["eyes"] = model.eyes.tolist()
    builder.root["extensions"] = {NAME: content}
    return builder


def local_rotations(model: BodyModel) -> Float64:
    """Return (J, 3, 3) rotation of each joint in its parent's frame, as modelled."""
    turns = model.bind[:, :3, :3].copy()
    parents = model.skeleton.parents
    turns[1:] = np.swapaxes(model.bind[parents[1:], :3, :3], 1, 2) @ turns[1:]
    return turns


def _quaternions(turns: Float64) -> Float64:
    """Return (N, 4) x, y, z, w of rotation matrices (N, 3, 3), w not negative; exactly 0 0 0 1 for none."""
    from scipy.spatial.transform import Rotation

    quaternions: Float64 = Rotation.from_matrix(turns).as_quat(canonical=True)
    quaternions[(turns == np.eye(3)).all(axis=(1, 2))] = (0, 0, 0, 1)
    return quaternions


def load(path: Path, limits: Limits = DEFAULT_LIMITS) -> BodyModel:
    """Return the body model in a .glb (or .gltf) file as `save` writes it.

    Raises FormatError where the file cannot be opened; ModelError, with the position in it, where it is
    damaged, contradicts itself, or lacks the extension FBA_body, LimitError where it takes more memory than
    the limits allow.
    """
    from fba.gltf import open_document

    return read_body(open_document(path, limits))


def read_body(document: Document) -> BodyModel:
    """Return the body in an opened document."""
    from fba.gltf import read_document

    content = optional_member(document.root.get("extensions"), NAME)
    if content is None:
        raise document.root.error(f"has no extension {NAME}, so it is not a body model of fba")
    version = content.member("version").integer(0, 1 << 30)
    if version != VERSION:
        raise content.error(f"has version {version}, but this fba reads version {VERSION} only")
    gltf = read_document(document)
    where = content.member("skin")
    skin = gltf.skins[where.index(len(gltf.skins), "skin")]
    if len(skin.joints) > MAX_JOINTS:
        raise where.error(f"{len(skin.joints)} joints, but at most {MAX_JOINTS} can be read")
    with locating_errors(where), np.errstate(all="ignore"):
        skeleton, bind, order = _skeleton(gltf, skin.joints)
        _check_bind(skin.inverse_bind[order], bind, skeleton.names)
    row = np.empty(len(order), dtype=np.int32)
    row[order] = np.arange(len(order), dtype=np.int32)
    listed = content.member("parts")
    parts = tuple(_part(entry, gltf, where, row, document) for entry in listed.elements(MAX_PARTS))
    eyes = content.get("eyes")
    pupils = (
        None
        if eyes is None
        else [each.numbers(3, -MAX_COORDINATE, MAX_COORDINATE) for each in eyes.elements(2)]
    )
    name = content.get("name")
    with locating_errors(content), np.errstate(all="ignore"):
        return BodyModel(
            parts=parts,
            skeleton=skeleton,
            bind=bind,
            eyes=None if pupils is None else np.array(pupils).reshape(-1, 3),
            name="" if name is None else name.text(),
            notes={key: value.text() for key, value in content.entries("notes", MAX_NOTES)},
        )


def _skeleton(gltf: Gltf, joints: tuple[int, ...]) -> tuple[Skeleton, Float64, Int64]:
    """Return the skeleton, the bind matrices, and which of the skin's joints each of its joints is."""
    column = {node: number for number, node in enumerate(joints)}
    wanted = [node for node in gltf.order if node in column]  # parents first
    row = {node: number for number, node in enumerate(wanted)}
    parents, centres, bind = [], np.zeros((len(wanted), 3)), np.tile(np.eye(4), (len(wanted), 1, 1))
    for number, node in enumerate(wanted):
        own = gltf.nodes[node]
        unscaled = own.scale is not None and bool((own.scale == 1).all())
        if own.translation is None or own.rotation is None or not unscaled:
            raise ModelError(
                f"joint {own.name!r} (node {node}) has a matrix or a scale; it must only move and turn"
            )
        if own.parent is not None and own.parent not in row:
            raise ModelError(
                f"joint {own.name!r} (node {node}) has the parent node {own.parent}, which is not a joint"
            )
        parent = -1 if own.parent is None else row[own.parent]
        parents.append(parent)
        centres[number] = own.translation + (centres[parent] if parent >= 0 else 0.0)
        bind[number, :3, :3] = rotations.matrices(own.rotation[[3, 0, 1, 2]])
        bind[number, :3, 3] = own.translation
        if parent >= 0:
            bind[number] = bind[parent] @ bind[number]
    if not (np.abs(centres) < MAX_COORDINATE).all():
        raise ModelError(f"a joint is more than {MAX_COORDINATE:g} m away")
    names = tuple(gltf.nodes[node].name for node in wanted)
    skeleton = Skeleton(names, np.array(parents, dtype=np.int64), centres)
    return skeleton, bind, np.array([column[node] for node in wanted], dtype=np.int64)


def _check_bind(inverse: Float64, bind: Float64, names: tuple[str, ...]) -> None:
    """Raise ModelError if the mesh was not modelled where the nodes stand."""
    off = np.abs(inverse @ bind - np.eye(4)).max(axis=(1, 2))
    if not (off < BIND_TOLERANCE).all():
        worst = int(np.argmax(~(off < BIND_TOLERANCE)))
        raise ModelError(
            f"the inverse bind matrix of joint {names[worst]!r} contradicts the position of its node"
        )


def _part(entry: Value, gltf: Gltf, skin: Value, row: Int32, document: Document) -> BodyPart:
    where = entry.member("node")
    node = gltf.nodes[where.index(len(gltf.nodes), "node")]
    if node.mesh is None or len(gltf.meshes[node.mesh].primitives) != 1:
        raise where.error("must have a mesh of one primitive")
    if node.skin != skin.data:
        raise where.error(f"must use skin {skin.data}")
    primitive = gltf.meshes[node.mesh].primitives[0]
    document.budget.charge(len(primitive.positions) * 200 + len(primitive.triangles) * 36, entry)
    with locating_errors(entry):
        joints, weights = _carried(primitive, row)
        return BodyPart(
            name=node.name,
            kind=entry.member("kind").choice(*BODY_PART_KINDS),
            vertices=primitive.positions,
            triangles=primitive.triangles,
            joints=joints,
            weights=weights,
            normals=primitive.normals,
            texcoords=primitive.texcoords[0] if primitive.texcoords else None,
            colours=primitive.colours,
            material=read_material(entry, gltf, primitive),
        )


def _carried(primitive: Primitive, row: Int32) -> tuple[Int32, Float32]:
    if primitive.joints is None or primitive.weights is None:
        raise ModelError("its vertices have no joints")
    if primitive.joints.shape[1] != INFLUENCES:
        raise ModelError(
            f"{primitive.joints.shape[1]} joints for each vertex, but at most {INFLUENCES} can be read"
        )
    if (np.abs(primitive.positions) > MAX_COORDINATE).any():
        raise ModelError(f"a vertex is more than {MAX_COORDINATE:g} m away")
    return row[primitive.joints], primitive.weights

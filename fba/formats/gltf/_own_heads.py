"""Shapes and eyes of the head of a skinned person, for FAPs: by names, or as VRM declares its expressions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fba.arrays import Float32, Float64, Intp
from fba.body.model import BodyPart
from fba.body.own_head import HeadShape, OwnEye, OwnHead
from fba.capture.blendshapes.shape_table import amounts_of, largest_amounts
from fba.face.shape_names import arkit_of
from fba.formats.gltf._face_motion import is_eye
from fba.formats.gltf.humanoid import Humanoid
from fba.gltf import Gltf, Primitive, Value, optional_member

MOST_BINDS = 1 << 16
LOCAL = 20
"""From this many shapes of ARKit on, which each move one part of the face, others are not used."""
HALF = 0.5
"""An eye carries the vertices that have more than this share of its joint's weight."""
OLD_PRESETS = {
    "a": "aa", "i": "ih", "u": "ou", "e": "ee", "o": "oh", "joy": "happy", "sorrow": "sad", "fun": "relaxed",
    "blink_l": "blinkLeft", "blink_r": "blinkRight", "lookup": "lookUp", "lookdown": "lookDown",
    "lookleft": "lookLeft", "lookright": "lookRight",
}  # fmt: skip
"""VRM 0's names of expressions that VRM 1 calls otherwise."""

Binds = list[tuple[int, int, float]]
"""Mesh, number of the morph target, and its weight."""


@dataclass(frozen=True, eq=False)
class PlacedMesh:
    """A primitive of a node as a part of a body.

    linear: (V, 3, 3), from its own axes to the body's. bound: joints of skins in the scene, (4, 4).
    """

    part: BodyPart
    node: int
    primitive: Primitive
    linear: Float64
    bound: Mapping[int, Float64]


def read_head(
    gltf: Gltf, humanoid: Humanoid | None, meshes: Sequence[PlacedMesh], turn: Float64
) -> OwnHead | None:
    """Return shapes and eyes of a person's head; None if it has neither.

    meshes: all that is shown, in the order of the body's vertices. turn: (3, 3), from the scene's axes to the
    body's. A head may have shapes with the names of ARKit, and others; most of ARKit's move one part of the
    face alone, and are preferred.
    """
    listed = _expressions(gltf) or _named(gltf)
    local = {name: binds for name, binds in _named(gltf).items() if arkit_of(name) is not None}
    if len(local) >= LOCAL:
        listed = local
    budget = gltf.budget.copy()
    shapes = []
    for name, binds in listed.items():
        faps = amounts_of(name)
        if faps is None or not faps.any():
            continue
        rows, shifts = _moved(gltf, meshes, binds)
        if len(rows):
            budget.charge(rows.nbytes + shifts.nbytes, gltf.document)
            shapes.append(HeadShape(name, faps, rows, shifts))
    eyes = [eye for side in "lr" if (eye := _eye(gltf, humanoid, meshes, turn, side)) is not None]
    return OwnHead(largest_amounts(), shapes, eyes) if shapes or eyes else None


def _named(gltf: Gltf) -> dict[str, Binds]:
    """Return the morph targets whose names are known; equal names of several meshes go together.

    Of several targets of one mesh that mean the same shape, such as VRoid's and ARKit's blink, the one with
    ARKit's own name counts, else the first.
    """
    result: dict[str, Binds] = {}
    for number, mesh in enumerate(gltf.meshes):
        best: dict[str, int] = {}
        for column, name in enumerate(mesh.morph_names):
            shape = arkit_of(name) or name
            if amounts_of(name) is not None and (shape not in best or name == shape):
                best[shape] = column
        for shape, column in best.items():
            result.setdefault(shape, []).append((number, column, 1.0))
    return result


def _expressions(gltf: Gltf) -> dict[str, Binds]:
    """Return the expressions that VRM declares, by VRM 1's names; empty in other files."""
    extensions = gltf.document.get("extensions")
    result: dict[str, Binds] = {}
    groups = optional_member(optional_member(extensions, "VRM"), "blendShapeMaster")
    listed = optional_member(groups, "blendShapeGroups")
    for entry in listed.elements(MOST_BINDS) if listed is not None else ():
        preset = entry.get("presetName")
        name = "" if preset is None else preset.text(200)
        binds = entry.get("binds")
        result[OLD_PRESETS.get(name.lower(), name)] = [
            (bind.member("mesh").index(len(gltf.meshes), "mesh"), *_target(bind, 100.0))
            for bind in (binds.elements(MOST_BINDS) if binds is not None else ())
        ]
    presets = optional_member(
        optional_member(optional_member(extensions, "VRMC_vrm"), "expressions"), "preset"
    )
    for name, entry in presets.members() if presets is not None else ():
        binds = entry.get("morphTargetBinds")
        found: Binds = []
        for bind in binds.elements(MOST_BINDS) if binds is not None else ():
            mesh = gltf.nodes[bind.member("node").index(len(gltf.nodes), "node")].mesh
            if mesh is not None:
                found.append((mesh, *_target(bind, 1.0)))
        result[name] = found
    return {name: binds for name, binds in result.items() if binds and amounts_of(name) is not None}


def _target(bind: Value, whole: float) -> tuple[int, float]:
    """Return number and weight of the morph target that an expression binds."""
    return bind.member("index").integer(0, 1 << 20), bind.member("weight").number(-1e6, 1e6) / whole


def _moved(gltf: Gltf, meshes: Sequence[PlacedMesh], binds: Binds) -> tuple[Intp, Float32]:
    """Return the body's vertices (N,) that morph targets move, and by how much, (N, 3), in its axes."""
    rows, shifts = [np.zeros(0, dtype=np.intp)], [np.zeros((0, 3), dtype=np.float32)]
    start = 0
    for mesh in meshes:
        own = [(column, weight) for number, column, weight in binds if number == gltf.nodes[mesh.node].mesh]
        morphs = mesh.primitive.morphs
        moved: Float64 = np.zeros((0, 3))
        for column, weight in own:
            morph = morphs[column] if column < len(morphs) else None
            if morph is not None:
                moved = weight * morph.astype(np.float64) + (moved if len(moved) else 0.0)
        if len(moved):
            which = np.flatnonzero(moved.any(axis=1))
            rows.append(which + start)
            shifts.append(np.einsum("vij,vj->vi", mesh.linear[which], moved[which]).astype(np.float32))
        start += len(mesh.part.vertices)
    return np.concatenate(rows), np.concatenate(shifts)


def _eye(
    gltf: Gltf, humanoid: Humanoid | None, meshes: Sequence[PlacedMesh], turn: Float64, side: str
) -> OwnEye | None:
    """Return an eyeball: what hangs on the bone that is declared or called an eye; None without."""
    bone = {"l": "leftEye", "r": "rightEye"}[side]
    rows, centre, start = [np.zeros(0, dtype=np.intp)], None, 0
    for mesh in meshes:
        skin = gltf.nodes[mesh.node].skin
        primitive = mesh.primitive
        if skin is not None and primitive.joints is not None and primitive.weights is not None:
            joints = gltf.skins[skin].joints
            for number, joint in enumerate(joints):
                declared = humanoid is not None and humanoid.bones.get(bone) == joint
                if not declared and (humanoid is not None or not is_eye(gltf.nodes[joint].name, side)):
                    continue
                share = np.where(primitive.joints == number, primitive.weights, 0.0).sum(axis=1)
                which = np.flatnonzero(share > HALF * primitive.weights.sum(axis=1))
                if len(which):
                    rows.append(which + start)
                    centre = turn @ mesh.bound[joint][:3, 3]
        start += len(mesh.part.vertices)
    found = np.concatenate(rows)
    return None if centre is None else OwnEye(side, found, centre)

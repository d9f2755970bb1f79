"""Shapes and eyes of the head of a skinned person, for FAPs: by names, or as VRM declares its expressions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fba.arrays import Float32, Float64, Intp
from fba.body import BodyPart
from fba.body.own_head import HeadShape, OwnEye, OwnHead
from fba.capture import shape_faps
from fba.capture.blendshapes.shape_table import largest_amounts
from fba.face import arkit_of
from fba.formats.gltf._face_motion import is_named
from fba.formats.gltf.humanoid import Humanoid
from fba.gltf import Gltf, Primitive, Value, optional_member

MOST_BINDS = 1 << 16
ENOUGH_SHAPES = 20
"""Fewest shapes of ARKit with which no others are used: each of ARKit's moves one part of the face."""
MIN_EYE_WEIGHT = 0.5
"""Share of a vertex's weight on the joint of an eye above which the vertex belongs to the eye."""
OLD_PRESETS = {
    "a": "aa", "i": "ih", "u": "ou", "e": "ee", "o": "oh", "joy": "happy", "sorrow": "sad", "fun": "relaxed",
    "blink_l": "blinkLeft", "blink_r": "blinkRight", "lookup": "lookUp", "lookdown": "lookDown",
    "lookleft": "lookLeft", "lookright": "lookRight",
}  # fmt: skip
"""VRM 1's names of expressions, by VRM 0's names in lower case."""

Binds = list[tuple[int, int, float]]
"""Mesh, number of the morph target, and its weight."""


@dataclass(frozen=True, eq=False)
class PlacedMesh:
    """A primitive of a node as a part of a body.

    linear: (V, 3, 3), from its axes to the body's. bound: matrices (4, 4) of the joints of skins in the
    scene.
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

    meshes: all that are shown, in the order of the body's vertices. turn: (3, 3), from the scene's axes to
    the body's. ARKit's shapes are preferred, as most of them move one part of the face alone.
    """
    listed = _expressions(gltf) or _named(gltf)
    local = {name: binds for name, binds in _named(gltf).items() if arkit_of(name) is not None}
    if len(local) >= ENOUGH_SHAPES:
        listed = local
    budget = gltf.budget.copy()
    shapes = []
    for name, binds in listed.items():
        faps = shape_faps(name)
        if faps is None or not faps.any():
            continue
        rows, shifts = _moved(gltf, meshes, binds)
        if len(rows):
            budget.charge(rows.nbytes + shifts.nbytes, gltf.document)
            shapes.append(HeadShape(name, faps, rows, shifts))
    eyes = [eye for side in "lr" if (eye := _eye(gltf, humanoid, meshes, turn, side)) is not None]
    return OwnHead(largest_amounts(), shapes, eyes) if shapes or eyes else None


def _named(gltf: Gltf) -> dict[str, Binds]:
    """Return the morph targets with known names; targets of several meshes with equal names go together.

    If several targets of a mesh mean the same shape, such as VRoid's and ARKit's blink, the target with
    ARKit's name counts, else the first.
    """
    result: dict[str, Binds] = {}
    for number, mesh in enumerate(gltf.meshes):
        best: dict[str, int] = {}
        for column, name in enumerate(mesh.morph_names):
            shape = arkit_of(name) or name
            if shape_faps(name) is not None and (shape not in best or name == shape):
                best[shape] = column
        for shape, column in best.items():
            result.setdefault(shape, []).append((number, column, 1.0))
    return result


def _expressions(gltf: Gltf) -> dict[str, Binds]:
    """Return the expressions that VRM declares, by VRM 1's names; empty in other files."""
    extensions = gltf.document.get("extensions")
    result: dict[str, Binds] = {}
    groups = optional_member(optional_member(extensions, "VRM"), "blendShapeMaster")
    for entry in groups.elements(MOST_BINDS, "blendShapeGroups") if groups is not None else ():
        preset = entry.get("presetName")
        name = "" if preset is None else preset.text(200)
        result[OLD_PRESETS.get(name.lower(), name)] = [
            (bind.member("mesh").index(len(gltf.meshes), "mesh"), *_target(bind, 100.0))
            for bind in entry.elements(MOST_BINDS, "binds")
        ]
    presets = optional_member(
        optional_member(optional_member(extensions, "VRMC_vrm"), "expressions"), "preset"
    )
    for name, entry in presets.members() if presets is not None else ():
        result[name] = [
            (mesh, *_target(bind, 1.0))
            for bind in entry.elements(MOST_BINDS, "morphTargetBinds")
            if (mesh := gltf.nodes[bind.member("node").index(len(gltf.nodes), "node")].mesh) is not None
        ]
    return {name: binds for name, binds in result.items() if binds and shape_faps(name) is not None}


def _target(bind: Value, whole: float) -> tuple[int, float]:
    """Return number and weight of the morph target that an expression binds. whole: the full weight there."""
    return bind.member("index").integer(0, 1 << 20), bind.member("weight").number(-1e6, 1e6) / whole


def _moved(gltf: Gltf, meshes: Sequence[PlacedMesh], binds: Binds) -> tuple[Intp, Float32]:
    """Return the body's vertices (N,) that morph targets move, and their displacements (N, 3) in its axes."""
    rows, shifts = [np.zeros(0, dtype=np.intp)], [np.zeros((0, 3), dtype=np.float32)]
    start = 0
    for mesh in meshes:
        morphs = mesh.primitive.morphs
        moved: Float64 = np.zeros((0, 3))
        for number, column, weight in binds:
            mine = number == gltf.nodes[mesh.node].mesh and column < len(morphs)
            if mine and (morph := morphs[column]) is not None:
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
    """Return an eyeball: the vertices of the bone that is declared or called an eye; None without a bone."""
    bone = {"l": "leftEye", "r": "rightEye"}[side]
    rows, centre, start = [np.zeros(0, dtype=np.intp)], None, 0
    for mesh in meshes:
        skin = gltf.nodes[mesh.node].skin
        primitive = mesh.primitive
        if skin is not None and primitive.joints is not None and primitive.weights is not None:
            joints = gltf.skins[skin].joints
            for number, joint in enumerate(joints):
                declared = humanoid is not None and humanoid.bones.get(bone) == joint
                if not declared and (humanoid is not None or not is_named(gltf.nodes[joint].name, side)):
                    continue
                share = np.where(primitive.joints == number, primitive.weights, 0.0).sum(axis=1)
                which = np.flatnonzero(share > MIN_EYE_WEIGHT * primitive.weights.sum(axis=1))
                if len(which):
                    rows.append(which + start)
                    centre = turn @ mesh.bound[joint][:3, 3]
        start += len(mesh.part.vertices)
    return None if centre is None else OwnEye(side, np.concatenate(rows), centre)

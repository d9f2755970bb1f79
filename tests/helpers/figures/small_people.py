"""Small people as glTF: a T pose of 22 bones, boxes for limbs, clips, morph targets, and VRM's extensions."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from fba.gltf._writer import Builder

BONES: dict[str, tuple[str | None, tuple[float, float, float]]] = {
    "hips": (None, (0.0, 0.9, 0.0)),
    "spine": ("hips", (0.0, 0.1, 0.0)),
    "chest": ("spine", (0.0, 0.15, 0.0)),
    "neck": ("chest", (0.0, 0.25, 0.0)),
    "head": ("neck", (0.0, 0.1, 0.0)),
    **{
        f"{side}{name}": (parent if parent in ("hips", "chest") else f"{side}{parent}", (x * sign, y, z))
        for side, sign in (("left", 1), ("right", -1))
        for name, parent, x, y, z in (
            ("Shoulder", "chest", 0.04, 0.2, 0.0),
            ("UpperArm", "Shoulder", 0.12, 0.0, 0.0),
            ("LowerArm", "UpperArm", 0.27, 0.0, 0.0),
            ("Hand", "LowerArm", 0.25, 0.0, 0.0),
            ("MiddleProximal", "Hand", 0.09, 0.0, 0.0),
            ("UpperLeg", "hips", 0.09, -0.05, 0.0),
            ("LowerLeg", "UpperLeg", 0.0, -0.4, 0.0),
            ("Foot", "LowerLeg", 0.0, -0.38, 0.0),
            ("Toes", "Foot", 0.0, -0.06, 0.13),
        )
    },
}
"""VRM's names of bones: the parent, and the place relative to it in metres; the person faces +z."""
SOLES = 0.01
"""Metres from the soles' height to 0."""

Clip = Mapping[str, Sequence[Rotation]]
"""Turns of bones about the axes of the scene, one a frame."""


def write_person(
    path: Path,
    *,
    clips: Mapping[str, Clip] | None = None,
    rate: float = 30.0,
    hips: Sequence[Sequence[float]] = (),
    names: Mapping[str, str] | None = None,
    extension: str | None = None,
    facing: int = 1,
    scale: float = 1.0,
    skin: bool = True,
    morphs: Mapping[str, Sequence[float]] | None = None,
    expressions: Mapping[str, Sequence[float]] | None = None,
    gaze: Sequence[Rotation] = (),
) -> Path:
    """Write a person.

    clips: turns of bones by clip, at rate frames/s, and hips (T, 3): how far these move. names: of nodes, by
    bone; a bone without is named like the bone. extension: "VRM", "VRMC_vrm", "VRMC_vrm_animation" or None.
    facing: 1 for +z, -1 for -z. scale: metres are divided by it, and a node above has it. skin: with a mesh.
    morphs: weights (T,) of the morph targets of the head, in every clip. expressions, gaze: of a VRMA.
    """
    builder = Builder()
    around = Rotation.from_rotvec([0, 0 if facing > 0 else np.pi, 0])
    order = list(BONES)
    first = 1
    children: dict[str | None, list[int]] = {}
    for number, bone in enumerate(order):
        children.setdefault(BONES[bone][0], []).append(number + first)
    builder.add("nodes", {"name": "Armature", "children": children[None], "scale": [scale] * 3})
    places: dict[str, np.ndarray] = {}
    for bone in order:
        parent, offset = BONES[bone]
        shift = around.apply(offset) / scale
        places[bone] = shift if parent is None else places[parent] + shift
        entry: dict[str, Any] = {"name": (names or {}).get(bone, bone), "translation": shift.tolist()}
        builder.add("nodes", entry | ({"children": children[bone]} if bone in children else {}))
    roots = [0]
    if skin:
        roots.append(_add_skin(builder, order, places, first, scale, morphs or {}))
    special: dict[str, int] = {}
    for name in (*(expressions or {}), *(["look"] if len(gaze) else [])):
        special[name] = builder.add("nodes", {"name": name})
        roots.append(special[name])
    builder.add("scenes", {"nodes": roots})
    for name, clip in (clips or {}).items():
        weights = [*(morphs or {}).values(), *(expressions or {}).values()]
        frames = max(len(rows) for rows in (*clip.values(), *weights, hips, gaze, [0]))
        times = builder.data((np.arange(frames) / rate).astype(np.float32), bounds=True)
        samplers: list[dict[str, Any]] = []
        channels: list[dict[str, Any]] = []

        def animate(node: int, what: str, values: np.ndarray) -> None:
            samplers.append({"input": times, "output": builder.data(values.astype(np.float32))})  # noqa: B023
            target = {"node": node, "path": what}
            channels.append({"sampler": len(samplers) - 1, "target": target})  # noqa: B023

        for bone, turns in clip.items():
            quaternions = [(around * turn * around.inv()).as_quat() for turn in turns]
            animate(order.index(bone) + first, "rotation", np.array(quaternions))
        if len(hips):
            animate(first, "translation", places["hips"] + around.apply(np.array(hips)) / scale)
        if morphs:
            animate(roots[1], "weights", np.array(list(morphs.values())).T.reshape(-1))
        for expression, weights in (expressions or {}).items():
            animate(special[expression], "translation", np.array([(w, 0.0, 0.0) for w in weights]))
        if len(gaze):
            animate(special["look"], "rotation", np.array([turn.as_quat() for turn in gaze]))
        builder.add("animations", {"name": name, "samplers": samplers, "channels": channels})
    if extension is not None:
        _declare(builder, extension, order, first, expressions or {}, special)
    path.write_bytes(builder.glb())
    return path


def _add_skin(
    builder: Builder,
    order: list[str],
    places: dict[str, np.ndarray],
    first: int,
    scale: float,
    morphs: Mapping[str, Sequence[float]],
) -> int:
    """Add a box around every bone, with a vertex colour of its own, and the skin; return the node."""
    corners = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
    faces = [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1),
             (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)]  # fmt: skip
    vertices, triangles, joints = [], [], []
    for number, bone in enumerate(order):
        tips = [places[child] for child, (parent, _) in BONES.items() if parent == bone]
        tip = np.mean(tips, axis=0) if tips else places[bone] + np.array([0, 0.1, 0]) / scale
        if bone.endswith("Toes"):
            tip = places[bone]
        middle = (places[bone] + tip) / 2
        half = np.abs(tip - places[bone]) / 2 + 0.03 / scale
        box = middle + corners * half
        if bone.endswith(("Foot", "Toes")):
            box[:, 1] = np.where(corners[:, 1] < 0, -SOLES / scale, box[:, 1])
        triangles += [tuple(8 * number + corner for corner in face) for face in faces]
        vertices.append(box)
        joints.append(np.full(8, number))
    positions = np.concatenate(vertices).astype(np.float32)
    primitive: dict[str, Any] = {
        "attributes": {
            "POSITION": builder.attribute(positions, bounds=True),
            "JOINTS_0": builder.attribute(
                np.stack([np.concatenate(joints), *[np.zeros(len(positions))] * 3], axis=1).astype(np.uint16)
            ),
            "WEIGHTS_0": builder.attribute(
                np.tile(np.array([1, 0, 0, 0], dtype=np.float32), (len(positions), 1))
            ),
        },
        "indices": builder.triangles(np.array(triangles, dtype=np.int32)),
    }
    mesh: dict[str, Any] = {"name": "Body", "primitives": [primitive]}
    if morphs:
        moved = np.zeros_like(positions)
        moved[8 * order.index("head") : 8 * order.index("head") + 8, 1] = 0.01 / scale
        primitive["targets"] = [{"POSITION": builder.displacements(moved)} for _ in morphs]
        mesh["extras"] = {"targetNames": list(morphs)}
    inverse = []
    for bone in order:
        matrix = np.eye(4)
        matrix[:3, 3] = -places[bone]
        inverse.append(matrix.T.reshape(16))
    skin = builder.add(
        "skins",
        {
            "joints": [number + first for number in range(len(order))],
            "inverseBindMatrices": builder.data(np.array(inverse, dtype=np.float32)),
        },
    )
    return builder.add("nodes", {"name": "Body", "mesh": builder.add("meshes", mesh), "skin": skin})


def _declare(
    builder: Builder,
    extension: str,
    order: list[str],
    first: int,
    expressions: Mapping[str, Sequence[float]],
    special: Mapping[str, int],
) -> None:
    """Add VRM's extension, which names the bones."""
    nodes = {bone: number + first for number, bone in enumerate(order)}
    content: dict[str, Any]
    if extension == "VRM":
        listed = [{"bone": bone, "node": node} for bone, node in nodes.items()]
        content = {"specVersion": "0.0", "humanoid": {"humanBones": listed}}
    else:
        bones = {bone: {"node": node} for bone, node in nodes.items()}
        content = {"specVersion": "1.0", "humanoid": {"humanBones": bones}}
    if expressions:
        preset = {name: {"node": special[name]} for name in expressions}
        content["expressions"] = {"preset": preset}
    if "look" in special:
        content["lookAt"] = {"node": special["look"]}
    builder.root["extensionsUsed"] = [extension]
    builder.root["extensions"] = {extension: content}

"""VRM avatars: which morph targets are a blink or an open mouth, and which way the face looks."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from fba.arrays import Float32
from fba.face.shape_names import canonical_names
from fba.gltf.scene import Gltf
from fba.gltf.values import Value

VISEMES = {
    "a": "viseme aa", "i": "viseme I", "u": "viseme U", "e": "viseme E", "o": "viseme O",
    "aa": "viseme aa", "ih": "viseme I", "ou": "viseme U", "ee": "viseme E", "oh": "viseme O",
    "joy": "mood joy", "happy": "mood joy", "angry": "mood anger", "sorrow": "mood sadness",
    "sad": "mood sadness", "surprised": "mood surprise",
}  # fmt: skip
"""Names of visemes and expressions (`assembly/visemes.csv`) by VRM's presets, in lower case."""
NAMES = {
    "a": "jawOpen",
    "aa": "jawOpen",
    "blink": "eyesClosed",
    "blink_l": "eyeBlinkLeft",
    "blinkleft": "eyeBlinkLeft",
    "blink_r": "eyeBlinkRight",
    "blinkright": "eyeBlinkRight",
}
"""ARKit's shapes by VRM's presets, in lower case."""
MOST = 4096
"""Most expressions of an avatar, and most morph targets of one."""


def looks_backwards(gltf: Gltf) -> bool:
    """Whether the file is of VRM 0, whose avatars look to -z."""
    extensions = gltf.document.get("extensions")
    return extensions is not None and extensions.get("VRM") is not None


def expression_targets(gltf: Gltf) -> dict[int, dict[str, list[tuple[int, float]]]]:
    """Morph targets of each mesh that show one of ARKit's shapes together: mesh -> name -> (number, weight).

    Raises ModelError where an expression names what does not exist.
    """
    result: dict[int, dict[str, list[tuple[int, float]]]] = {}
    for preset, binds, full in _expressions(gltf):
        names = [table[preset.lower()] for table in (NAMES, VISEMES) if preset.lower() in table]
        if not names:
            continue
        for bind in binds:
            number = bind.member("index").integer(0, MOST)
            weight = 1.0 if (share := bind.get("weight")) is None else share.number() / full
            mesh: int | None
            if bind.get("node") is not None:
                mesh = gltf.nodes[bind.member("node").index(len(gltf.nodes), "node")].mesh
            else:
                mesh = bind.member("mesh").index(len(gltf.meshes), "mesh")
            if mesh is not None and number < len(gltf.meshes[mesh].morph_names):
                for name in names:
                    result.setdefault(mesh, {}).setdefault(name, []).append((number, weight))
    return result


def name_shapes(
    morphs: Mapping[str, Float32], names: tuple[str, ...], targets: Mapping[str, list[tuple[int, float]]]
) -> dict[str, Float32]:
    """Morph targets of a surface with ARKit's names for the expressions of its mesh.

    morphs: displacements (V, 3) by name. names: those of all targets of the mesh. targets: of
    `expression_targets`. One target that is an expression is renamed, several are added up; shapes that
    the file itself names as ARKit's stay.
    """
    own = canonical_names(names)
    result = dict(morphs)
    for shape, parts in targets.items():
        moving = [(names[number], weight) for number, weight in parts if names[number] in morphs]
        if shape in own or not moving:
            continue
        single = len(parts) == 1 and parts[0][1] == 1.0 and shape in NAMES.values()
        if single and moving[0][0] in result and moving[0][0] not in own.values():
            name = moving[0][0]
            result = {shape if each == name else each: morph for each, morph in result.items()}
        else:
            result[shape] = np.sum([morphs[name] * np.float32(weight) for name, weight in moving], axis=0)
    return result


def _expressions(gltf: Gltf) -> Iterator[tuple[str, list[Value], float]]:
    """Of each expression of VRM 0 and VRM 1 the preset, the binds to morph targets, and their full weight."""
    extensions = gltf.document.get("extensions")
    if extensions is None:
        return
    master = None if (vrm := extensions.get("VRM")) is None else vrm.get("blendShapeMaster")
    for group in [] if master is None else master.elements(MOST, "blendShapeGroups"):
        preset = group.get("presetName")
        if preset is not None:
            yield preset.text(200), group.elements(MOST, "binds"), 100.0
    expressions = None if (vrm := extensions.get("VRMC_vrm")) is None else vrm.get("expressions")
    presets = None if expressions is None else expressions.get("preset")
    for name, expression in [] if presets is None else presets.members():
        yield name, expression.elements(MOST, "morphTargetBinds"), 1.0

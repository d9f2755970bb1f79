"""VRM avatars: which morph targets are a blink or an open mouth, and which way the face looks."""

from __future__ import annotations

from collections.abc import Iterator

from fba.gltf.scene import Gltf
from fba.gltf.values import Value

NAMES = {
    "a": "jawOpen",
    "aa": "jawOpen",
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


def name_shapes(gltf: Gltf) -> dict[tuple[int, int], str]:
    """ARKit's names of morph targets, by (mesh, number of the target), where one target is an expression.

    Raises ModelError where an expression names what does not exist.
    """
    result: dict[tuple[int, int], str] = {}
    for preset, binds in _expressions(gltf):
        if preset.lower() not in NAMES or len(binds) != 1:
            continue
        (bind,) = binds
        number = bind.member("index").integer(0, MOST)
        mesh: int | None
        if bind.get("node") is not None:
            mesh = gltf.nodes[bind.member("node").index(len(gltf.nodes), "node")].mesh
        else:
            mesh = bind.member("mesh").index(len(gltf.meshes), "mesh")
        if mesh is not None and number < len(gltf.meshes[mesh].morph_names):
            result.setdefault((mesh, number), NAMES[preset.lower()])
    return result


def _expressions(gltf: Gltf) -> Iterator[tuple[str, list[Value]]]:
    """The preset and the binds to morph targets of each expression, of VRM 0 and VRM 1."""
    extensions = gltf.document.get("extensions")
    if extensions is None:
        return
    master = None if (vrm := extensions.get("VRM")) is None else vrm.get("blendShapeMaster")
    for group in [] if master is None else master.elements(MOST, "blendShapeGroups"):
        preset = group.get("presetName")
        if preset is not None:
            yield preset.text(200), group.elements(MOST, "binds")
    expressions = None if (vrm := extensions.get("VRMC_vrm")) is None else vrm.get("expressions")
    presets = None if expressions is None else expressions.get("preset")
    for name, expression in [] if presets is None else presets.members():
        yield name, expression.elements(MOST, "morphTargetBinds")

"""Known heads with shapes of their own motion, written as glTF in the conventions of many makers."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from fba.face.authoring import author
from fba.face.deform._deformer import Deformer
from fba.face.model import FaceModel, Part
from fba.parameters import fap_numbers
from gltf_documents import Sheet
from grid_head import grid_head

Float64 = npt.NDArray[np.float64]
LOWER_LIP = {name: -700.0 for name in fap_numbers() if name.startswith(("raise_b_midlip", "raise_b_lip"))}


def _smile(side: str, wide: float, up: float) -> dict[str, float]:
    ends = ("", "_o")
    return {f"stretch_{side}_cornerlip{end}": wide for end in ends} | {
        f"raise_{side}_cornerlip{end}": up for end in ends
    }


ACTIONS: Mapping[str, Mapping[str, float]] = {
    "eyeBlinkLeft": {"close_t_l_eyelid": 1024},
    "eyeBlinkRight": {"close_t_r_eyelid": 1024},
    "jawOpen": {"open_jaw": 800, **LOWER_LIP},
    "mouthSmileLeft": _smile("l", 150, 200),
    "mouthSmileRight": _smile("r", 150, 200),
    "browInnerUp": {"raise_l_i_eyebrow": 200, "raise_r_i_eyebrow": 200},
    "browOuterUpLeft": {"raise_l_m_eyebrow": 200, "raise_l_o_eyebrow": 200},
    "browOuterUpRight": {"raise_r_m_eyebrow": 200, "raise_r_o_eyebrow": 200},
    "mouthPucker": {
        **{f"stretch_{side}_cornerlip{end}": -150 for side in "lr" for end in ("", "_o")},
        "push_t_lip": 150,
        "push_b_lip": 150,
    },
}
"""FAPs of the pose that each shape shows, by ARKit's name for it."""
VRM_PRESETS = {
    0: {"eyeBlinkLeft": "blink_l", "eyeBlinkRight": "blink_r", "jawOpen": "a", "mouthPucker": "u"},
    1: {"eyeBlinkLeft": "blinkLeft", "eyeBlinkRight": "blinkRight", "jawOpen": "aa", "mouthPucker": "ou"},
}
OCULUS = {"jawOpen": "viseme_aa", "mouthPucker": "viseme_U"}
UNDERSCORED = {name: "head_" + name.replace("Left", "_L").replace("Right", "_R") for name in ACTIONS}
MADE_UP = {name: f"expr {number:02}" for number, name in enumerate(ACTIONS)}


@dataclass(frozen=True)
class Maker:
    """A convention.

    shapes: ARKit's name -> that in the file; others are left out. vrm: 0 or 1 for expressions that name the
    shapes. unit: of the file, in metres. shift: of the whole file, metres. node_scale: scale and shift stand
    in a node above all. split: the skin is cut into this many surfaces. above: names stand on the nodes above
    unnamed meshes.
    """

    name: str
    shapes: Mapping[str, str] = field(default_factory=lambda: {name: name for name in ACTIONS})
    vrm: int | None = None
    unit: float = 1.0
    shift: tuple[float, float, float] = (0.0, 0.0, 0.0)
    node_scale: bool = False
    split: int = 1
    above: bool = False


@cache
def original(which: str) -> FaceModel:
    """The "built-in" head, or the "grid" head that tests author."""
    if which == "built-in":
        return FaceModel.default()
    parts, points, bound = grid_head()
    return author(parts, points, bound=bound)


@cache
def shape_moves(which: str) -> dict[str, Float64]:
    """(V, 3) displacements of all vertices of a head, by ARKit's name."""
    deform = Deformer(original(which))
    rest = deform.local(np.zeros(68))
    moves = {}
    for name, pose in ACTIONS.items():
        values = np.zeros(68)
        for fap, value in pose.items():
            values[fap_numbers()[fap] - 1] = value
        moves[name] = (deform.local(values) - rest).astype(np.float64)
    return moves


def write(maker: Maker, which: str, path: Path) -> Path:
    """A .glb of a head in the convention of a maker."""
    model, moves = original(which), shape_moves(which)
    sheet = Sheet()
    turn = np.array([-1.0, 1.0, -1.0]) if maker.vrm == 0 else np.ones(3)
    factor, shift = (1.0, np.zeros(3)) if maker.node_scale else (1 / maker.unit, np.array(maker.shift))
    names = list(maker.shapes.values())
    sheet.json |= {"meshes": [], "nodes": [], "scene": 0, "scenes": [{"nodes": []}]}
    roots: list[int] = []
    skins: list[int] = []
    for part in model.parts:
        start = model.starts[part.name]
        own = {maker.shapes[name]: moves[name][start : start + len(part.vertices)] for name in maker.shapes}
        shown = any(np.abs(move).max() > 0 for move in own.values())
        for triangles in _cut(part, maker.split if part.kind == "skin" else 1):
            used, corners = np.unique(triangles, return_inverse=True)
            placed = (part.vertices[used].astype(np.float64) + shift) * turn * factor
            primitive: dict[str, Any] = {
                "attributes": {"POSITION": sheet.array(placed)},
                "indices": sheet.array(corners.reshape(-1), "u4"),
            }
            mesh: dict[str, Any] = {"primitives": [primitive]}
            if shown:
                primitive["targets"] = [
                    {"POSITION": sheet.array(own[name][used] * turn * factor)} for name in names
                ]
                mesh["extras"] = {"targetNames": names}
            number = len(sheet.json["meshes"])
            sheet.json["meshes"].append(mesh)
            node: dict[str, Any] = {"mesh": number, "name": part.name}
            if maker.above:
                node["name"] = f"mesh_{number}"
                sheet.json["nodes"].append(node)
                node = {"name": part.name, "children": [len(sheet.json["nodes"]) - 1]}
            else:
                mesh["name"] = part.name
            sheet.json["nodes"].append(node)
            roots.append(len(sheet.json["nodes"]) - 1)
            if part.kind == "skin":
                skins.append(number)
    if maker.node_scale:
        scale = 1 / maker.unit
        place = [component * scale for component in maker.shift]
        sheet.json["nodes"].append(
            {"name": "scene", "scale": [scale] * 3, "translation": place, "children": roots}
        )
        roots = [len(sheet.json["nodes"]) - 1]
    sheet.json["scenes"][0]["nodes"] = roots
    if maker.vrm is not None:
        sheet.json["extensions"] = _expressions(maker, skins, sheet.json["nodes"])
    return sheet.save(path)


def _cut(part: Part, count: int) -> list[npt.NDArray[np.int32]]:
    """The triangles of a part in bands from left to right, whose edges share no vertex numbers."""
    middles = part.vertices[part.triangles].mean(axis=1)[:, 0]
    borders = np.quantile(middles, np.linspace(0, 1, count + 1)[1:-1])
    band = np.searchsorted(borders, middles)
    return [part.triangles[band == each] for each in range(count)]


def _expressions(maker: Maker, skins: list[int], nodes: list[dict[str, Any]]) -> dict[str, Any]:
    index = {name: number for number, name in enumerate(maker.shapes)}
    if maker.vrm == 0:
        groups = [
            {
                "presetName": preset,
                "binds": [{"mesh": skin, "index": index[name], "weight": 100} for skin in skins],
            }
            for name, preset in VRM_PRESETS[0].items()
        ]
        return {"VRM": {"blendShapeMaster": {"blendShapeGroups": groups}}}
    shown = [number for number, entry in enumerate(nodes) if entry.get("mesh") in skins]
    preset = {
        preset: {"morphTargetBinds": [{"node": node, "index": index[name], "weight": 1.0} for node in shown]}
        for name, preset in VRM_PRESETS[1].items()
    }
    return {"VRMC_vrm": {"specVersion": "1.0", "expressions": {"preset": preset}}}


MAKERS = (
    Maker("ARKit, metres"),
    Maker("ARKit, centimetres, moved, four surfaces", unit=0.01, shift=(0.4, 1.6, -0.3), split=4),
    Maker("ARKit with sides as letters, millimetres, names above", UNDERSCORED, unit=0.001, above=True),
    Maker("ARKit, scaled by a node", unit=0.01, shift=(0.0, 1.5, 0.1), node_scale=True),
    Maker("VRM 0", MADE_UP, vrm=0, shift=(0.0, 1.4, 0.0)),
    Maker("VRM 1", MADE_UP, vrm=1, shift=(0.0, 1.4, 0.0)),
    Maker("VRM 1, two surfaces, names above", MADE_UP, vrm=1, split=2, above=True),
    Maker("Oculus visemes", OCULUS, shift=(0.0, 1.6, 0.0)),
    Maker("Oculus visemes, centimetres, names above, three surfaces", OCULUS, unit=0.01, split=3, above=True),
)

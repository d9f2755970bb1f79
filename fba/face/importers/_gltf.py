"""Imports glTF heads of other makers: surfaces, materials, and morph targets as shapes.

Of VRM avatars, expressions say which morph targets are a blink or an open mouth.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterator, Mapping

import numpy as np

from fba.arrays import Float32
from fba.errors import FormatError, ModelError
from fba.face.importers._shaped import import_shaped, match_sides
from fba.face.importers.assembly._pieces import guess_kind, part_names
from fba.face.importers.assembly._polygon_parts import Piece
from fba.face.importers.assembly.model import ImportOptions
from fba.face.model import FaceModel, Material, Part
from fba.face.shape_names import canonical_names
from fba.gltf import Gltf, Value, convert_material
from fba.limits import DEFAULT_LIMITS, Limits
from fba.text_files import MAX_VERTICES

EXTENSION = "FBA_face"
VRM_VISEMES = {
    "a": "viseme aa", "i": "viseme I", "u": "viseme U", "e": "viseme E", "o": "viseme O",
    "aa": "viseme aa", "ih": "viseme I", "ou": "viseme U", "ee": "viseme E", "oh": "viseme O",
    "joy": "mood joy", "happy": "mood joy", "angry": "mood anger", "sorrow": "mood sadness",
    "sad": "mood sadness", "surprised": "mood surprise",
}  # fmt: skip
"""Names of visemes and expressions (`assembly/visemes.csv`) by VRM's presets, in lower case."""
VRM_SHAPES = {
    "a": "jawOpen", "aa": "jawOpen", "blink": "eyesClosed",
    "blink_l": "eyeBlinkLeft", "blinkleft": "eyeBlinkLeft",
    "blink_r": "eyeBlinkRight", "blinkright": "eyeBlinkRight",
}  # fmt: skip
"""ARKit's shapes by VRM's presets, in lower case."""
MAX_EXPRESSIONS = 4096
"""Number of expressions that an avatar may have, and of morph targets that an expression may have."""


def import_gltf(options: ImportOptions, points: object = None) -> FaceModel:
    """Return a face from a .glb or .gltf head; one that `FaceModel.save` wrote is simply loaded.

    points: as `import_model`. Morph targets named as ARKit's blendshapes, or as FAPs, give tables; feature
    points that are not given are located by them. Avatars of VRM 0, which look to -z, are turned to +z
    first: positions of points are those after that. Raises ModelError as `import_model`.
    """
    path = options.path
    pieces, has_extension = gltf_pieces(path, options.limits)
    if has_extension and points is None:
        return FaceModel.load(path, limits=options.limits)
    return import_shaped(pieces, options, points)


def gltf_pieces(path: str | os.PathLike[str], limits: Limits = DEFAULT_LIMITS) -> tuple[list[Piece], bool]:
    """Return (every surface of a glTF file as a piece, whether the file is a face model of this project).

    Origins of vertices are counted through the pieces. Avatars of VRM 0 are turned to look to +z.
    """
    from fba.gltf import read_gltf, surfaces

    try:
        gltf = read_gltf(path, limits=limits)
    except FormatError as error:
        raise ModelError(str(error)) from error
    extensions = gltf.document.get("extensions")
    is_own = extensions is not None and extensions.get(EXTENSION) is not None
    pieces: list[Piece] = []
    start = 0
    names_of_parts = part_names()
    shown = surfaces(gltf)
    primitives = Counter(surface.node for surface in shown)
    targets = expression_targets(gltf)
    facing = np.array((-1.0, 1.0, -1.0) if looks_backwards(gltf) else (1.0, 1.0, 1.0), dtype=np.float32)
    for surface in shown:
        count = len(surface.positions)
        if start + count > MAX_VERTICES:
            raise ModelError(f"{path}: more than {MAX_VERTICES} vertices; reduce the mesh to its head")
        material = Material()
        if (own := surface.material) is not None:
            texture = None if surface.texcoords is None else own.texture
            material = convert_material(own, texture)
        name = surface.name or "mesh"
        if primitives[surface.node] > 1 and guess_kind(material.name) is not None:
            name = material.name  # of several surfaces of one node, the material says which this is
        name = names_of_parts(name)
        part = Part(
            name,
            "other",
            surface.positions * facing,
            surface.triangles,
            None if surface.normals is None else surface.normals * facing,
            surface.texcoords,
            None if surface.colours is None else _with_gloss(surface.colours, material),
            material,
        )
        origin = np.arange(start, start + count, dtype=np.int32)
        mesh = gltf.nodes[surface.node].mesh
        assert mesh is not None  # a surface is of a mesh
        named = name_shapes(surface.morphs, gltf.meshes[mesh].morph_names, targets.get(mesh, {}))
        morphs = {name: morph * facing for name, morph in named.items()}
        pieces.append(Piece(part, material.name, origin, morphs))
        start += count
    if not pieces:
        raise ModelError(f"{path}: the scene contains no triangles; export the head as a mesh")
    return match_sides(pieces), is_own


def _with_gloss(colours: Float32, material: Material) -> Float32:
    """Return the vertex colours times the material's; the fourth, opacity in glTF, is gloss here."""
    result = colours.copy()
    result[:, :3] *= np.array(material.colour, dtype=np.float32)
    result[:, 3] = material.gloss
    return result


def looks_backwards(gltf: Gltf) -> bool:
    """Return whether the file is of VRM 0, whose avatars look to -z."""
    extensions = gltf.document.get("extensions")
    return extensions is not None and extensions.get("VRM") is not None


def expression_targets(gltf: Gltf) -> dict[int, dict[str, list[tuple[int, float]]]]:
    """Return the morph targets that show a shape of ARKit together: mesh -> name -> (number, weight).

    Raises ModelError where an expression names what does not exist.
    """
    result: dict[int, dict[str, list[tuple[int, float]]]] = {}
    for preset, binds, full in _vrm_expressions(gltf):
        names = [table[preset.lower()] for table in (VRM_SHAPES, VRM_VISEMES) if preset.lower() in table]
        if not names:
            continue
        for bind in binds:
            number = bind.member("index").integer(0, MAX_EXPRESSIONS)
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
    """Return the morph targets of a surface with ARKit's names for the expressions of its mesh.

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
        single = len(parts) == 1 and parts[0][1] == 1.0 and shape in VRM_SHAPES.values()
        if single and moving[0][0] in result and moving[0][0] not in own.values():
            name = moving[0][0]
            result = {shape if each == name else each: morph for each, morph in result.items()}
        else:
            result[shape] = np.sum([morphs[name] * np.float32(weight) for name, weight in moving], axis=0)
    return result


def _vrm_expressions(gltf: Gltf) -> Iterator[tuple[str, list[Value], float]]:
    """Yield preset, binds to morph targets and their full weight of each expression of VRM 0 and VRM 1."""
    extensions = gltf.document.get("extensions")
    if extensions is None:
        return
    master = None if (vrm := extensions.get("VRM")) is None else vrm.get("blendShapeMaster")
    for group in [] if master is None else master.elements(MAX_EXPRESSIONS, "blendShapeGroups"):
        preset = group.get("presetName")
        if preset is not None:
            yield preset.text(200), group.elements(MAX_EXPRESSIONS, "binds"), 100.0
    expressions = None if (vrm := extensions.get("VRMC_vrm")) is None else vrm.get("expressions")
    presets = None if expressions is None else expressions.get("preset")
    for name, expression in [] if presets is None else presets.members():
        yield name, expression.elements(MAX_EXPRESSIONS, "morphTargetBinds"), 1.0

"""A face model written as glTF: meshes and morph targets for all viewers, the extension for this project."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from fba.errors import ModelError
from fba.face.gltf.extension import NAME, extension
from fba.face.gltf.morphs import displacements
from fba.face.model import FaceModel, Material, Part
from fba.face.tables import HEAD
from fba.gltf.writer import Builder
from fba.parameters import faps

Float32 = npt.NDArray[np.float32]
WHITE = (1.0, 1.0, 1.0)


def build(model: FaceModel) -> Builder:
    """The whole document of a model. Raises ModelError where glTF cannot hold it, with the reason."""
    builder = Builder()
    builder.root["extensionsUsed"] = [NAME]
    builder.root["scene"] = 0
    builder.add("scenes", {"nodes": [0]})
    nodes = list(range(1, len(model.parts) + 1))
    builder.add("nodes", {"name": HEAD, "children": nodes})
    materials = _Materials(builder)
    primitives = [_primitive(builder, part, materials) for part in model.parts]
    targets = _targets(builder, model)
    for part, primitive, moved in zip(model.parts, primitives, targets, strict=True):
        mesh: dict[str, Any] = {"name": part.name, "primitives": [primitive]}
        if moved:
            primitive["targets"] = [{"POSITION": accessor} for accessor in moved.values()]
            mesh["extras"] = {"targetNames": list(moved)}
        builder.add("nodes", {"name": part.name, "mesh": builder.add("meshes", mesh)})
    builder.root["extensions"] = {NAME: extension(builder, model, nodes)}
    return builder


def _primitive(builder: Builder, part: Part, materials: _Materials) -> dict[str, Any]:
    if not len(part.triangles):
        raise ModelError(f"part {part.name!r} has no triangles; a glTF mesh needs some: leave the part out")
    if part.material.texture is not None and part.texcoords is None:
        raise ModelError(
            f"part {part.name!r} has a texture, but no texture coordinates; leave the texture out"
        )
    attributes = {"POSITION": builder.attribute(part.vertices, bounds=True)}
    for key, array in (("NORMAL", part.normals), ("TEXCOORD_0", part.texcoords)):
        if array is not None:
            attributes[key] = builder.attribute(array)
    if part.colours is not None:
        attributes["COLOR_0"] = builder.colours(part.colours)
    return {
        "attributes": attributes,
        "indices": builder.triangles(part.triangles),
        "material": materials.index(part),
    }


def _targets(builder: Builder, model: FaceModel) -> list[dict[str, int]]:
    """For each part the accessors of its morph targets, by name of the FAP."""
    found: list[dict[str, int]] = [{} for _ in model.parts]
    ends = np.cumsum([len(part.vertices) for part in model.parts])[:-1]
    for number, shift in displacements(model):
        for targets, moved in zip(found, np.split(shift, ends), strict=True):
            if moved.any():
                targets[faps()[number - 1].name] = builder.displacements(moved)
    return found


class _Materials:
    """Materials and textures of the document, each written once."""

    def __init__(self, builder: Builder) -> None:
        self._builder = builder
        self._known: dict[Material, int] = {}
        self._textures: dict[int, int] = {}

    def index(self, part: Part) -> int:
        # in glTF the colours of vertices multiply the material's, here they replace it
        material, colour = part.material, part.material.colour if part.colours is None else WHITE
        shown = Material(material.name, colour, material.roughness, material.texture)
        if shown not in self._known:
            self._known[shown] = self._builder.add("materials", self._entry(shown, part.name))
        return self._known[shown]

    def _entry(self, material: Material, part: str) -> dict[str, Any]:
        numbers = (*material.colour, material.roughness)
        if len(numbers) != 4 or not all(0 <= number <= 1 for number in numbers):
            raise ModelError(
                f"part {part!r}: colour and roughness of its material must be within 0..1, not {numbers}"
            )
        look: dict[str, Any] = {
            "baseColorFactor": [*map(float, material.colour), 1.0],
            "metallicFactor": 0.0,
            "roughnessFactor": float(material.roughness),
        }
        if material.texture is not None:
            image = self._builder.image(material.texture, material.name)
            if image not in self._textures:
                self._textures[image] = self._builder.add("textures", {"source": image})
            look["baseColorTexture"] = {"index": self._textures[image]}
        return {"name": material.name, "pbrMetallicRoughness": look}

"""Conversion of parts of faces and bodies to glTF primitives and materials, and of materials back."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Protocol

from fba.arrays import Float32
from fba.errors import ModelError
from fba.gltf._scene import Gltf, GltfMaterial, Primitive
from fba.gltf._values import Value
from fba.gltf._writer import Builder
from fba.mesh import Material, Mesh

WHITE = (1.0, 1.0, 1.0)


class MeshPart(Mesh, Protocol):
    """A mesh with material, texture coordinates and colours: a part of a face or a body."""

    @property
    def texcoords(self) -> Float32 | None: ...
    @property
    def colours(self) -> Float32 | None: ...
    @property
    def material(self) -> Material: ...


class PartWriter:
    """Writes parts as primitives of a document, and each material and texture once."""

    def __init__(self, builder: Builder) -> None:
        self._builder = builder
        self._known: dict[Material, int] = {}
        self._textures: dict[int, int] = {}

    def primitive(self, part: MeshPart) -> dict[str, Any]:
        """Return the primitive of a part, for the list of a mesh. ModelError where glTF cannot hold it."""
        if not len(part.triangles):
            raise ModelError(
                f"part {part.name!r} has no triangles; a glTF mesh needs some: leave this part out"
            )
        if part.material.texture is not None and part.texcoords is None:
            raise ModelError(
                f"part {part.name!r} has a texture, but no texture coordinates; leave the texture out"
            )
        attributes = {"POSITION": self._builder.attribute(part.vertices, bounds=True)}
        for key, array in (("NORMAL", part.normals), ("TEXCOORD_0", part.texcoords)):
            if array is not None:
                attributes[key] = self._builder.attribute(array)
        if part.colours is not None:
            attributes["COLOR_0"] = self._builder.colours(part.colours)
        return {
            "attributes": attributes,
            "indices": self._builder.triangles(part.triangles),
            "material": self._material(part),
        }

    def _material(self, part: MeshPart) -> int:
        # colours of vertices multiply the material's in glTF, but replace it in fba
        material, colour = part.material, part.material.colour if part.colours is None else WHITE
        shown = replace(material, colour=colour)
        if shown not in self._known:
            self._known[shown] = self._builder.add("materials", self._entry(shown, part.name))
        return self._known[shown]

    def _entry(self, material: Material, part: str) -> dict[str, Any]:
        numbers = (*material.colour, material.roughness, material.opacity)
        if len(numbers) != 5 or not all(0 <= number <= 1 for number in numbers):
            raise ModelError(
                f"part {part!r}: colour, roughness and opacity must be within 0..1, not {numbers}"
            )
        surface: dict[str, Any] = {
            "baseColorFactor": [*map(float, (*material.colour, material.opacity))],
            "metallicFactor": 0.0,
            "roughnessFactor": float(material.roughness),
        }
        if material.texture is not None:
            image = self._builder.image(material.texture, material.name)
            if image not in self._textures:
                self._textures[image] = self._builder.texture(image)
            surface["baseColorTexture"] = {"index": self._textures[image]}
        entry: dict[str, Any] = {"name": material.name, "pbrMetallicRoughness": surface}
        if material.alpha != "auto":
            entry["alphaMode"] = material.alpha.upper()
        if material.alpha == "mask":
            entry["alphaCutoff"] = float(material.cutoff)
        if material.two_sided:
            entry["doubleSided"] = True
        return entry


def read_material(entry: Value, gltf: Gltf, primitive: Primitive) -> Material:
    """Return the material of the part made of a primitive. ModelError for a texture without coordinates.

    entry: the part's entry in our extension, which has the material's colour where colours of vertices
    replace it.
    """
    given = entry.get("colour")
    if primitive.material is None:
        return Material()
    material = gltf.materials[primitive.material]
    if material.texture is not None and not primitive.texcoords:
        raise entry.error(
            "its material has a texture, but its mesh has no texture coordinates; leave one out"
        )
    read = convert_material(material, material.texture)
    if given is not None:
        red, green, blue = given.numbers(3, 0.0, 1.0)
        read = replace(read, colour=(red, green, blue))
    return read if material.alpha is not None else replace(read, alpha="auto")


def convert_material(material: GltfMaterial, texture: bytes | None) -> Material:
    """Return a document's material as that of a part that has this texture."""
    *colour, opacity = material.colour
    red, green, blue = colour
    return Material(
        material.name, (red, green, blue), material.roughness, texture, opacity, material.alpha or "opaque",
        min(material.cutoff, 1.0), material.two_sided,
    )  # fmt: skip

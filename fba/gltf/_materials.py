"""Materials and pictures of a glTF file."""

from __future__ import annotations

from typing import Literal

from fba.errors import warn
from fba.gltf._document import Document
from fba.gltf._scene import GltfMaterial
from fba.gltf._values import Value, optional_member

WEBP = "EXT_texture_webp"
"""The extension by which a texture has a picture in WebP."""
PICTURES = {b"\x89PNG\r\n\x1a\n": "image/png", b"\xff\xd8\xff": "image/jpeg", b"RIFF": "image/webp"}
"""First bytes and media types of the pictures that a glTF file may hold."""
ALPHA: dict[str, Literal["opaque", "mask", "blend"]] = {"OPAQUE": "opaque", "MASK": "mask", "BLEND": "blend"}


def media_type(data: bytes) -> str | None:
    """Return "image/png", "image/jpeg" or "image/webp" by the first bytes, None for other content."""
    kind = next((name for mark, name in PICTURES.items() if data.startswith(mark)), None)
    return None if kind == "image/webp" and data[8:12] != b"WEBP" else kind


def read_materials(document: Document) -> tuple[GltfMaterial, ...]:
    """Return all materials, in order."""
    pictures = _Pictures(document)
    materials = tuple(_material(entry, n, pictures) for n, entry in enumerate(document.entries("materials")))
    pictures.warn()
    return materials


def _material(entry: Value, number: int, pictures: _Pictures) -> GltfMaterial:
    pictures.document.budget.charge(1024, entry)
    name = entry.get("name")
    surface = entry.get("pbrMetallicRoughness")
    colour, metallic, roughness, texture = (
        optional_member(surface, key)
        for key in ("baseColorFactor", "metallicFactor", "roughnessFactor", "baseColorTexture")
    )
    red, green, blue, alpha = (1.0,) * 4 if colour is None else colour.numbers(4, 0.0, 1.0)
    coordinates = optional_member(texture, "texCoord")
    given, cutoff, two_sided = (entry.get(key) for key in ("alphaMode", "alphaCutoff", "doubleSided"))
    mode = None if given is None else given.choice(*ALPHA)
    return GltfMaterial(
        name=f"material {number}" if name is None else name.text(),
        colour=(red, green, blue, alpha),
        metallic=1.0 if metallic is None else metallic.number(0.0, 1.0),
        roughness=1.0 if roughness is None else roughness.number(0.0, 1.0),
        texture=None if texture is None else pictures.texture(texture),
        texcoord=0 if coordinates is None else coordinates.integer(0, 31),
        alpha=None if mode is None else ALPHA[mode],
        cutoff=0.5 if cutoff is None else cutoff.number(0.0, 1e6),
        two_sided=two_sided is not None and two_sided.boolean(),
    )


class _Pictures:
    """Reads the pictures of a document, each once."""

    def __init__(self, document: Document) -> None:
        self.document = document
        self._textures = document.entries("textures")
        self._images = document.entries("images")
        self._known: dict[int, bytes | None] = {}
        self._left_out: list[tuple[Value, str]] = []

    def texture(self, info: Value) -> bytes | None:
        index = info.member("index").index(len(self._textures), "texture")
        texture = self._textures[index]
        better = optional_member(texture.get("extensions"), WEBP)
        source = texture.get("source") if better is None else better.member("source")
        if source is None:  # only another extension names its picture
            self._left_out.append((texture, "has no PNG, JPEG or WebP picture"))
            return None
        number = source.index(len(self._images), "image")
        if number not in self._known:
            self._known[number] = self._image(self._images[number])
        return self._known[number]

    def _image(self, entry: Value) -> bytes | None:
        uri = entry.get("uri")
        if uri is None:
            view, _ = self.document.view(entry.member("bufferView"))
            self.document.budget.charge(len(view), entry)
            data = bytes(view)
        else:
            data = self.document.resource(uri)
            self.document.budget.add_source(len(data))
            self.document.budget.charge(len(data), entry)
        if media_type(data) is None:
            self._left_out.append((entry, "is neither PNG, JPEG nor WebP"))
            return None
        return data

    def warn(self) -> None:
        """Warn of the pictures that were left out, once for all of them."""
        if self._left_out:
            entry, text = self._left_out[0]
            more = len({each.path for each, _ in self._left_out}) - 1
            rest = f" (and so {more} more)" if more else ""
            warn(f"{entry.file}: {entry.path}: {text}; left out{rest}", stacklevel=5)

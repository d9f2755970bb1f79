"""glTF 2.0 files, read into plain arrays and written.

read_gltf(path) -> Gltf                  # meshes with morph targets, nodes with matrices, skins, animations
surfaces(gltf) -> tuple[Surface, ...]    # the surfaces of its scene, all in the frame of the scene
"""

from fba.gltf._accessors import unpack
from fba.gltf._document import MAX_ITEMS, Document, open_document, parse_json
from fba.gltf._part_materials import PartWriter, convert_material, read_material
from fba.gltf._reader import read_document, read_gltf
from fba.gltf._scene import Channel, Clip, Gltf, GltfMaterial, GltfMesh, Node, Primitive, Skin
from fba.gltf._surfaces import Surface, surfaces
from fba.gltf._values import MAX_TEXT, Budget, Value, locating_errors, optional_member
from fba.gltf._writer import Builder

__all__ = [
    "MAX_ITEMS", "MAX_TEXT", "Budget", "Builder", "Channel", "Clip", "Document", "Gltf", "GltfMaterial",
    "GltfMesh", "Node", "PartWriter", "Primitive", "Skin", "Surface", "Value", "convert_material",
    "locating_errors", "open_document", "optional_member", "parse_json", "read_document", "read_gltf",
    "read_material", "surfaces", "unpack",
]  # fmt: skip

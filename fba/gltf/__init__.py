"""glTF 2.0 files, read into plain arrays and written.

read_gltf(path) -> Gltf                  # meshes with morph targets, nodes with matrices, skins, animations
surfaces(gltf) -> tuple[Surface, ...]    # the surfaces of its scene, all in the frame of the scene
"""

from fba.gltf.reader import read_gltf
from fba.gltf.scene import Channel, Clip, Gltf, GltfMaterial, GltfMesh, Node, Primitive, Skin
from fba.gltf.surfaces import Surface, surfaces

__all__ = [
    "Channel",
    "Clip",
    "Gltf",
    "GltfMaterial",
    "GltfMesh",
    "Node",
    "Primitive",
    "Skin",
    "Surface",
    "read_gltf",
    "surfaces",
]

"""Meshes, nodes, skins, materials and animations of a glTF file, as plain arrays."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from fba.arrays import Float32, Float64, Int32
from fba.gltf._accessors import Accessors
from fba.gltf._values import Budget, Value


@dataclass(frozen=True, eq=False)
class GltfMaterial:
    """The look of a surface.

    colour: red, green, blue in linear light, and opacity, 0..1; it multiplies the texture. texture: PNG,
    JPEG or WebP bytes, sRGB, or None. texcoord: number of the set of texture coordinates that it uses. alpha:
    "opaque", "mask" with a cutoff, or "blend"; None where the file does not say, which means "opaque".
    two_sided: whether backs are seen.
    """

    name: str
    colour: tuple[float, float, float, float]
    metallic: float
    roughness: float
    texture: bytes | None
    texcoord: int
    alpha: Literal["opaque", "mask", "blend"] | None = None
    cutoff: float = 0.5
    two_sided: bool = False


@dataclass(frozen=True, eq=False)
class Primitive:
    """Triangles of one material. All arrays are read-only.

    positions: float32 (V, 3). triangles: int32 (F, 3). normals: float32 (V, 3) or None. texcoords: one
    float32 (V, 2) a set, origin at the picture's top left. colours: float32 (V, 4) or None. joints:
    int32 (V, 4 n), positions in the skin's list of joints, and weights: float32 (V, 4 n), or None.
    morphs: one float32 (V, 3) a morph target, displacements at weight 1, or None for one that moves nothing.
    material: its index, or None.
    """

    positions: Float32
    triangles: Int32
    normals: Float32 | None
    texcoords: tuple[Float32, ...]
    colours: Float32 | None
    joints: Int32 | None
    weights: Float32 | None
    morphs: tuple[Float32 | None, ...]
    material: int | None


@dataclass(frozen=True, eq=False)
class GltfMesh:
    """Primitives with the same morph targets. morph_names, weights: the targets' names and defaults."""

    name: str
    primitives: tuple[Primitive, ...]
    morph_names: tuple[str, ...]
    weights: tuple[float, ...]


@dataclass(frozen=True, eq=False)
class Node:
    """A node of the scene's tree.

    parent: index, or None for a root. translation (3,), rotation (4,) quaternion x y z w, scale (3,), or
    None where the file gives a matrix instead. local: float64 (4, 4), to the parent's frame. world: float64
    (4, 4), to the scene's. mesh, skin: indices or None.
    """

    name: str
    parent: int | None
    children: tuple[int, ...]
    translation: Float64 | None
    rotation: Float64 | None
    scale: Float64 | None
    local: Float64
    world: Float64
    mesh: int | None
    skin: int | None


@dataclass(frozen=True, eq=False)
class Skin:
    """Joints that carry a mesh: nodes, and (J, 4, 4) from the mesh's frame to each joint's."""

    name: str
    joints: tuple[int, ...]
    inverse_bind: Float64


@dataclass(frozen=True, eq=False)
class Channel:
    """One animated property of one node.

    path: "translation", "rotation", "scale" or "weights". interpolation: "LINEAR", "STEP" or
    "CUBICSPLINE". times: float32 (T,), seconds, increasing. values: float32 (T, width), or (T, 3, width) for
    CUBICSPLINE: in-tangent, value, out-tangent.
    """

    node: int
    path: str
    interpolation: str
    times: Float32
    values: Float32


@dataclass(frozen=True, eq=False)
class Clip:
    """Channels that play together."""

    name: str
    channels: tuple[Channel, ...]


@dataclass(frozen=True, eq=False)
class Gltf:
    """The content of a glTF file.

    roots: nodes at the top of the default scene. order: all nodes, parents first. document: the JSON,
    accessors: the arrays, both for extensions and extras. budget: of the memory. Lengths are metres, +y is
    up, models face +z.
    """

    file: str
    meshes: tuple[GltfMesh, ...]
    nodes: tuple[Node, ...]
    skins: tuple[Skin, ...]
    materials: tuple[GltfMaterial, ...]
    animations: tuple[Clip, ...]
    roots: tuple[int, ...]
    order: tuple[int, ...]
    document: Value
    accessors: Accessors
    budget: Budget

    def shown(self) -> tuple[int, ...]:
        """Return the nodes of the default scene, parents first."""
        inside: set[int] = set()
        roots = set(self.roots)
        for number in self.order:
            parent = self.nodes[number].parent
            if number in roots or (parent is not None and parent in inside):
                inside.add(number)
        return tuple(number for number in self.order if number in inside)

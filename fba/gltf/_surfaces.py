"""The surfaces of a glTF scene, in the frame of the scene: transforms and skins are applied."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fba.arrays import Float32, Float64, Int32
from fba.errors import warn
from fba.gltf._scene import Gltf, GltfMaterial, Node, Primitive
from fba.mesh import UniqueNames

SURFACE_BYTES = 2500
"""Memory of a surface, whatever its number of vertices."""
GENERIC = re.compile(
    r"(?:(?:mesh|node|object|primitive|polysurface|geometry)[ _.:-]*)?[\d_.]*", re.IGNORECASE
)
"""Names that programs give by themselves."""
MOST_ABOVE = 8
"""Most names that are tried."""


@dataclass(frozen=True, eq=False)
class Surface:
    """One primitive of one node, at rest: morph targets at 0, joints as in the file.

    name: the node's, else the mesh's, else that of the nearest node above; made unique. positions: float32
    (V, 3), in the scene's frame. triangles: int32 (F, 3), counter-clockwise from outside. normals: float32
    (V, 3) unit, or None.
    texcoords: float32 (V, 2) of the set that the material uses, or None. colours: float32 (V, 4) or None.
    morphs: float32 (V, 3) displacements at weight 1, in the scene's frame, by name. node: its index.
    primitive: what it was made from (joints and weights of a skin).
    """

    name: str
    positions: Float32
    triangles: Int32
    normals: Float32 | None
    texcoords: Float32 | None
    colours: Float32 | None
    morphs: Mapping[str, Float32]
    material: GltfMaterial | None
    node: int
    primitive: Primitive


def surfaces(gltf: Gltf) -> tuple[Surface, ...]:
    """Return every surface of the default scene, parents first.

    Raises LimitError where they take more memory than the limits of `gltf` allow, as a mesh that is shown
    a million times does.
    """
    budget = gltf.budget.copy()
    result: list[Surface] = []
    names = UniqueNames()
    of_skins: dict[int, Float64] = {}
    for number in gltf.shown():
        node = gltf.nodes[number]
        if node.mesh is None:
            continue
        mesh = gltf.meshes[node.mesh]
        for primitive in mesh.primitives:
            moving = sum(morph is not None for morph in primitive.morphs)
            # float64 positions and normals; with a skin, a matrix for each vertex
            each = 200 + 12 * moving + (0 if node.skin is None else 600)
            budget.charge(SURFACE_BYTES + len(primitive.positions) * each, gltf.document)
            name = names(_telling_name(gltf, number, mesh.name))
            with np.errstate(all="ignore"):  # overflow is detected at the end
                result.append(_surface(gltf, number, primitive, mesh.morph_names, name, of_skins))
    return tuple(result)


def _telling_name(gltf: Gltf, number: int, mesh: str) -> str:
    """Return the name of a node, of its mesh, or of the nearest node above it: the first that a person gave.

    Exporters that split or compress meshes leave the person's names to the nodes above.
    """
    own = gltf.nodes[number].name
    above = gltf.nodes[number].parent
    candidates = [own, mesh]
    while above is not None and len(candidates) < MOST_ABOVE:
        candidates.append(gltf.nodes[above].name)
        above = gltf.nodes[above].parent
    return next((name for name in candidates if not GENERIC.fullmatch(name)), own)


def _surface(
    gltf: Gltf,
    number: int,
    primitive: Primitive,
    names: tuple[str, ...],
    name: str,
    of_skins: dict[int, Float64],
) -> Surface:
    """Return the surface of a node's primitive. of_skins: see `_frames`."""
    matrices = _frames(gltf, gltf.nodes[number], primitive, of_skins)
    linear = matrices[..., :3, :3]
    positions = _moved(linear, primitive.positions) + matrices[..., :3, 3]
    morphs = {
        target: _moved(linear, morph).astype(np.float32)
        for target, morph in zip(names, primitive.morphs, strict=True)
        if morph is not None
    }
    if len(set(names)) < len(names):
        warn(f"{gltf.file}: {name}: two morph targets have the same name", stacklevel=3)
    placed = positions.astype(np.float32)
    if not all(np.isfinite(array).all() for array in (placed, *morphs.values())):
        raise gltf.document.error(f"nodes[{number}]: positions overflow in the frame of the scene")
    mirrored = float(np.linalg.det(linear.reshape(-1, 3, 3)[0])) < 0
    material = None if primitive.material is None else gltf.materials[primitive.material]
    texcoord = 0 if material is None else material.texcoord
    return Surface(
        name=name,
        positions=placed,
        triangles=primitive.triangles[:, ::-1].copy() if mirrored else primitive.triangles,
        normals=None if primitive.normals is None else _turned(linear, primitive.normals),
        texcoords=primitive.texcoords[texcoord] if texcoord < len(primitive.texcoords) else None,
        colours=primitive.colours,
        morphs=morphs,
        material=material,
        node=number,
        primitive=primitive,
    )


def _frames(gltf: Gltf, node: Node, primitive: Primitive, of_skins: dict[int, Float64]) -> Float64:
    """Return the node's matrix (4, 4), or one a vertex (V, 4, 4) of a skin, cached in `of_skins`."""
    if node.skin is None or primitive.joints is None or primitive.weights is None:
        return node.world
    if node.skin not in of_skins:
        skin = gltf.skins[node.skin]
        worlds = np.stack([gltf.nodes[joint].world for joint in skin.joints])
        of_skins[node.skin] = worlds @ skin.inverse_bind
    joints = of_skins[node.skin]
    total = primitive.weights.sum(axis=1, dtype=np.float64)
    carried = total > 0
    matrices = np.zeros((len(primitive.positions), 4, 4))
    for slot in range(primitive.joints.shape[1]):
        share = primitive.weights[:, slot] / np.where(carried, total, 1.0)
        matrices += share[:, None, None] * joints[primitive.joints[:, slot]]
    matrices[~carried] = node.world
    return matrices


def _moved(linear: Float64, vectors: Float32) -> Float64:
    return np.asarray(np.einsum("...ij,...j->...i", linear, vectors.astype(np.float64)))


def _turned(linear: Float64, normals: Float32) -> Float32:
    """Return normals transformed by the inverse transpose, so that uneven scales leave them perpendicular."""
    cofactors = np.stack(
        [np.cross(linear[..., (i + 1) % 3, :], linear[..., (i + 2) % 3, :]) for i in range(3)], axis=-2
    )
    sign = np.sign(np.linalg.det(linear))[..., None]
    turned = _moved(cofactors, normals) * sign
    length = np.linalg.norm(turned, axis=1, keepdims=True)
    unit = np.where(length > 0, turned / length, (0.0, 0.0, 1.0))
    return np.nan_to_num(unit).astype(np.float32)

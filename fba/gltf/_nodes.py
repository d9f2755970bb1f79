"""The tree of nodes of a glTF file, their transforms to parent and scene, and the joints of skins."""

from __future__ import annotations

import numpy as np

from fba import rotations
from fba.arrays import Float64
from fba.gltf._accessors import Accessors
from fba.gltf._document import MAX_ITEMS, Document
from fba.gltf._scene import GltfMesh, Node, Skin
from fba.gltf._values import Value

MAX_NUMBER = 1e100
"""Bound of the numbers of transforms to the scene: squares of larger ones overflow."""

MAX_ROUNDING = 1e-6
"""Largest difference of the last row of a matrix from 0 0 0 1, as exporters round it."""


def read_nodes(
    document: Document, meshes: tuple[GltfMesh, ...], skins: tuple[Skin, ...]
) -> tuple[tuple[Node, ...], tuple[int, ...]]:
    """Return all nodes, and their indices with parents before children.

    ModelError where a node has two parents or is its own ancestor, or a transform is wrong or overflows.
    """
    entries = document.entries("nodes")
    for entry in entries:
        document.budget.charge(2048, entry)
    children = [
        tuple(value.index(len(entries), "node") for value in entry.elements(MAX_ITEMS, "children"))
        for entry in entries
    ]
    parents = _parents(entries, children)
    order = _order(entries, children, parents)
    local = [_transform(entry) for entry in entries]
    world: dict[int, Float64] = {}
    for number in order:
        parent = parents[number]
        own = local[number][3]
        with np.errstate(all="ignore"):
            world[number] = own if parent is None else world[parent] @ own
        if not (np.abs(world[number]) < MAX_NUMBER).all():
            raise entries[number].error("the transform to the scene overflows")
        own.flags.writeable = world[number].flags.writeable = False
    highest = [_highest_joint(mesh) for mesh in meshes]
    nodes = []
    for number, entry in enumerate(entries):
        name, mesh, skin = entry.get("name"), entry.get("mesh"), entry.get("skin")
        translation, rotation, scale, matrix = local[number]
        node = Node(
            name=f"node {number}" if name is None else name.text(),
            parent=parents[number],
            children=children[number],
            translation=translation,
            rotation=rotation,
            scale=scale,
            local=matrix,
            world=world[number],
            mesh=None if mesh is None else mesh.index(len(meshes), "mesh"),
            skin=None if skin is None else skin.index(len(skins), "skin"),
        )
        if node.mesh is not None and node.skin is not None:
            count = len(skins[node.skin].joints)
            if highest[node.mesh] >= count:
                raise entry.error(
                    f"mesh {node.mesh} names joint {highest[node.mesh]}, but skin {node.skin} has {count}"
                )
        nodes.append(node)
    return tuple(nodes), tuple(order)


def read_roots(document: Document, nodes: tuple[Node, ...]) -> tuple[int, ...]:
    """Return the nodes at the top of the default scene, or of the file where it has no scenes."""
    scenes = document.entries("scenes")
    if not scenes:
        return tuple(number for number, node in enumerate(nodes) if node.parent is None)
    default = document.root.get("scene")
    scene = scenes[0 if default is None else default.index(len(scenes), "scene")]
    roots: dict[int, None] = {}
    for value in scene.elements(MAX_ITEMS, "nodes"):
        root = value.index(len(nodes), "node")
        if nodes[root].parent is not None:
            raise value.error(
                f"names node {root}, which is not a root: it is a child of node {nodes[root].parent}"
            )
        roots[root] = None
    return tuple(roots)


def _parents(entries: list[Value], children: list[tuple[int, ...]]) -> list[int | None]:
    parents: list[int | None] = [None] * len(entries)
    for number, below in enumerate(children):
        for child in below:
            if parents[child] is not None:
                raise entries[number].error(
                    f"names node {child} as a child, which is already a child of node {parents[child]}"
                )
            parents[child] = number
    return parents


def _order(entries: list[Value], children: list[tuple[int, ...]], parents: list[int | None]) -> list[int]:
    order = [number for number, parent in enumerate(parents) if parent is None]
    for number in order:  # grows during the loop
        order.extend(children[number])
    if len(order) < len(entries):
        reached = set(order)
        circular = next(number for number in range(len(entries)) if number not in reached)
        raise entries[circular].error("is its own ancestor: the tree of nodes has a cycle")
    return order


def _transform(entry: Value) -> tuple[Float64 | None, Float64 | None, Float64 | None, Float64]:
    """Return translation, rotation and scale of a node, None where it has a matrix, and its matrix."""
    matrix = entry.get("matrix")
    if matrix is not None:
        numbers = np.array(matrix.numbers(16)).reshape(4, 4).T.copy()  # column by column in the file
        if not np.allclose(numbers[3], (0, 0, 0, 1), rtol=0, atol=MAX_ROUNDING):
            raise matrix.error(f"its last row is {numbers[3].tolist()}, but must be 0 0 0 1")
        numbers[3] = (0, 0, 0, 1)
        return None, None, None, numbers
    given = {key: entry.get(key) for key in ("translation", "rotation", "scale")}
    translation = np.array(
        (0.0, 0.0, 0.0) if given["translation"] is None else given["translation"].numbers(3)
    )
    scale = np.array((1.0, 1.0, 1.0) if given["scale"] is None else given["scale"].numbers(3))
    rotation = np.array((0.0, 0.0, 0.0, 1.0))
    if given["rotation"] is not None:
        rotation = np.array(given["rotation"].numbers(4, -1e9, 1e9))
        length = float(np.linalg.norm(rotation))
        if length < 1e-6:
            raise given["rotation"].error("is not a rotation: the quaternion has length 0")
        rotation /= length
    matrix_out = np.eye(4)
    with np.errstate(all="ignore"):  # overflow is detected where the matrices are multiplied
        matrix_out[:3, :3] = rotations.matrices(rotation[[3, 0, 1, 2]]) * scale
    matrix_out[:3, 3] = translation
    for array in (translation, rotation, scale):
        array.flags.writeable = False
    return translation, rotation, scale, matrix_out


def _highest_joint(mesh: GltfMesh) -> int:
    """Return the highest number of a joint that a mesh names, -1 where it names none."""
    return max((int(p.joints.max()) for p in mesh.primitives if p.joints is not None), default=-1)


def read_skins(document: Document, accessors: Accessors, nodes: int) -> tuple[Skin, ...]:
    """Return all skins, in order; nodes: how many there are."""
    return tuple(
        _skin(document, accessors, entry, n, nodes) for n, entry in enumerate(document.entries("skins"))
    )


def _skin(document: Document, accessors: Accessors, entry: Value, number: int, nodes: int) -> Skin:
    name = entry.get("name")
    listed = entry.member("joints")
    entries = listed.elements(MAX_ITEMS)
    document.budget.charge(len(entries) * 1024, entry)
    joints = tuple(value.index(nodes, "node") for value in entries)
    if not joints:
        raise listed.error("a skin needs at least one joint")
    if len(set(joints)) < len(joints):
        raise listed.error("a node is listed twice")
    return Skin(
        name=f"skin {number}" if name is None else name.text(),
        joints=joints,
        inverse_bind=_inverse_bind(accessors, entry, len(joints)),
    )


def _inverse_bind(accessors: Accessors, entry: Value, count: int) -> Float64:
    reference = entry.get("inverseBindMatrices")
    if reference is None:
        matrices = np.broadcast_to(np.eye(4), (count, 4, 4))
    else:
        flat = accessors.floats(reference, "MAT4")
        if len(flat) < count:
            raise reference.error(f"{len(flat)} matrices for {count} joints")
        # column by column in the file
        matrices = flat[:count].astype(np.float64).reshape(count, 4, 4).transpose(0, 2, 1).copy()
    matrices.flags.writeable = False
    return matrices

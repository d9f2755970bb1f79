"""glTF 2.0 files read into plain arrays: `read_gltf`.

It reads triangles with morph targets and skins, the tree of nodes, metallic-roughness materials with PNG or
JPEG textures, and animations. Everything is checked before it is used or allocated.
"""

from __future__ import annotations

import numpy as np

from fba.errors import warn
from fba.gltf._accessors import Accessors
from fba.gltf._document import MAX_ITEMS, Document, open_document
from fba.gltf._materials import read_materials
from fba.gltf._meshes import read_meshes
from fba.gltf._nodes import read_nodes, read_roots, read_skins
from fba.gltf._scene import Channel, Clip, Gltf, GltfMesh, Node
from fba.gltf._values import Value
from fba.limits import DEFAULT_LIMITS, Limits
from fba.source import Path

PACKED = {"KHR_meshopt_compression": "meshopt-compressed buffers"}
"""Extensions by which the geometry itself is compressed."""
KNOWN = {
    "KHR_draco_mesh_compression", "EXT_meshopt_compression", "EXT_texture_webp", "KHR_mesh_quantization",
    "KHR_texture_transform", "KHR_lights_punctual", "FBA_face",
}  # fmt: skip
"""Extensions that a file may require: they are read, or do not change shapes."""
CHANNEL_TYPES = {"translation": "VEC3", "rotation": "VEC4", "scale": "VEC3", "weights": "SCALAR"}
"""Type of the elements of an animated property."""


def read_gltf(path: Path, *, limits: Limits = DEFAULT_LIMITS) -> Gltf:
    """Return the content of a .glb or .gltf file.

    Buffers and pictures may be in the file, in data URIs, or in files in the same folder or below it. Points,
    lines, and pictures that are neither PNG, JPEG nor WebP are left out with an FbaWarning. FormatError where
    the file cannot be opened; ModelError, which names the place in the document, where it is damaged, too
    large, or requires an unknown extension; LimitError where it takes more memory than the limits allow.
    """
    return read_document(open_document(path, limits))


def read_document(document: Document) -> Gltf:
    """Return the content of an opened document; errors and warnings as `read_gltf`."""
    _check_extensions(document)
    accessors = Accessors(document)
    materials = read_materials(document)
    meshes = read_meshes(document, accessors, len(materials))
    skins = read_skins(document, accessors, len(document.entries("nodes")))
    nodes, order = read_nodes(document, meshes, skins)
    return Gltf(
        file=document.root.file,
        meshes=meshes,
        nodes=nodes,
        skins=skins,
        materials=materials,
        animations=_read_animations(document, accessors, nodes, meshes),
        roots=read_roots(document, nodes),
        order=order,
        document=document.root,
        accessors=accessors,
        budget=document.budget,
    )


def _check_extensions(document: Document) -> None:
    for entry in document.root.elements(1000, "extensionsRequired"):
        name = entry.text(200)
        if name in PACKED:
            raise entry.error(
                f"{name}: {PACKED[name]} are not read; convert the file without compression: "
                "npx @gltf-transform/cli copy in.glb out.glb"
            )
        if name not in KNOWN and not name.startswith("KHR_materials_"):
            if "texture" in name:  # another kind of picture: shapes can be read without it
                warn(f"{entry.file}: {name} cannot be read; left out", stacklevel=3)
                continue
            raise entry.error(f"the file needs the extension {name}, which fba does not support")


def _read_animations(
    document: Document, accessors: Accessors, nodes: tuple[Node, ...], meshes: tuple[GltfMesh, ...]
) -> tuple[Clip, ...]:
    """Return all animations, in order, without channels that have no node or belong to extensions."""
    animations = []
    for number, entry in enumerate(document.entries("animations")):
        document.budget.charge(1024, entry)
        name = entry.get("name")
        samplers = entry.member("samplers").elements(MAX_ITEMS)
        channels = []
        for each in entry.member("channels").elements(MAX_ITEMS):
            document.budget.charge(512, each)
            target = each.member("target")
            path = target.member("path").text(100)
            node = target.get("node")
            sampler = samplers[each.member("sampler").index(len(samplers), "sampler")]
            if node is not None and path in CHANNEL_TYPES:
                where = node.index(len(nodes), "node")
                width = _width(target, path, nodes[where], meshes)
                channel = _channel(accessors, sampler, where, path, width)
                # charged for every channel that shares the keys, so that millions of channels are refused
                document.budget.charge(channel.times.nbytes + channel.values.nbytes, each)
                channels.append(channel)
        animations.append(Clip(f"animation {number}" if name is None else name.text(), tuple(channels)))
    return tuple(animations)


def _width(target: Value, path: str, node: Node, meshes: tuple[GltfMesh, ...]) -> int:
    """Return how many numbers a key has; for weights, one for each morph target of the node's mesh."""
    if path != "weights":
        return 4 if path == "rotation" else 3
    count = 0 if node.mesh is None else len(meshes[node.mesh].morph_names)
    if not count:
        raise target.error("animates the weights of a node whose mesh has no morph targets")
    return count


def _channel(accessors: Accessors, sampler: Value, node: int, path: str, width: int) -> Channel:
    given = sampler.get("interpolation")
    interpolation = "LINEAR" if given is None else given.choice("LINEAR", "STEP", "CUBICSPLINE")
    times = accessors.floats(sampler.member("input"), "SCALAR")[:, 0]
    if (np.diff(times) <= 0).any() or times[0] < 0:
        raise sampler.member("input").error("the times of the keys must increase, from 0 or later")
    cubic = 3 if interpolation == "CUBICSPLINE" else 1
    per_key = width if path == "weights" else 1
    values = accessors.floats(
        sampler.member("output"), CHANNEL_TYPES[path], count=len(times) * cubic * per_key
    )
    shape = (len(times), 3, width) if cubic == 3 else (len(times), width)
    return Channel(node, path, interpolation, times, values.reshape(shape))

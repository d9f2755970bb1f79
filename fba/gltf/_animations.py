"""Animations of a glTF file."""

from __future__ import annotations

import numpy as np

from fba.gltf._accessors import Accessors
from fba.gltf._document import MAX_ITEMS, Document
from fba.gltf._scene import Channel, Clip, GltfMesh, Node
from fba.gltf._values import Value

TYPES = {"translation": "VEC3", "rotation": "VEC4", "scale": "VEC3", "weights": "SCALAR"}


def read_animations(
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
            if node is not None and path in TYPES:
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
    values = accessors.floats(sampler.member("output"), TYPES[path], count=len(times) * cubic * per_key)
    shape = (len(times), 3, width) if cubic == 3 else (len(times), width)
    return Channel(node, path, interpolation, times, values.reshape(shape))

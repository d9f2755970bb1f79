"""Write a head that captured markers move as an animated glTF file (.glb)."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from fba.arrays import Float64
from fba.capture.virtual_markers import MarkerPerformance
from fba.errors import FormatError
from fba.formats.gltf._joints import adopt, move, start_clip
from fba.formats.gltf._writer import MOST_FRAMES
from fba.gltf import Builder, PartWriter
from fba.source import Path

STEP = 0.01
"""Metres that a morph target moves the centre of its virtual marker."""
AXES = "xyz"


def write_moved_head(path: Path, performance: MarkerPerformance, name: str = "") -> None:
    """Write a head that captured markers move.

    Each virtual marker has three morph targets, named after it and an axis, that move the vertices in its
    reach by 10 mm at weight 1; their displacements add up exactly. The node "head" moves as the head does.
    Keys are at the capture's own times, from its first frame. name: of the animation.

    Raises FormatError for no frame, or more than 100,000; ModelError where glTF cannot hold the head.
    """
    if not 1 <= len(performance) <= MOST_FRAMES:
        raise FormatError(
            f"{len(performance)} frames; 1 to {MOST_FRAMES} can be written as glTF; cut the capture into "
            "pieces",
            path=path,
        )
    builder = Builder()
    clip = start_clip(builder, performance.times - performance.times[0], path)
    metres = performance.head.metres
    node = builder.add("nodes", {"name": "head"})
    move(builder, clip, node, performance.rotation, performance.shift * metres)
    materials = PartWriter(builder)
    for number, part in enumerate(performance.head.parts):
        if not len(part.triangles):
            continue
        rest = performance.rest[performance.head.rows[number]]
        shape = replace(part, vertices=(rest * metres).astype(np.float32))
        primitive = materials.primitive(shape)
        mesh: dict[str, Any] = {"name": part.name, "primitives": [primitive]}
        child = builder.add("nodes", {"name": part.name})
        weights = _add_targets(builder, performance, number, primitive, mesh)
        builder.root["nodes"][child]["mesh"] = builder.add("meshes", mesh)
        adopt(builder, node, child)
        if weights is not None:
            clip.animate(child, "weights", weights)
        for eye in performance.eyes:
            if eye.part == number:
                centre = eye.centre * metres
                move(builder, clip, child, performance.looks, centre - performance.looks @ centre)
    builder.root["scene"] = 0
    builder.add("scenes", {"nodes": [node]})
    if clip.channels:
        clip.add_to_file(name or "markers")
    builder.save(path)


def _add_targets(
    builder: Builder,
    performance: MarkerPerformance,
    number: int,
    primitive: dict[str, Any],
    mesh: dict[str, Any],
) -> Float64 | None:
    """Add the morph targets that move a part to its mesh; return the weights (T, K), or None."""
    head = performance.head
    shares = performance.weights.shares[head.rows[number]].tocsc()
    targets, names, weights = [], [], []
    for marker, marker_name in enumerate(performance.names):
        reach = slice(shares.indptr[marker], shares.indptr[marker + 1])
        rows, values = shares.indices[reach], shares.data[reach]
        if not values.any():
            continue
        for axis in range(3):
            moves = performance.moves[:, marker, axis]
            if not moves.any():
                continue
            shifts = np.zeros((len(head.rows[number]), 3), dtype=np.float32)
            shifts[rows, axis] = STEP * values
            targets.append({"POSITION": builder.displacements(shifts)})
            names.append(f"{marker_name} {AXES[axis]}")
            weights.append(moves * (head.metres / STEP))
    if not targets:
        return None
    primitive["targets"] = targets
    stacked = np.stack(weights, axis=1)
    mesh["weights"] = stacked[0].tolist()
    mesh["extras"] = {"targetNames": names}
    return stacked

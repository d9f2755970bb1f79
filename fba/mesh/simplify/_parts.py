"""Parts of models on their way through a simplification: where they end, and what they carry along."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from fba.arrays import Float32, Float64
from fba.mesh import Meshes
from fba.mesh.simplify._memoryless import Level


def part_looks(model: Meshes[Any]) -> Float64:
    """Return (V, 7): number of the part, texture coordinates, colours; differences between them are seams."""
    looks = np.zeros((len(model.vertices), 7))
    for number, part in enumerate(model.parts):
        rows = slice(model.starts[part.name], model.starts[part.name] + len(part.vertices))
        looks[rows, 0] = number
        if part.texcoords is not None:
            looks[rows, 1:3] = part.texcoords
        if part.colours is not None:
            looks[rows, 3:] = part.colours
    return looks


def part_starts(model: Meshes[Any], level: Level) -> list[int]:
    """Return the first vertex of each part on a level that `part_looks` divides, and the number of all."""
    counts = [len(part.vertices) for part in model.parts]
    owner = np.repeat(np.arange(len(counts)), counts)[level.rows[:, 0]]
    return [int(start) for start in np.searchsorted(owner, np.arange(len(counts) + 1))]


def carry_parts(model: Meshes[Any], level: Level) -> Iterator[tuple[Any, slice, dict[str, Any]]]:
    """Yield each part, its vertices on a level, and its arrays there: places, triangles and looks."""
    starts = part_starts(model, level)
    for part, begin, end in zip(model.parts, starts[:-1], starts[1:], strict=True):
        sources, weights = level.rows[begin:end] - model.starts[part.name], level.weights[begin:end]
        own = (level.triangles[:, 0] >= begin) & (level.triangles[:, 0] < end)
        arrays: dict[str, Any] = {
            "vertices": level.positions[begin:end].astype(np.float32),
            "triangles": level.triangles[own] - np.int32(begin),
        }
        for name in ("normals", "texcoords", "colours"):
            values: Float32 | None = getattr(part, name)
            if values is not None:
                arrays[name] = np.einsum("nk,nkd->nd", weights, values[sources]).astype(np.float32)
        yield part, slice(begin, end), arrays

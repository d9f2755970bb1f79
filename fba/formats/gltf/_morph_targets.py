"""Make morph targets that follow the piecewise linear motion of FAPs within the values of an animation."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from fba.arrays import Float32, Float64
from fba.face import Deformer, FaceDefTables, FaceModel
from fba.face.gltf.morphs import morph_values
from fba.parameters import FAP_COUNT, faps

TOLERANCE = 1e-4
"""Largest distance, in metres, of a vertex from its exact path, for a face of natural size."""
NATURAL_HEIGHT = 0.25
"""Height, in metres, of a face of natural size with its hair."""


@dataclass(frozen=True, eq=False)
class Targets:
    """The morph targets of one FAP.

    names: K, of the targets. shifts: float32 (K, V, 3), displacements of the whole face at weight 1, in the
    model's unit. weights: float32 (T, K). values: K values of the FAP at weight 1; the FAP is the sum of
    weights times these values.
    """

    fap: int
    names: tuple[str, ...]
    shifts: Float32
    weights: Float32
    values: tuple[float, ...]


def make_targets(model: FaceModel, shown: Float32) -> Iterator[Targets]:
    """Yield the targets of each FAP that moves vertices in an animation.

    shown: float32 (T, 68), FAPs as `resolve` returns them. A FAP that moves vertices along straight lines has
    one target, at its reference value. Other FAPs have a target at each value where a path bends by more than
    `TOLERANCE`; between two values both targets have weights, so that their sum follows the path. Transforms
    (of eyes and head) are left out.
    """
    tables = tuple(FaceDefTables(table.fap, table.meshes) for table in model.tables if table.meshes)
    if not tables:
        return
    deformer = Deformer(replace(model, tables=tables))
    rest = deformer.local(np.zeros(FAP_COUNT))
    height = float(np.ptp(model.vertices[:, 1])) if len(model.vertices) else 0.0
    tolerance = TOLERANCE * height / NATURAL_HEIGHT
    for table in tables:
        values = shown[:, table.fap - 1].astype(np.float64)
        if values.any():
            targets = _make_targets(deformer, rest, table, values, tolerance)
            if targets is not None:
                yield targets


def _make_targets(
    deformer: Deformer, rest: Float32, table: FaceDefTables, values: Float64, tolerance: float
) -> Targets | None:
    """Return the targets of one FAP with values (T,), or None if it moves nothing."""
    low, high = min(0.0, float(values.min())), max(0.0, float(values.max()))
    borders = {float(b) for mesh in table.meshes for b in mesh.borders if low < b < high}
    stops = np.array(sorted({low, 0.0, high} | borders))
    faces = np.zeros((len(stops), FAP_COUNT))
    faces[:, table.fap - 1] = stops
    shifts = deformer.local(faces) - rest
    if not shifts.any():
        return None
    used = _find_bends(stops, shifts, tolerance)
    name = faps()[table.fap - 1].name
    reference = float(morph_values()[table.fap])
    ends = [row for row in used if stops[row] != 0]
    largest = max(ends, key=lambda row: abs(stops[row]))
    straight = shifts[largest] * np.float32(1 / stops[largest])
    if all(np.abs(shifts[row] - straight * np.float32(stops[row])).max() <= tolerance for row in ends):
        weights = (values / reference).astype(np.float32)[:, None]
        return Targets(table.fap, (name,), (straight * np.float32(reference))[None], weights, (reference,))
    hats = np.stack([np.interp(values, stops[used], np.eye(len(used))[used.index(row)]) for row in ends], 1)
    names = tuple(f"{name} {stops[row]:.10g}" for row in ends)
    values_at = tuple(float(stops[row]) for row in ends)
    return Targets(table.fap, names, shifts[ends], hats.astype(np.float32), values_at)


def _find_bends(stops: Float64, shifts: Float32, tolerance: float) -> list[int]:
    """Return the rows of stops whose connecting lines come close to all other rows.

    stops: (S,), values of the FAP. shifts: (S, V, 3). The first row, the last row and that of 0 are included.
    """
    used = sorted({0, int(np.flatnonzero(stops == 0)[0]), len(stops) - 1})
    while True:
        worst, worst_row = tolerance, -1
        for a, b in pairwise(used):
            for row in range(a + 1, b):
                share = np.float32((stops[row] - stops[a]) / (stops[b] - stops[a]))
                line = shifts[a] + share * (shifts[b] - shifts[a])
                distance = float(np.sqrt(((shifts[row] - line) ** 2).sum(axis=1).max()))
                if distance > worst:
                    worst, worst_row = distance, row
        if worst_row < 0:
            return used
        used = sorted([*used, worst_row])

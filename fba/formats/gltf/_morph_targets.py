"""Morph targets that follow the piecewise linear paths of FAPs over the values that an animation shows."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from fba.arrays import Float32, Float64
from fba.face.deform.deformer import Deformer
from fba.face.gltf.morphs import morph_values
from fba.face.model import FaceModel
from fba.face.tables import FaceDefTables
from fba.parameters import FAP_COUNT, faps

TOLERANCE = 1e-4
"""Metres by which a target may miss a vertex's path between two of its values, for a face of natural size."""
NATURAL = 0.25
"""Metres: height of such a face with its hair."""


@dataclass(frozen=True, eq=False)
class Targets:
    """What one FAP does. names: one a target. shifts: float32 (K, V, 3), displacements of the whole face at
    weight 1, in the model's unit. weights: float32 (T, K). values: the FAP is the sum of weights times these.
    """

    fap: int
    names: tuple[str, ...]
    shifts: Float32
    weights: Float32
    values: tuple[float, ...]


def targets(model: FaceModel, shown: Float32) -> Iterator[Targets]:
    """The targets of all FAPs that move vertices in an animation. shown: float32 (T, 68), as `resolve` gives.

    A FAP whose path is straight has one target, that of its reference value; another has one at each value
    where its path bends by more than `TOLERANCE`, and between two of them both have a share, so that the
    weights times the targets follow the path. What transforms do (eyes, the head's turn) is not in it.
    """
    bare = tuple(FaceDefTables(table.fap, table.meshes) for table in model.tables if table.meshes)
    if not bare:
        return
    move = Deformer(replace(model, tables=bare))
    rest = move.local(np.zeros(FAP_COUNT))
    tall = float(np.ptp(model.vertices[:, 1])) if len(model.vertices) else 0.0
    tolerance = TOLERANCE * tall / NATURAL
    for table in bare:
        values = shown[:, table.fap - 1].astype(np.float64)
        if values.any():
            found = _targets(move, rest, table, values, tolerance)
            if found is not None:
                yield found


def _targets(
    move: Deformer, rest: Float32, table: FaceDefTables, values: Float64, tolerance: float
) -> Targets | None:
    low, high = min(0.0, float(values.min())), max(0.0, float(values.max()))
    borders = {float(b) for mesh in table.meshes for b in mesh.borders if low < b < high}
    places = np.array(sorted({low, 0.0, high} | borders))
    faces = np.zeros((len(places), FAP_COUNT))
    faces[:, table.fap - 1] = places
    shifts = move.local(faces) - rest
    if not shifts.any():
        return None
    kept = _bends(places, shifts, tolerance)
    name = faps()[table.fap - 1].name
    reference = float(morph_values()[table.fap])
    ends = [row for row in kept if places[row] != 0]
    largest = max(ends, key=lambda row: abs(places[row]))
    straight = shifts[largest] * np.float32(1 / places[largest])
    if all(np.abs(shifts[row] - straight * np.float32(places[row])).max() <= tolerance for row in ends):
        weights = (values / reference).astype(np.float32)[:, None]
        return Targets(table.fap, (name,), (straight * np.float32(reference))[None], weights, (reference,))
    hats = np.stack([np.interp(values, places[kept], np.eye(len(kept))[kept.index(row)]) for row in ends], 1)
    names = tuple(f"{name} {places[row]:.10g}" for row in ends)
    values_at = tuple(float(places[row]) for row in ends)
    return Targets(table.fap, names, shifts[ends], hats.astype(np.float32), values_at)


def _bends(places: Float64, shifts: Float32, tolerance: float) -> list[int]:
    """Rows between which straight lines are close to all others; the first, the last and 0 are among them."""
    kept = sorted({0, int(np.flatnonzero(places == 0)[0]), len(places) - 1})
    while True:
        worst, at = tolerance, -1
        for a, b in pairwise(kept):
            for row in range(a + 1, b):
                share = np.float32((places[row] - places[a]) / (places[b] - places[a]))
                line = shifts[a] + share * (shifts[b] - shifts[a])
                off = float(np.sqrt(((shifts[row] - line) ** 2).sum(axis=1).max()))
                if off > worst:
                    worst, at = off, row
        if at < 0:
            return kept
        kept = sorted([*kept, at])

"""Displacements of one FAP, in metres at chosen values, and their conversion to FaceDefTables."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from fba.arrays import Float64, Intp
from fba.face._tables import FaceDefMesh, FaceDefTables, FaceDefTransform
from fba.face.authoring.surface.surface import Surface, positions_in
from fba.parameters import faps

UNMOVED_DISTANCE = 2e-6
"""Vertices that move by at most this (m) are left out of the tables."""


@dataclass(frozen=True, eq=False)
class Motion:
    """Displacements of vertices at several values of a FAP.

    values: (K,) rising FAP values, one of them 0. vertices: (N,). shifts: (K, N, 3), metres from the
    neutral face at each value, all zero where the value is 0.
    """

    values: Float64
    vertices: Intp
    shifts: Float64

    def shifts_at(self, value: float) -> Float64:
        """Return (N, 3) shifts at a value, metres; constant beyond the outermost values."""
        x = float(np.clip(value, self.values[0], self.values[-1]))
        k = int(np.clip(np.searchsorted(self.values, x) - 1, 0, len(self.values) - 2))
        share = (x - self.values[k]) / (self.values[k + 1] - self.values[k])
        result: Float64 = self.shifts[k] * (1 - share) + self.shifts[k + 1] * share
        return result


def fap_limits(fap: int) -> tuple[float, float]:
    """Return the smallest and largest value that a stream can carry with the finest quantiser step."""
    entry = faps()[fap - 1]
    assert entry.i_limits is not None
    low, high = entry.i_limits
    return float(low * entry.step), float(high * entry.step)


def split_by_part(surface: Surface, motion: Motion) -> dict[str, Motion]:
    """Return a motion of the surface as motions of its parts, by name of the part."""
    row = positions_in(motion.vertices, len(surface))
    result = {}
    for name, number in surface.members.items():
        own = np.flatnonzero(row[number] >= 0)
        if len(own):
            result[name] = Motion(motion.values, own, motion.shifts[:, row[number[own]]])
    return result


def build_tables(
    fap: int, unit: float, motions: Mapping[str, Motion], transforms: Iterable[FaceDefTransform] = ()
) -> FaceDefTables:
    """Return the FaceDefTables of one FAP. unit: metres a step. motions: by name of the part."""
    meshes = [mesh for name, motion in motions.items() if (mesh := _mesh(name, motion, unit)) is not None]
    return FaceDefTables(fap, tuple(meshes), tuple(transforms))


def _mesh(part: str, motion: Motion, unit: float) -> FaceDefMesh | None:
    moving = (
        (np.abs(motion.shifts).max(axis=(0, 2)) > UNMOVED_DISTANCE)
        if len(motion.vertices)
        else np.zeros(0, bool)
    )
    if not moving.any():
        return None
    borders = np.round(motion.values).astype(np.int64)
    slopes = np.diff(motion.shifts[:, moving], axis=0) / np.diff(borders)[:, None, None] / unit
    # constant beyond the outermost values, whatever a stream asks for
    flat = np.zeros((1, *slopes.shape[1:]))
    borders = np.concatenate([[borders[0] - 1], borders, [borders[-1] + 1]])
    slopes = np.concatenate([flat, slopes, flat])
    return FaceDefMesh(
        part,
        borders.astype(np.int32),
        motion.vertices[moving].astype(np.int32),
        slopes.swapaxes(0, 1).astype(np.float32),
    )

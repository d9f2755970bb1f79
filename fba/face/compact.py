"""A smaller file for a face: numbers rounded by less than can be seen."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fba.arrays import Float32
from fba.face.model import FaceModel, Part
from fba.face.tables import FaceDefMesh, FaceDefTables

BITS = 20
"""Displacements keep this many bits below the largest of their FaceDefMesh: one part in a million."""
SHADES = 65535
"""Colours become multiples of 1 / SHADES, which glTF stores in 16 bits."""


def compact(model: FaceModel) -> FaceModel:
    """The face with displacements rounded to 2**-20 of the largest and colours to multiples of 1/65535.

    A vertex then ends less than a millionth of the way beside where it was; files get a tenth smaller or
    more. Saving never does this by itself. Vertices that a FAP moves by less than the rounding stay in
    its tables.
    """
    return replace(
        model,
        parts=tuple(_part(part) for part in model.parts),
        tables=tuple(
            FaceDefTables(table.fap, tuple(_mesh(mesh) for mesh in table.meshes), table.transforms)
            for table in model.tables
        ),
    )


def _part(part: Part) -> Part:
    if part.colours is None:
        return part
    top = np.float32(SHADES)
    return replace(part, colours=np.rint(np.clip(part.colours, 0, 1) * top) / top)


def _mesh(mesh: FaceDefMesh) -> FaceDefMesh:
    largest = float(np.abs(mesh.displacements).max(initial=0.0))
    if not largest:
        return mesh
    step = 2.0 ** (np.ceil(np.log2(largest)) - BITS)
    rounded: Float32 = (np.rint(mesh.displacements.astype(np.float64) / step) * step).astype(np.float32)
    return replace(mesh, displacements=rounded)

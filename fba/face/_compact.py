"""Rounds the numbers of a face by less than is visible, for smaller files."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fba.arrays import Float32
from fba.face._tables import FaceDefMesh, FaceDefTables
from fba.face.model import FaceModel, Part

BITS = 20
"""Displacements are rounded to multiples of 2**-BITS of the largest of their FaceDefMesh."""
SHADES = 65535
"""Colours become multiples of 1 / SHADES, which glTF stores in 16 bits."""


def compact(model: FaceModel) -> FaceModel:
    """Return the face with displacements rounded to 2**-20 of the largest and colours to multiples of
    1/65535.

    The error is less than a millionth of a vertex's motion; files get at least a tenth smaller. `save` does
    not round. Vertices that a FAP moves by less than the rounding stay in its tables.
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
    steps = np.float32(SHADES)
    return replace(part, colours=np.rint(np.clip(part.colours, 0, 1) * steps) / steps)


def _mesh(mesh: FaceDefMesh) -> FaceDefMesh:
    largest = float(np.abs(mesh.displacements).max(initial=0.0))
    if not largest:
        return mesh
    step = 2.0 ** (np.ceil(np.log2(largest)) - BITS)
    rounded: Float32 = (np.rint(mesh.displacements.astype(np.float64) / step) * step).astype(np.float32)
    return replace(mesh, displacements=rounded)

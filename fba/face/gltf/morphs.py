"""Morph targets for any glTF viewer: one per FAP, at a typical value.

`morph_values.csv` lists the value of each FAP at which its target has weight 1, in the FAP's own unit:
lids close, the jaw opens by some 16 mm on an adult, brows rise by some 9 mm, eyes and head turn by 0.3
radians. A morph target moves vertices in straight lines, even where the FAP rotates or bends.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache

import numpy as np

from fba.arrays import Float32
from fba.errors import ModelError
from fba.face.deform._deformer import Deformer
from fba.face.model import FaceModel
from fba.parameters import FAP_COUNT, fap_numbers, faps
from fba.text_files import packaged_rows


@cache
def morph_values() -> dict[int, int]:
    """Return the FAP value at weight 1, by FAP number, 3..68."""
    rows = packaged_rows(__package__, "morph_values.csv")
    return {fap_numbers()[row["fap"]]: int(row["value"]) for row in rows}


def displacements(model: FaceModel) -> Iterator[tuple[int, Float32]]:
    """Yield each table's FAP and its shifts at that value, float32 (V, 3); ModelError if not finite."""
    move = Deformer(model)
    neutral = move(np.zeros(FAP_COUNT))
    for table in model.tables:
        values = np.zeros(FAP_COUNT)
        values[table.fap - 1] = morph_values()[table.fap]
        shift = move(values) - neutral
        if not np.isfinite(shift).all():
            raise ModelError(
                f"{faps()[table.fap - 1].label} moves vertices beyond 32-bit floats at {values.max():g}"
            )
        yield table.fap, shift

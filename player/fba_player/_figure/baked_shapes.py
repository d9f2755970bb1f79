"""What is computed once of a shape, stored for the figures that come with the library.

`baked/KEY.npz` belongs to the face or body with this `shape_key`; `tools/figure/make_baked.py` makes them. Of
other shapes the same is computed on first use.
"""

from __future__ import annotations

from collections.abc import Sequence
from importlib.resources import as_file, files
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from fba.arrays import Array, Float32
from fba.face.model import shape_key

if TYPE_CHECKING:
    from fba.body import BodyPart
    from fba.face import Part

FOLDER = files(__package__) / "baked"
KEY_LENGTH = 16
STEPS = 127
"""Steps from 0 to the largest number of a column as it is stored."""


def file_name(parts: Sequence[Part] | Sequence[BodyPart]) -> str:
    """Return the name of the file of a shape."""
    return f"{shape_key(cast('Sequence[Part]', parts))[:KEY_LENGTH]}.npz"


def load_baked(parts: Sequence[Part] | Sequence[BodyPart]) -> dict[str, Any]:
    """Return the arrays stored for a shape, by name; none for one that does not come with the library."""
    file = FOLDER / file_name(parts)
    if not file.is_file():
        return {}
    with as_file(file) as path, np.load(path) as data:
        return dict(data)


def pack(values: Float32) -> dict[str, Array]:
    """Return numbers (V, N) in a byte each, and the size (N,) of each column's step."""
    step = np.abs(values).max(axis=0, initial=1e-9) / STEPS
    return {"values": np.rint(values / step).astype(np.int8), "step": step.astype(np.float32)}


def unpack(values: Array, step: Float32) -> Float32:
    """Return what was packed, float32 (V, N)."""
    return np.asarray(values * step, dtype=np.float32)

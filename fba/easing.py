"""Smoothstep, a curve from 0 to 1 that is level at both ends: for arrays, and for compiled loops."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fba.arrays import Float64
from fba.compiled import inlined


def smoothstep(value: npt.ArrayLike) -> Float64:
    """Return a float64 array of value's shape: 0 up to 0, 1 from 1 on, 3 t^2 - 2 t^3 between."""
    t = np.clip(np.asarray(value, dtype=np.float64), 0.0, 1.0)
    result: Float64 = t * t * (3.0 - 2.0 * t)
    return result


@inlined
def smoothstep_of_one(value: float) -> float:
    """Return `smoothstep` of a single number, for compiled loops."""
    t = min(max(value, 0.0), 1.0)
    return t * t * (3.0 - 2.0 * t)

"""Angles wrapped into the range that a stream can carry, without changing the pose."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fba.arrays import Float64, Int32, Int64
from fba.parameters import baps

HALF_TURN = 314159
"""pi in 1e-5 rad."""


def wrapped(values: npt.ArrayLike, limit: int = HALF_TURN) -> Int32:
    """int32 (T, 296): the same poses with every angle within +-pi, kept continuous where possible.

    A column of angles that leaves +-limit (1e-5 rad) is first moved as a whole by full turns; only if
    that does not bring it within, single values are moved, which makes jumps of a full turn. Other
    columns stay as they are. A full turn is rounded to 628319 units, so a pose changes by less than
    1e-5 rad. limit must be at least pi. ValueError for other shapes.
    """
    array = np.asarray(values)
    columns = [b.number - 1 for b in baps() if b.unit == "1e-5 rad"]
    if array.ndim != 2 or array.shape[1] <= max(columns):
        raise ValueError(f"wrapped: needs BAPs of shape (T, 296), not {array.shape}")
    if limit < HALF_TURN:
        raise ValueError(f"wrapped: limit must be at least {HALF_TURN} (half a turn), not {limit}")
    result = array.astype(np.int32)
    for column in columns:
        angles = array[:, column].astype(np.int64)
        low, high = int(angles.min(initial=0)), int(angles.max(initial=0))
        if -limit <= low and high <= limit:
            continue
        low, high = int(angles.min()), int(angles.max())
        angles = angles - _full_turns((low + high) / 2)
        if int(np.abs(angles).max()) > limit:
            angles = angles - _full_turns(angles.astype(np.float64))
        result[:, column] = angles
    return result


def _full_turns(angle: float | Float64) -> Int64:
    """Whole turns in an angle, in 1e-5 rad."""
    full = 2e5 * np.pi
    turns: Int64 = np.rint(np.rint(np.asarray(angle) / full) * full).astype(np.int64)
    return turns

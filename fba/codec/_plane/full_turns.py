"""Full turns of angles: planes can carry some angles only after a full turn, which does not change the pose.

An angle that continues from pi to -pi changes by a full turn, more than a P plane carries; an angle beyond pi
is more than an I plane carries. The joints and the root of a body have the same pose after a full turn.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from fba.arrays import Bool, Int32, Int64
from fba.codec._plane import slots
from fba.parameters import FULL_TURN, bap_angles

_INT32_MAX = 2**31 - 1


@cache
def angle_slots() -> Bool:
    """Return bool (SLOTS,): True for slots that turn a joint or the root of the body."""
    result = np.zeros(slots.SLOTS, dtype=np.bool_)
    result[slots.BAPS] = bap_angles()
    result.flags.writeable = False
    return result


def follow(column: Int32, last: int) -> bool:
    """Unwrap angles (T,) in place, from the angle `last` on; return whether that changed the first of them.

    An angle that would not fit 32 bits stays as it is.
    """
    angles = column.astype(np.int64)
    changes = np.diff(angles, prepend=last)
    turns = np.cumsum(-np.rint(changes / FULL_TURN)).astype(np.int64)
    turned = angles + turns * FULL_TURN
    column[:] = np.where(np.abs(turned) <= _INT32_MAX, turned, angles)
    return bool(column[0] != angles[0])


def nearest_turn(row: Int32, last: Int64) -> Int32:
    """Return a row (columns,) with angles moved by full turns as near as possible to `last` (slots,)."""
    angles = np.flatnonzero(angle_slots()[: len(row)])
    result = row.astype(np.int64)
    turns = np.rint((result[angles] - last[angles]) / FULL_TURN).astype(np.int64)
    result[angles] -= turns * FULL_TURN
    return np.where(np.abs(result) <= _INT32_MAX, result, row).astype(np.int32)


def within_half_turn(row: Int32, misfits: Bool) -> Int32:
    """Return a row (columns,) with the angles among misfits, bool (columns,), moved within +-pi."""
    angles = misfits & angle_slots()[: len(row)]
    if not angles.any():
        return row
    result = row.astype(np.int64)
    result[angles] -= np.rint(result[angles] / FULL_TURN).astype(np.int64) * FULL_TURN
    return result.astype(np.int32)

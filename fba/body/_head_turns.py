"""Whether a head keeps looking where it looked while the body turns under it: `head_turns_too_far`.

People hold their heads still in the world: while the pelvis turns by a few degrees, spine and neck turn back
by about as much. Of 80 captures by some 25 makers, 20 have a pelvis that turns by 2 to 45 degrees against the
head; in 18 of them the head turns back 0.8 to 1.7 times as far, in two 2.4 times.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from fba.arrays import Int64
from fba.body.solve._pose_loops import UNIT
from fba.parameters import bap_numbers, baps

MIN_TURN = np.radians(2.0)
"""Radians that a body must turn at least."""
MAX_TURN = np.radians(45.0)
"""Radians that a body may turn at most."""
OPPOSED = -0.6
"""Correlation of body and head up to which the head turns against the body."""
TURNED_AWAY = -1.8
"""Turn of the head, relative to the body's, below which it looks away from what it looked at."""
KEPT_AHEAD = -0.4
"""Turn of the head, relative to the body's, above which it follows the body."""


def head_turns_too_far(values: Int64, other: Int64) -> float | None:
    """Return how many times as far as the body a head turns back, if too far; else None.

    values, other: BAPs (T, 296) of the same motion, as two tables read it. None as well where a head does not
    turn back as people's do in `other`.
    """
    now, then = _head_by_body(values), _head_by_body(other)
    if now is None or then is None or not MIN_TURN <= then[0] <= MAX_TURN:
        return None
    return -now[1] if now[1] < TURNED_AWAY <= then[1] <= KEPT_AHEAD else None


def _head_by_body(values: Int64) -> tuple[float, float] | None:
    """Return by how many radians a body turns, and how far its head by radian of that.

    None if the head does not turn against the body.
    """
    root, columns = _columns()
    body = np.unwrap(values[:, root] * UNIT)
    head = values[:, columns].sum(axis=1) * UNIT
    if not body.any() or not head.any() or np.ptp(body) == 0 or np.ptp(head) == 0:
        return None
    if np.corrcoef(body, head)[0, 1] > OPPOSED:
        return None
    return float(np.ptp(body)), float(np.polyfit(body, head, 1)[0])


@cache
def _columns() -> tuple[int, tuple[int, ...]]:
    """Return the column of the body's turn, and those of all joints between the pelvis and the head."""
    spine = tuple(
        bap.number - 1
        for bap in baps()
        if bap.name.endswith("_torsion") and not bap.name.startswith("sacroiliac")
    )
    return bap_numbers()["HumanoidRoot_rt_body_turn"] - 1, spine

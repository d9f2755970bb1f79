"""How far the legs of a result are wrung: turned about their own length more than people turn them.

Directions of bones do not show it: a thigh that is turned round, with a shank that turns back, points
nowhere else, and the skin between is twisted like a cloth.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fba.arrays import Float64
from fba.capture.comparison.figure import SIDES, Figure
from fba.capture.comparison.pose_measures import WORDS, Row

LEGS = (("thigh", "sacroiliac", "{}_hip"), ("shank", "{}_hip", "{}_knee"))
"""Parts, the joint above, and the part's own."""


def wringing(result: Figure) -> Iterator[Row]:
    """Angles in degrees of thighs and shanks about their length, against pelvis and thigh."""
    for side in SIDES:
        for part, above, joint in LEGS:
            upper, lower = (result.frames[name.format(side)] for name in (above, joint))
            yield Row("wrung", f"{WORDS[side]} {part}", _twists(np.swapaxes(upper, -1, -2) @ lower))


def _twists(turns: Float64) -> Float64:
    """Return degrees (T,) of the turn about +y that comes closest to each rotation (T, 3, 3)."""
    sine = turns[:, 0, 2] - turns[:, 2, 0]
    cosine = turns[:, 0, 0] + turns[:, 2, 2]
    result: Float64 = np.abs(np.degrees(np.arctan2(sine, cosine)))
    return result

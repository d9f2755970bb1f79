"""The motion of a parameter that is strong and plausible, to compare parameters of different units."""

from __future__ import annotations

from functools import cache

import numpy as np

from fba.parameters import bap_numbers, baps
from fba.text_files import packaged_rows

TYPICAL_ANGLE = 45.0
"""Degrees of a BAP that count as much as the typical motion of a FAP."""
TYPICAL_SHIFT = 300.0
"""Millimetres of a BAP that count as much."""


@cache
def reach(number: int) -> float:
    """Return the amount of a FAP in the gallery, in its unit: a strong, plausible motion."""
    rows = packaged_rows("fba_player.export", "contact_sheet.csv")
    return next(abs(float(row["value"])) for row in rows if int(row["fap"]) == number)


def bap_reach(number: int) -> float:
    """Return the typical strong motion of a BAP, in its unit."""
    if baps()[number - 1].unit == "mm":
        return TYPICAL_SHIFT
    root = number >= bap_numbers()["HumanoidRoot_tr_vertical"]
    return float(np.radians(TYPICAL_ANGLE * (2 if root else 1)) * 1e5)

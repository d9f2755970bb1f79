"""Unsent FAPs estimated from sent ones: left/right mates, inner and outer lips.

ISO/IEC 14496-2 leaves this to the decoder: if one side of the face is sent, the other copies it, and the
outer contour of the lips copies the inner one and vice versa.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import numpy.typing as npt

from fba.arrays import Bool, Intp
from fba.parameters._tables import faps


@cache
def mate_columns() -> tuple[Intp, ...]:
    """Return columns (68,) that unsent FAPs copy: mate, lip mate, its mate; their own without one."""
    mate = np.array([(f.left_right_mate or f.number) - 1 for f in faps()])
    lip = np.array([(f.lip_mate or f.number) - 1 for f in faps()])
    return (mate, lip, mate[lip])


def fill_from_mates(values: npt.NDArray[np.generic], sent: Bool) -> tuple[npt.NDArray[np.generic], Bool]:
    """Return values (..., 68) with unsent FAPs copied from their mates, and a mask of those now known."""
    filled, known = values.copy(), sent.copy()
    for column in mate_columns():
        copied = ~known & sent[..., column]
        np.copyto(filled, values[..., column], where=copied)
        known |= copied
    return filled, known

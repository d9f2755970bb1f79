"""Estimates unsent FAPs from sent ones: left/right mates, inner and outer lips.

ISO/IEC 14496-2 leaves this to the decoder: if one side of the face is sent, the other copies it, and the
outer contour of the lips copies the inner one and vice versa.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import numpy.typing as npt

from fba.arrays import Bool, Intp
from fba.parameters import faps


@cache
def donors() -> tuple[Intp, ...]:
    """Return the columns (68,) that unsent FAPs copy, best first: mate, lip mate, the lip mate's mate.

    A FAP without such a mate has its own column.
    """
    mate = np.array([(f.left_right_mate or f.number) - 1 for f in faps()])
    lip = np.array([(f.lip_mate or f.number) - 1 for f in faps()])
    return (mate, lip, mate[lip])


def fill(values: npt.NDArray[np.generic], sent: Bool) -> tuple[npt.NDArray[np.generic], Bool]:
    """Return (values with unsent FAPs copied from their mates, mask of the values now known), as new arrays.

    values: (..., 68). sent: bool (..., 68), whether the value was ever sent.
    """
    filled, known = values.copy(), sent.copy()
    for column in donors():
        copied = ~known & sent[..., column]
        np.copyto(filled, values[..., column], where=copied)
        known |= copied
    return filled, known

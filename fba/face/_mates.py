"""FAPs that were never sent, estimated from those that were: left/right mates, inner and outer lips.

ISO/IEC 14496-2 leaves this to the decoder: with one side of the face sent, the other copies it, and
the outer contour of the lips follows the inner one and the other way round.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import numpy.typing as npt

from fba.arrays import Bool, Intp
from fba.parameters import FAP_COUNT, faps


@cache
def donors() -> tuple[Intp, ...]:
    """Columns (68,) from which an unsent FAP is copied, best first: mate, lip mate, the lip mate's mate.

    A FAP without such a relative names itself.
    """
    own = np.arange(FAP_COUNT)
    mate = np.array([(f.left_right_mate or f.number) - 1 for f in faps()])
    lip = np.array([(f.lip_mate or f.number) - 1 for f in faps()])
    return (np.where(mate != own, mate, own), lip, mate[lip])


def fill(values: npt.NDArray[np.generic], sent: Bool) -> tuple[npt.NDArray[np.generic], Bool]:
    """Values in which unsent FAPs are copied from their mates, and a mask of the values now known.

    values: (..., 68). sent: bool (..., 68), True where the value was sent at some time. Returns new
    arrays of the same shapes.
    """
    filled, known = values.copy(), sent.copy()
    for column in donors():
        take = ~known & sent[..., column]
        np.copyto(filled, values[..., column], where=take)
        known |= take
    return filled, known

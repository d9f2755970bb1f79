"""FAPs that an interpolation table (FIT) of the receiver's face gives, so that they need not be sent."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.arrays import Bool, Int32, Int64
from fba.face.interpolation.table import InterpolationTable, sources_of
from fba.face.mates import fill
from fba.face.resolve import fit_values
from fba.parameters import FAP_COUNT
from fba.planning.derived_faps import FitChoice
from fba.planning.segments import Cuts
from fba.tracks import FaceTrack


@dataclass(frozen=True, eq=False)
class FitFaps:
    """What a FIT has to do with the FAPs of a face.

    values: int32 (T, 68), those in force, rounded. known: bool (T, 68), which those are. exact: bool (T, 68),
    those to which the FIT gives the value that is shown. given: bool (T, 68), those to which it gives any.
    unsendable: bool (T, 68), those that cannot be sent in place of others. needed: bool (T, 68), those from
    which it computes others.

    What the FIT computes from is known to it only if it is sent or computed, never from a mate. So the same
    FAPs must be, as without a plan: then every link applies as it did.
    """

    values: Int32
    known: Bool
    exact: Bool
    given: Bool
    unsendable: Bool
    needed: Bool

    def choice(self, cuts: Cuts) -> FitChoice:
        """Return what the FIT gives from one cut to another."""
        return FitChoice(
            gives=~_any(~self.exact, cuts),
            leaves=~_any(self.given | self.needed, cuts),
            unsendable=_any(self.unsendable, cuts),
        )


def find_fit_faps(face: FaceTrack, table: InterpolationTable, step: Int64) -> FitFaps:
    """Return what a FIT has to do with the FAPs of a face. step: int64 (68,), of the quantiser."""
    fit = fit_values(face, table)
    filled, known = fill(fit.values, fit.known)
    values = np.rint(filled).astype(np.int32)
    known[:, :2] = False
    sources = np.zeros(FAP_COUNT, dtype=np.bool_)
    sources[[number - 1 for needed in sources_of(table.links).values() for number in needed]] = True
    exact = fit.gives & (fit.alone.astype(np.float32) == filled.astype(np.float32))
    unsendable = (values != filled) | (values % step != 0) | (sources & ~fit.known)
    return FitFaps(values, known, exact, fit.gives, unsendable, sources & fit.known)


def table_columns(table: InterpolationTable) -> list[int]:
    """Return the columns of all FAPs that a FIT computes, or computes others from."""
    sources = sources_of(table.links)
    numbers = set(sources).union(*sources.values())
    return sorted(number - 1 for number in numbers)


def _any(events: Bool, cuts: Cuts) -> Bool:
    """Return bool (68, C, C): whether something happens from one cut to another. events: bool (T, 68)."""
    before = np.zeros((1, FAP_COUNT), dtype=np.int64)
    counts = np.concatenate([before, np.cumsum(events, axis=0)])[cuts.frames].T
    result: Bool = counts[:, :, None] != counts[:, None, :]
    return result

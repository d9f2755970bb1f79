"""FAPs that a player derives from others, and the FAPs to send so that it derives all values correctly.

ISO/IEC 14496-2 leaves it to the decoder how unsent FAPs are interpolated; these are the rules that the
standard suggests and `fba.face.resolve` follows (see `fba.parameters.fill_from_mates`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from itertools import combinations
from typing import NamedTuple

import numpy as np

from fba.arrays import Bool, Float64, Int32, Int64
from fba.face import InterpolationTable, fit_values
from fba.face.interpolation.table import sources_of
from fba.parameters import FAP_COUNT, fap_groups, fill_from_mates, mate_columns
from fba.planning._segments import Cuts
from fba.tracks import FaceTrack


class Choice(NamedTuple):
    """Which FAPs to send in a segment, for every pair of cuts.

    sent: bool (68, C, C). bits: float64 (C, C), of all of them.
    """

    sent: Bool
    bits: Float64


@dataclass(frozen=True, eq=False)
class FitChoice:
    """What an interpolation table (FIT) makes of each FAP between two cuts, if only that FAP is not sent.

    gives: bool (68, C, C), it gives the shown value at every frame. leaves: bool (68, C, C), it gives nothing
    at any frame, and computes nothing from the FAP, which may copy its mate. unsendable: bool (68, C, C), the
    FAP cannot be sent.
    """

    gives: Bool
    leaves: Bool
    unsendable: Bool


@cache
def related_faps() -> tuple[tuple[int, ...], ...]:
    """Return the columns of low-level FAPs in sets of 1, 2 or 4 that can be derived from one another."""
    sets = {
        frozenset([column, *(int(by[column]) for by in mate_columns())]) for column in range(2, FAP_COUNT)
    }
    return tuple(sorted(tuple(sorted(related)) for related in sets))


def choose_faps(
    values: Int32, known: Bool, bits: Float64, cuts: Cuts, fit: FitChoice | None = None
) -> Choice:
    """Return the FAPs to send between any two cuts that take the fewest bits and give all others.

    values: int32 (T, 68), shown. known: bool (T, 68), FAPs to be shown; they change only at needed cuts, and
    include all FAPs of a related set or none of them. bits: float64 (68, C, C), of each FAP by itself. fit:
    what an interpolation table gives.
    """
    if fit is not None:
        bits = np.where(fit.unsendable, np.inf, bits)
    sent = np.zeros(bits.shape, dtype=np.bool_)
    total = np.zeros(bits.shape[1:])
    starts = cuts.frames[:-1]
    smallest = 1 if fit is None else 0
    for related in related_faps():
        shown = np.append(known[starts, related[0]], False)[:, None]
        if not shown.any():
            continue
        least = np.full(bits.shape[1:], np.inf)
        equal = _equal_pairs(values, related, cuts)
        for few in subsets(related, smallest):
            cost = np.where(derive_others(related, few, equal, fit), bits[list(few)].sum(axis=0), np.inf)
            better = shown & (cost < least)
            least[better] = cost[better]
            for column in related:
                sent[column][better] = column in few
        total += np.where(shown, least, 0.0)
    return Choice(sent, total)


def subsets(related: tuple[int, ...], smallest: int) -> list[tuple[int, ...]]:
    """Return the subsets of at least `smallest` members, the smallest first."""
    return [subset for size in range(smallest, len(related) + 1) for subset in combinations(related, size)]


def interpolated_faps(sent: Bool, known: Bool) -> Bool:
    """Return bool (T, 68): FAPs to ask players to interpolate: all unsent FAPs of groups that need it.

    A group needs it if it has an unsent FAP that is `known`, because its mask type is the same for all its
    unsent FAPs. sent, known: bool (T, 68).
    """
    result = np.zeros_like(sent)
    for group in fap_groups()[1:]:
        columns = np.array(group) - 1
        derives = np.asarray((known[:, columns] & ~sent[:, columns]).any(axis=1))
        result[:, columns] = derives[:, None] & ~sent[:, columns]
    return result


def _equal_pairs(values: Int32, related: tuple[int, ...], cuts: Cuts) -> dict[tuple[int, int], Bool]:
    """Return for each pair of related FAPs whether they are equal between any two cuts: bool (C, C)."""
    result = {}
    for one, other in combinations(related, 2):
        differences = np.append(0, np.cumsum(values[:, one] != values[:, other]))[cuts.frames]
        result[one, other] = result[other, one] = differences[:, None] == differences[None]
    return result


def derive_others(
    related: tuple[int, ...],
    sent: tuple[int, ...],
    equal: Mapping[tuple[int, int], Bool | np.bool_],
    fit: FitChoice | None,
) -> Bool | np.bool_:
    """Return bool (C, C): whether the sent FAPs and a FIT give all related FAPs between any two cuts."""
    result: Bool | np.bool_ = np.True_
    for column in related:
        if column in sent:
            continue
        copied: Bool | np.bool_ = np.False_
        known: Bool | np.bool_ = np.False_  # whether a better donor gives it
        for donor in (int(by[column]) for by in mate_columns()):
            if donor == column:
                continue
            gives = np.bool_(donor in sent) if fit is None or donor in sent else fit.gives[donor]
            copied = copied | (gives & ~known & equal[column, donor])
            known = known | gives
        result = result & (copied if fit is None else fit.gives[column] | (copied & fit.leaves[column]))
    return result


@dataclass(frozen=True, eq=False)
class FitFaps:
    """The FAPs of a face as a FIT computes them, and computes others from them.

    values: int32 (T, 68), FAPs in force, rounded. The others are bool (T, 68): known: FAPs in force. exact:
    the FIT gives the shown value. given: the FIT gives any value. unsendable: the FAP cannot be sent in place
    of others. needed: the FIT computes others from it.

    A FIT computes only from FAPs that are sent or computed, never from copies of mates. So a plan must leave
    these FAPs as they are; then every link applies as without a plan.
    """

    values: Int32
    known: Bool
    exact: Bool
    given: Bool
    unsendable: Bool
    needed: Bool

    def choice(self, cuts: Cuts) -> FitChoice:
        """Return what the FIT gives between any two cuts."""
        return FitChoice(
            gives=~_any(~self.exact, cuts),
            leaves=~_any(self.given | self.needed, cuts),
            unsendable=_any(self.unsendable, cuts),
        )


def find_fit_faps(face: FaceTrack, table: InterpolationTable, step: Int64) -> FitFaps:
    """Return the FAPs of a face as a FIT computes them. step: int64 (68,), of the quantiser."""
    fit = fit_values(face, table)
    filled, known = fill_from_mates(fit.values, fit.known)
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
    """Return bool (68, C, C): whether any event happens between two cuts. events: bool (T, 68)."""
    before = np.zeros((1, FAP_COUNT), dtype=np.int64)
    counts = np.concatenate([before, np.cumsum(events, axis=0)])[cuts.frames].T
    result: Bool = counts[:, :, None] != counts[:, None, :]
    return result

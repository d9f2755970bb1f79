"""The cheapest FAPs that keep a face within a tolerance: path by path, each within what the others leave.

The errors of all FAPs at the rows of an `ErrorBasis` are known at every frame. For each FAP in turn they say
how far it may move either way without any row getting too long; `find_path` takes the cheapest levels
there. A second round gives what the first has left over to those that came early.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.arrays import Bool, Float32, Float64, Int32, Int64
from fba.codec import level_bits
from fba.compiled import compiled
from fba.face.deform.displacements import DisplacementMeter
from fba.parameters import FAP_COUNT, fap_steps
from fba.planning.mesh_error import ErrorBasis
from fba.planning.paths import Bounds, find_path

MARGIN = 0.998
"""Share of the tolerance that the search fills: slopes are not quite what the mesh does."""
SWEEPS = 3
"""Rounds over all FAPs."""
CHECKS = 8
"""Times that less is allowed where the mesh turns out to be beyond the tolerance."""
ROUNDING = 1e-4
"""Share of the tolerance that rounding in 32 bits may take."""
PLANE_BITS, SKIP_BITS = 6, 4
"""Bits of a P plane that no FAP pays for, and more where frames are left out behind it."""
REPAIRS = 3
"""Times that frames left out are taken back where that leaves too little."""


@dataclass(frozen=True)
class Effort:
    """How a search goes about it.

    quant: of FAPs. share: of the tolerance that each FAP may take in the first round. gap_share: of that, what
    leaving frames out may take; 0 leaves none out but those that repeat. most: frames left out in a row.
    """

    quant: int
    share: float
    gap_share: float
    most: int = 4


@dataclass(frozen=True, eq=False)
class Segment:
    """Frames that begin with an I plane, and what is sent of them.

    shown: float64 (T, 68), what the source shows. values: float64 (T, 68), of the FAPs in force, without what
    visemes and expressions add. groups: for each FAP that is sent, the columns that a player shows with its
    values, its own first. gaps: bool (T,), frames that may be left out.
    """

    shown: Float64
    values: Float64
    groups: dict[int, tuple[int, ...]]
    gaps: Bool


@dataclass(frozen=True, eq=False)
class FoundFaps:
    """Result of a search. keys: int64 (K,), frames sent. values: int32 (K, 68), of the FAPs sent.

    bits: what they take, about. within: whether the mesh keeps within the tolerance at every frame.
    """

    keys: Int64
    values: Int32
    bits: float
    within: bool


def search_faps(segment: Segment, basis: ErrorBasis, meter: DisplacementMeter, effort: Effort) -> FoundFaps:
    """Return the cheapest FAPs found for a segment, measured on all vertices."""
    search = _Search(segment, basis, effort)
    search.sweep(first=True)
    search.drop_repeated()
    for _ in range(SWEEPS - 1):
        search.sweep()
    for _ in range(REPAIRS):
        if search.is_within() or not search.add_keys():
            break
        search.sweep()
        search.sweep()
    if not search.is_within():  # the quantiser is too coarse
        return search.result(within=False)
    within = search.measure(meter)
    for _ in range(CHECKS):
        if within:
            break
        search.sweep()
        within = search.measure(meter)
    search.drop_repeated()
    return search.result(within=within)


class _Search:
    """Errors and paths of a search: what `search_faps` goes through."""

    def __init__(self, segment: Segment, basis: ErrorBasis, effort: Effort) -> None:
        self.segment, self.quant, self.tolerance = segment, effort.quant, basis.tolerance
        self.steps = fap_steps() * effort.quant
        slopes = {column: basis.slopes(columns, segment.shown) for column, columns in segment.groups.items()}
        self.slopes = slopes
        # What is coarsest chooses first: later ones have finer levels to fit in.
        self.columns = sorted(slopes, key=lambda one: -slopes[one].largest * self.steps[one])
        self.reach = {one: effort.share / max(slopes[one].largest, 1e-12) for one in self.columns}
        self.wanted = {one: np.ascontiguousarray(segment.values[:, one]) for one in self.columns}
        self.limit = np.full(len(segment.shown), MARGIN)
        self.frames = np.arange(len(segment.shown))
        self.keys = self.frames
        if effort.gap_share > 0 and segment.gaps.any() and self.columns:
            scaled = [self.wanted[one] / (self.reach[one] * effort.gap_share) for one in self.columns]
            self.keys = _choose_keys(np.stack(scaled, axis=1), segment.gaps, effort.most)
        self.paths: dict[int, Int64] = {}
        self.shown: dict[int, Float64] = {}
        self.errors = np.zeros((len(segment.shown), basis.count, 3), dtype=np.float32)
        _add_differences(self.errors, segment, basis)
        for one in self.columns:
            self.shown[one] = np.interp(self.frames, self.keys, self.wanted[one][self.keys])
            _add_error(self.errors, *slopes[one][:3], self.shown[one] - self.wanted[one])

    def sweep(self, *, first: bool = False) -> None:
        """Give each FAP the cheapest path within what the others leave."""
        for column in self.columns:
            own, step, shown = self.slopes[column], int(self.steps[column]), self.shown[column]
            room = _free_room(self.errors, *own[:3], self.limit)
            added = self.segment.shown[:, column] - self.segment.values[:, column]
            lower = np.maximum(shown + room[0], np.minimum(own.lowest - added, shown))
            upper = np.minimum(shown + room[1], np.maximum(own.highest - added, shown))
            if first:
                lower = np.maximum(lower, np.minimum(self.wanted[column] - self.reach[column], shown))
                upper = np.minimum(upper, np.maximum(self.wanted[column] + self.reach[column], shown))
            bounds = Bounds(lower, upper, self.keys, step, self.quant)
            path = find_path(bounds, self.paths.get(column))
            now = np.interp(self.frames, self.keys, path * step)
            _add_error(self.errors, *own[:3], now - shown)
            self.paths[column], self.shown[column] = path, now

    def drop_repeated(self) -> None:
        """Leave out frames that a player shows the same without: those between two that are the same."""
        if not self.columns:
            return
        rows = np.stack([self.paths[one] for one in self.columns], axis=1)
        same = (rows[1:] == rows[:-1]).all(axis=1)
        kept = np.ones(len(self.keys), dtype=np.bool_)
        kept[1:-1] = ~(same[:-1] & same[1:] & self.segment.gaps[self.keys[1:-1]])
        self.keys = self.keys[kept]
        self.paths = {column: path[kept] for column, path in self.paths.items()}

    def add_keys(self) -> bool:
        """Send frames beyond the tolerance, and those beside them; return whether any was left out."""
        beyond = np.flatnonzero(self._longest() > 1)
        near = np.clip(np.concatenate([beyond - 1, beyond, beyond + 1]), 0, len(self.frames) - 1)
        keys = np.union1d(self.keys, near)
        if len(keys) == len(self.keys):
            return False
        self.keys, self.paths = keys, {}
        return True

    def is_within(self) -> bool:
        """Whether all rows keep within the tolerance."""
        return bool((self._longest() <= 1).all())

    def measure(self, meter: DisplacementMeter) -> bool:
        """Whether the mesh keeps within the tolerance; less is allowed from now on in frames where not."""
        new = self.segment.shown.copy()
        for column, columns in self.segment.groups.items():
            for one in columns:
                new[:, one] += self.shown[column] - self.segment.values[:, one]
        longest = meter.measure(self.segment.shown, new).largest / self.tolerance.face
        beyond = longest > 1 - ROUNDING
        self.limit[beyond] *= np.maximum(0.98 / longest[beyond], 0.5)
        return self.is_within() and not beyond.any()

    def result(self, *, within: bool) -> FoundFaps:
        """Return what was found."""
        values = np.zeros((len(self.keys), FAP_COUNT), dtype=np.int32)
        bits = PLANE_BITS * (len(self.keys) - 1.0)
        bits += SKIP_BITS * int((np.diff(self.keys) > 1).sum())
        for column, path in self.paths.items():
            values[:, column] = path * self.steps[column]
            bits += level_bits(path, self.quant)
        return FoundFaps(self.keys, values, bits, within)

    def _longest(self) -> Float64:
        """Return the length of the longest row at each frame: float64 (T,)."""
        squared = np.einsum("trc,trc->tr", self.errors, self.errors)
        longest: Float64 = np.sqrt(squared.max(axis=1, initial=0.0)).astype(np.float64)
        return longest


def _add_differences(errors: Float32, segment: Segment, basis: ErrorBasis) -> None:
    """Add by how much FAPs that are shown alike differ in the source."""
    for column, columns in segment.groups.items():
        for other in columns[1:]:
            difference = segment.values[:, column] - segment.values[:, other]
            if difference.any():
                own = basis.slopes((other,), segment.shown)
                _add_error(errors, *own[:3], difference)


@compiled
def _choose_keys(values: Float64, gaps: Bool, most: int) -> Int64:
    """Return frames between which values (T, F) are straight lines, but for less than 1: int64 (K,).

    gaps: bool (T,), frames that may be left out, at most `most` in a row.
    """
    count = len(values)
    keys = np.zeros(count, dtype=np.int64)
    number, frame = 1, 0
    while frame < count - 1:
        following = frame + 1
        for end in range(min(frame + most + 1, count - 1), frame + 1, -1):
            straight = True
            for between in range(frame + 1, end):
                straight = straight and gaps[between]
                share = (between - frame) / (end - frame)
                for one in range(values.shape[1]):
                    line = values[frame, one] + share * (values[end, one] - values[frame, one])
                    if abs(line - values[between, one]) > 1.0:
                        straight = False
                        break
                if not straight:
                    break
            if straight:
                following = end
                break
        keys[number] = following
        number += 1
        frame = following
    return keys[:number]


@compiled
def _add_error(errors: Float32, rows: Int64, table: Float32, which: Int64, change: Float64) -> None:
    """Add to errors (T, R, 3) what a change (T,) of a FAP moves; rows, table, which: as in `Slopes`."""
    for frame in range(len(change)):
        if change[frame] == 0.0:
            continue
        amount = np.float32(change[frame])
        slopes = table[which[frame]]
        for k in range(len(rows)):
            row = errors[frame, rows[k]]
            row[0] += amount * slopes[k, 0]
            row[1] += amount * slopes[k, 1]
            row[2] += amount * slopes[k, 2]


@compiled
def _free_room(errors: Float32, rows: Int64, table: Float32, which: Int64, limit: Float64) -> Float64:
    """Return how far a FAP may move down and up at each frame: float64 (2, T), the first one 0 or less.

    So far no row of errors (T, R, 3) becomes longer than limit (T,). One that is longer already must become
    nearly as short as this FAP alone can make it.
    """
    room = np.zeros((2, len(which)))
    for frame in range(len(which)):
        low, high = -1e9, 1e9
        allowed = limit[frame] * limit[frame]
        slopes = table[which[frame]]
        for k in range(len(rows)):
            gx, gy, gz = float(slopes[k, 0]), float(slopes[k, 1]), float(slopes[k, 2])
            steepness = gx * gx + gy * gy + gz * gz
            if steepness < 1e-16:
                continue
            row = errors[frame, rows[k]]
            x, y, z = float(row[0]), float(row[1]), float(row[2])
            along = (x * gx + y * gy + z * gz) / steepness
            least = max(x * x + y * y + z * z - along * along * steepness, 0.0)
            half = np.sqrt(max(allowed - least, 0.02 * least) / steepness)
            low, high = max(low, -along - half), min(high, half - along)
        if low > high:
            low, high = 0.0, 0.0
        room[0, frame], room[1, frame] = low, high
    return room

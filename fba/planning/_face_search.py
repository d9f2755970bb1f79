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
from fba.planning._mesh_error import ErrorBasis
from fba.planning._paths import ROUNDS, Bounds, find_path

MARGIN = 0.998
"""Share of the tolerance that the search fills: slopes are not quite what the mesh does."""
JERK = 1.0
"""Share of the tolerance by which a FAP's change from frame to frame may differ from the source's unseen."""
SWEEPS = 3
"""Rounds over all FAPs."""
ROUNDING = 1e-4
"""Share of the tolerance that rounding in 32 bits may take."""
PLANE_BITS, SKIP_BITS = 6, 4
"""Bits of a P plane that no FAP pays for, and more where frames are left out behind it."""
AROUND = 12
"""Frames on either side of one beyond the tolerance in which paths are searched again."""
HOPELESS = 0.2
"""Share of frames beyond the tolerance above which a quantiser is given up."""
REPAIRS = 8
"""Times that paths are searched again around frames beyond the tolerance."""


@dataclass(frozen=True)
class Effort:
    """How a search goes about it.

    quant: of FAPs. share: of the tolerance that each FAP may take at first. gap_share: of that, what leaving
    frames out may take; 0 leaves out only those that repeat. most: frames left out in a row.
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


def search_faps(
    segment: Segment, basis: ErrorBasis, meter: DisplacementMeter, effort: Effort, below: float = np.inf
) -> FoundFaps:
    """Return the cheapest FAPs found for a segment, measured on all vertices.

    below: bits; what takes more is given up.
    """
    search = _Search(segment, basis, effort)
    search.sweep(first=True)
    search.drop_repeated()
    for _ in range(SWEEPS - 1):
        search.sweep()
    beyond = search.find_beyond()
    for attempt in range(REPAIRS):
        if not beyond.any() or beyond.mean() > HOPELESS:
            break
        search.repair(beyond, round_off=attempt >= REPAIRS // 2)
        beyond = search.find_beyond()
    search.drop_repeated()
    if beyond.any() or search.bits() >= below:  # too coarse a quantiser, or no better
        return search.result(within=False)
    beyond = search.measure(meter)
    for attempt in range(REPAIRS):
        if not beyond.any():
            break
        search.repair(beyond, round_off=attempt >= REPAIRS // 2)
        beyond = search.measure(meter)
    search.drop_repeated()
    return search.result(within=not beyond.any())


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
        self.measured, self.longest = segment.shown, np.zeros(len(segment.shown))
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

    def sweep(self, *, first: bool = False, around: Bool | None = None) -> None:
        """Give each FAP the cheapest path within what the others leave.

        first: no FAP may take more than its share. around: bool (T,), paths change near these frames only.
        """
        still = np.zeros(len(self.frames), dtype=np.bool_)
        if around is not None:
            still = ~_widen(around, AROUND)
        for column in self.columns:
            own, step, shown = self.slopes[column], int(self.steps[column]), self.shown[column]
            room = _free_room(self.errors, *own[:3], self.limit)
            added = self.segment.shown[:, column] - self.segment.values[:, column]
            lower = np.maximum(shown + room[0], np.minimum(own.lowest - added, shown))
            upper = np.minimum(shown + room[1], np.maximum(own.highest - added, shown))
            if first:
                lower = np.maximum(lower, np.minimum(self.wanted[column] - self.reach[column], shown))
                upper = np.minimum(upper, np.maximum(self.wanted[column] + self.reach[column], shown))
            lower, upper = np.where(still, shown, lower), np.where(still, shown, upper)
            calm = JERK / max(own.largest, 1e-12)
            bounds = Bounds(lower, upper, self.keys, step, self.quant, self.wanted[column], calm)
            path = find_path(bounds, self.paths.get(column), rounds=ROUNDS if around is None else 1)
            self._show(column, path)

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

    def repair(self, beyond: Bool, *, round_off: bool) -> None:
        """Search paths again around frames beyond the tolerance, bool (T,), after all frames there are sent.

        round_off: begin with the levels nearest to the source there.
        """
        near = _widen(beyond, 1)
        self.keys, before = np.union1d(self.keys, np.flatnonzero(near)), self.keys
        if round_off:
            for column in self.columns:
                step, shown = int(self.steps[column]), self.shown[column]
                levels = np.where(near, np.rint(self.wanted[column] / step), shown / step)[self.keys]
                self._show(column, np.rint(levels).astype(np.int64))
        elif len(self.keys) > len(before):
            self.paths = {}
        for _ in range(2):
            self.sweep(around=beyond)

    def _show(self, column: int, path: Int64) -> None:
        """Take a path for a FAP."""
        now = np.interp(self.frames, self.keys, path * int(self.steps[column]))
        _add_error(self.errors, *self.slopes[column][:3], now - self.shown[column])
        self.paths[column], self.shown[column] = path, now

    def find_beyond(self) -> Bool:
        """Return where a row is beyond the tolerance: bool (T,)."""
        squared = np.einsum("trc,trc->tr", self.errors, self.errors)
        beyond: Bool = squared.max(axis=1, initial=0.0) > 1
        return beyond

    def measure(self, meter: DisplacementMeter) -> Bool:
        """Return where the mesh is beyond the tolerance, bool (T,); less is allowed there from now on."""
        new = self.segment.shown.copy()
        for column, columns in self.segment.groups.items():
            for one in columns:
                new[:, one] += self.shown[column] - self.segment.values[:, one]
        changed = np.flatnonzero((new != self.measured).any(axis=1))
        own = meter.measure(self.segment.shown[changed], new[changed]).largest / self.tolerance.face
        self.longest[changed], self.measured = own, new
        beyond = self.longest > 1 - ROUNDING
        self.limit[beyond] *= np.maximum(0.98 / self.longest[beyond], 0.5)
        return beyond | self.find_beyond()

    def bits(self) -> float:
        """Return the bits of all that is sent, about."""
        planes = PLANE_BITS * (len(self.keys) - 1) + SKIP_BITS * int((np.diff(self.keys) > 1).sum())
        return planes + sum(level_bits(path, self.quant) for path in self.paths.values())

    def result(self, *, within: bool) -> FoundFaps:
        """Return what was found."""
        values = np.zeros((len(self.keys), FAP_COUNT), dtype=np.int32)
        for column, path in self.paths.items():
            values[:, column] = path * self.steps[column]
        return FoundFaps(self.keys, values, self.bits(), within)


def _widen(frames: Bool, by: int) -> Bool:
    """Return bool (T,): the frames and those so near to one of them."""
    ends = np.cumsum(np.concatenate([np.zeros(by + 1), frames, np.zeros(by)]))
    widened: Bool = ends[2 * by + 1 :] > ends[: len(frames)]
    return widened


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

    Bounds: keys increase from 0 to T - 1, so there are no more than T.
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
    """Add to errors (T, R, 3) what a change (T,) of a FAP moves; rows, table, which: as in `Slopes`.

    Bounds: rows are those of errors, and entries of `which` those of the table: `ErrorBasis` makes all of
    them for the frames of one segment.
    """
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
    nearly as short as this FAP alone can make it. Bounds: as in `_add_error`; room is made for len(which).
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

"""The cheapest FAPs that keep a face within a tolerance, measured on the mesh of a head."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.arrays import Bool, Float32, Float64, Int64
from fba.compiled import compiled
from fba.face.deform.displacements import DisplacementMeter
from fba.planning._mesh_error import ErrorBasis
from fba.planning._search import SWEEPS, Effort, Found, PathSearch, Room


@dataclass(frozen=True)
class Tuning:
    """Constants of the search. Shares are of the tolerance."""

    jerk: float = 1.0  # share by which a FAP's change between frames may differ from the source's, unseen
    rounding: float = 1e-4  # share that rounding in 32 bits may take
    repaired_frames: int = 12  # frames on either side of a frame beyond the tolerance that are searched again
    hopeless_share: float = 0.2  # share of frames beyond the tolerance above which a quantiser is given up
    max_repairs: int = 16  # searches around frames beyond the tolerance


TUNING = Tuning()


@dataclass(frozen=True, eq=False)
class Segment:
    """Frames that begin with an I plane, and what is sent of them.

    shown: float64 (T, 68), what the source shows. values: float64 (T, 68), of the FAPs in force, without what
    visemes and expressions add. groups: for each FAP that is sent, its column and after it the others that a
    player shows with its values. gaps: bool (T,), frames that may be left out.
    """

    shown: Float64
    values: Float64
    groups: dict[int, tuple[int, ...]]
    gaps: Bool


def search_faps(
    segment: Segment, basis: ErrorBasis, meter: DisplacementMeter, effort: Effort, below: float
) -> Found:
    """Return the cheapest FAPs that the search comes to for a segment, measured on all vertices.

    below: bits; the search gives up results that do not take fewer.
    """
    rows = _FaceRows(segment, basis, effort)
    search = _FaceSearch(rows, rows.choose_keys(effort), effort)
    for column in rows.columns:
        rows.add(column, search.shown[:, column] - segment.values[:, column])
    search.sweep(first=True)
    search.drop_repeated(segment.gaps)
    for _ in range(SWEEPS - 1):
        search.sweep()
    beyond = rows.find_beyond()
    for attempt in range(TUNING.max_repairs):
        if not beyond.any() or beyond.mean() > TUNING.hopeless_share:
            break
        search.repair(beyond, round_off=attempt >= TUNING.max_repairs // 2)
        beyond = rows.find_beyond()
    search.drop_repeated(segment.gaps)
    if beyond.any() or search.bits() >= below:  # too coarse a quantiser, or no better
        return search.result(np.inf)
    beyond = search.measure(meter)
    for attempt in range(TUNING.max_repairs):
        if not beyond.any():
            break
        search.repair(beyond, round_off=attempt >= TUNING.max_repairs // 2)
        beyond = search.measure(meter)
    search.drop_repeated(segment.gaps)
    return search.result(np.inf if beyond.any() else float(search.longest.max(initial=0.0)))


class _FaceRows:
    """Errors of FAPs at the rows of an `ErrorBasis`: `Rows` of a face."""

    def __init__(self, segment: Segment, basis: ErrorBasis, effort: Effort) -> None:
        self.segment, self.wanted, self.tolerance = segment, segment.values, basis.tolerance
        slopes = {column: basis.slopes(columns, segment.shown) for column, columns in segment.groups.items()}
        self.slopes = slopes
        # FAPs with the coarsest levels choose first: the finer levels of later FAPs can adapt.
        self.columns = sorted(slopes, key=lambda column: -slopes[column].largest * effort.steps[column])
        self.errors = np.zeros((len(segment.shown), basis.count, 3), dtype=np.float32)
        _add_differences(self.errors, segment, basis)

    def choose_keys(self, effort: Effort) -> Int64:
        """Return the frames to send: int64 (K,)."""
        if effort.gap_share <= 0 or not self.segment.gaps.any() or not self.columns:
            return np.arange(len(self.wanted))
        scaled = [
            self.wanted[:, column] / (self._reach(column, effort.share) * effort.gap_share)
            for column in self.columns
        ]
        return _choose_keys(np.stack(scaled, axis=1), self.segment.gaps, effort.most)

    def _reach(self, column: int, share: float) -> float:
        """Return how far a FAP may move within a share of the tolerance."""
        return share / max(self.slopes[column].largest, 1e-12)

    def begin_sweep(self, shown: Float64) -> list[int]:
        """Return the FAPs in the order in which they choose."""
        return self.columns

    def room(self, column: int, shown: Float64, limit: Float64, share: float | None) -> Room:
        """Return where a FAP may be so that no row becomes longer than limit (T,); see `Rows`."""
        slopes = self.slopes[column]
        down, up = _free_room(self.errors, *slopes[:3], limit)
        added = self.segment.shown[:, column] - self.wanted[:, column]
        lower = np.maximum(shown + down, np.minimum(slopes.lowest - added, shown))
        upper = np.minimum(shown + up, np.maximum(slopes.highest - added, shown))
        if share is not None:
            wanted, reach = self.wanted[:, column], self._reach(column, share)
            lower = np.maximum(lower, np.minimum(wanted - reach, shown))
            upper = np.minimum(upper, np.maximum(wanted + reach, shown))
        return Room(lower, upper, self._reach(column, TUNING.jerk))

    def add(self, column: int, change: Float64) -> None:
        """Add to the errors what a change (T,) of a FAP moves."""
        _add_error(self.errors, *self.slopes[column][:3], change)

    def find_beyond(self) -> Bool:
        """Return where a row is beyond the tolerance: bool (T,)."""
        squared = np.einsum("trc,trc->tr", self.errors, self.errors)
        beyond: Bool = squared.max(axis=1, initial=0.0) > 1
        return beyond


class _FaceSearch(PathSearch):
    """Paths of FAPs. longest: float64 (T,), the largest measured error, in shares of the tolerance."""

    def __init__(self, rows: _FaceRows, keys: Int64, effort: Effort) -> None:
        super().__init__(rows, keys, effort)
        self.face = rows
        self.measured, self.longest = rows.segment.shown, np.zeros(len(rows.wanted))

    def repair(self, beyond: Bool, *, round_off: bool) -> None:
        """Send all frames around those beyond the tolerance, bool (T,), and search their paths again.

        round_off: begin with the levels nearest to the source there.
        """
        near = _widen(beyond, 1)
        self.keys, before = np.union1d(self.keys, np.flatnonzero(near)), self.keys
        if round_off:
            for column in self.face.columns:
                step = int(self.effort.steps[column])
                wanted, shown = self.rows.wanted[:, column] / step, self.shown[:, column] / step
                levels = np.where(near, np.rint(wanted), shown)[self.keys]
                self.take(column, np.rint(levels).astype(np.int64))
        elif len(self.keys) > len(before):
            self.paths = {}
        for _ in range(2):
            self.sweep(around=_widen(beyond, TUNING.repaired_frames))

    def measure(self, meter: DisplacementMeter) -> Bool:
        """Return where the mesh is beyond the tolerance, bool (T,), and lower the limits there."""
        segment = self.face.segment
        new = segment.shown.copy()
        for column, columns in segment.groups.items():
            for follower in columns:
                new[:, follower] += self.shown[:, column] - segment.values[:, follower]
        changed = np.flatnonzero((new != self.measured).any(axis=1))
        moved = meter.measure(segment.shown[changed], new[changed]).largest
        self.longest[changed], self.measured = moved / self.face.tolerance.face, new
        beyond = self.longest > 1 - TUNING.rounding
        self.limit[beyond] *= np.maximum(0.98 / self.longest[beyond], 0.5)
        return beyond | self.face.find_beyond()


def _widen(frames: Bool, by: int) -> Bool:
    """Return bool (T,): these frames, and those up to `by` frames before or after them."""
    ends = np.cumsum(np.concatenate([np.zeros(by + 1), frames, np.zeros(by)]))
    widened: Bool = ends[2 * by + 1 :] > ends[: len(frames)]
    return widened


def _add_differences(errors: Float32, segment: Segment, basis: ErrorBasis) -> None:
    """Add the errors that come from showing FAPs alike which differ in the source."""
    for column, columns in segment.groups.items():
        for other in columns[1:]:
            difference = segment.values[:, column] - segment.values[:, other]
            if difference.any():
                _add_error(errors, *basis.slopes((other,), segment.shown)[:3], difference)


@compiled
def _choose_keys(values: Float64, gaps: Bool, most: int) -> Int64:
    """Return frames between which values (T, F) differ by at most 1 from straight lines: int64 (K,).

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
                for column in range(values.shape[1]):
                    line = values[frame, column] + share * (values[end, column] - values[frame, column])
                    if abs(line - values[between, column]) > 1.0:
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
    """Return how far a FAP may move down and up at each frame: float64 (2, T), the first row 0 or less.

    Within these changes no row of errors (T, R, 3) becomes longer than limit (T,). A row that is longer
    already must become nearly as short as this FAP alone can make it. Bounds: as in `_add_error`; room is
    made for len(which).
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

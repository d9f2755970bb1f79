"""The cheapest BAPs that keep a body within a tolerance: path by path, each within what the others leave.

The errors of all BAPs at the points of `BodyRows` are known at every frame. From the root to fingers and
toes, they say for each BAP how far it may be off without any point getting too far; `find_path` takes
the cheapest levels there. What is off above, a joint below may make up for. Later rounds give what is left
over to those that came early.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fba.arrays import Bool, Float64, Int32, Int64
from fba.body.solve.conventions import NO_BAP
from fba.body.solve.motions import BapMotion, bap_motions
from fba.codec import level_bits
from fba.parameters import BAP_COUNT
from fba.planning._body_rows import BodyRows, BodyTarget, add_error, all_rows, blocks, free_room
from fba.planning._paths import Bounds, find_path

SWEEPS = 3
"""Rounds over all BAPs."""
CHECKS = 6
"""Times that less is allowed, or frames left out are taken back, where a body is too far off."""
HOPELESS = 1.6
"""Shares of the tolerance beyond which the quantiser is too coarse: less would not help."""
PLANE_BITS, SKIP_BITS = 6, 4
"""Bits of a P plane that no BAP pays for, and more where frames are left out behind it."""


@dataclass(frozen=True)
class BodyEffort:
    """How a search goes about it.

    steps: int64 (296,), of the quantiser. scale: table steps in each. share: of the tolerance that each BAP
    may take in the first round. gap_share: of the tolerance, what may be taken up before, by frames that are
    left out; 0 leaves none out. margin: share of the tolerance that the search fills; where no BAP alone can
    bring a frame back, less leaves room. most: frames left out in a row.
    """

    steps: Int64
    scale: int
    share: float = 0.7
    gap_share: float = 0.7
    margin: float = 0.99
    most: int = 16


@dataclass(frozen=True, eq=False)
class FoundBaps:
    """Result of a search. keys: int64 (K,), frames sent. values: int32 (K, 296).

    bits: what they take, about. longest: the largest error at any frame, in shares of the tolerance.
    """

    keys: Int64
    values: Int32
    bits: float
    longest: float


def search_baps(target: BodyTarget, base: Float64, gaps: Bool, effort: BodyEffort) -> FoundBaps:
    """Return the cheapest BAPs found.

    base: float64 (T, 296), BAPs to start from, within the tolerance. gaps: bool (T,), frames that may be left
    out.
    """
    keys = choose_keys(target, base, gaps, effort)
    search = _Search(target, base, keys, effort)
    for number in range(SWEEPS):
        search.sweep(first=number == 0)
    best = search.result()
    for _ in range(CHECKS):
        if best.longest <= 1 or best.longest > HOPELESS:
            break
        search.tighten()
        search.sweep()
        found = search.result()
        best = min(best, found, key=lambda one: (max(one.longest, 1.0), one.bits))
    return best


def choose_keys(target: BodyTarget, base: Float64, gaps: Bool, effort: BodyEffort) -> Int64:
    """Return frames, (K,), between which BAPs that are interpolated keep within a share of the tolerance."""
    count = len(base)
    if effort.gap_share <= 0 or not gaps.any():
        return np.arange(count)
    rows = all_rows(target.solver.skeleton)
    allowed = np.maximum(target.longest(base, rows), effort.gap_share)
    keys, frame = [0], 0
    while frame < count - 1:
        following, end = frame + 1, frame + 2
        while end < count and end <= frame + effort.most + 1 and gaps[end - 1]:
            inner = slice(frame + 1, end)
            shares = np.arange(1, end - frame)[:, None] / (end - frame)
            off = target.longest(base[frame] + shares * (base[end] - base[frame]), rows, inner)
            if (off > allowed[inner]).any():
                break
            following, end = end, end + 1
        keys.append(following)
        frame = following
    return np.array(keys, dtype=np.int64)


class _Search:
    """Errors and paths of a search: what `search_baps` goes through."""

    def __init__(self, target: BodyTarget, base: Float64, keys: Int64, effort: BodyEffort) -> None:
        self.target, self.effort, self.keys = target, effort, keys
        self.frames = np.arange(len(base))
        self.limit = np.full(len(base), effort.margin)
        self.wanted = _interpolated(self.frames, keys, base)
        self.shown = self.wanted.copy()
        self.moved = np.asarray(self.wanted.any(axis=0))
        self.paths: dict[int, Int64] = {}
        skeleton, rules = target.solver.skeleton, target.solver.convention
        turned = [
            joint
            for joint, columns in zip(rules.joints, rules.bap, strict=True)
            if joint in skeleton and self.moved[columns[columns != NO_BAP]].any()
        ]
        joints = {0, *(skeleton.number(joint) for joint in turned)}
        self.rows = BodyRows(skeleton, joints)
        self.all_rows = all_rows(skeleton)
        self.weights = target.weights(self.rows)
        self.below = {joint: self.rows.below(skeleton, joint) for joint in joints}
        shape = (len(base), len(self.rows.joints), 3)
        self.points, self.errors = np.zeros(shape, dtype=np.float32), np.zeros(shape, dtype=np.float32)
        self.centres = {joint: np.zeros((len(base), 3), dtype=np.float32) for joint in joints}

    def sweep(self, *, first: bool = False) -> None:
        """Give each BAP the cheapest path within what the others leave."""
        for one in self._place():
            shown, step = self.shown[:, one.column], int(self.effort.steps[one.column])
            below, centre = self.below[one.joint], self.centres[one.joint]
            place = (self.points, self.weights, below, centre, one.axis, one.turns)
            low, high, steepest = free_room(self.errors, *place, self.limit)
            lower, upper = shown + low, shown + high
            if first:
                wanted = self.wanted[:, one.column]
                reach = np.maximum(self.effort.share / np.maximum(steepest, 1e-12), 0.5 * step)
                lower, upper = (
                    np.maximum(lower, np.minimum(wanted - reach, upper)),
                    np.minimum(upper, np.maximum(wanted + reach, lower)),
                )
            bounds = Bounds(lower, upper, self.keys, step, self.effort.scale)
            path = find_path(bounds, self.paths.get(one.column))
            now = np.interp(self.frames, self.keys, path * step)
            add_error(self.errors, *place, now - shown)
            self.paths[one.column] = path
            self.shown[:, one.column] = now

    def _place(self) -> list[BapMotion]:
        """Return what BAPs move in the body's present pose, and take its errors and points as they are."""
        solver = self.target.solver
        parts: list[list[BapMotion]] = []
        for block in blocks(len(self.shown)):
            matrices = solver.pose(self.shown[block])
            points = self.rows.points(matrices)
            apart = points - self.rows.points(solver.pose(self.target.values[block]))
            self.points[block] = points
            self.errors[block] = apart * self.weights[block][..., None]
            for joint, centres in self.centres.items():
                centres[block] = matrices[:, joint, :3, 3]
            parts.append(bap_motions(solver, self.shown[block], matrices, self.moved))
        return [_joined(one) for one in zip(*parts, strict=True)]

    def tighten(self) -> None:
        """Allow less in frames that are too far off, and send frames beside them that were left out."""
        longest = self._longest()
        beyond = longest > 1
        self.limit[beyond] *= np.clip(0.98 / longest[beyond], 0.5, 0.98)
        near = np.flatnonzero(beyond & ~np.isin(self.frames, self.keys))
        if len(near):
            keys = np.union1d(self.keys, near)
            self.paths = {
                column: np.rint(np.interp(keys, self.keys, path)).astype(np.int64)
                for column, path in self.paths.items()
            }
            self.keys = keys

    def result(self) -> FoundBaps:
        """Return what was found."""
        values = np.zeros((len(self.keys), BAP_COUNT), dtype=np.int32)
        bits = PLANE_BITS * (len(self.keys) - 1.0)
        bits += SKIP_BITS * int((np.diff(self.keys) > 1).sum())
        for column, path in self.paths.items():
            values[:, column] = path * self.effort.steps[column]
            bits += level_bits(path, self.effort.scale)
        return FoundBaps(self.keys, values, bits, float(self._longest().max(initial=0.0)))

    def _longest(self) -> Float64:
        """Return the largest error at each frame, as a body shows it, in shares of the tolerance: (T,)."""
        return self.target.longest(self.shown, self.all_rows)


def _interpolated(frames: Int64, keys: Int64, values: Float64) -> Float64:
    """Return values (T, N) at all frames, straight lines between those at keys."""
    if len(keys) == len(frames):
        return values
    result = np.zeros_like(values)
    for column in np.flatnonzero(values.any(axis=0)):
        result[:, column] = np.interp(frames, keys, values[keys, column])
    return result


def _joined(parts: tuple[BapMotion, ...]) -> BapMotion:
    """Return what a BAP moves at all frames, from what it moves in blocks of them."""
    return replace(parts[0], axis=np.concatenate([one.axis for one in parts]))

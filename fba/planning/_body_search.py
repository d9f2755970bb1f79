"""The cheapest BAPs that keep a body within a tolerance, measured at the points of `BodyRows`.

They are chosen from the root to fingers and toes: a joint may compensate for errors of those above it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fba.arrays import Bool, Float64, Int64
from fba.body import BapSolver
from fba.body.solve.conventions import NO_BAP
from fba.body.solve.motions import BapMotion, bap_motions
from fba.planning._body_rows import BodyRows, BodyTarget, MovedPoints, add_error, all_rows, blocks, free_room
from fba.planning._search import SWEEPS, Effort, Found, PathSearch, Room, interpolated

MAX_TIGHTENINGS = 6
"""How often the limits are lowered, and frames sent that were left out, where a body is too far off."""
HOPELESS_ERROR = 1.6
"""Shares of the tolerance above which the quantiser is too coarse: lower limits would not help."""


def search_baps(target: BodyTarget, base: Float64, gaps: Bool, effort: Effort) -> Found:
    """Return the cheapest BAPs that the search comes to.

    base: float64 (T, 296), BAPs to start from, within the tolerance. gaps: bool (T,), frames that may be left
    out. effort: its gap_share includes the share that `base` has taken.
    """
    keys = choose_keys(target, base, gaps, effort)
    rows = _MovingRows(target, interpolated(base, keys), effort)
    search = PathSearch(rows, keys, effort)
    for number in range(SWEEPS):
        search.sweep(first=number == 0)
    longest = rows.longest(search.shown)
    best = search.result(float(longest.max(initial=0.0)))
    for _ in range(MAX_TIGHTENINGS):
        if best.within or best.longest > HOPELESS_ERROR:
            break
        _tighten(search, longest)
        search.sweep()
        longest = rows.longest(search.shown)
        found = search.result(float(longest.max(initial=0.0)))
        best = min(best, found, key=lambda result: (max(result.longest, 1.0), result.bits))
    return best


def _tighten(search: PathSearch, longest: Float64) -> None:
    """Lower the limits of frames that are too far off, and send those of them that were left out.

    longest: float64 (T,), the largest error at each frame, in shares of the tolerance.
    """
    beyond = longest > 1
    search.limit[beyond] *= np.clip(0.98 / longest[beyond], 0.5, 0.98)
    before, search.keys = search.keys, np.union1d(search.keys, np.flatnonzero(beyond))
    if len(search.keys) > len(before):
        for column, path in search.paths.items():
            search.paths[column] = np.rint(np.interp(search.keys, before, path)).astype(np.int64)


def turning_joints(solver: BapSolver, moved: Bool) -> list[str]:
    """Return the joints of the skeleton that have BAPs which move, bool (296,)."""
    rules = solver.convention
    return [
        joint
        for joint, columns in zip(rules.joints, rules.bap, strict=True)
        if joint in solver.skeleton and moved[columns[columns != NO_BAP]].any()
    ]


def choose_keys(target: BodyTarget, base: Float64, gaps: Bool, effort: Effort) -> Int64:
    """Return frames (K,) between which interpolated BAPs stay within a share of the tolerance."""
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


class _MovingRows:
    """Errors of BAPs at the points of the joints that move: `Rows` of a body."""

    def __init__(self, target: BodyTarget, wanted: Float64, effort: Effort) -> None:
        self.target, self.wanted, self.steps = target, wanted, effort.steps
        self.moved = np.asarray(wanted.any(axis=0))
        self.motions: dict[int, BapMotion] = {}
        skeleton = target.solver.skeleton
        joints = {0, *(skeleton.number(joint) for joint in turning_joints(target.solver, self.moved))}
        self.points_of = BodyRows(skeleton, joints)
        self.all_rows = all_rows(skeleton)
        self.weights = target.weights(self.points_of)
        self.below = {joint: self.points_of.below(skeleton, joint) for joint in joints}
        shape = (len(wanted), len(self.points_of.joints), 3)
        self.points, self.errors = np.zeros(shape, dtype=np.float32), np.zeros(shape, dtype=np.float32)
        self.centres = {joint: np.zeros((len(wanted), 3), dtype=np.float32) for joint in joints}

    def begin_sweep(self, shown: Float64) -> list[int]:
        """Measure the body's present pose; return the BAPs from the root outwards."""
        solver = self.target.solver
        parts: list[list[BapMotion]] = []
        for block in blocks(len(shown)):
            matrices = solver.pose(shown[block])
            points = self.points_of.points(matrices)
            apart = points - self.points_of.points(solver.pose(self.target.values[block]))
            self.points[block] = points
            self.errors[block] = apart * self.weights[block][..., None]
            for joint, centres in self.centres.items():
                centres[block] = matrices[:, joint, :3, 3]
            parts.append(bap_motions(solver, shown[block], matrices, self.moved))
        self.motions = {}
        for pieces in zip(*parts, strict=True):
            axis = np.concatenate([piece.axis for piece in pieces])
            self.motions[pieces[0].column] = replace(pieces[0], axis=axis)
        return list(self.motions)

    def room(self, column: int, shown: Float64, limit: Float64, share: float | None) -> Room:
        """Return where a BAP may be so that no error becomes longer than limit (T,); see `Rows`."""
        low, high, steepest = free_room(self.errors, self._moved_points(column), limit)
        lower, upper = shown + low, shown + high
        if share is not None:
            wanted = self.wanted[:, column]
            reach = np.maximum(share / np.maximum(steepest, 1e-12), 0.5 * int(self.steps[column]))
            lower, upper = (
                np.maximum(lower, np.minimum(wanted - reach, upper)),
                np.minimum(upper, np.maximum(wanted + reach, lower)),
            )
        return Room(lower, upper)

    def add(self, column: int, change: Float64) -> None:
        """Add to the errors what a change (T,) of a BAP moves."""
        add_error(self.errors, self._moved_points(column), change)

    def _moved_points(self, column: int) -> MovedPoints:
        """Return the points that a BAP moves."""
        motion = self.motions[column]
        below, centre = self.below[motion.joint], self.centres[motion.joint]
        return MovedPoints(self.points, self.weights, below, centre, motion.axis, motion.turns)

    def longest(self, shown: Float64) -> Float64:
        """Return the largest error at each frame, as a body shows it, in shares of the tolerance: (T,)."""
        return self.target.longest(shown, self.all_rows)

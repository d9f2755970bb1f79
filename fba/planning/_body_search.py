"""The cheapest BAPs that keep a body within a tolerance, measured at the points of `BodyRows`.

They choose from the root to fingers and toes: what is off above, a joint below may make up for.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fba.arrays import Bool, Float64, Int64
from fba.body.solve.conventions import NO_BAP
from fba.body.solve.motions import BapMotion, bap_motions
from fba.planning._body_rows import BodyRows, BodyTarget, MovedPoints, add_error, all_rows, blocks, free_room
from fba.planning._search import SWEEPS, Effort, Found, PathSearch, Room, interpolated

CHECKS = 6
"""Times that less is allowed, or frames left out are taken back, where a body is too far off."""
HOPELESS = 1.6
"""Shares of the tolerance beyond which the quantiser is too coarse: less would not help."""


def search_baps(target: BodyTarget, base: Float64, gaps: Bool, effort: Effort) -> Found:
    """Return the cheapest BAPs found.

    base: float64 (T, 296), BAPs to start from, within the tolerance. gaps: bool (T,), frames that may be left
    out. effort: its gap_share counts what `base` has taken up.
    """
    keys = choose_keys(target, base, gaps, effort)
    rows = _MovingRows(target, interpolated(base, keys), effort)
    search = PathSearch(rows, keys, effort)
    for number in range(SWEEPS):
        search.sweep(first=number == 0)
    longest = rows.longest(search.shown)
    best = search.result(float(longest.max(initial=0.0)))
    for _ in range(CHECKS):
        if best.within or best.longest > HOPELESS:
            break
        _tighten(search, longest)
        search.sweep()
        longest = rows.longest(search.shown)
        found = search.result(float(longest.max(initial=0.0)))
        best = min(best, found, key=lambda one: (max(one.longest, 1.0), one.bits))
    return best


def _tighten(search: PathSearch, longest: Float64) -> None:
    """Allow less in frames that are too far off, and send frames beside them that were left out.

    longest: float64 (T,), the largest error at each frame, in shares of the tolerance.
    """
    beyond = longest > 1
    search.limit[beyond] *= np.clip(0.98 / longest[beyond], 0.5, 0.98)
    before, search.keys = search.keys, np.union1d(search.keys, np.flatnonzero(beyond))
    if len(search.keys) > len(before):
        for column, path in search.paths.items():
            search.paths[column] = np.rint(np.interp(search.keys, before, path)).astype(np.int64)


def choose_keys(target: BodyTarget, base: Float64, gaps: Bool, effort: Effort) -> Int64:
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


class _MovingRows:
    """Errors of BAPs at the points of the joints that move: `Rows` of a body."""

    def __init__(self, target: BodyTarget, wanted: Float64, effort: Effort) -> None:
        self.target, self.wanted, self.steps = target, wanted, effort.steps
        self.moved = np.asarray(wanted.any(axis=0))
        self.motions: dict[int, BapMotion] = {}
        skeleton, rules = target.solver.skeleton, target.solver.convention
        turned = [
            joint
            for joint, columns in zip(rules.joints, rules.bap, strict=True)
            if joint in skeleton and self.moved[columns[columns != NO_BAP]].any()
        ]
        joints = {0, *(skeleton.number(joint) for joint in turned)}
        self.points_of = BodyRows(skeleton, joints)
        self.all_rows = all_rows(skeleton)
        self.weights = target.weights(self.points_of)
        self.below = {joint: self.points_of.below(skeleton, joint) for joint in joints}
        shape = (len(wanted), len(self.points_of.joints), 3)
        self.points, self.errors = np.zeros(shape, dtype=np.float32), np.zeros(shape, dtype=np.float32)
        self.centres = {joint: np.zeros((len(wanted), 3), dtype=np.float32) for joint in joints}

    def begin_sweep(self, shown: Float64) -> list[int]:
        """Take points, errors and axes of the body's present pose; return its BAPs from the root outwards."""
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
        self.motions = {one[0].column: _joined(one) for one in zip(*parts, strict=True)}
        return list(self.motions)

    def room(self, column: int, shown: Float64, limit: Float64, share: float | None) -> Room:
        """Return where a BAP may be so that no point gets further off than limit (T,); see `Rows`."""
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
        one = self.motions[column]
        below, centre = self.below[one.joint], self.centres[one.joint]
        return MovedPoints(self.points, self.weights, below, centre, one.axis, one.turns)

    def longest(self, shown: Float64) -> Float64:
        """Return the largest error at each frame, as a body shows it, in shares of the tolerance: (T,)."""
        return self.target.longest(shown, self.all_rows)


def _joined(parts: tuple[BapMotion, ...]) -> BapMotion:
    """Return what a BAP moves at all frames, from what it moves in blocks of them."""
    return replace(parts[0], axis=np.concatenate([one.axis for one in parts]))

"""`hold_still`: levels for a captured body with which parts that rest in the source rest after decoding, too.

With plain rounding, a joint that rests between two levels alternates between them, and a root that sways by
2 mm moves the feet. So a Viterbi search takes the cheapest path of each BAP through its levels, in which each
change has a cost. BAPs of root, pelvis and legs are searched one after the other, those of legs several
times: each makes up for the errors that the others leave at a sole.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fba.animation import Animation
from fba.arrays import Bool, Float64
from fba.body import SIDES, BapSolver, find_stance
from fba.body.footing import foot_frames
from fba.body.solve.motions import BapMotion, bap_motions
from fba.body.stance import heel_and_ball, sole_points
from fba.codec import EncoderOptions, step_scale
from fba.compiled import compiled
from fba.parameters import BAP_COUNT, bap_steps
from fba.planning._body_rows import blocks
from fba.planning._body_tolerance import held_angles
from fba.tracks import BodyTrack, hold

# Weights in the cost of a path, relative to a BAP that is off by a step in a frame, which costs 1.
CHANGE_COST = 1.0
"""Cost of a change of level."""
STANDING_WEIGHT = 5e5
"""Weight of the squared error of a sole that rests, per square metre."""
SWINGING_WEIGHT = 5e4
"""Weight of the squared error of a sole that does not rest, per square metre."""
STIR_WEIGHT = 6e6
"""Weight of the squared change of a resting sole's error from one frame to the next, per square metre."""


@dataclass(frozen=True)
class Tuning:
    """Constants of the search."""

    rest_speed: float = 0.06  # m/s, below which the point of a foot that stands rests
    rest_seconds: float = 0.2  # s, over which that speed is measured
    smoothing: float = 0.25  # s, over which resting soles are averaged: captured roots have whole millimetres
    sweeps: int = 3  # rounds over the BAPs of legs; those of root and pelvis are searched once, before them
    max_root_step: int = (
        10  # mm of the root for which legs can make up; the standard's table has a coarser one
    )


TUNING = Tuning()


def hold_still(animation: Animation, options: EncoderOptions | None = None) -> Animation:
    """Return an animation whose BAPs are multiples of their steps, and rest where the source's rest.

    Each value differs from the source's by less than a step; with rounding, it would be at most half a step.
    But feet that stand stay nearer to the source's, and there are fewer changes to code. This is for motion
    capture; BAPs that an author wrote should be sent as they are.

    options: for the steps; with options.clamp, angles continue past half a turn, as they are coded then.
    Faces, bodies whose BAPs are not quantised (bap_quant 0), and unsent parameters do not change.
    """
    options = options or EncoderOptions()
    body = animation.body
    if body is None or not options.bap_quant or not body.values.any():
        return animation
    steps = (bap_steps(options.bap_steps) * step_scale(options, body=True)).astype(np.float64)
    in_force = hold(body.values, body.mask, np.zeros(BAP_COUNT, dtype=np.int32)).astype(np.float64)
    wanted = held_angles(body) if options.clamp else in_force
    levels = np.zeros_like(wanted)
    for block in blocks(len(animation)):
        start = max(block.start - 1, 0)  # the last frame of the block before stays as it is
        frames = slice(start, block.stop)
        levels[frames] = _Block(wanted[frames], levels[start] if start else None, steps, animation).levels()
    return replace(animation, body=BodyTrack((levels * steps).astype(np.int32), body.mask))


class _Block:
    """A block of frames of a body, and where its soles should be."""

    def __init__(self, wanted: Float64, first: Float64 | None, steps: Float64, animation: Animation) -> None:
        """wanted: (T, 296). first: levels of the first frame (296,), if they are given."""
        self.wanted, self.steps, self.rate = wanted, steps, float(animation.rate)
        self.first = np.full(BAP_COUNT, np.nan) if first is None else first
        self.result = np.zeros_like(wanted)
        self.moved = np.asarray(wanted.any(axis=0))
        self.slopes: dict[int, Float64] = {}
        self.trunk: set[int] = set()  # BAPs with slopes that move both feet
        self.rests, self.errors = _no_soles(len(wanted))

    def levels(self) -> Float64:
        """Return the levels of all BAPs: (T, 296)."""
        solver = BapSolver()
        if (
            self.steps[[column for column in solver.convention.translation if column >= 0]].max()
            <= TUNING.max_root_step
        ):
            self._place_soles(solver)
        rests, errors = _no_soles(len(self.wanted))
        for column in np.flatnonzero(self.moved).tolist():
            if column not in self.slopes:
                self._search(column, errors, errors, rests)
        off = {column: np.zeros(len(self.wanted)) for column in self.slopes}
        for number in range(TUNING.sweeps):
            for column, slopes in self.slopes.items():
                if number and column in self.trunk:
                    continue
                others = self.errors - slopes * off[column][:, None, None]
                self._search(column, others, slopes, self.rests)
                off[column] = self.result[:, column] * self.steps[column] - self.wanted[:, column]
                self.errors = others + slopes * off[column][:, None, None]
        return self.result

    def _search(self, column: int, errors: Float64, slopes: Float64, rests: Bool) -> None:
        step, first = float(self.steps[column]), float(self.first[column])
        wanted = self.wanted[:, column] / step
        self.result[:, column] = _find_path(wanted, first, errors, slopes * step, rests)

    def _place_soles(self, solver: BapSolver) -> None:
        """Find where the soles are, when they rest, and what moves them."""
        skeleton = solver.skeleton
        joints = [skeleton.number(name) for side in SIDES for name in sole_points(skeleton, side) or {}]
        matrices = solver.pose(self.wanted)
        ends = [heel_and_ball(skeleton, foot_frames(skeleton, matrices, side), side) for side in SIDES]
        soles = np.stack([end for foot in ends for end in foot or ()], axis=1)
        stands = np.repeat(find_stance(skeleton, matrices, self.rate).T, 2, axis=1)
        self.rests = stands & _find_rest(soles, self.rate)
        self.errors = soles - _smoothed(soles, self.rests, round(TUNING.smoothing * self.rate / 2))
        for motion in bap_motions(solver, self.wanted, matrices, self.moved):
            moves = np.isin(joints, skeleton.descendants(motion.joint)) | (not motion.turns)
            if moves.any():
                slopes = _slopes(motion, soles - matrices[:, None, motion.joint, :3, 3])
                self.slopes[motion.column] = slopes * moves[:, None]
            if moves.all():
                self.trunk.add(motion.column)


def _no_soles(count: int) -> tuple[Bool, Float64]:
    """Return empty rests (T, 0) and errors (T, 0, 3), for `count` frames."""
    return np.zeros((count, 0), dtype=np.bool_), np.zeros((count, 0, 3))


def _slopes(motion: BapMotion, arms: Float64) -> Float64:
    """Return how a BAP moves points, in metres for an increase by 1: (T, P, 3).

    arms: (T, P, 3), the points from its joint.
    """
    axis = motion.axis.astype(np.float64)[:, None]
    return np.cross(axis, arms) if motion.turns else np.broadcast_to(axis, arms.shape)


def _find_rest(points: Float64, rate: float) -> Bool:
    """Return bool (T, P): when points (T, P, 3) are slow from before a frame to after it."""
    half = max(round(TUNING.rest_seconds * rate / 2), 1)
    around = np.pad(points, ((half, half), (0, 0), (0, 0)), mode="edge")
    distances = np.linalg.norm(around[2 * half :] - around[: -2 * half], axis=2)
    rests: Bool = distances * rate < TUNING.rest_speed * 2 * half
    return rests


def _smoothed(points: Float64, rests: Bool, half: int) -> Float64:
    """Return points (T, P, 3), averaged over up to `half` frames on both sides while they rest."""
    result = points.copy()
    for point in range(points.shape[1]):
        sums = np.concatenate([np.zeros((1, 3)), np.cumsum(points[:, point], axis=0)])
        borders = np.flatnonzero(np.diff(rests[:, point], prepend=False, append=False))
        for start, stop in borders.reshape(-1, 2).tolist():
            frames = np.arange(start, stop)
            reach = np.minimum(np.minimum(frames - start, stop - 1 - frames), half)
            result[start:stop, point] = (sums[frames + reach + 1] - sums[frames - reach]) / (2 * reach + 1)[
                :, None
            ]
    return result


@compiled
def _find_path(wanted: Float64, first: float, errors: Float64, slopes: Float64, rests: Bool) -> Float64:
    """Return the cheapest levels of a BAP, float64 (T,): at each frame, one of the two nearest.

    wanted: (T,), in steps. first: the first level; NaN if it is free. errors: (T, P, 3), metres by which the
    other BAPs leave points off; slopes: (T, P, 3), metres for a step of this BAP. rests: bool (T, P).
    """
    count, points = errors.shape[0], errors.shape[1]
    if len(wanted) != count or slopes.shape != errors.shape or errors.shape[2] != 3:
        raise IndexError("wanted levels, errors and slopes must have the same frames and points")
    if rests.shape[0] != count or rests.shape[1] != points:
        raise IndexError("rests must have the frames and points of errors")
    costs = np.zeros((count, 2))
    came_from = np.zeros((count, 2), np.int64)
    for frame in range(count):
        for choice in range(2):
            level = np.trunc(wanted[frame]) + choice * np.sign(wanted[frame])
            off = level - wanted[frame]
            if abs(off) >= 1.0 or (frame == 0 and not np.isnan(first) and level != first):
                costs[frame, choice] = np.inf
                continue
            cost = off * off
            for point in range(points):
                weight = STANDING_WEIGHT if rests[frame, point] else SWINGING_WEIGHT
                for axis in range(3):
                    error = errors[frame, point, axis] + slopes[frame, point, axis] * off
                    cost += weight * error * error
            least = 0.0 if frame == 0 else np.inf
            for previous in range(2 if frame > 0 else 0):
                path_cost = costs[frame - 1, previous]
                before = np.trunc(wanted[frame - 1]) + previous * np.sign(wanted[frame - 1])
                if path_cost == np.inf:
                    continue
                if before != level:
                    path_cost += CHANGE_COST
                for point in range(points):
                    if rests[frame, point] and rests[frame - 1, point]:
                        for axis in range(3):
                            moved = errors[frame, point, axis] + slopes[frame, point, axis] * off
                            moved -= errors[frame - 1, point, axis]
                            moved -= slopes[frame - 1, point, axis] * (before - wanted[frame - 1])
                            path_cost += STIR_WEIGHT * moved * moved
                if path_cost < least:
                    least = path_cost
                    came_from[frame, choice] = previous
            costs[frame, choice] = cost + least
    levels = np.zeros(count)
    choice = 0 if costs[count - 1, 0] <= costs[count - 1, 1] else 1
    for frame in range(count - 1, -1, -1):
        levels[frame] = np.trunc(wanted[frame]) + choice * np.sign(wanted[frame])
        choice = int(came_from[frame, choice])
    return levels

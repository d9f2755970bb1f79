"""`hold_still`: the levels of a captured body with which what rests in the source rests after decoding, too.

Rounded by itself, a joint that rests between two levels goes to and fro between them, and a root that sways
by 2 mm takes the feet along. So the path of each BAP through its levels is searched (Viterbi), where a
change costs something. Those of root, pelvis and legs are searched one after the other, those of legs a few
times over: what one leaves at a sole, the next ones make up for.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fba.animation import Animation
from fba.arrays import Bool, Float64
from fba.body import SIDES, BapSolver
from fba.body.footing import foot_frames
from fba.body.solve.motions import BapMotion, bap_motions
from fba.body.stance import find_stance, heel_and_ball, sole_points
from fba.codec import EncoderOptions, step_scale
from fba.compiled import compiled
from fba.parameters import BAP_COUNT, bap_steps
from fba.planning._body_rows import blocks
from fba.planning._body_tolerance import held_angles
from fba.tracks import BodyTrack, hold

CHANGE = 1.0
"""What a change of level costs: as much as a BAP that is off by a step in one frame."""
STANDING_WEIGHT = 5e5
"""Weight of the square of a resting sole's error, per square metre; that of a BAP counts 1 per
square step."""
SWINGING_WEIGHT = 5e4
"""The same for soles that do not rest."""
STIR_WEIGHT = 6e6
"""Weight of the squared change of a resting sole's error from one frame to the next, per square metre."""
REST_SPEED = 0.06
"""Speed, in metres per second, below which the point of a foot that stands rests."""
REST_SECONDS = 0.2
"""Seconds over which that speed is measured."""
SMOOTHED = 0.25
"""Seconds over which the place of a sole that rests is averaged: captured roots come in whole millimetres."""
SWEEPS = 3
"""Rounds over the BAPs of legs; those of root and pelvis are searched once, before them."""
COARSE = 10
"""Millimetres in a step of the root for which legs cannot make up: with the standard's table."""


def hold_still(animation: Animation, options: EncoderOptions | None = None) -> Animation:
    """Return an animation whose BAPs are multiples of their steps, and rest where the source's rest.

    Each differs from the source's by less than a step, where rounding differs by at most half a step. Feet
    that stand stay nearer to the source's than with rounding, and there are fewer changes to code. For
    motion capture: BAPs that are given as such should be sent as they are.

    options: with the steps; with options.clamp, angles go on past half a turn, as they are coded then.
    Nothing changes in a face, in a body whose BAPs are sent unquantised (bap_quant 0), and in what is not
    sent.
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
    """Some frames of a body, and where its soles are to be."""

    def __init__(self, wanted: Float64, first: Float64 | None, steps: Float64, animation: Animation) -> None:
        """wanted: (T, 296). first: levels of the first frame (296,), if they are given."""
        self.wanted, self.steps, self.rate = wanted, steps, float(animation.rate)
        self.first = np.full(BAP_COUNT, np.nan) if first is None else first
        self.result = np.zeros_like(wanted)
        self.moved = np.asarray(wanted.any(axis=0))
        self.slopes: dict[int, Float64] = {}
        self.trunk: set[int] = set()  # of them, those that move both feet, and what is above
        self.rests, self.errors = _no_soles(len(wanted))

    def levels(self) -> Float64:
        """Return the levels of all BAPs: (T, 296)."""
        solver = BapSolver()
        if self.steps[[column for column in solver.convention.translation if column >= 0]].max() <= COARSE:
            self._place_soles(solver)
        rests, errors = _no_soles(len(self.wanted))
        for column in np.flatnonzero(self.moved).tolist():
            if column not in self.slopes:
                self._search(column, errors, errors, rests)
        off = {column: np.zeros(len(self.wanted)) for column in self.slopes}
        for number in range(SWEEPS):
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
        self.errors = soles - _smoothed(soles, self.rests, round(SMOOTHED * self.rate / 2))
        for motion in bap_motions(solver, self.wanted, matrices, self.moved):
            moves = np.isin(joints, skeleton.descendants(motion.joint)) | (not motion.turns)
            if moves.any():
                slopes = _slopes(motion, soles - matrices[:, None, motion.joint, :3, 3])
                self.slopes[motion.column] = slopes * moves[:, None]
            if moves.all():
                self.trunk.add(motion.column)


def _no_soles(count: int) -> tuple[Bool, Float64]:
    """Return rests (T, 0) and errors (T, 0, 3) of no points, for `count` frames."""
    return np.zeros((count, 0), dtype=np.bool_), np.zeros((count, 0, 3))


def _slopes(motion: BapMotion, arms: Float64) -> Float64:
    """Return where a BAP moves points, in metres for an increase by 1: (T, P, 3).

    arms: (T, P, 3), the points from its joint.
    """
    axis = motion.axis.astype(np.float64)[:, None]
    return np.cross(axis, arms) if motion.turns else np.broadcast_to(axis, arms.shape)


def _find_rest(points: Float64, rate: float) -> Bool:
    """Return bool (T, P): when points (T, P, 3) go slowly, from before a frame to after it."""
    half = max(round(REST_SECONDS * rate / 2), 1)
    around = np.pad(points, ((half, half), (0, 0), (0, 0)), mode="edge")
    ways = np.linalg.norm(around[2 * half :] - around[: -2 * half], axis=2)
    rests: Bool = ways * rate < REST_SPEED * 2 * half
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
    """Return the cheapest levels of one BAP, float64 (T,): at each frame, one of the two nearest.

    wanted: (T,), in steps. first: the first level; NaN if it is free. errors: (T, P, 3), metres by which the
    other BAPs leave points off; slopes: (T, P, 3), metres for a step of this one. rests: bool (T, P).
    """
    count, points = errors.shape[0], errors.shape[1]
    if len(wanted) != count or slopes.shape != errors.shape or errors.shape[2] != 3:
        raise IndexError("wanted levels, errors and slopes must have the same frames and points")
    if rests.shape[0] != count or rests.shape[1] != points:
        raise IndexError("rests must have the frames and points of errors")
    costs = np.zeros((count, 2))
    came_from = np.zeros((count, 2), np.int64)
    for frame in range(count):
        for one in range(2):
            level = np.trunc(wanted[frame]) + one * np.sign(wanted[frame])
            off = level - wanted[frame]
            if abs(off) >= 1.0 or (frame == 0 and not np.isnan(first) and level != first):
                costs[frame, one] = np.inf
                continue
            cost = off * off
            for point in range(points):
                weight = STANDING_WEIGHT if rests[frame, point] else SWINGING_WEIGHT
                for axis in range(3):
                    error = errors[frame, point, axis] + slopes[frame, point, axis] * off
                    cost += weight * error * error
            least = 0.0 if frame == 0 else np.inf
            for other in range(2 if frame > 0 else 0):
                way = costs[frame - 1, other]
                before = np.trunc(wanted[frame - 1]) + other * np.sign(wanted[frame - 1])
                if way == np.inf:
                    continue
                if before != level:
                    way += CHANGE
                for point in range(points):
                    if rests[frame, point] and rests[frame - 1, point]:
                        for axis in range(3):
                            moved = errors[frame, point, axis] + slopes[frame, point, axis] * off
                            moved -= errors[frame - 1, point, axis]
                            moved -= slopes[frame - 1, point, axis] * (before - wanted[frame - 1])
                            way += STIR_WEIGHT * moved * moved
                if way < least:
                    least = way
                    came_from[frame, one] = other
            costs[frame, one] = cost + least
    levels = np.zeros(count)
    one = 0 if costs[count - 1, 0] <= costs[count - 1, 1] else 1
    for frame in range(count - 1, -1, -1):
        levels[frame] = np.trunc(wanted[frame]) + one * np.sign(wanted[frame])
        one = int(came_from[frame, one])
    return levels

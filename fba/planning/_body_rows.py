"""Points of a body at which its errors are measured: 3 cm off joints, and under the soles.

An error of a BAP moves the points below its joint along a slope: about an axis, or along an axis. Errors of
all BAPs add up at every point. Points that move as a rigid body are off by no more than their outermost
points, so that some dozens of points represent all.

Bounds of the compiled loops: joints and rows of points come from `BodyRows`, of the skeleton whose matrices
and points are given; `BodyRows.points` and `BodyTarget` make the results, with a frame for each of their
frames. Arrays that a loop makes itself are as long as the rows that it goes through.
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from fba.arrays import Float32, Float64, Int64
from fba.body import SIDES, BapSolver, Skeleton, find_stance
from fba.body.displacement import REACH
from fba.body.stance import sole_points
from fba.compiled import compiled
from fba.planning._tolerance import Tolerance

BLOCK_FRAMES = 1024
"""Number of frames that are posed at once, to limit the memory."""
DIRECTIONS = 48
"""Number of directions; the outermost points of a rigid part in each represent the part."""


class BodyRows:
    """Points of a skeleton that represent all points which move with some of its joints.

    joints: int64 (R,), the joint that each point moves with. offsets: float64 (R, 3), from its centre, in
    its frame. soles: int64 (R,), 0 or 1 for a point under the left or the right sole, else -1.
    """

    def __init__(self, skeleton: Skeleton, moving: set[int]) -> None:
        """moving: numbers of the joints that turn in any frame."""
        parts: dict[int, list[tuple[int, Float64]]] = {}
        for joint in range(len(skeleton)):
            part = joint
            while part not in moving and part > 0:
                part = int(skeleton.parents[part])
            for axis in np.eye(3):
                parts.setdefault(part, []).append((joint, REACH * axis))
        directions = np.random.default_rng(0).normal(size=(DIRECTIONS, 3))
        rows: list[tuple[int, Float64, int]] = []
        for points in parts.values():
            at = np.array([skeleton.centres[joint] + offset for joint, offset in points])
            rows += [(*points[outermost], -1) for outermost in np.unique((at @ directions.T).argmax(axis=0))]
        for foot, side in enumerate(SIDES):
            for name, point in (sole_points(skeleton, side) or {}).items():
                number = skeleton.number(name)
                rows.append((number, point - skeleton.centres[number], foot))
        self.joints: Int64 = np.array([row[0] for row in rows], dtype=np.int64)
        self.offsets = np.array([row[1] for row in rows])
        self.soles: Int64 = np.array([row[2] for row in rows], dtype=np.int64)

    def points(self, matrices: Float64) -> Float64:
        """Return where the points are: float64 (T, R, 3). matrices: (T, J, 4, 4)."""
        result = np.zeros((len(matrices), len(self.joints), 3))
        _place_points(matrices, self.joints, self.offsets, result)
        return result

    def below(self, skeleton: Skeleton, joint: int) -> Int64:
        """Return the rows of points that a joint moves: int64 (K,)."""
        return np.flatnonzero(np.isin(self.joints, skeleton.descendants(joint))).astype(np.int64)


class BodyTarget:
    """Where a body must be, and within which tolerances.

    values: float64 (T, 296), BAPs, without jumps of full turns. tolerances: float32 (T, 3), metres: at
    joints, and at the soles of the left and the right foot.
    """

    def __init__(self, values: Float64, rate: float, tolerance: Tolerance) -> None:
        """rate: frames a second, from which speeds of feet are computed."""
        self.values = values
        self.solver = BapSolver()
        self.tolerances = np.full((len(values), 3), tolerance.joint, dtype=np.float32)
        for block in blocks(len(values)):
            stands = find_stance(self.solver.skeleton, self.solver.pose(values[block]), rate)
            self.tolerances[block, 1:][stands.T] = tolerance.foot

    def weights(self, rows: BodyRows) -> Float32:
        """Return the factors that turn errors at the points into shares of the tolerance: (T, R)."""
        return np.reciprocal(self.tolerances)[:, rows.soles + 1]

    def longest(self, shown: Float64, rows: BodyRows, frames: slice = slice(None)) -> Float64:
        """Return the largest error of BAPs (F, 296) at some frames, in shares of the tolerance: (F,)."""
        wanted = self.values[frames]
        weights = self.weights(rows)[frames]
        result = np.zeros(len(shown))
        for block in blocks(len(shown)):
            apart = rows.points(self.solver.pose(shown[block])) - rows.points(self.solver.pose(wanted[block]))
            result[block] = (np.linalg.norm(apart, axis=2) * weights[block]).max(axis=1)
        return result


def all_rows(skeleton: Skeleton) -> BodyRows:
    """Return all points, as if every joint turned."""
    return BodyRows(skeleton, set(range(len(skeleton))))


def blocks(count: int) -> list[slice]:
    """Return slices of about `BLOCK_FRAMES` frames, none of them much shorter."""
    ends = np.linspace(0, count, max(count // BLOCK_FRAMES, 1) + 1).astype(int)
    return [slice(int(start), int(end)) for start, end in pairwise(ends)]


@compiled
def _place_points(matrices: Float64, joints: Int64, offsets: Float64, result: Float64) -> None:
    """Set result (T, R, 3) to where points are that move with joints (R,), offsets (R, 3) from them."""
    for frame in range(len(result)):
        for row in range(len(joints)):
            matrix = matrices[frame, joints[row]]
            for axis in range(3):
                result[frame, row, axis] = (
                    matrix[axis, 3]
                    + matrix[axis, 0] * offsets[row, 0]
                    + matrix[axis, 1] * offsets[row, 1]
                    + matrix[axis, 2] * offsets[row, 2]
                )


class MovedPoints(NamedTuple):
    """The points that a BAP moves.

    points: (T, R, 3). weights: (T, R), see `BodyTarget.weights`. rows: (K,), the points below its joint.
    centre, axis: (T, 3), and turns: see `BapMotion`; only turns have a centre.
    """

    points: Float32
    weights: Float32
    rows: Int64
    centre: Float32
    axis: Float32
    turns: bool


@compiled
def add_error(errors: Float32, moved: MovedPoints, change: Float64) -> None:
    """Add to errors (T, R, 3), shares of the tolerance, what a change (T,) of a BAP moves."""
    points, weights, rows, centre, axis, turns = moved
    for frame in range(len(change)):
        if change[frame] == 0.0:
            continue
        amount = np.float32(change[frame])
        ax, ay, az = amount * axis[frame, 0], amount * axis[frame, 1], amount * axis[frame, 2]
        for k in range(len(rows)):
            row = int(rows[k])
            weight = weights[frame, row]
            error = errors[frame, row]
            if turns:
                x = points[frame, row, 0] - centre[frame, 0]
                y = points[frame, row, 1] - centre[frame, 1]
                z = points[frame, row, 2] - centre[frame, 2]
                error[0] += weight * (ay * z - az * y)
                error[1] += weight * (az * x - ax * z)
                error[2] += weight * (ax * y - ay * x)
            else:
                error[0] += weight * ax
                error[1] += weight * ay
                error[2] += weight * az


@compiled
def free_room(errors: Float32, moved: MovedPoints, limit: Float64) -> Float64:
    """Return how far a BAP may move down and up at each frame, and its longest slope: float64 (3, T).

    Within these changes no error (T, R, 3) below its joint becomes longer than limit (T,). If there is no
    such change, down and up both are the change that makes the longest error shortest.
    """
    points, weights, rows, centre, axis, turns = moved
    count = len(rows)
    room = np.zeros((3, len(errors)))
    steep, along, length = np.zeros(count), np.zeros(count), np.zeros(count)
    for frame in range(len(errors)):
        ax, ay, az = float(axis[frame, 0]), float(axis[frame, 1]), float(axis[frame, 2])
        for k in range(count):
            row = int(rows[k])
            weight = float(weights[frame, row])
            gx, gy, gz = ax, ay, az
            if turns:
                x = float(points[frame, row, 0]) - float(centre[frame, 0])
                y = float(points[frame, row, 1]) - float(centre[frame, 1])
                z = float(points[frame, row, 2]) - float(centre[frame, 2])
                gx, gy, gz = ay * z - az * y, az * x - ax * z, ax * y - ay * x
            error = errors[frame, row]
            ex, ey, ez = float(error[0]), float(error[1]), float(error[2])
            steep[k] = weight * weight * (gx * gx + gy * gy + gz * gz)
            along[k] = weight * (ex * gx + ey * gy + ez * gz)
            length[k] = ex * ex + ey * ey + ez * ez
        low, high, steepest = _interval(steep, along, length, limit[frame] * limit[frame])
        if low > high:
            low = _shortest_longest(steep, along, length)
            high = low
        room[0, frame], room[1, frame], room[2, frame] = low, high, np.sqrt(steepest)
    return room


MIN_SLOPE_SQUARE = 1e-16
"""Square of the slope, shares of the tolerance for a step of 1, below which a BAP does not move a point."""


@compiled
def _interval(steep: Float64, along: Float64, length: Float64, allowed: float) -> tuple[float, float, float]:
    """Return the changes down and up within which squares of errors stay allowed, and the steepest square.

    The square of error k after a change c is length[k] + 2 along[k] c + steep[k] c c. Down is above up if no
    change keeps all errors within.
    """
    low, high, steepest = -1e9, 1e9, 0.0
    for k in range(len(steep)):
        square = float(steep[k])
        if square < MIN_SLOPE_SQUARE:
            continue
        steepest = max(steepest, square)
        inside = float(along[k]) * float(along[k]) - square * (float(length[k]) - allowed)
        if inside < 0.0:
            low, high = 1e9, -1e9
            continue
        half = np.sqrt(inside)
        low = max(low, (-float(along[k]) - half) / square)
        high = min(high, (-float(along[k]) + half) / square)
    return low, high, steepest


@compiled
def _shortest_longest(steep: Float64, along: Float64, length: Float64) -> float:
    """Return the change that makes the longest error shortest, by ternary search: that length is convex."""
    low, high = 0.0, 0.0
    for k in range(len(steep)):
        if steep[k] >= MIN_SLOPE_SQUARE:
            best = -float(along[k]) / float(steep[k])
            low, high = min(low, best), max(high, best)
    for _ in range(40):
        lower, upper = low + (high - low) / 3, high - (high - low) / 3
        longest_lower, longest_upper = 0.0, 0.0
        for k in range(len(steep)):
            if steep[k] < MIN_SLOPE_SQUARE:
                continue
            base, rise, curve = float(length[k]), 2 * float(along[k]), float(steep[k])
            longest_lower = max(longest_lower, base + lower * (rise + curve * lower))
            longest_upper = max(longest_upper, base + upper * (rise + curve * upper))
        if longest_lower < longest_upper:
            high = upper
        else:
            low = lower
    return (low + high) / 2

"""Stance: when a foot stands on the ground, by the height and the motion of its sole."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fba.arrays import Bool, Float64
from fba.body import ground
from fba.body._skeleton import SIDES, Skeleton
from fba.body.footing import FOOT, SOLE, foot_frames, lowest_edge

HEEL = 0.045
"""Metres from an ankle back to the heel."""
STILL_SPEED = 0.15
"""Speed in metres per second below which a heel or a ball stands."""
LEVEL_SPEED = 0.15
"""Speed in metres per second, up or down, below which the lower foot stands, wherever it slides."""
STILL_SECONDS = 0.1
"""Seconds for which a standing foot is still, longer than at the top of a leap."""
SUPPORT_HEIGHT = 0.08
"""Height of a sole up to which it may stand on the ground, metres; higher, it is on a step."""
PLACED_HEIGHT = 0.025
"""Height over the lower foot up to which a foot stands if it is still for `PLACED_SECONDS`, metres."""
PLACED_SECONDS = 0.5
"""Seconds for which a foot must be still to stand on ground that is higher than the lower foot."""


def sole_points(skeleton: Skeleton, side: str) -> dict[str, Float64] | None:
    """Return the points (3,) of a sole under heel and ball, by the joint that moves them.

    In the default posture, metres. side: "l" or "r". None for a skeleton that lacks a joint of the foot.
    """
    ankle, heel, middle, ball = (f"{side}_{joint}" for joint in FOOT)
    if not all(joint in skeleton for joint in (ankle, heel, middle, ball)):
        return None
    above, front = (skeleton.centres[skeleton.number(joint)] for joint in (ankle, ball))
    return {heel: np.array([above[0], 0.0, above[2] - HEEL]), middle: np.array([front[0], 0.0, front[2]])}


def find_stance(skeleton: Skeleton, matrices: Float64, rate: float) -> Bool:
    """Return bool (2, T): when the left and the right foot of a body stand on the ground.

    matrices: (T, J, 4, 4), as `BapSolver.pose` returns them. rate: frames a second. All False for a skeleton
    without feet.
    """
    feet = [foot_frames(skeleton, matrices, side) for side in SIDES]
    ends = [heel_and_ball(skeleton, foot, side) for foot, side in zip(feet, SIDES, strict=True)]
    if len(matrices) < 2 or ends[0] is None or ends[1] is None:
        return np.zeros((2, len(matrices)), dtype=np.bool_)
    lowest = np.array([
        lowest_edge(skeleton, foot, side, SOLE) for foot, side in zip(feet, SIDES, strict=True)
    ])  # fmt: skip
    points = np.array(ends)
    return find_standing(lowest - ground.level_under(lowest, points), points, rate)


def heel_and_ball(
    skeleton: Skeleton, frames: Mapping[str, tuple[Float64, Float64]], side: str
) -> list[Float64] | None:
    """Return where heel and ball of a sole are, (T, 3) each; None for a skeleton that lacks a joint of it.

    frames: joint -> position (T, 3) and rotation (T, 3, 3). side: "l" or "r".
    """
    soles = sole_points(skeleton, side)
    if soles is None:
        return None
    return [
        frames[name][0] + frames[name][1] @ (point - skeleton.centres[skeleton.number(name)])
        for name, point in soles.items()
    ]


def find_standing(above: Float64, points: Float64, rate: float) -> Bool:
    """Return bool (2, T): when feet stand on the ground.

    above: (2, T), heights of the soles above the ground, metres. points: (2, 2, T, 3), heels and balls. The
    lower foot stands while its height is steady and near the ground, even if it slides or a treadmill carries
    it. The other foot stands while its heel or ball is still; as captures are often wrong by that much, it
    may be up to `PLACED_HEIGHT` higher.
    """
    if above.shape[1] < 2:
        return np.zeros(above.shape, dtype=np.bool_)
    speed = np.linalg.norm(np.gradient(points, axis=2), axis=3).min(axis=1) * rate
    rising = np.abs(np.gradient(above, axis=1)) * rate
    lowest = above.min(axis=0)
    lower, near = above <= lowest, above <= lowest + PLACED_HEIGHT
    still = _fastest(speed, rate, STILL_SECONDS) < STILL_SPEED
    alone = (_fastest(rising, rate, STILL_SECONDS) < LEVEL_SPEED) & ~near[::-1]
    placed = (_fastest(speed, rate, PLACED_SECONDS) < STILL_SPEED) & near
    return np.asarray((above < SUPPORT_HEIGHT) & np.where(lower, still | alone, placed))


def _fastest(speed: Float64, rate: float, seconds: float) -> Float64:
    """Return the highest of speeds (2, T) within a window of `seconds` around each frame."""
    half = round(seconds * rate / 2)
    around = np.pad(speed, ((0, 0), (half, half)), mode="edge")
    return np.asarray(np.lib.stride_tricks.sliding_window_view(around, 2 * half + 1, axis=1).max(axis=2))

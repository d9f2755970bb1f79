"""Which rest pose a motion is retargeted from: the file's own, the first frame, or one from the motion."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fba import rotations
from fba.arrays import Float64
from fba.body.skeleton import ROOT
from fba.capture import _standing as standing
from fba.capture.motion import SkeletonMotion

POSED_DISTANCE = 3.0
"""Degrees from standing up to which a rest pose that might be any pose is believed."""
FIRST_DISTANCE = 4.0
"""The same for a first frame that is taken as the rest pose of a file that has none."""
SAME_POSE = 0.01
"""Share of the size within which a rest pose is a frame of the motion."""
MOST_ROW_TURN = {"hip": 25.0, "shoulder": 45.0}
"""Degrees by which the rows of hips and shoulders may differ, on average, from the rest pose, as the joint
sees them that they hang on. In real files hips differ by up to 6, shoulders by up to 8."""


def choose_rest(
    motion: SkeletonMotion,
    quaternions: Float64,
    positions: Float64,
    mapped: Mapping[str, int],
    at_rest: standing.Stance,
    rest: str | int,
) -> tuple[str, float, str]:
    """Return which rest pose to take, the confidence, and a reason.

    quaternions, positions: (T, J, 4), (T, J, 3), of the source in the world.
    """
    if rest != "auto":
        return str(rest), 1.0, "as given"
    distance = float(at_rest.distance[0])
    possible = bool(at_rest.possible[0])
    if possible and motion.posed:
        relative = motion.rest() - motion.rest()[mapped[ROOT]]
        size = float(np.ptp(relative, axis=0).max())
        frames = positions - positions[:, [mapped[ROOT]]]
        same = len(frames) > 1 and float(np.abs(frames - relative).max(axis=(1, 2)).min()) < SAME_POSE * size
        possible = distance <= POSED_DISTANCE and not same
        why = "the nodes' own pose is one of the motion"
    else:
        why = f"nobody can stand as in the file's rest pose ({at_rest.worst(0)})"
    if possible:
        turned = _find_turned_row(motion, quaternions, positions, mapped)
        if turned is None:
            return "file", max(0.6, 1.0 - distance / 50.0), "the file's own rest pose is a person's"
        why = f"the {turned[0]} are {turned[1]:.0f} degrees from the file's rest pose on average"
    first = standing.measure(positions[:1], mapped)
    if (
        bool(first.possible[0])
        and float(first.distance[0]) <= FIRST_DISTANCE
        and _arms_out(positions[0], mapped, first)
    ):
        return "first", 0.9, f"{why}; the first frame is a T-pose"
    return "motion", 1.0, why


def _find_turned_row(
    motion: SkeletonMotion, quaternions: Float64, positions: Float64, mapped: Mapping[str, int]
) -> tuple[str, float] | None:
    """Return which row, of hips or shoulders, lies otherwise than in the rest pose, and by how many degrees.

    Turns that were fitted to positions of joints may leave the pelvis turned aside, whose hips then are
    turned back: such a rest pose says nothing.
    """
    at_rest = motion.rest()
    for joint, most in MOST_ROW_TURN.items():
        ends = [mapped[name] for name in (f"l_{joint}", f"r_{joint}") if name in mapped]
        if len(ends) < 2 or (above := _common(motion, *ends)) < 0:
            continue
        row = at_rest[ends[0]] - at_rest[ends[1]]
        frames = rotations.matrices(quaternions[:, above])
        turn = standing.row_turn(frames, positions[:, ends[0]] - positions[:, ends[1]], row)
        if turn > most:
            return f"{joint}s", turn
    return None


def _common(motion: SkeletonMotion, one: int, other: int) -> int:
    """Return the number of the joint that two joints hang on, -1 without one."""
    while one != other:
        one, other = int(motion.parents[max(one, other)]), min(one, other)
    return one


def _arms_out(positions: Float64, mapped: Mapping[str, int], stance: standing.Stance) -> bool:
    """Whether both arms point straight to the sides."""
    for side, sign in (("l", 1.0), ("r", -1.0)):
        if f"{side}_shoulder" not in mapped or f"{side}_wrist" not in mapped:
            return False
        arm = standing.unit(positions[mapped[f"{side}_wrist"]] - positions[mapped[f"{side}_shoulder"]])
        if float(arm @ stance.left[0]) * sign < np.cos(np.radians(10.0)):
            return False
    return True

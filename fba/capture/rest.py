"""How a skeleton at rest relates to the standard's default posture, for bodies that are shown."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from fba.arrays import Float64
from fba.body import Skeleton
from fba.capture import _rest_alignment as rest_alignment
from fba.capture._up_axis import find_upright, turn_axes
from fba.capture.bones import find_bones
from fba.capture.motion import SkeletonMotion


@dataclass(frozen=True, eq=False)
class Rest:
    """A skeleton at rest; `find_rest` makes it.

    mapped: joint of the body -> number of the source's joint. positions: float64 (J, 3), of the source's
    joints at rest, in its unit, y up, facing +z. corrections: joint of the body -> rotation (3, 3) from the
    default posture to the rest pose, in the same axes. turn: (3, 3), from the source's frame to those axes.
    """

    mapped: Mapping[str, int]
    positions: Float64
    corrections: Mapping[str, Float64]
    turn: Float64


def find_rest(motion: SkeletonMotion, skeleton: Skeleton, joints: Mapping[str, str] | None = None) -> Rest:
    """Return how a skeleton rests. joints: as for `from_skeleton`. ModelError as `from_skeleton`."""
    mapped = find_bones(motion, joints, skeleton).joints
    upright = find_upright(motion, mapped)
    alignment = rest_alignment.align(turn_axes(motion, upright), mapped, skeleton)
    ahead = alignment.corrections["sacroiliac"].T
    corrections = {joint: ahead @ correction for joint, correction in alignment.corrections.items()}
    turn = ahead @ upright
    return Rest(mapped, motion.rest() @ turn.T, corrections, turn)

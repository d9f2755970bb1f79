"""Displacements between two motions of a body, 3 cm from every joint and at standing soles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from fba.arrays import Bool, Float64, Int32
from fba.body._skeleton import SIDES, Skeleton
from fba.body.solve.solver import BapSolver
from fba.body.stance import find_stance, sole_points

REACH = 0.03
"""Distance from a joint to the points at which displacements are measured, on each axis of its frame, m."""
MEASURED_AT_ONCE = 1024
"""Number of frames measured at once, to limit the memory."""

Frame = Literal["world", "root"]


@dataclass(frozen=True, eq=False)
class Displacements:
    """Displacements of a body from the source, metres.

    joints: float64 (T, J), largest displacement of the three points around each joint. feet: float64 (T, 2),
    larger displacement of heel and ball of the left and the right foot; 0 while it does not stand.
    """

    joints: Float64
    feet: Float64

    def share_within(self, limit: float) -> float:
        """Return the share, 0 to 1, of joints over all frames within a limit in metres."""
        return float((self.joints <= limit).mean()) if self.joints.size else 1.0


def displacements(
    source: Int32 | Float64,
    shown: Int32 | Float64,
    rate: float,
    *,
    frame: Frame = "world",
    skeleton: Skeleton | None = None,
) -> Displacements:
    """Return the displacements of a body between the BAPs of the source and those shown, (T, 296) each.

    They are measured at a point on each axis of a joint's frame, so that errors of rotation count as well as
    of position, as in the Animation Compression Library. rate: frames a second, which decides when feet stand
    (`fba.body.stance`). frame: "world", with the body's path, which that library calls object space, or
    "root", relative to the body's root. skeleton: by default the built-in one.

    ValueError if the numbers of frames differ.
    """
    if len(source) != len(shown):
        raise ValueError(f"the source has {len(source)} frames, what is shown {len(shown)}")
    solver = BapSolver(skeleton)
    joints = np.zeros((len(source), len(solver.skeleton)))
    soles = np.zeros((len(source), 2))
    for start in range(0, len(source), MEASURED_AT_ONCE):
        block = slice(start, start + MEASURED_AT_ONCE)
        pair = [solver.pose(baps[block]) for baps in (source, shown)]
        if frame == "root":
            pair = [np.linalg.inv(matrices[:, :1]) @ matrices for matrices in pair]
        apart = pair[1] - pair[0]
        offsets = apart[..., :3, 3][..., None] + REACH * apart[..., :3, :3]
        joints[block] = np.sqrt(np.square(offsets).sum(axis=2).max(axis=2))
        soles[block] = _sole_displacements(solver.skeleton, apart)
    stands = _stance(solver, source, rate)
    return Displacements(joints, np.where(stands.T, soles, 0.0))


def _sole_displacements(skeleton: Skeleton, apart: Float64) -> Float64:
    """Return the larger displacement of heel and ball, (T, 2), for differences of joint matrices."""
    result = np.zeros((len(apart), 2))
    for foot, side in enumerate(SIDES):
        for joint, point in (sole_points(skeleton, side) or {}).items():
            number = skeleton.number(joint)
            joint_apart = apart[:, number]
            moved = joint_apart[:, :3, 3] + joint_apart[:, :3, :3] @ (point - skeleton.centres[number])
            result[:, foot] = np.maximum(result[:, foot], np.linalg.norm(moved, axis=1))
    return result


def _stance(solver: BapSolver, baps: Int32 | Float64, rate: float) -> Bool:
    """Return bool (2, T): when feet stand. Each piece of a long motion has its ground, as captures climb."""
    pieces = np.array_split(baps, max(len(baps) // MEASURED_AT_ONCE, 1))
    stances = [find_stance(solver.skeleton, solver.pose(piece), rate) for piece in pieces]
    return np.concatenate(stances, axis=1)

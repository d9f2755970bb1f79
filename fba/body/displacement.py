"""How far two motions of a body are apart: at points 3 cm off every joint, and at soles that stand."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from fba.arrays import Bool, Float64, Int32
from fba.body.skeleton import SIDES, Skeleton
from fba.body.solve.solver import BapSolver
from fba.body.stance import find_stance, sole_points

REACH = 0.03
"""Metres from a joint to the points at which errors are measured, along each axis of the joint's frame."""
BLOCK = 1024
"""Frames measured at once: matrices of a long capture would not fit into memory."""

Frame = Literal["world", "root"]


@dataclass(frozen=True, eq=False)
class Displacements:
    """How far a body is from where the source has it, in metres.

    joints: float64 (T, J), the largest displacement of the three points 3 cm off each joint. feet: float64
    (T, 2), of heel and ball of the left and the right foot; 0 while it does not stand on the ground.
    """

    joints: Float64
    feet: Float64

    def share_within(self, limit: float) -> float:
        """Return the share, 0 to 1, of all joints in all frames that are within a limit in metres."""
        return float((self.joints <= limit).mean()) if self.joints.size else 1.0


def displacements(
    source: Int32 | Float64,
    shown: Int32 | Float64,
    rate: float,
    *,
    frame: Frame = "world",
    skeleton: Skeleton | None = None,
) -> Displacements:
    """Return how far BAPs that are shown, (T, 296), take a body from where those of the source take it.

    Each axis of a joint's own frame has a point `REACH` along it, so that turns count as well as ways; this
    is how the Animation Compression Library measures. rate: frames a second, by which a foot of the source
    stands (`fba.body.stance`). frame: "world", where the body's way counts, which that library calls object
    space, or "root", as seen from the body's root. skeleton: by default the built-in one.

    ValueError if the numbers of frames differ.
    """
    if len(source) != len(shown):
        raise ValueError(f"the source has {len(source)} frames, what is shown {len(shown)}")
    solver = BapSolver(skeleton)
    joints = np.zeros((len(source), len(solver.skeleton)))
    soles = np.zeros((len(source), 2))
    for start in range(0, len(source), BLOCK):
        block = slice(start, start + BLOCK)
        pair = [solver.pose(baps[block]) for baps in (source, shown)]
        if frame == "root":
            pair = [_seen_from_root(one) for one in pair]
        apart = pair[1] - pair[0]
        offsets = apart[..., :3, 3][..., None] + REACH * apart[..., :3, :3]
        joints[block] = np.sqrt(np.square(offsets).sum(axis=2).max(axis=2))
        soles[block] = _sole_displacements(solver.skeleton, apart)
    stands = _stance(solver, source, rate)
    return Displacements(joints, np.where(stands.T, soles, 0.0))


def _seen_from_root(matrices: Float64) -> Float64:
    """Return joint matrices in the frame of the root."""
    return np.linalg.inv(matrices[:, :1]) @ matrices


def _sole_displacements(skeleton: Skeleton, apart: Float64) -> Float64:
    """Return how far heels and balls move, whichever moves more: (T, 2). apart: differences of matrices."""
    result = np.zeros((len(apart), 2))
    for foot, side in enumerate(SIDES):
        for joint, point in (sole_points(skeleton, side) or {}).items():
            number = skeleton.number(joint)
            own = apart[:, number]
            moved = own[:, :3, 3] + own[:, :3, :3] @ (point - skeleton.centres[number])
            result[:, foot] = np.maximum(result[:, foot], np.linalg.norm(moved, axis=1))
    return result


def _stance(solver: BapSolver, baps: Int32 | Float64, rate: float) -> Bool:
    """Return bool (2, T): when feet stand. Pieces of a long motion have a ground each: captures climb."""
    pieces = np.array_split(baps, max(len(baps) // BLOCK, 1))
    found = [find_stance(solver.skeleton, solver.pose(piece), rate) for piece in pieces]
    return np.concatenate(found, axis=1)

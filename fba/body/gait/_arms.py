"""Arms that bring the palms where the poses want them: inverse kinematics, digest 2.5."""

from __future__ import annotations

import numpy as np

from fba.arrays import Float64
from fba.body.gait._anatomy import Side, Writer
from fba.body.gait._characters import Character
from fba.body.gait._curves import periodic
from fba.body.gait._plan import KNOTS, Plan
from fba.body.gait._rotations import limb_angles
from fba.body.solve.solver import BapSolver

_LATE = 0.02
"""Fraction of the cycle by which arms come after the legs."""
_REACH = 0.995
"""Share of its length to which an arm stretches."""


def goals(side: Side, character: Character, size: float) -> Float64:
    """(8, 3), metres from the shoulder to the palm at the eight poses of a cycle of the leg on this side."""
    out, down, forward = (np.array(character.curve(field)) for field in ("out", "down", "forward"))
    swing = forward - forward.mean()
    forward = forward.mean() + swing * np.clip(size, 0.0, 1.4)
    goal = np.stack([side.way * out, -down, forward], axis=-1) * side.arm.reach
    length = np.linalg.norm(goal, axis=-1, keepdims=True)
    result: Float64 = goal * np.minimum(1.0, _REACH * side.arm.reach / length)
    return result


def swing(writer: Writer, plan: Plan, phase: Float64) -> None:
    """Write the angles of shoulders and elbows; the spine stands in writer.values already.

    At the poses the palms are at their goals; in between, angles are interpolated.
    """
    anatomy, character = plan.anatomy, plan.character
    solver = BapSolver(anatomy.skeleton)
    girdle = anatomy.skeleton.parents
    for letter, side in anatomy.sides.items():
        start = 0.0 if letter == "r" else 0.5
        at = np.mod(KNOTS + start + _LATE, 1.0)
        nearest = np.array([np.argmin(np.abs(np.mod(phase - a + 0.5, 1.0) - 0.5)) for a in at])
        shoulder = anatomy.skeleton.number(f"{letter}_shoulder")
        matrices = solver.pose(writer.values[nearest])[:, girdle[shoulder], :3, :3]
        # goals are meant in a frame that walks with the body, level and looking ahead
        local = np.einsum("tji,tj->ti", matrices, goals(side, character, plan.size))
        twist = -side.way * np.radians(character.arms.twist)
        upper, bend = side.arm.solve(local, np.full(len(KNOTS), twist))
        x, y, z = limb_angles(upper)
        own = phase - start - _LATE
        for axis, angle in ((0, x), (1, y), (2, z)):
            writer.turn(f"{letter}_shoulder", axis, periodic(KNOTS, angle, own, plan.interpolation))
        writer.turn(f"{letter}_elbow", 0, -periodic(KNOTS, bend, own, plan.interpolation))
        wrist = -side.way * np.radians(character.arms.wrist)
        writer.turn(f"{letter}_wrist", 2, np.full(phase.shape, wrist))

"""What each BAP moves: the joint below which it turns, and the axis that it turns about, in every pose."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba import rotations
from fba.arrays import Bool, Float32, Float64
from fba.body.solve._pose_loops import MILLIMETRE, UNIT
from fba.body.solve.solver import BapSolver


@dataclass(frozen=True, eq=False)
class BapMotion:
    """What an increase of one BAP by 1 does to a body, at every frame.

    column: of the BAP. joint: number of the joint; what is below it moves. turns: whether it turns about an
    axis through the joint, or moves everything along it. axis: float32 (T, 3), in the world, as long as
    what it turns in radians or moves in metres.
    """

    column: int
    joint: int
    turns: bool
    axis: Float32


def bap_motions(solver: BapSolver, baps: Float64, matrices: Float64, columns: Bool) -> list[BapMotion]:
    """Return what BAPs move, the root's first, parents before children, at each joint the outermost first.

    baps: (T, 296). matrices: (T, J, 4, 4), their pose. columns: bool (296,), the BAPs that are asked for; a
    joint's others are taken to be 0.
    """
    rules, skeleton = solver.convention, solver.skeleton
    result = []
    for place, (column, sign) in enumerate(zip(rules.translation, rules.translation_sign, strict=True)):
        if column >= 0 and columns[column]:
            axis = np.zeros((len(baps), 3), dtype=np.float32)
            axis[:, place] = sign * MILLIMETRE
            result.append(BapMotion(int(column), 0, False, axis))
    rows = {joint: row for row, joint in enumerate(rules.joints)}
    for joint, name in enumerate(skeleton.names):
        row = rows.get(name)
        if row is None or not columns[list(rules.freedoms(name))].any():
            continue
        parent = int(skeleton.parents[joint])
        frame = matrices[:, parent, :3, :3] if parent >= 0 else np.broadcast_to(np.eye(3), (len(baps), 3, 3))
        for column, axis, sign in zip(rules.bap[row], rules.axis[row], rules.sign[row], strict=True):
            if column < 0 or not columns[column]:
                continue
            along = (frame[:, :, axis] * sign * UNIT).astype(np.float32)
            result.append(BapMotion(int(column), joint, True, along))
            frame = frame @ rotations.axis_matrices(int(axis), baps[:, column] * sign * UNIT)
    return result

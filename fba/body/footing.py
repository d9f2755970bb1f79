"""Where the soles of a body are, and poses in which a body of other proportions stands on the same ground.

BAPs give the root's position in metres, which fits one length of legs. `GroundedPoser` raises or lowers a
body whose legs differ from the default skeleton's, so that its lower foot is as high as that one's.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fba.arrays import Float64
from fba.body.skeleton import Skeleton
from fba.body.solve.solver import BapSolver

OUTLINE = (
    ("ankle", 0.011, 0.0, -0.0685), ("ankle", -0.028, 0.0, -0.040), ("ankle", 0.043, 0.0, -0.040),
    ("ankle", -0.038, 0.0, 0.055), ("ankle", 0.055, 0.0, 0.055),
    ("metatarsal", -0.046, 0.0, 0.0), ("metatarsal", 0.065, 0.0, 0.0),
)  # fmt: skip
"""Edge of the shown person's soles: the joint that it moves with, and metres from that joint, outwards and
ahead, at a height above the ground in the default posture. Measured on `fba/body/builtin/body.glb`."""
TIP = (
    ("metatarsal", -0.045, 0.002, 0.031), ("metatarsal", 0.053, 0.002, 0.031),
    ("metatarsal", -0.033, 0.0067, 0.070), ("metatarsal", 0.023, 0.0067, 0.070),
    ("metatarsal", -0.005, 0.008, 0.0745),
)  # fmt: skip
"""The same for what is ahead of the ball."""


def lowest_sole(skeleton: Skeleton, matrices: Float64) -> Float64 | None:
    """Return the height (T,) of the lower foot's lowest point; None for a skeleton without feet.

    matrices: (T, J, 4, 4), as `BapSolver.pose` returns them.
    """
    lows = []
    for side, outwards in (("l", 1.0), ("r", -1.0)):
        if not all(f"{side}_{joint}" in skeleton for joint in ("ankle", "metatarsal")):
            return None
        for joint, x, y, z in (*OUTLINE, *TIP):
            number = skeleton.number(f"{side}_{joint}")
            point = np.array([outwards * x, y - skeleton.centres[number, 1], z])
            lows.append(matrices[:, number, 1, 3] + matrices[:, number, 1, :3] @ point)
    result: Float64 = np.min(lows, axis=0)
    return result


class GroundedPoser:
    """Poses of a body of any proportions, in which its lower foot is as high as the default skeleton's.

    A body without feet, and the default skeleton itself, stay where the BAPs put them. axes: see `BapSolver`.
    """

    def __init__(self, skeleton: Skeleton, axes: str = "iso") -> None:
        self._solver = BapSolver(skeleton, axes)
        feet = all(f"{side}_{joint}" in skeleton for side in "lr" for joint in ("ankle", "metatarsal"))
        default = Skeleton.default()
        self._default = BapSolver(default, axes) if feet and skeleton is not default else None

    def pose(self, baps: npt.ArrayLike) -> Float64:
        """Return joint matrices, see `BapSolver.pose`."""
        matrices = self._solver.pose(baps)
        frames = matrices.reshape(-1, *matrices.shape[-3:])
        frames[:, :, 1, 3] += self.lifts(baps)[:, None]
        return matrices

    def lifts(self, baps: npt.ArrayLike) -> Float64:
        """Return metres (T,) by which poses are raised; (1,) for a single pose."""
        rows = np.atleast_2d(np.asarray(baps))
        if self._default is None:
            return np.zeros(len(rows))
        theirs, ours = (
            lowest_sole(solver.skeleton, solver.pose(rows)) for solver in (self._default, self._solver)
        )
        assert theirs is not None
        assert ours is not None
        return theirs - ours

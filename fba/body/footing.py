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
from fba.choices import Axes

OUTLINE = (
    ("ankle", 0.011, 0.0, -0.0645), ("ankle", -0.024, 0.0, -0.030), ("ankle", 0.040, 0.0, -0.039),
    ("ankle", -0.033, 0.0, 0.057), ("ankle", 0.054, 0.0, 0.063),
    ("ankle", 0.011, 0.004, -0.0685), ("ankle", -0.028, 0.004, -0.032), ("ankle", 0.043, 0.004, -0.041),
    ("ankle", -0.037, 0.004, 0.057), ("ankle", 0.0575, 0.004, 0.062),
    ("metatarsal", -0.0415, 0.0, -0.002), ("metatarsal", 0.061, 0.0, -0.012),
    ("metatarsal", 0.059, 0.0, 0.0025), ("metatarsal", -0.0455, 0.004, -0.002),
    ("metatarsal", 0.065, 0.004, -0.0115), ("metatarsal", 0.063, 0.004, 0.003),
)  # fmt: skip
"""Edge of the shown person's soles, which is bevelled: the joint that it moves with, and metres from that
joint, outwards and ahead, at a height above the ground in the default posture. Vertices of
`fba/body/builtin/body.glb`."""
TIP = (
    ("metatarsal", -0.041, 0.002, 0.028), ("metatarsal", 0.050, 0.002, 0.029),
    ("metatarsal", -0.031, 0.0067, 0.066), ("metatarsal", 0.021, 0.0062, 0.059),
    ("metatarsal", -0.005, 0.0068, 0.0695), ("metatarsal", -0.019, 0.0069, 0.0705),
    ("metatarsal", -0.045, 0.006, 0.028), ("metatarsal", 0.053, 0.006, 0.031),
    ("metatarsal", -0.033, 0.0105, 0.069), ("metatarsal", 0.023, 0.010, 0.063),
    ("metatarsal", -0.005, 0.0105, 0.0735), ("metatarsal", -0.019, 0.0105, 0.0745),
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

    def __init__(self, skeleton: Skeleton, axes: Axes = "iso") -> None:
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

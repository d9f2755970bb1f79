"""Heights of the soles of a body, and poses in which a body of other proportions stands on the same ground.

BAPs give the root's position in metres, which fits one length of legs. `GroundedPoser` raises or lowers a
body whose legs differ from the default skeleton's, so that its lower foot is as high as that one's.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache

import numpy as np
import numpy.typing as npt

from fba.arrays import Float64
from fba.body._skeleton import SIDES, Skeleton
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
"""The bevelled edge of the built-in person's soles, from vertices of `fba/body/builtin/body.glb`: joint that
moves it, metres outwards from that joint, metres above the ground in the default posture, metres ahead."""
TIP = (
    ("metatarsal", -0.041, 0.002, 0.028), ("metatarsal", 0.050, 0.002, 0.029),
    ("metatarsal", -0.031, 0.0067, 0.066), ("metatarsal", 0.021, 0.0062, 0.059),
    ("metatarsal", -0.005, 0.0068, 0.0695), ("metatarsal", -0.019, 0.0069, 0.0705),
    ("metatarsal", -0.045, 0.006, 0.028), ("metatarsal", 0.053, 0.006, 0.031),
    ("metatarsal", -0.033, 0.0105, 0.069), ("metatarsal", 0.023, 0.010, 0.063),
    ("metatarsal", -0.005, 0.0105, 0.0735), ("metatarsal", -0.019, 0.0105, 0.0745),
)  # fmt: skip
"""The same for the part ahead of the ball."""


SOLE = (*OUTLINE, *TIP)
"""The whole edge."""
FOOT = ("ankle", "subtalar", "midtarsal", "metatarsal")
"""Joints of a foot."""


def foot_frames(skeleton: Skeleton, matrices: Float64, side: str) -> dict[str, tuple[Float64, Float64]]:
    """Return position (T, 3) and rotation (T, 3, 3) of the joints of a foot that a skeleton has, by name.

    matrices: (T, J, 4, 4), as `BapSolver.pose` returns them. side: "l" or "r".
    """
    names = [f"{side}_{joint}" for joint in FOOT if f"{side}_{joint}" in skeleton]
    rows = {name: matrices[:, skeleton.number(name)] for name in names}
    return {name: (row[:, :3, 3], row[:, :3, :3]) for name, row in rows.items()}


def lowest_edge(
    skeleton: Skeleton,
    frames: Mapping[str, tuple[Float64, Float64]],
    side: str,
    edge: Sequence[tuple[str, float, float, float]],
) -> Float64:
    """Return the height (T,) of the lowest point of a sole's edge.

    frames: joint -> position (T, 3) and rotation (T, 3, 3). edge: `SOLE`, or a part of it.
    """
    heights = []
    for joint, own in _edge_points(tuple(edge), side):
        position, frame = frames[joint]
        height = skeleton.centres[skeleton.number(joint), 1]
        heights.append(_lowest_point(position[:, 1], frame[..., 1, :], height, own))
    return np.asarray(np.min(heights, axis=0))


def _lowest_point(heights: Float64, up: Float64, height: float, own: Float64) -> Float64:
    """Return the height (T,) of the lowest of a joint's points, float64 (3, N).

    heights: (T,), of the joint; up: (T, 3), the vertical in its frame; height: in the default posture.
    """
    return np.asarray(heights - up[..., 1] * height + (up @ own).min(axis=-1))


@cache
def _edge_points(edge: tuple[tuple[str, float, float, float], ...], side: str) -> list[tuple[str, Float64]]:
    """Return the joints of an edge on a side, each with its points, float64 (3, N)."""
    outwards = np.array([1.0 if side == "l" else -1.0, 1.0, 1.0])
    joints = dict.fromkeys(row[0] for row in edge)
    return [
        (f"{side}_{joint}", np.array([row[1:] * outwards for row in edge if row[0] == joint]).T)
        for joint in joints
    ]


def lowest_sole(skeleton: Skeleton, matrices: Float64) -> Float64 | None:
    """Return the height (T,) of the lower sole in poses (T, J, 4, 4); None for a skeleton without feet."""
    if not has_feet(skeleton):
        return None
    lows = []
    for joint, own in (points for side in SIDES for points in _edge_points(SOLE, side)):
        number = skeleton.number(joint)
        vertical = matrices[:, number, 1]
        lows.append(_lowest_point(vertical[:, 3], vertical[:, :3], skeleton.centres[number, 1], own))
    return np.asarray(np.min(lows, axis=0))


def has_feet(skeleton: Skeleton) -> bool:
    """Whether a skeleton has the joints that move the edges of the soles."""
    return all(f"{side}_{joint}" in skeleton for side in SIDES for joint in ("ankle", "metatarsal"))


class GroundedPoser:
    """Poses a body of any proportions so that its lower foot is as high as the default skeleton's.

    A body without feet, and the default skeleton, are posed as the BAPs say. axes: see `BapSolver`.
    """

    def __init__(self, skeleton: Skeleton, axes: Axes = "iso") -> None:
        self._solver = BapSolver(skeleton, axes)
        default = Skeleton.default()
        self._default = BapSolver(default, axes) if has_feet(skeleton) and skeleton is not default else None

    def pose(self, baps: npt.ArrayLike) -> Float64:
        """Return joint matrices, see `BapSolver.pose`."""
        matrices = self._solver.pose(baps)
        frames = matrices.reshape(-1, *matrices.shape[-3:])
        if self._default is not None:
            frames[:, :, 1, 3] += _lifts(self._default, baps, self._solver.skeleton, frames)[:, None]
        return matrices

    def lifts(self, baps: npt.ArrayLike) -> Float64:
        """Return metres (T,) by which poses are raised; (1,) for a single pose."""
        rows = np.atleast_2d(np.asarray(baps))
        if self._default is None:
            return np.zeros(len(rows))
        return _lifts(self._default, rows, self._solver.skeleton, self._solver.pose(rows))


def _lifts(default: BapSolver, baps: npt.ArrayLike, skeleton: Skeleton, matrices: Float64) -> Float64:
    """Return metres (T,) by which the poses (T, J, 4, 4) of a skeleton are raised to those of the default."""
    wanted = lowest_sole(default.skeleton, default.pose(np.atleast_2d(np.asarray(baps))))
    present = lowest_sole(skeleton, matrices)
    assert wanted is not None
    assert present is not None
    return wanted - present

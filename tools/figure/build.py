"""Build of a figure: how the proportions of its body differ from the first figure's.

What is modelled, points as well as joints, is moved by the same rule, so that joints stay within their limbs.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import PchipInterpolator

from fba.arrays import Float64
from fba.body import Skeleton
from fba.rotations import axis_matrices
from fba.sampling import smoothstep

BETWEEN = (0.04, 0.15)
"""Metres from the midline: up to the first nothing is moved sideways, from the second on everything."""
SLOPE = (0.06, 0.17)
"""Metres from the midline between which shoulders slope."""
LOWERED = (1.00, 1.36)
"""Heights between which the trunk becomes shorter, metres."""
FRONT, BACK = -0.02, -0.08
"""z from which points belong to the front and the back of the trunk, metres, and how far that fades."""
FADES = 0.06


@dataclass(frozen=True)
class Build:
    """Differences from the first figure, metres unless said otherwise.

    trunk: rows of a height and of what is added there to half the width, to the front and to the back.
    bust: how far it stands out. bust_at: how far from the midline, and its height; bust_size: how far it
    reaches sideways, up and down. shoulders: by which each is moved in. slope: by which it is lower. shorter:
    of the trunk. arms: their length, relative to the first figure's. carried: degrees by which upper arms and
    forearms hang outwards, past wider hips.
    """

    trunk: tuple[tuple[float, float, float, float], ...]
    bust: float
    bust_at: tuple[float, float]
    bust_size: tuple[float, float, float]
    shoulders: float
    slope: float
    shorter: float
    arms: float
    carried: tuple[float, float]

    def move(self, p: Float64, arm: Float64, shoulders: Float64) -> Float64:
        """Return points p (N, 3), as modelled, in this build.

        arm (N,): how far the arms carry them, 0..1. shoulders (2, 3): joints of the left and the right arm.
        """
        side = np.sign(p[:, 0])
        joint = np.where(side[:, None] >= 0, shoulders[0], shoulders[1])
        body, out = self._move_trunk(p), np.zeros_like(p)
        at = self._move_trunk(joint)
        at[:, 0] = -side * self.shoulders
        out[:] = at + (self.arms - 1) * (p - joint)
        return p + (1 - arm[:, None]) * body + arm[:, None] * out

    def _move_trunk(self, p: Float64) -> Float64:
        """Return (N, 3), by how much points of trunk, neck and legs are moved."""
        x, y, z = np.abs(p[:, 0]), p[:, 1], p[:, 2]
        rows = np.array(self.trunk)
        wider, front, back = PchipInterpolator(rows[:, 0], rows[:, 1:], extrapolate=False)(
            np.clip(y, rows[0, 0], rows[-1, 0])
        ).T
        ahead, behind = smoothstep((z - FRONT) / FADES), smoothstep((BACK - z) / FADES)
        moved = np.zeros_like(p)
        moved[:, 0] = np.sign(p[:, 0]) * wider * smoothstep((x - BETWEEN[0]) / (BETWEEN[1] - BETWEEN[0]))
        moved[:, 1] = -self.shorter * smoothstep((y - LOWERED[0]) / (LOWERED[1] - LOWERED[0]))
        high = smoothstep((y - 1.28) / 0.10)
        moved[:, 1] -= self.slope * high * smoothstep((x - SLOPE[0]) / (SLOPE[1] - SLOPE[0]))
        up = y - self.bust_at[1]
        reach = np.where(up > 0, self.bust_size[1], self.bust_size[2])
        mound = np.exp(-(((x - self.bust_at[0]) / self.bust_size[0]) ** 2) - (up / reach) ** 2)
        moved[:, 2] = ahead * (front + self.bust * mound) - behind * back
        return moved

    def turn_arms(self, bind: Float64, skeleton: Skeleton) -> None:
        """Turn bind matrices (J, 4, 4), in place, so that the arms hang as they are carried."""
        for side, sign in (("l", 1.0), ("r", -1.0)):
            for joint, degrees in zip(("shoulder", "elbow"), self.carried, strict=True):
                back = axis_matrices(2, np.radians(-sign * degrees))
                below = skeleton.descendants(skeleton.number(f"{side}_{joint}"))
                bind[below, :3, :3] = bind[below, :3, :3] @ back

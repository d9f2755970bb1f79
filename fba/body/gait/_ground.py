"""Positions of standing feet, and the legs that reach them.

A foot lands on its heel, lies flat, and rises over the metatarsal joint while the toes stay flat: what
touches the ground does not move. The source corrects for ground and slip by moving the root; so does
`_plan`. That is not enough while both feet are on the ground: the legs make up the rest here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.arrays import Float64
from fba.body.gait._anatomy import Side, foot_angles, limb_angles
from fba.rotations import apply, axis_matrices
from fba.sampling import smoothstep

_ROUNDS = 4
"""Rounds in which the roll of the subtalar joint and the turn of the foot settle."""
_RISEN = np.sin(np.radians(12.0))
"""Sine of the pitch of a foot whose heel is well off the ground."""


@dataclass(frozen=True, eq=False)
class Footing:
    """One foot over T frames: turn (T, 3, 3), and position of its subtalar joint (T, 3), metres."""

    turn: Float64
    subtalar: Float64


@dataclass(frozen=True, eq=False)
class Leg:
    """Poses of one leg over T frames, float64.

    thigh: (T, 3, 3) rotation in the world. bend: (T,) of the knee, radians. foot: (T, 3, 3) rotation of the
    foot.
    """

    thigh: Float64
    bend: Float64
    foot: Float64

    def ankle(self) -> tuple[Float64, Float64, Float64]:
        """Return ankle flexion about x, twisting about y, and the subtalar joint's roll about z, radians."""
        shin = self.thigh @ axis_matrices(0, self.bend)
        return foot_angles(np.swapaxes(shin, -1, -2) @ self.foot)


def foot_turn(pitch: Float64, yaw: Float64 | float) -> Float64:
    """Return the rotation of a foot whose toes are raised by pitch and turned by yaw (about +y), radians."""
    return axis_matrices(1, np.broadcast_to(yaw, pitch.shape)) @ axis_matrices(0, -pitch)


def place_standing_foot(side: Side, footprint: Float64, pitch: Float64, yaw: float) -> Footing:
    """Return the poses of a foot on the ground.

    footprint: (T, 3), the point on the ground (y = 0) below the ankle's centre while the foot is flat.
    pitch: (T,), yaw: radians.
    """
    turn, flat = foot_turn(pitch, yaw), axis_matrices(1, yaw)
    level = footprint + (0.0, side.ankle[1], 0.0) + flat @ side.subtalar
    on_heel = level + flat @ side.heel - apply(turn, side.heel)
    on_toes = level + flat @ side.toe - apply(turn, side.toe)
    return Footing(turn, np.where(pitch[..., None] > 0.0, on_heel, on_toes))


def ankle_position(side: Side, footing: Footing, roll: Float64 | float = 0.0) -> Float64:
    """Return (T, 3) position of the ankle above a foot, for a roll of the subtalar joint, metres."""
    shape = footing.subtalar.shape[:-1]
    turn = footing.turn @ axis_matrices(2, -np.broadcast_to(roll, shape))
    return footing.subtalar - apply(turn, side.subtalar)


def solve_leg(side: Side, hip: Float64, footing: Footing, knee_yaw: float, level_roll: float = 0.0) -> Leg:
    """Return the leg from a hip (T, 3) to a foot. knee_yaw: direction of the knee about +y, radians.

    The ankle rolls with the shin, the foot does not. So that neither heel nor ball moves, a flat foot turns a
    little about the metatarsal joint: not at all where the roll is level_roll, and less as the heel rises.
    """
    roll: Float64 | float = 0.0
    adjusted = footing
    down = smoothstep(1.0 + footing.turn[..., 1, 2] / _RISEN)
    joint = footing.subtalar + apply(footing.turn, side.toe)
    for _ in range(_ROUNDS):  # the roll of the subtalar joint moves ankle and heel, each time by less
        thigh, bend = side.leg.solve(ankle_position(side, adjusted, roll) - hip, knee_yaw)
        leg = Leg(thigh, bend, adjusted.turn)
        _, _, roll = leg.ankle()
        aside = side.heel[1] / (side.toe[2] - side.heel[2]) * (np.sin(roll) - np.sin(level_roll))
        turn = axis_matrices(1, down * aside) @ footing.turn
        adjusted = Footing(turn, joint - apply(turn, side.toe))
    return leg


def place_swinging_foot(side: Side, hip: Float64, thigh: Float64, bend: Float64, foot: Float64) -> Footing:
    """Return the poses of a foot with rotation (T, 3, 3) at the end of a given hip, thigh and knee."""
    shin = thigh @ axis_matrices(0, bend)
    angles = foot_angles(np.swapaxes(shin, -1, -2) @ foot)
    ankle = shin @ axis_matrices(0, angles[0]) @ axis_matrices(1, angles[1])
    end = hip + apply(thigh, side.leg.upper) + apply(shin, side.leg.lower)
    return Footing(foot, end + apply(ankle, side.subtalar))


def lowest_height(side: Side, footing: Footing, toes: Float64 | float = 0.0) -> Float64:
    """Return (T,) height of the lowest of heel, ball and tip of the toes, metres. toes: bend up, radians."""
    heel = footing.subtalar + apply(footing.turn, side.heel)
    joint = footing.subtalar + apply(footing.turn, side.toe)
    bent = footing.turn @ axis_matrices(0, -np.broadcast_to(toes, footing.subtalar.shape[:-1]))
    ball = joint + apply(footing.turn, side.tip * (0.0, 1.0, 0.0))
    tip = joint + apply(bent, side.tip)
    return np.minimum(np.minimum(heel[..., 1], ball[..., 1]), tip[..., 1])


def hip_angles(pelvis: Float64, thigh: Float64) -> tuple[Float64, Float64, Float64]:
    """Return angles (x, y, z) of the hip, radians, between pelvis and thigh, both (T, 3, 3) in the world."""
    return limb_angles(np.swapaxes(pelvis, -1, -2) @ thigh)


def hip_position(
    side: Side, pelvis_centre: Float64, root: Float64, lean: Float64, pelvis: Float64
) -> Float64:
    """Return (T, 3) position of a hip, metres.

    root: (T, 3), its centre. lean: (T, 3, 3), its rotation. pelvis: (T, 3, 3), rotation relative to it.
    """
    local = pelvis_centre + apply(pelvis, side.hip - pelvis_centre)
    return root + apply(lean, local)


def hip_height(side: Side, hip: Float64, ankle: Float64, bend: Float64) -> Float64:
    """Return (T,) height of the hip above the ground, metres, at which the leg to the ankle has that bend."""
    gap = hip - ankle
    rest = np.square(side.leg.length(bend)) - np.square(gap[..., 0]) - np.square(gap[..., 2])
    return np.asarray(ankle[..., 1] + np.sqrt(np.maximum(rest, 1e-6)))

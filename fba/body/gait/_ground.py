"""Positions of standing feet, and the legs that reach them.

A foot lands on its heel, lies flat, and rises over the metatarsal joint while the toes stay flat: what
touches does not move. The digest corrects for ground and slip by moving the root (2.5, steps 3 and 4);
so does the `plan`. What that leaves open, two feet on the ground at once, is closed here, by the legs.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.arrays import Float64
from fba.body.gait._anatomy import Side
from fba.body.gait._joint_angles import foot_angles, limb_angles
from fba.easing import smoothstep
from fba.rotations import apply, axis_matrices

TOE_OFF = 0.6
"""Fraction of the cycle at which a foot leaves the ground."""
_ROUNDS = 4
_RISEN = np.sin(np.radians(12.0))
"""Sine of the pitch of a foot whose heel is well off the ground."""


@dataclass(frozen=True, eq=False)
class Footing:
    """Frames of one foot. Float64.

    turn: (T, 3, 3) rotation of the foot. subtalar: (T, 3) place of its joint.
    """

    turn: Float64
    subtalar: Float64


@dataclass(frozen=True, eq=False)
class Leg:
    """Frames of one leg: rotations of the thigh (T, 3, 3), in the world, and bends of the knee (T,), with
    the foot's turn (T, 3, 3), all float64."""

    thigh: Float64
    bend: Float64
    foot: Float64

    def ankle(self) -> tuple[Float64, Float64, Float64]:
        """Ankle flexion about x, twisting about y, and the subtalar joint's roll about z, radians."""
        shin = self.thigh @ axis_matrices(0, self.bend)
        return foot_angles(np.swapaxes(shin, -1, -2) @ self.foot)


def foot_turn(pitch: Float64, yaw: Float64 | float) -> Float64:
    """Rotation of a foot with its toes raised by pitch and pointing aside by yaw (about +y), radians."""
    return axis_matrices(1, np.broadcast_to(yaw, pitch.shape)) @ axis_matrices(0, -pitch)


def standing(side: Side, place: Float64, pitch: Float64, yaw: float) -> Footing:
    """A foot on the ground.

    place: (T, 3), where its ankle's centre is above when the foot is flat, y = 0. pitch: (T,).
    """
    turn, flat = foot_turn(pitch, yaw), axis_matrices(1, yaw)
    level = place + (0.0, side.ankle[1], 0.0) + flat @ side.subtalar
    on_heel = level + flat @ side.heel - apply(turn, side.heel)
    on_toes = level + flat @ side.toe - apply(turn, side.toe)
    return Footing(turn, np.where(pitch[..., None] > 0.0, on_heel, on_toes))


def ankle_place(side: Side, footing: Footing, roll: Float64 | float = 0.0) -> Float64:
    """(T, 3), where the ankle is that carries a foot, turned back by the subtalar joint's roll."""
    shape = footing.subtalar.shape[:-1]
    turn = footing.turn @ axis_matrices(2, -np.broadcast_to(roll, shape))
    return footing.subtalar - apply(turn, side.subtalar)


def reach(side: Side, hip: Float64, footing: Footing, knee_yaw: float, level_roll: float = 0.0) -> Leg:
    """The leg from a hip (T, 3) to a foot. knee_yaw: where the knee points, about +y, radians.

    The heel hangs on the ankle, which rolls with the shin where the foot does not. So that neither heel nor
    ball leaves its place, a flat foot turns a little about the metatarsal joint: by nothing where that roll
    is level_roll, and less as the heel rises.
    """
    roll: Float64 | float = 0.0
    held = footing
    down = smoothstep(1.0 + footing.turn[..., 1, 2] / _RISEN)
    joint = footing.subtalar + apply(footing.turn, side.toe)
    for _ in range(_ROUNDS):  # the subtalar joint's roll moves ankle and heel, by less each time
        thigh, bend = side.leg.solve(ankle_place(side, held, roll) - hip, knee_yaw)
        leg = Leg(thigh, bend, held.turn)
        _, _, roll = leg.ankle()
        aside = side.heel[1] / (side.toe[2] - side.heel[2]) * (np.sin(roll) - np.sin(level_roll))
        turn = axis_matrices(1, down * aside) @ footing.turn
        held = Footing(turn, joint - apply(turn, side.toe))
    return leg


def hanging(side: Side, hip: Float64, thigh: Float64, bend: Float64, foot: Float64) -> Footing:
    """The foot (turned so in the world, (T, 3, 3)) of a leg from the hip with given thigh and knee."""
    shin = thigh @ axis_matrices(0, bend)
    angles = foot_angles(np.swapaxes(shin, -1, -2) @ foot)
    ankle = shin @ axis_matrices(0, angles[0]) @ axis_matrices(1, angles[1])
    at = hip + apply(thigh, side.leg.upper) + apply(shin, side.leg.lower)
    return Footing(foot, at + apply(ankle, side.subtalar))


def lowest(side: Side, footing: Footing, toes: Float64 | float = 0.0) -> Float64:
    """(T,), height of the lowest of heel, ball and tip of the toes; toes: bent up by so much, radians."""
    heel = footing.subtalar + apply(footing.turn, side.heel)
    joint = footing.subtalar + apply(footing.turn, side.toe)
    bent = footing.turn @ axis_matrices(0, -np.broadcast_to(toes, footing.subtalar.shape[:-1]))
    ball = joint + apply(footing.turn, side.tip * (0.0, 1.0, 0.0))
    tip = joint + apply(bent, side.tip)
    result: Float64 = np.minimum(np.minimum(heel[..., 1], ball[..., 1]), tip[..., 1])
    return result


def hip_angles(pelvis: Float64, thigh: Float64) -> tuple[Float64, Float64, Float64]:
    """Angles about x, y, z of the hip between pelvis and thigh, both in the world: as the pelvis turns one
    way, they turn the other, and the leg keeps its direction."""
    return limb_angles(np.swapaxes(pelvis, -1, -2) @ thigh)


def hip_place(side: Side, pelvis_centre: Float64, root: Float64, lean: Float64, pelvis: Float64) -> Float64:
    """(T, 3), where a hip is. root: (T, 3), its centre; lean: (T, 3, 3), its rotation; pelvis: in it."""
    local = pelvis_centre + apply(pelvis, side.hip - pelvis_centre)
    return root + apply(lean, local)


def hip_height(side: Side, hip: Float64, ankle: Float64, bend: Float64) -> Float64:
    """(T,), height of the hip over the ground at which the leg to the ankle has that bend."""
    gap = hip - ankle
    rest = np.square(side.leg.length(bend)) - np.square(gap[..., 0]) - np.square(gap[..., 2])
    result: Float64 = ankle[..., 1] + np.sqrt(np.maximum(rest, 1e-6))
    return result

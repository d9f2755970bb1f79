"""Elbows and knees: joints that flex and twist, but cannot abduct.

Such a hinge swings its bone in one plane only. Where the source leaves that plane, the upper bone is turned
about its own length until the plane is right, and the hinge's twist reverses that turn for the parts below:
both bones keep their directions, and so does the hand or foot. Everything is an array over frames.

With the twist tau - phi of the hinge, a turn phi leaves an error c0 + c1 cos phi + c2 sin phi of the lower
bone's direction, sideways, which is zero for two phi: with one the hinge bends the natural way, with one the
other way. If the limb is almost straight, the error is small for all phi. `fba.capture._limbs._hinge_path`
finds a path of small errors that bends the natural way and does not jump.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba import rotations
from fba.arrays import Float64
from fba.capture._limbs._hinge_path import follow
from fba.capture._limbs.bone_ik import aim

STIFF = 0.3
"""Weight of the computed twists relative to the lower bone's direction, in the last step: a limb that is bent
by much less than this (radians) keeps them, so that it does not spin when its plane does."""
LOOSE = 2e-3
"""The same for flexion."""
CLEAR_BEND = 0.3
"""Angle in radians above which a bend shows the hinge's direction; less may be a little beyond straight."""
ABRUPT = 0.4
"""Radians from one frame to the next: if the source turns faster, the result may turn faster, too."""


@dataclass(frozen=True, eq=False)
class Hinge:
    """A hinge in the default posture.

    upper, lower: unit (3,), directions of the bones. flexion, twist: unit (3,), signed axes of the hinge,
    flexion outermost. natural: +1 if it bends by positive flexion, -1 if by negative.
    """

    upper: Float64
    lower: Float64
    flexion: Float64
    twist: Float64
    natural: float


def solve(hinge: Hinge, direction: Float64, local: Float64, rate: float) -> Float64:
    """Return angles (T, 3): turn about the upper bone, flexion, twist.

    direction: (T, 3), local: (T, 3, 3), target direction and rotation of the lower bone, both in the frame of
    the upper bone before it is turned. rate: frames per second. The direction has priority.
    """
    total = turn_about(local, hinge.twist)
    along = 1.0 if hinge.upper @ hinge.twist > 0 else -1.0
    turn = _turn(hinge, direction, total, along, rate)

    flexion = _flexion(hinge, direction, turn, total - along * turn)
    remains = rotations.turn(hinge.flexion, -flexion) @ rotations.turn(hinge.upper, -turn) @ local
    twist = total - along * turn
    exact = turn_about(remains, hinge.twist)
    twist = twist + np.angle(np.exp(1j * (exact - twist)))
    start = np.stack([turn, flexion, twist], axis=1)
    axes = np.stack([hinge.upper, hinge.flexion, hinge.twist])
    return aim(axes, start, hinge.lower, direction, np.array([STIFF, LOOSE, STIFF]))


def turn_about(rotation: Float64, axis: Float64) -> Float64:
    """Return angles (T,), without jumps, of the turn about an axis that comes closest to each rotation."""
    m = rotation
    vector = np.stack([m[:, 2, 1] - m[:, 1, 2], m[:, 0, 2] - m[:, 2, 0], m[:, 1, 0] - m[:, 0, 1]], axis=1)
    along = np.einsum("i,tij,j->t", axis, m, axis)
    trace = np.trace(m, axis1=1, axis2=2)
    return _centred(np.unwrap(np.arctan2(vector @ axis, trace - along)))


def _centred(angle: Float64) -> Float64:
    """Return angles (T,), shifted by a multiple of full turns so that their median is close to 0."""
    return angle - 2 * np.pi * np.rint(np.median(angle) / (2 * np.pi)) if len(angle) else angle


def _turn(hinge: Hinge, direction: Float64, total: Float64, along: float, rate: float) -> Float64:
    """Return turns (T,) of the upper bone that bring the hinge's plane close to its target, without jumps."""
    a, h, y, d = hinge.upper, hinge.flexion, hinge.twist, hinge.lower
    # sideways part of the wanted direction, seen from the turned upper bone, less that of the lower bone
    constant = direction @ a * (a @ h)
    straight, across = d @ h, np.cross(y, d) @ h
    cosine = direction @ (h - a * (a @ h)) - (np.cos(total) * straight + np.sin(total) * across)
    sine = direction @ np.cross(a, h) - along * (np.sin(total) * straight - np.cos(total) * across)
    sideways = np.stack([constant, cosine, sine], axis=1)
    side = np.cross(h, d) * hinge.natural
    flat = direction @ a * (a @ side)
    natural = np.stack([flat, direction @ side - flat, direction @ np.cross(a, side)], axis=1)

    # the usual turn is the one with which clear bends are natural
    reach = np.hypot(natural[:, 1], natural[:, 2])
    sure = np.where(reach > CLEAR_BEND, natural[:, 1] + 1j * natural[:, 2], 0.0).sum()
    swing = np.linalg.norm(np.diff(direction, axis=0, prepend=direction[:1]), axis=1)
    ease = 1 / (1 + (swing / ABRUPT) ** 2) ** 2
    path = np.zeros(len(direction))
    follow(sideways, natural, ease, float(np.angle(sure + 1e-9)), 1 / rate, path)
    return _centred(path)


def _flexion(hinge: Hinge, direction: Float64, turn: Float64, twist: Float64) -> Float64:
    """Return the flexion (T,) that brings the twisted lower bone closest to its direction."""
    wanted = (rotations.turn(hinge.upper, -turn) @ direction[:, :, None])[:, :, 0]
    bone = rotations.turn(hinge.twist, twist) @ hinge.lower
    sine = np.cross(bone, wanted) @ hinge.flexion
    cosine = np.einsum("ti,ti->t", bone, wanted) - (bone @ hinge.flexion) * (wanted @ hinge.flexion)
    result: Float64 = np.arctan2(sine, cosine)
    return result

"""Elbows and knees: joints that flex and twist, but cannot abduct.

Such a hinge swings its bone in one plane only. Where the source does more, the upper bone is turned
about its own length until the plane is right, and the hinge's twist takes that turn back for what
hangs below: both bones keep their directions, and the hand or foot keeps its own. Everything is an
array over frames.

The turn phi is found in closed form: with the twist tau - phi of the hinge, the sideways part of the
lower bone's direction is c0 + c1 cos phi + c2 sin phi, which is zero for two phi: one bends the hinge the
natural way, one the other way. `fba.capture.branches` picks one of them for each frame.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fba.capture import rotations
from fba.capture.aiming import aim, product
from fba.capture.branches import choose

Float = npt.NDArray[np.float64]
Complex = npt.NDArray[np.complex128]

STRAIGHT = 0.09
"""Where the twist changes the lower bone's direction by less than this (radians), it follows its
neighbours in time rather than the direction. Also the weight of the preferred twists against the direction: a
limb bent sideways by less than this is straightened, by up to 5 degrees, instead of twisted half round."""
FIRM = 0.03
"""From this much on, a sudden change of twist would be seen."""
CLEAR_BEND = 0.3
"""From this angle on, a bend shows which way the hinge opens; less may be a little beyond straight."""
NEIGHBOURHOOD = 0.2
"""Seconds over which neighbours in time are asked."""
PATIENCE = 0.3
"""Seconds for which a limb may bend the wrong way before a sudden half turn is the lesser evil."""


@dataclass(frozen=True, eq=False)
class Hinge:
    """A hinge in the default posture.

    upper, lower: unit (3,), directions of the bones. flexion, twist: unit (3,), signed axes of the hinge,
    flexion outermost. natural: +1 where it bends by positive flexion, -1 by negative.
    """

    upper: Float
    lower: Float
    flexion: Float
    twist: Float
    natural: float


def solve(hinge: Hinge, direction: Float, local: Float, rate: float) -> Float:
    """Angles (T, 3): turn about the upper bone, flexion, twist.

    direction: (T, 3), wanted for the lower bone, and local: (T, 3, 3), wanted rotation of the lower bone,
    both in the frame of the upper bone before it is turned. Direction comes first.
    """
    total = turn_about(local, hinge.twist)
    along = 1.0 if hinge.upper @ hinge.twist > 0 else -1.0
    twists, reach = _roots(hinge, direction, total, along)
    flexions = np.stack(
        [_flexion(hinge, direction, twists[:, k], total - along * twists[:, k]) for k in (0, 1)], 1
    )
    turn = _path(twists, flexions * hinge.natural, reach, rate)

    flexion = _flexion(hinge, direction, turn, total - along * turn)
    remains = rotations.turn(hinge.flexion, -flexion) @ rotations.turn(hinge.upper, -turn) @ local
    twist = total - along * turn
    exact = turn_about(remains, hinge.twist)
    twist = twist + np.angle(np.exp(1j * (exact - twist)))
    start = np.stack([turn, flexion, twist], axis=1)
    axes = np.stack([hinge.upper, hinge.flexion, hinge.twist])
    return aim(axes, start, hinge.lower, direction, np.array([STRAIGHT, STRAIGHT * 0.02, STRAIGHT]))


def matrices(hinge: Hinge, angles: Float) -> tuple[Float, Float]:
    """Rotations (T, 3, 3): the turn of the upper bone, and that of the hinge."""
    return rotations.turn(hinge.upper, angles[:, 0]), product(
        np.stack([hinge.flexion, hinge.twist]), angles[:, 1:]
    )


def turn_about(rotation: Float, axis: Float) -> Float:
    """Angles (T,), without jumps, of the turn about an axis that comes closest to each rotation."""
    m = rotation
    vector = np.stack([m[:, 2, 1] - m[:, 1, 2], m[:, 0, 2] - m[:, 2, 0], m[:, 1, 0] - m[:, 0, 1]], axis=1)
    along = np.einsum("i,tij,j->t", axis, m, axis)
    trace = np.trace(m, axis1=1, axis2=2)
    return _centred(np.unwrap(np.arctan2(vector @ axis, trace - along)))


def _centred(angle: Float) -> Float:
    """Moved by whole turns as a whole, to lie around 0."""
    return angle - 2 * np.pi * np.rint(np.median(angle) / (2 * np.pi)) if len(angle) else angle


def _roots(hinge: Hinge, direction: Float, total: Float, along: float) -> tuple[Float, Float]:
    """Both turns (T, 2) that leave nothing sideways, and by how much a turn moves the sideways part (T,)."""
    a, h, y, d = hinge.upper, hinge.flexion, hinge.twist, hinge.lower
    # sideways part of the wanted direction, seen from the turned upper bone, less that of the lower bone
    constant = direction @ a * (a @ h)
    straight, across = d @ h, np.cross(y, d) @ h
    cosine = direction @ (h - a * (a @ h)) - (np.cos(total) * straight + np.sin(total) * across)
    sine = direction @ np.cross(a, h) - along * (np.sin(total) * straight - np.cos(total) * across)
    reach = np.hypot(cosine, sine)
    middle = np.arctan2(sine, cosine)
    half = np.arccos(np.clip(-constant / np.maximum(reach, 1e-12), -1.0, 1.0))
    return np.stack([middle + half, middle - half], axis=1), reach


def _flexion(hinge: Hinge, direction: Float, turn: Float, twist: Float) -> Float:
    """Flexion (T,) that brings the twisted lower bone closest to its direction."""
    wanted = (rotations.turn(hinge.upper, -turn) @ direction[:, :, None])[:, :, 0]
    bone = rotations.turn(hinge.twist, twist) @ hinge.lower
    sine = np.cross(bone, wanted) @ hinge.flexion
    cosine = np.einsum("ti,ti->t", bone, wanted) - (bone @ hinge.flexion) * (wanted @ hinge.flexion)
    result: Float = np.arctan2(sine, cosine)
    return result


def _path(twists: Float, bends: Float, reach: Float, rate: float) -> Float:
    """One turn a frame, (T,), without needless jumps. bends: (T, 2), positive the natural way."""
    frames = np.arange(len(twists))
    best = np.argmax(bends, axis=1)
    clear = bends[frames, best] > CLEAR_BEND
    sure = np.where(clear, reach * reach, 0.0) * np.exp(1j * twists[frames, best])
    anchor = _direction(np.array([sure.sum() + 1e-9]))[0]  # 1 where nothing is known: the source's own twist
    usual = np.unwrap(np.angle(_direction(_smoothed(sure, NEIGHBOURHOOD * rate) + 1e-4 * anchor)))
    chosen = np.zeros(len(twists), dtype=np.int64)
    firm = np.minimum(1.0, (reach / FIRM) ** 2)
    choose(twists, np.maximum(0.0, -bends), firm, usual, 1 / rate, CLEAR_BEND, PATIENCE, chosen)
    vote = reach * reach * np.exp(1j * twists[frames, chosen])
    around = _direction(_smoothed(vote, NEIGHBOURHOOD * rate) + STRAIGHT * STRAIGHT * np.exp(1j * usual))
    return _centred(np.unwrap(np.angle(vote + STRAIGHT * STRAIGHT * around)))


def _direction(values: Complex) -> Complex:
    size = np.abs(values)
    return np.where(size > 1e-12, values / np.maximum(size, 1e-12), 1.0)


def _smoothed(values: Complex, width: float) -> Complex:
    """Moving average, three times over: close to a bell curve of this standard deviation, in frames."""
    half = max(1, round(width))
    for _ in range(3):
        sums = np.concatenate([[0.0], np.cumsum(np.pad(values, half, mode="edge"))])
        values = (sums[2 * half + 1 :] - sums[: -2 * half - 1]) / (2 * half + 1)
    return values

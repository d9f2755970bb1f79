"""Elbows and knees: joints that flex and twist, but cannot abduct.

Such a hinge swings its bone in a single plane. Where the source leaves that plane, the upper bone is turned
about its length until the plane is right, and the hinge's twist reverses that turn for the parts below: both
bones keep their directions, and so does the hand or foot. All quantities are arrays over frames.

With the twist tau - phi of the hinge, a turn phi leaves a sideways error c0 + c1 cos phi + c2 sin phi of the
lower bone's direction, which is zero for two phi: the hinge bends naturally with the first, and the wrong way
with the second. If the limb is almost straight, the error is small for all phi.

If a limb is bent, the plane of its hinge determines the turn; if it is almost straight, the plane is
uncertain and may spin within a frame. So the path over all frames is optimised at once. It costs to miss the
target direction, to bend the wrong way and to turn fast. Dynamic programming finds the best path over a grid
of turns, then Newton's method improves it between the values of the grid.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fba import rotations
from fba.arrays import Float64, UInt8
from fba.capture._limbs._coupled_paths import chain
from fba.capture._limbs.bone_ik import aim
from fba.compiled import compiled

TWIST_WEIGHT = 0.3
"""Weight of the computed twists in the last step, relative to that of the lower bone's direction: a limb that
is bent by much less than this (radians) keeps them, so that it does not spin when its plane does."""
FLEXION_WEIGHT = 2e-3
"""The same for flexion."""
MIN_BEND = 0.3
"""Smallest bend, in radians, that shows the hinge's direction: less may be a little beyond straight."""
ABRUPT_STEP = 0.4
"""Turn of the source from frame to frame, in radians, above which the result may also turn fast."""

STATES = 48
"""Values of the grid: every 7.5 degrees."""
TURN = 2.0 * math.pi
SIDEWAYS_ERROR = 0.03
"""Sideways error, in radians, that costs 1 per second."""
STEEP_ERROR = 0.05
"""Error, in radians, that costs another 1 per second. The cost grows by the sixth power, which keeps errors
below 5 degrees."""
WRONG_BEND = 0.6
"""Bend the wrong way, in radians, that costs 1 per second: makers overstretch limbs a little, and half a turn
about the bone costs more than 20 degrees."""
TURNING_SPEED = 2.0
"""Speed of turning, in radians per second, that costs 1 per second."""
USUAL_DISTANCE = 5.0
"""Distance from the usual turn, in radians, that costs 1 per second."""
FRAMES_PER_CALL = 1024
"""Frames whose costs are in memory at once."""
MAX_ITERATIONS = 12
"""Largest number of iterations of Newton's method."""
MAX_STEP = 0.2
"""Largest change of a turn in one iteration, in radians."""
MAX_CHANGE = 1e-4
"""Change in radians below which the iteration ends."""


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
    return aim(axes, start, hinge.lower, direction, np.array([TWIST_WEIGHT, FLEXION_WEIGHT, TWIST_WEIGHT]))


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

    # with the usual turn, clear bends are natural
    reach = np.hypot(natural[:, 1], natural[:, 2])
    sure = np.where(reach > MIN_BEND, natural[:, 1] + 1j * natural[:, 2], 0.0).sum()
    swing = np.linalg.norm(np.diff(direction, axis=0, prepend=direction[:1]), axis=1)
    ease = 1 / (1 + (swing / ABRUPT_STEP) ** 2) ** 2
    path = np.zeros(len(direction))
    _follow(sideways, natural, ease, float(np.angle(sure + 1e-9)), 1 / rate, path)
    return _centred(path)


def _flexion(hinge: Hinge, direction: Float64, turn: Float64, twist: Float64) -> Float64:
    """Return the flexion (T,) that brings the twisted lower bone closest to its direction."""
    wanted = (rotations.turn(hinge.upper, -turn) @ direction[:, :, None])[:, :, 0]
    bone = rotations.turn(hinge.twist, twist) @ hinge.lower
    sine = np.cross(bone, wanted) @ hinge.flexion
    cosine = np.einsum("ti,ti->t", bone, wanted) - (bone @ hinge.flexion) * (wanted @ hinge.flexion)
    result: Float64 = np.arctan2(sine, cosine)
    return result


def _cost(sideways: Float64, natural: Float64, away: Float64) -> Float64:
    """Return the cost per second of each state: see the constants above."""
    square = (sideways / STEEP_ERROR) ** 2
    cost = (sideways / SIDEWAYS_ERROR) ** 2 + square * square * square  # powers are many times slower
    return cost + (np.minimum(natural, 0.0) / WRONG_BEND) ** 2 + (away / USUAL_DISTANCE) ** 2


def _follow(
    sideways: Float64, natural: Float64, ease: Float64, usual: float, period: float, path: Float64
) -> None:
    """Fill path, float64 (T,): turns in radians, without jumps of full turns.

    sideways, natural: (T, 3), a of a . (1, cos turn, sin turn), which is how far the target direction is off
    the hinge's plane, and how far on the side that the hinge bends to. ease: (T,), 1 or less, factor of the
    cost of turning since the frame before. usual: the turn without any other cost. period: seconds per frame.
    IndexError for arrays of other lengths.
    """
    if not len(sideways) == len(natural) == len(ease) == len(path):
        raise IndexError("a hinge's arrays have different lengths")
    path[:] = _best_on_grid(sideways, natural, ease, usual, period)
    centre = usual + TURN * math.floor((float(np.median(path)) - usual) / TURN + 0.5)
    _refine(sideways, natural, ease, centre, period, path)


def _best_on_grid(sideways: Float64, natural: Float64, ease: Float64, usual: float, period: float) -> Float64:
    """Return the best path (T,) over the grid, by dynamic programming; arguments as of `_follow`."""
    states = np.arange(STATES)
    turns = states * (TURN / STATES)
    waves = np.stack([np.ones(STATES), np.cos(turns), np.sin(turns)])
    away = np.mod(turns - usual + math.pi, TURN) - math.pi
    change = (np.minimum(states, STATES - states) * (TURN / STATES) / TURNING_SPEED) ** 2 / period
    best, twice = np.zeros(STATES), np.zeros(2 * STATES)
    origin = np.zeros((len(ease), STATES), dtype=np.uint8)
    for start in range(0, len(ease), FRAMES_PER_CALL):
        part = slice(start, start + FRAMES_PER_CALL)
        cost = period * _cost(sideways[part] @ waves, natural[part] @ waves, away)
        _search(cost, ease[part], change, twice, best, origin[part])
    path = np.empty(len(ease), dtype=np.int64)
    state = int(best.argmin())
    for t in range(len(ease) - 1, -1, -1):
        path[t] = state
        state = (state + int(origin[t, state])) % STATES
    return np.asarray(np.unwrap(path, period=STATES) * (TURN / STATES))


@compiled
def _search(
    cost: Float64, ease: Float64, change: Float64, twice: Float64, best: Float64, origin: UInt8
) -> None:
    """Add cost (T, STATES) to that of the best way to each state, best (STATES,), frame after frame.

    origin (T, STATES): how many states further each state's predecessor is. change (STATES,): cost of such a
    step. twice: scratch. Bounds: `_best_on_grid` makes all arrays; states and shifts are below STATES, so
    that their sum is below 2 STATES.
    """
    for t in range(len(cost)):
        for state in range(STATES):
            twice[state] = twice[state + STATES] = best[state]
            best[state] = math.inf
        for shift in range(STATES):
            step = ease[t] * change[shift]
            for state in range(STATES):
                total = twice[state + shift] + step
                if total < best[state]:
                    best[state] = total
                    origin[t, state] = shift
        for state in range(STATES):
            best[state] += cost[t, state]


def _refine(
    sideways: Float64, natural: Float64, ease: Float64, centre: float, period: float, path: Float64
) -> None:
    """Improve path by Newton's method, whose equations couple each frame with its neighbours only.

    centre: the usual turn plus the number of full turns that brings it closest to the path.
    """
    bonds = 2.0 / (TURNING_SPEED * TURNING_SPEED * period) * ease[1:]
    move = np.zeros(len(path))
    for _ in range(MAX_ITERATIONS):
        c, s = np.cos(path), np.sin(path)
        missed = sideways[:, 0] + sideways[:, 1] * c + sideways[:, 2] * s
        slope = sideways[:, 2] * c - sideways[:, 1] * s
        bent = np.minimum(natural[:, 0] + natural[:, 1] * c + natural[:, 2] * s, 0.0)
        bending = np.where(bent < 0.0, natural[:, 2] * c - natural[:, 1] * s, 0.0)
        steep = ((missed / STEEP_ERROR) ** 2 / STEEP_ERROR) ** 2
        pull = missed * slope * (2.0 / SIDEWAYS_ERROR**2 + 6.0 * steep)
        pull += 2.0 / WRONG_BEND**2 * bent * bending + 2.0 / USUAL_DISTANCE**2 * (path - centre)
        curve = slope * slope * (2.0 / SIDEWAYS_ERROR**2 + 30.0 * steep)
        curve += 2.0 / WRONG_BEND**2 * bending * bending + 2.0 / USUAL_DISTANCE**2
        weights, right = period * curve, -period * pull
        difference = bonds * np.diff(path)
        right[1:] -= difference
        right[:-1] += difference
        chain(weights, bonds, right, move)
        path += np.clip(move, -MAX_STEP, MAX_STEP)
        if np.abs(move).max(initial=0.0) < MAX_CHANGE:
            break

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
from fba.arrays import Float64
from fba.capture._limbs._coupled_paths import chain
from fba.capture._limbs.bone_ik import aim
from fba.compiled import compiled, inlined

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


@inlined
def _cost(sideways: float, natural: float, away: float) -> float:
    """Return the cost per second: see the constants above."""
    wrong = max(0.0, -natural) / WRONG_BEND
    square = (sideways / STEEP_ERROR) ** 2
    return (
        (sideways / SIDEWAYS_ERROR) ** 2
        + square * square * square
        + wrong * wrong
        + (away / USUAL_DISTANCE) ** 2
    )


@inlined
def _away(turn: float, usual: float) -> float:
    """Return the distance from the usual turn, in -pi..pi."""
    difference = turn - usual
    return difference - TURN * math.floor(difference / TURN + 0.5)


def _follow(
    sideways: Float64, natural: Float64, ease: Float64, usual: float, period: float, path: Float64
) -> None:
    """Fill path, float64 (T,): turns in radians, without jumps of full turns.

    sideways, natural: (T, 3), a of a . (1, cos turn, sin turn), which is how far the target direction is off
    the hinge's plane, and how far on the side that the hinge bends to. ease: (T,), 1 or less, factor of the
    cost of turning since the frame before. usual: the turn without any other cost. period: seconds per frame.
    IndexError for arrays of other lengths.

    Bounds of the loops: with these lengths, frames are places in all arrays; states are below STATES, and
    shifts as well, so that their sum is below 2 STATES.
    """
    if not len(sideways) == len(natural) == len(ease) == len(path):
        raise IndexError("a hinge's arrays have different lengths")
    _search(sideways, natural, ease, usual, period, path)
    centre = usual + TURN * math.floor((float(np.median(path)) - usual) / TURN + 0.5)
    _refine(sideways, natural, ease, centre, period, path)


@compiled
def _search(
    sideways: Float64, natural: Float64, ease: Float64, usual: float, period: float, path: Float64
) -> None:
    """Fill path with the best one over the grid: dynamic programming. Bounds: see `_follow`."""
    count = path.shape[0]
    step = TURN / STATES
    sines = np.zeros(STATES)
    cosines = np.zeros(STATES)
    away = np.zeros(STATES)
    change = np.zeros(STATES)
    for state in range(STATES):
        sines[state] = math.sin(state * step)
        cosines[state] = math.cos(state * step)
        away[state] = _away(state * step, usual)
        steps = min(state, STATES - state)
        change[state] = (steps * step / TURNING_SPEED) ** 2 / period
    origin = np.zeros((count, STATES), dtype=np.uint8)
    cost = np.zeros(STATES)
    twice = np.zeros(2 * STATES)
    best = np.zeros(STATES)
    for t in range(count):
        if t > 0:
            for state in range(STATES):
                twice[state] = cost[state]
                twice[state + STATES] = cost[state]
                best[state] = math.inf
            for shift in range(STATES):
                for state in range(STATES):
                    total = float(twice[state + shift]) + float(ease[t]) * float(change[shift])
                    if total < best[state]:
                        best[state] = total
                        origin[t, state] = shift
        for state in range(STATES):
            c = cosines[state]
            s = sines[state]
            missed = sideways[t, 0] + sideways[t, 1] * c + sideways[t, 2] * s
            bent = natural[t, 0] + natural[t, 1] * c + natural[t, 2] * s
            cost[state] = best[state] + period * _cost(missed, bent, float(away[state]))
    state = int(np.argmin(cost))
    for t in range(count - 1, -1, -1):
        path[t] = state * step
        state = (state + int(origin[t, state])) % STATES
    for t in range(1, count):
        path[t] = path[t - 1] + _away(path[t], path[t - 1])


@compiled
def _refine(
    sideways: Float64, natural: Float64, ease: Float64, centre: float, period: float, path: Float64
) -> None:
    """Improve path by Newton's method, whose equations couple each frame with its neighbours only.

    centre: the usual turn plus the number of full turns that brings it closest to the path. Bounds: see
    `follow`.
    """
    count = path.shape[0]
    stiff = 2.0 / (TURNING_SPEED * TURNING_SPEED * period)
    weights = np.zeros(count)
    right = np.zeros(count)
    move = np.zeros(count)
    bonds = stiff * ease[1:]
    for _ in range(MAX_ITERATIONS):
        for t in range(count):
            c = math.cos(path[t])
            s = math.sin(path[t])
            missed = sideways[t, 0] + sideways[t, 1] * c + sideways[t, 2] * s
            slope = sideways[t, 2] * c - sideways[t, 1] * s
            bent = natural[t, 0] + natural[t, 1] * c + natural[t, 2] * s
            bending = natural[t, 2] * c - natural[t, 1] * s
            square = (missed / STEEP_ERROR) ** 2
            pull = (
                2.0 * missed * slope / (SIDEWAYS_ERROR * SIDEWAYS_ERROR)
                + 6.0 * square * square * missed * slope / STEEP_ERROR**2
            )
            curve = (
                2.0 * slope * slope / (SIDEWAYS_ERROR * SIDEWAYS_ERROR)
                + 30.0 * square * square * slope * slope / STEEP_ERROR**2
            )
            if bent < 0.0:
                pull += 2.0 * bent * bending / (WRONG_BEND * WRONG_BEND)
                curve += 2.0 * bending * bending / (WRONG_BEND * WRONG_BEND)
            pull += 2.0 * (path[t] - centre) / (USUAL_DISTANCE * USUAL_DISTANCE)
            curve += 2.0 / (USUAL_DISTANCE * USUAL_DISTANCE)
            weights[t] = period * curve
            right[t] = -period * pull
            if t > 0:
                difference = path[t] - path[t - 1]
                right[t] -= bonds[t - 1] * difference
                right[t - 1] += bonds[t - 1] * difference
        chain(weights, bonds, right, move)
        largest = 0.0
        for t in range(count):
            largest = max(largest, abs(move[t]))
            path[t] += min(max(move[t], -MAX_STEP), MAX_STEP)
        if largest < MAX_CHANGE:
            break

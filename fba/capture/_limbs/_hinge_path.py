"""Find the turn of a hinge's upper bone in every frame, for `fba.capture._limbs.hinges`.

If a limb is bent, the plane of its hinge determines the turn; if it is almost straight, the plane is
uncertain and may spin within a frame. So the path over all frames is optimised at once. Costs are: missing
the target direction, bending the wrong way, turning fast. First over a grid of turns (dynamic programming,
which finds the best path), then between the grid's values (Newton's method).
"""

from __future__ import annotations

import math

import numpy as np

from fba.arrays import Float64
from fba.capture._limbs._coupled_paths import chain
from fba.compiled import compiled, inlined

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


def follow(
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
    """Fill path with the best one over the grid: dynamic programming. Bounds: see `follow`."""
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
    own = np.zeros(count)
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
            own[t] = period * curve
            right[t] = -period * pull
            if t > 0:
                difference = path[t] - path[t - 1]
                right[t] -= bonds[t - 1] * difference
                right[t - 1] += bonds[t - 1] * difference
        chain(own, bonds, right, move)
        largest = 0.0
        for t in range(count):
            largest = max(largest, abs(move[t]))
            path[t] += min(max(move[t], -MAX_STEP), MAX_STEP)
        if largest < MAX_CHANGE:
            break

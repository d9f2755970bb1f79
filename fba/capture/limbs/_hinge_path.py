"""By how much a hinge's upper bone is turned, frame by frame: the search behind `fba.capture.limbs.hinges`.

Where a limb is bent, the plane of its hinge says how; where it is almost straight, the plane means little,
and may swing round within a frame. So the whole path is sought at once: the one of least cost, where missing
the wanted direction, bending the wrong way and turning fast all cost. First over a grid of turns (dynamic
programming, which finds the best of all paths), then between the grid's lines (Newton's method).
"""

from __future__ import annotations

import math

import numpy as np

from fba.arrays import Float64
from fba.capture.limbs._coupled_paths import chain
from fba.compiled import compiled, inlined

STATES = 48
"""Lines of the grid: every 7.5 degrees."""
TURN = 2.0 * math.pi
SLACK = 0.03
"""Radians sideways that cost 1 a second."""
BOUND = 0.05
"""Radians sideways that cost as much again, by the sixth power: errors end below 5 degrees."""
WRONG = 0.15
"""Radians of bending the wrong way that cost 1 a second."""
SPEED = 2.0
"""Radians a second of turning that cost 1 a second."""
LOYAL = 7.0
"""Radians away from the usual turn that cost 1 a second."""
STEPS = 12
LEAP = 0.2
"""Radians that a turn changes by at most in a step of the second search."""
SETTLED = 1e-4


@inlined
def _cost(sideways: float, natural: float, away: float) -> float:
    """A second's cost: see the constants above."""
    wrong = max(0.0, -natural) / WRONG
    square = (sideways / BOUND) ** 2
    return (sideways / SLACK) ** 2 + square * square * square + wrong * wrong + (away / LOYAL) ** 2


@inlined
def _away(turn: float, usual: float) -> float:
    difference = turn - usual
    return difference - TURN * math.floor(difference / TURN + 0.5)


def follow(
    sideways: Float64, natural: Float64, ease: Float64, usual: float, period: float, path: Float64
) -> None:
    """Fills path, float64 (T,): turns in radians, without jumps of whole turns.

    sideways, natural: (T, 3), of the wanted direction: what is left sideways of the hinge, and how far it
    lies to the side that the hinge bends to, both as a . (1, cos turn, sin turn). ease: (T,), 1 or less,
    by which turning since the frame before costs less. usual: the turn where nothing says otherwise.
    period: seconds a frame.
    """
    _search(sideways, natural, ease, usual, period, path)
    centre = usual + TURN * math.floor((float(np.median(path)) - usual) / TURN + 0.5)
    _refine(sideways, natural, ease, centre, period, path)


@compiled
def _search(
    sideways: Float64, natural: Float64, ease: Float64, usual: float, period: float, path: Float64
) -> None:
    """Fills the path with the best one over the grid: dynamic programming."""
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
        change[state] = (steps * step / SPEED) ** 2 / period
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
    """Improves the path: Newton's method, whose equations couple each frame with its neighbours only.

    centre: the usual turn, with the number of whole turns that brings it closest to the path.
    """
    count = path.shape[0]
    stiff = 2.0 / (SPEED * SPEED * period)
    own = np.zeros(count)
    right = np.zeros(count)
    move = np.zeros(count)
    bonds = stiff * ease[1:]
    for _ in range(STEPS):
        for t in range(count):
            c = math.cos(path[t])
            s = math.sin(path[t])
            missed = sideways[t, 0] + sideways[t, 1] * c + sideways[t, 2] * s
            slope = sideways[t, 2] * c - sideways[t, 1] * s
            bent = natural[t, 0] + natural[t, 1] * c + natural[t, 2] * s
            bending = natural[t, 2] * c - natural[t, 1] * s
            square = (missed / BOUND) ** 2
            pull = 2.0 * missed * slope / (SLACK * SLACK) + 6.0 * square * square * missed * slope / BOUND**2
            curve = 2.0 * slope * slope / (SLACK * SLACK) + 30.0 * square * square * slope * slope / BOUND**2
            if bent < 0.0:
                pull += 2.0 * bent * bending / (WRONG * WRONG)
                curve += 2.0 * bending * bending / (WRONG * WRONG)
            pull += 2.0 * (path[t] - centre) / (LOYAL * LOYAL)
            curve += 2.0 / (LOYAL * LOYAL)
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
            path[t] += min(max(move[t], -LEAP), LEAP)
        if largest < SETTLED:
            break

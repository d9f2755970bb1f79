"""Which way a hinge bends, frame by frame: the compiled search behind `fba.capture.hinges`."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from fba.compiled import compiled

Float = npt.NDArray[np.float64]

WINDINGS = 1
"""Twists are followed as far as so many whole turns to either side of the usual one."""
TURN = 2.0 * math.pi


@compiled
def choose(
    twists: Float,
    wrong: Float,
    firm: Float,
    usual: Float,
    period: float,
    clear: float,
    patience: float,
    chosen: npt.NDArray[np.int64],
) -> None:
    """Fills chosen, int64 (T,): which of the two possible twists to take in each frame.

    twists: float64 (T, 2), radians. wrong: (T, 2), angle by which the hinge then bends the unnatural way.
    firm: (T,), 0 where the limb is so straight that its twist says nothing, 1 where it is not. usual: (T,),
    twist that is usual around this frame, without jumps. The cheapest path: bending the wrong way
    costs by its angle over clear, a twist far from the usual one costs by time over patience (seconds),
    a change of twist costs by its size, and nothing counts while straight. period: seconds a frame.
    """
    count = twists.shape[0]
    turns = 2 * WINDINGS + 1
    states = 2 * turns
    origin = np.zeros((count, states), dtype=np.uint8)
    cost = np.zeros(states)
    fresh = np.zeros(states)
    twist = np.zeros(states)
    last = np.zeros(states)
    for t in range(count):
        sooner = float(firm[t - 1]) * float(firm[t]) if t > 0 else 0.0
        for state in range(states):
            root = state // turns
            away = float(twists[t, root]) - float(usual[t])
            away -= TURN * math.floor(away / TURN + 0.5)
            away += TURN * (state % turns - WINDINGS)
            twist[state] = float(usual[t]) + away
            here = float(firm[t]) * 2.0 * (away / math.pi) ** 2 + 4.0 * (float(wrong[t, root]) / clear) ** 2
            best = 0.0
            if t > 0:
                best = math.inf
                for before in range(states):
                    change = (twist[state] - last[before]) / math.pi
                    total = float(cost[before]) + sooner * 2.0 * abs(change)
                    if total < best:
                        best = total
                        origin[t, state] = before
            fresh[state] = best + here * period / patience
        for state in range(states):
            cost[state] = fresh[state]
            last[state] = twist[state]
    state = int(np.argmin(cost))
    for t in range(count - 1, -1, -1):
        chosen[t] = state // turns
        state = int(origin[t, state])

"""Speech as FAP 1: visemes in the frames where the mouth arrives at them, and visemes out of FAP 1."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from itertools import pairwise

import numpy as np

from fba.animation import Animation
from fba.arrays import Float64, Int64
from fba.speech._sounds import Shape

MOST_BLEND = 63
CLOSED = (1, 2)
"""Visemes at which the lips, or lip and teeth, meet."""
KEPT = (*CLOSED, 3)
"""Visemes that are not left out to save bits: these, and the tongue between the teeth."""
LONG = 0.22
"""Seconds from which a viseme is held: it has a key frame at its begin and at its end."""
INSET = 0.06
"""Seconds from begin and end of a held viseme to its key frames."""
APART = Fraction(7, 100)
"""Seconds between key frames; of two that are nearer, the weaker is left out."""
SHORT, WEAK = 0.08, 0.3
"""Seconds and weight up to which a viseme gives way to its neighbours."""
BLENDS = (0, 21, 42, 63)
"""Blends that are sent: few different ones take fewer bits."""


def find_keys(shapes: Sequence[Shape], rate: Fraction) -> list[tuple[int, Shape]]:
    """Return frames at which the mouth shows a viseme, in their order; between them it moves linearly.

    Frame n is at n / rate seconds. Closures are always among them, and a sound between two of them, for which
    the mouth opens; of others that are too near to each other, the one that weighs more.
    """
    closed = [False, *(shape.viseme in CLOSED for shape in shapes), False]
    wanted: list[tuple[float, Shape, tuple[bool, float]]] = []
    for shape, before, itself, after in zip(shapes, closed, closed[1:], closed[2:], strict=False):
        length, rank = shape.end - shape.start, (itself or (before and after), shape.weight)
        if length >= LONG and not itself:
            wanted += [(shape.start + INSET, shape, rank), (shape.end - INSET, shape, rank)]
        elif rank[0] or length > SHORT or shape.weight > WEAK:
            wanted.append((shape.centre, shape, rank))
    keys: list[tuple[int, Shape, tuple[bool, float]]] = []
    for moment, shape, rank in wanted:
        frame = round(moment * rate)
        while keys and frame - keys[-1][0] < APART * rate and keys[-1][2] < rank and not keys[-1][2][0]:
            keys.pop()
        free = frame - keys[-1][0] if keys else APART * rate
        if free >= APART * rate or (rank[0] and free > 0):
            keys.append((frame, shape, rank))
    return [(frame, shape) for frame, shape, _ in keys]


def rank_keys(keys: Sequence[tuple[int, Shape]], rows: Float64) -> list[int]:
    """Return the keys that may be left out, as their numbers, the ones that are missed least first.

    rows: float (K, columns), what the mouth shows at each. A key is missed by how far a straight line between
    its neighbours passes it, times the time between them. First and last, closures, what lies between two of
    them, and the tongue between the teeth stay.
    """
    closed = [shape.viseme in CLOSED for _, shape in keys]
    inner = range(1, len(keys) - 1)
    free = [
        at in inner and keys[at][1].viseme not in KEPT and not (closed[at - 1] and closed[at + 1])
        for at in range(len(keys))
    ]
    times = np.array([frame for frame, _ in keys], dtype=np.float64)
    before, after = np.arange(len(keys)) - 1, np.arange(len(keys)) + 1

    links = times, rows, before, after
    cost = np.array([_missed(at, *links) if free[at] else np.inf for at in range(len(keys))])
    order: list[int] = []
    while cost.size and np.isfinite(cost.min()):
        at = int(cost.argmin())
        order.append(at)
        cost[at] = np.inf
        first, last = int(before[at]), int(after[at])
        after[first], before[last] = last, first
        for near in (first, last):
            if free[near]:
                cost[near] = _missed(near, *links)
    return order


def _missed(at: int, times: Float64, rows: Float64, before: Int64, after: Int64) -> float:
    """Return how much a key would be missed between the neighbours that it has. before, after: int64 (K,)."""
    first, last = int(before[at]), int(after[at])
    share = (times[at] - times[first]) / (times[last] - times[first])
    line = (1 - share) * rows[first] + share * rows[last]
    return float(np.linalg.norm(rows[at] - line) * (times[last] - times[first]))


def nearest_blend(share: float) -> int:
    """Return the blend, of those that are sent, that is nearest to a share of the first viseme."""
    return min(BLENDS, key=lambda blend: abs(blend - MOST_BLEND * share))


def read_shapes(animation: Animation) -> tuple[Shape, ...]:
    """Return the visemes that FAP 1 of an animation shows, each from halfway to its neighbours.

    Of two visemes of a frame, the one with the larger share; it is 0 below a share of a quarter, and before
    the first FAP 1. size: the share.
    """
    face = animation.face
    if face is None:
        return ()
    sent = np.flatnonzero(face.mask[:, 0])
    times = [float(animation.index[at] / animation.rate) for at in sent]
    end = float((animation.index[-1] + 1) / animation.rate) if len(animation) else 0.0
    borders = [0.0, *((one + two) / 2 for one, two in pairwise(times)), end]
    shapes: list[Shape] = []
    for at, start, stop in zip(sent, borders, borders[1:], strict=False):
        first, second, blend, _ = (int(each) for each in face.viseme[at])
        viseme, share = (first, blend) if blend >= MOST_BLEND - blend else (second, MOST_BLEND - blend)
        if viseme == 0 and 4 * (MOST_BLEND - share) >= MOST_BLEND:
            viseme, share = (second if viseme == first else first), MOST_BLEND - share
        if shapes and shapes[-1].viseme == viseme:
            shapes[-1] = replace(shapes[-1], end=stop)
        else:
            shapes.append(Shape(viseme, start, stop, share / MOST_BLEND if viseme else 1.0, 1.0))
    return tuple(shapes)

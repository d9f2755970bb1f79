"""How far a body slides along the ground on legs that rest: `slide_on_resting_legs`.

People who sway move their hips over feet that stand, so the feet move against the root. A root that goes to
and fro by decimetres while both feet stay where they are under it is a skater, or a sway of some millimetres
read with steps that are too large.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fba.arrays import Float64, Int64
from fba.body.solve.pose_loops import MILLIMETRE

STILL = 0.02
"""Metres that the feet of legs at rest may move against the root, in any direction."""


def slide_on_resting_legs(root: Int64, feet: Float64, index: Int64) -> float:
    """Return how many metres a root goes to and fro, at most, while all feet stay in place under it.

    root: (T, K), millimetres, along the ground. feet: (T, F, 3), metres, from the root. index: (T,) numbers
    of the frames. One quantiser step an axis is taken off: by that much rounding moves a root that stands.
    """
    quantum = np.gcd.reduce(root - root[0], axis=0)
    ways = [_to_and_fro(root[run]) - quantum for run in _rests(feet, index)]
    return MILLIMETRE * max(0, int(np.max(ways)))


def _to_and_fro(root: Int64) -> Int64:
    """Return how far coordinates (T, K) go one way and back, each; 0 for one that goes one way only.

    Who jumps with stiff legs goes one way.
    """
    ahead = (root - np.minimum.accumulate(root)).max(axis=0)
    back = (np.maximum.accumulate(root) - root).max(axis=0)
    shorter: Int64 = np.minimum(ahead, back)
    return shorter


def _rests(feet: Float64, index: Int64) -> Iterator[slice]:
    """Yield the runs of successive frames in which every foot stays where it is under the root.

    A run ends with the frame in which a foot has moved by more than `STILL` from where the run began.
    """
    begin = 0
    for frame in range(1, len(index)):
        if index[frame] != index[frame - 1] + 1 or np.abs(feet[frame] - feet[begin]).max() > STILL:
            yield slice(begin, frame)
            begin = frame
    yield slice(begin, len(index))

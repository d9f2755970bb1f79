"""Speech as FAP 1: visemes in the frames where the mouth arrives at them."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

import numpy as np

from fba.animation import Animation
from fba.arrays import Array
from fba.parameters import FAP_COUNT
from fba.speech._sounds import Shape
from fba.tracks import FaceTrack

MOST_BLEND = 63
TRANSITION = 0.12
"""Seconds that a mouth takes from one viseme to the next, as far as they last that long."""


def key_visemes(shapes: Sequence[Shape], rate: Fraction) -> Animation:
    """Return an animation whose frames are those where the mouth arrives at a viseme, or leaves it.

    Players that interpolate between frames show a transition of 0.12 s or less from each viseme to the next.
    Frame n is at n / rate seconds. Of several visemes in one frame, closures (1 and 2) are shown first, then
    those that weigh most.
    """
    keys: dict[int, tuple[tuple[bool, float], int]] = {}
    for shape in shapes:
        inset = min(TRANSITION / 2, (shape.end - shape.start) / 2)
        rank = (shape.viseme in (1, 2), shape.weight)
        for moment in (shape.start + inset, shape.end - inset):
            frame = round(moment * rate)
            if frame not in keys or keys[frame][0] < rank:
                keys[frame] = (rank, shape.viseme)
    index = np.array(sorted(keys), dtype=np.int64)
    fields: Array = np.zeros((len(index), 4), dtype=np.int16)
    fields[:, 0] = [keys[int(frame)][1] for frame in index]
    fields[:, 2] = MOST_BLEND
    mask = np.zeros((len(index), FAP_COUNT), dtype=bool)
    mask[:, 0] = True
    face = FaceTrack(np.zeros((len(index), FAP_COUNT), dtype=np.int32), mask, viseme=fields)
    return Animation(face=face, body=None, rate=rate, index=index)

"""Lids that go along with the gaze, as they are shown.

A stream may turn the eyeballs (FAPs 25, 26) and leave the lids (19-22) where they are. People's lids follow
their gaze up and down, so the player adds that to what it draws; FAPs and feature points stay as they are.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

from fba.arrays import Float32
from fba.face.points import PITCH_EYE

UPPER, LOWER = (19, 20), (21, 22)
"""FAPs of the left and right lids; upper ones positive downwards, lower ones upwards."""
CLOSED = 1024.0
UPPER_FOLLOWS, LOWER_FOLLOWS = 0.6, 0.3
"""Shares of the pupil's way up or down that the lids make."""
PITCH_UNIT = 1e-5
"""Radians of one unit of FAPs 25 and 26, positive downwards."""


def follow_gaze(faps: Float32, eyes: Iterable[tuple[int, float]], unit: float) -> Float32:
    """Return FAPs (68,) with lids that follow the gaze, less where they are closed.

    eyes: side (0 left, 1 right) and radius (m) of each eyeball. unit: IRISD, metres.
    """
    shown = faps
    for side, radius in eyes:
        pitch = float(faps[PITCH_EYE[side] - 1]) * PITCH_UNIT
        if pitch == 0.0:
            continue
        if shown is faps:
            shown = faps.copy()
        upper, lower = UPPER[side] - 1, LOWER[side] - 1
        open_share = min(max(1 - float(faps[upper] + faps[lower]) / CLOSED, 0.0), 1.0)
        way = math.sin(pitch) * radius / unit * open_share
        shown[upper] += UPPER_FOLLOWS * way
        shown[lower] -= LOWER_FOLLOWS * way
    return shown

"""How far an actor's eyes are open, from blinks, where only one lid of each eye has a marker."""

from __future__ import annotations

import numpy as np

from fba.arrays import Float64

LONGEST = 0.5
"""Seconds that a blink lasts at most, at half its depth."""
DEEP = 0.5
"""Share of the usual opening that an upper lid sinks at least in a blink."""
UPPER_SHARE = 0.95
"""Share of the opening that the upper lid sinks in a blink. The lower one comes up to meet it on four heads
with ARKit's shapes (0.90 there, fba/capture/blendshapes/shape_faps.csv), and hardly in streams of old
encoders; as it is not sent, a blink must nearly close the eye without it."""
RANGE = (0.7, 1.3)
"""Openings that are believed, relative to the usual one."""
SMOOTH = 0.02
"""Seconds over which noise is averaged."""
FULLEST = 75
"""Percentile of the blinks' depths: while people talk, many blinks stop half-way."""


def opening_by_blinks(sunk: Float64, times: Float64, usual: float) -> float | None:
    """Return how far eyes are open in the neutral face, metres; None if the take has no blinks.

    sunk: float64 (T, E), metres that the upper lid of each eye is below its neutral place, at the times (T,).
    usual: the opening of an eye of this face if nothing is known.
    """
    from scipy.ndimage import uniform_filter1d
    from scipy.signal import find_peaks

    if len(times) < 3:
        return None
    rate = (len(times) - 1) / float(times[-1] - times[0])
    depths: list[float] = []
    for lid in uniform_filter1d(sunk, max(1, round(SMOOTH * rate)), axis=0).T:
        peaks, _ = find_peaks(lid, prominence=DEEP * usual, width=(None, LONGEST * rate))
        depths += lid[peaks].tolist()
    if not depths:
        return None
    opening = float(np.percentile(depths, FULLEST)) / UPPER_SHARE
    return float(np.clip(opening, RANGE[0] * usual, RANGE[1] * usual))

"""The neutral face of a film: its first second, or the frames that look most like one."""

from __future__ import annotations

import warnings

import numpy as np

from fba.arrays import Float64, Intp
from fba.errors import FbaWarning, Remedy

NEUTRAL_FRAMES = 30
"""Frames at the start whose median is the neutral face: a second."""
WINDOW = 0.2
"""Seconds of the neutral face where the first second shows none."""
FEWEST = 5
"""Frames at least that tell a neutral face."""
LIDS = (14, 23), (11, 13)
"""Middles of the upper lids, and of the lower ones."""
LIPS, CORNERS, BROWS, EYE_CORNERS = (30, 33), (42, 45), (5, 7), (15, 17, 19, 21)
"""Inner edges of the lips, corners of the mouth, middles of the brows, corners of the eyes."""
OPEN = 75
"""Percentile of the openings of eyes that is usual for eyes that are open."""
LID_SPREAD, WIDTH_SPREAD, MILLIMETRES, TURNED = 0.15, 0.10, 3.0, 0.2
"""How far a neutral face may be off: the opening of eyes and the width of the mouth as shares of the usual
ones, the gap of the lips and the height of brows in millimetres, the head's angles in radians."""
NO_REST = 4.0
"""Cost, in squares of these, above which the first second is no neutral face."""


def find_rest(points: Float64, angles: Float64, times: Float64) -> Intp:
    """Return which frames show the neutral face: rows of those given, at least five where there are as many.

    points: float64 (S, 64, 2), laid on the standard mask, millimetres. angles: (S, 3), radians: pitch, yaw,
    roll. times: (S,), seconds. Gives an FbaWarning where the first second shows none, and says which frames
    are taken instead.
    """
    first = np.arange(min(NEUTRAL_FRAMES, len(points)))
    costs = _costs(points, angles)
    if np.median(costs[first]) <= NO_REST:
        return first
    length = max(FEWEST, int(np.searchsorted(times - times[0], WINDOW)))
    if length >= len(costs):
        return first
    start = int(np.convolve(costs, np.ones(length), mode="valid").argmin())
    if costs[start : start + length].mean() > costs[first].mean():
        return first
    warnings.warn(
        FbaWarning(
            "the face does not rest in the first second: eyes, mouth, brows or head are not as usual; the "
            f"frames from {times[start]:.2f} to {times[start + length - 1]:.2f} s are taken for its rest"
        ).with_remedies(Remedy("neutral", "say where it rests with {}", "2.0-2.5")),
        stacklevel=4,
    )
    return np.arange(start, start + length)


def eye_opening(points: Float64) -> Float64:
    """Return the opening of the eyes in frames (..., 64, 2), the mean of both, millimetres: (...)."""
    upper, lower = ([number - 1 for number in pair] for pair in LIDS)
    opening: Float64 = (points[..., upper, 1] - points[..., lower, 1]).mean(axis=-1)
    return opening


def _costs(points: Float64, angles: Float64) -> Float64:
    """Return how far each frame is from a neutral face: (S,), a sum of squares."""

    def at(*numbers: int) -> Float64:
        return np.asarray(points[:, [number - 1 for number in numbers]].mean(axis=1))

    opening = eye_opening(points)
    usual = max(float(np.percentile(opening, OPEN)), 1e-6)
    gap = (at(LIPS[0]) - at(LIPS[1]))[:, 1]
    width = (at(CORNERS[0]) - at(CORNERS[1]))[:, 0]
    height = (at(*BROWS) - at(*EYE_CORNERS))[:, 1]
    usual_width = max(abs(float(np.median(width))), 1e-6)
    costs: Float64 = (
        ((opening / usual - 1) / LID_SPREAD) ** 2
        + (gap / MILLIMETRES) ** 2
        + ((np.abs(width) / usual_width - 1) / WIDTH_SPREAD) ** 2
        + ((height - np.median(height)) / MILLIMETRES) ** 2
        + (angles[:, 1] / TURNED) ** 2
        + ((angles[:, 0] - np.median(angles[:, 0])) / TURNED) ** 2
    )
    return costs

"""The neutral face of a film: its first second, or the frames that are most like a neutral face."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np

from fba.arrays import Float64, Intp
from fba.errors import FbaWarning, Remedy

NEUTRAL_FRAMES = 30
"""Number of frames at the start whose median is the neutral face: a second."""
MIN_FRAMES = 5
"""Number of frames that a neutral face needs."""
# Points, as in `fba.persona.points.layout`
UPPER_LIDS = (14, 23)
LOWER_LIDS = (11, 13)
INNER_LIPS = (30, 33)
MOUTH_CORNERS = (42, 45)
BROWS = (5, 7)
EYE_CORNERS = (15, 17, 19, 21)


@dataclass(frozen=True)
class Tolerance:
    """Deviations of a neutral face from the film's usual face; a frame's cost is the sum of their squares."""

    opening: float = 0.15  # of the eyes, share of the usual opening
    width: float = 0.10  # of the mouth, share of the usual width
    millimetres: float = 3.0  # of the gap between the lips, and of the brows' height
    turn: float = 0.2  # of the head, radians
    max_cost: float = 4.0  # of the median frame in the first second
    open_percentile: float = 75.0  # of the openings of the eyes: the usual one
    seconds: float = 0.2  # duration of the neutral face if it is not in the first second


TOLERANCE = Tolerance()


def find_rest(points: Float64, angles: Float64, times: Float64) -> Intp:
    """Return the rows of the frames that show the neutral face.

    points: float64 (S, 64, 2), on the standard mask, millimetres. angles: (S, 3), radians: pitch, yaw, roll.
    times: (S,), seconds. Where the face is not neutral in the first second, an FbaWarning names the frames
    that are used.
    """
    first = np.arange(min(NEUTRAL_FRAMES, len(points)))
    costs = _costs(points, angles)
    if np.median(costs[first]) <= TOLERANCE.max_cost:
        return first
    length = max(MIN_FRAMES, int(np.searchsorted(times - times[0], TOLERANCE.seconds)))
    if length >= len(costs):
        return first
    start = int(np.convolve(costs, np.ones(length), mode="valid").argmin())
    if costs[start : start + length].mean() > costs[first].mean():
        return first
    warnings.warn(
        FbaWarning(
            "the face does not rest in the first second: eyes, mouth, brows or head are not as usual; the "
            f"frames from {times[start]:.2f} to {times[start + length - 1]:.2f} s are used as its rest"
        ).with_remedies(Remedy("neutral", "say where it rests with {}", "2.0-2.5")),
        stacklevel=4,
    )
    return np.arange(start, start + length)


def eye_opening(points: Float64) -> Float64:
    """Return the opening of the eyes in frames (..., 64, 2), the mean of both, millimetres: (...)."""
    upper, lower = ([number - 1 for number in pair] for pair in (UPPER_LIDS, LOWER_LIDS))
    opening: Float64 = (points[..., upper, 1] - points[..., lower, 1]).mean(axis=-1)
    return opening


def _costs(points: Float64, angles: Float64) -> Float64:
    """Return the cost of each frame, (S,): see `Tolerance`."""

    def at(*numbers: int) -> Float64:
        return np.asarray(points[:, [number - 1 for number in numbers]].mean(axis=1))

    opening = eye_opening(points)
    usual = max(float(np.percentile(opening, TOLERANCE.open_percentile)), 1e-6)
    gap = (at(INNER_LIPS[0]) - at(INNER_LIPS[1]))[:, 1]
    width = (at(MOUTH_CORNERS[0]) - at(MOUTH_CORNERS[1]))[:, 0]
    height = (at(*BROWS) - at(*EYE_CORNERS))[:, 1]
    usual_width = max(abs(float(np.median(width))), 1e-6)
    costs: Float64 = (
        ((opening / usual - 1) / TOLERANCE.opening) ** 2
        + (gap / TOLERANCE.millimetres) ** 2
        + ((np.abs(width) / usual_width - 1) / TOLERANCE.width) ** 2
        + ((height - np.median(height)) / TOLERANCE.millimetres) ** 2
        + (angles[:, 1] / TOLERANCE.turn) ** 2
        + ((angles[:, 0] - np.median(angles[:, 0])) / TOLERANCE.turn) ** 2
    )
    return costs

"""The neutral face of a take: its start if the face does not move there, else its usual shape."""

from __future__ import annotations

import numpy as np

from fba.arrays import Float64
from fba.errors import OptionError

NEUTRAL_SECONDS = 0.1
"""Length of the window, in seconds, whose median is the neutral face."""
MAX_START_MOTION = 0.6
"""Largest motion in the first window of a take with a neutral start, relative to the usual motion."""


def neutral_frames(local: Float64, times: Float64, neutral: str | int | tuple[float, float] | slice) -> slice:
    """Return the frames of the neutral face.

    local: float64 (T, M, 3), markers relative to the head, NaN for gaps. neutral: "auto", "first", the number
    of a frame, (from, to) in seconds from the start, or the frames. Raises OptionError for frames that are
    not in the take.
    """
    if isinstance(neutral, slice):
        return neutral
    length = max(1, int(np.searchsorted(times - times[0], NEUTRAL_SECONDS)))
    if isinstance(neutral, tuple):
        first, last = (int(np.searchsorted(times - times[0], second)) for second in neutral)
        if not 0 <= neutral[0] < neutral[1] or first >= len(times) or last <= first:
            raise OptionError(
                f"neutral: no frames between {neutral[0]:g} and {neutral[1]:g} s; the take lasts "
                f"{times[-1] - times[0]:.2f} s"
            )
        return slice(first, last)
    if isinstance(neutral, int):
        if not 0 <= neutral < len(times):
            raise OptionError(
                f"neutral: there is no frame {neutral}; the take has frames 0 to {len(times) - 1}"
            )
        return slice(neutral, neutral + 1)
    if neutral == "first":
        return slice(0, length)
    if neutral != "auto":
        raise OptionError(f"neutral must be auto, first, a frame or two times, not {neutral!r}")
    return _find(local, length)


def _find(local: Float64, length: int) -> slice:
    """Return the start of the take if the face does not move there, as takes usually begin.

    Otherwise return the window in which the face is nearest to its rest: the value at which each coordinate
    mostly is, to which a mouth that speaks and lids that blink return.
    """
    flat = local.reshape(len(local), -1)
    if len(flat) <= length:
        return slice(0, len(flat))
    centre = _most_usual(flat)
    smooth = np.cumsum(np.where(np.isnan(flat), centre, flat), axis=0)
    smooth = (smooth[length:] - smooth[:-length]) / length
    speed = np.abs(smooth[length:] - smooth[:-length]).mean(axis=1) if len(smooth) > length else np.zeros(1)
    if speed[0] <= MAX_START_MOTION * float(np.median(speed)):
        return slice(0, length)
    cost = _mean(np.abs(flat - centre)) + _mean(np.abs(np.diff(flat, axis=0, prepend=flat[:1])))
    best = int(_sums(cost, length).argmin())
    return slice(best, best + length)


def _mean(values: Float64) -> Float64:
    """Return the mean of each row without NaN, infinity for rows of NaN: float64 (T,)."""
    count = (~np.isnan(values)).sum(axis=1)
    total = np.nansum(values, axis=1)
    return np.where(count > 0, total / np.maximum(count, 1), np.inf)


def _sums(cost: Float64, length: int) -> Float64:
    return np.array([cost[n : n + length].sum() for n in range(len(cost) - length + 1)])


def _most_usual(flat: Float64) -> Float64:
    """Return the value at which each column is densest: the middle of the shortest half of its values."""
    ordered = np.sort(flat, axis=0)  # NaN last
    result = np.full(flat.shape[1], np.nan)
    counts = (~np.isnan(flat)).sum(axis=0)
    for column, count in enumerate(counts):
        if count:
            half = max(1, int(count) // 2)
            values = ordered[:count, column]
            widths = values[half - 1 :] - values[: count - half + 1]
            start = int(widths.argmin())
            result[column] = values[start : start + half].mean()
    return result

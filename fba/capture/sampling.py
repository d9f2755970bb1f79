"""Captures at their own times: their nominal rates, their gaps, and their values at the times of frames."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from math import ceil, floor

import numpy as np

from fba.arrays import Float64, Int64
from fba.errors import ModelError
from fba.limits import Limits

NOMINAL = tuple(
    sorted({Fraction(n) for n in (10, 12, 15, 20, 24, 25, 30, 48, 50, 60, 72, 75, 90, 100, 120, 144, 150)}
           | {Fraction(n) for n in (180, 200, 240, 250, 300, 480, 500, 1000)}
           | {Fraction(n * 1000, 1001) for n in (24, 30, 60)})
)  # fmt: skip
"""Frame rates, one of which the median step of a capture probably means."""
MAX_RATE_ERROR = 0.01
"""Largest relative difference between a measured rate and the nominal rate that it is taken for."""
EXACT = 1e-4
"""The same for rates that differ by a thousandth, as 30 and 29.97."""
GAP = 2.5
"""Steps of the nominal rate above which frames are missing."""
BRIDGED = 0.5
"""Seconds of the longest gap that is filled by a straight line."""
RETURN = 0.2
"""Seconds before the end of a longer gap in which the face goes over from what it held."""
TIME_TOLERANCE = 1e-6
"""Share of a frame by which a time may miss a frame's and still be it."""
CELL_BYTES = 40
"""Memory that resampling takes for each value."""


def find_rate(times: Float64) -> Fraction:
    """Return the nominal rate of rows at times (T,), seconds: that of their median step; 30 for a single row.

    Raises ModelError for times that give none.
    """
    if len(times) < 2:
        return Fraction(30)
    rate = 1.0 / float(np.median(np.diff(times)))
    if not 0.1 <= rate <= 10_000:
        raise ModelError(f"the rows are {1 / rate:.3g} s apart, {rate:.3g} frames/s: no times in seconds")
    for bound in (EXACT, MAX_RATE_ERROR):
        near = min(NOMINAL, key=lambda one: abs(float(one) - rate))
        if abs(float(near) - rate) <= bound * rate:
            return near
    return Fraction(round(rate)) if rate >= 1 else Fraction(rate).limit_denominator(1000)


def find_gaps(times: Float64, rate: Fraction) -> list[tuple[float, float]]:
    """Return gaps between rows at times (T,): the time of the row before each, and its seconds."""
    steps = np.diff(times)
    return [(float(times[one]), float(steps[one])) for one in np.flatnonzero(steps * float(rate) >= GAP)]


def frame_numbers(times: Float64, rate: Fraction, limits: Limits) -> Int64:
    """Return numbers (F,) of the frames of a rate from the first of times (T,) to the last, at least one.

    Raises LimitError for more than the limits allow.
    """
    frames = float(rate)
    limits.check_seconds(float(times[-1] - times[0]), "the capture")
    first = ceil(float(times[0]) * frames - TIME_TOLERANCE)
    last = max(floor(float(times[-1]) * frames + TIME_TOLERANCE), first)
    limits.check_frames(last - first + 1, f"the capture, at {frames:g} frames/s,")
    return np.arange(first, last + 1)


def interpolate(times: Float64, values: Sequence[Float64], at: Float64, limits: Limits) -> list[Float64]:
    """Return arrays of values (T, ...) at times (T,) as they are at other times (F,), on straight lines.

    Over a gap of more than `BRIDGED` seconds values stay, and go over at its end. Before the first row and
    after the last they are those of these rows.
    """
    width = sum(one[0].size for one in values) if len(times) else 0
    limits.check_bytes(
        CELL_BYTES * width * len(at), "the capture, resampled,", source=CELL_BYTES * width * len(times)
    )
    after = np.clip(np.searchsorted(times, at), 1, max(len(times) - 1, 1))
    before = after - 1
    after = np.minimum(after, len(times) - 1)
    length = times[after] - times[before]
    spread = np.where(length > BRIDGED, RETURN, length)
    share = np.clip(1 - (times[after] - at) / np.where(spread > 0, spread, 1.0), 0.0, 1.0)
    result = []
    for one in values:
        weight = share.reshape(-1, *[1] * (one.ndim - 1))
        result.append(one[before] * (1 - weight) + one[after] * weight)
    return result

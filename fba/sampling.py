"""Values at times: rates and gaps of irregular times, interpolation at the times of frames, smooth steps."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from math import ceil, floor

import numpy as np
import numpy.typing as npt

from fba.arrays import Float64, Int64
from fba.errors import ModelError
from fba.limits import Limits

NOMINAL = tuple(
    sorted({Fraction(n) for n in (10, 12, 15, 20, 24, 25, 30, 48, 50, 60, 72, 75, 90, 100, 120, 144, 150)}
           | {Fraction(n) for n in (180, 200, 240, 250, 300, 480, 500, 1000)}
           | {Fraction(n * 1000, 1001) for n in (24, 30, 60)})
)  # fmt: skip
"""Usual frame rates; the median step of a capture probably means one of them."""
MAX_RATE_ERROR = 0.01
"""Largest relative difference between a measured rate and the nominal rate that it is taken for."""
GAP = 2.5
"""Smallest gap between rows, in steps of the nominal rate, in which frames are missing."""
MAX_BRIDGED = 0.5
"""Longest gap, in seconds, that a straight line fills."""
RETURN_SECONDS = 0.2
"""Seconds before the end of a longer gap in which the face moves to its new place."""
TIME_TOLERANCE = 1e-6
"""Largest difference, as a share of a frame, between a time and that of the frame that it means."""
CELL_BYTES = 40
"""Memory, in bytes, that resampling takes for each value."""


def find_rate(times: Float64) -> Fraction:
    """Return the nominal rate of rows at times (T,), seconds: that of their median step; 30 for a single row.

    Raises ModelError for times that give none.
    """
    if len(times) < 2:
        return Fraction(30)
    rate = 1.0 / float(np.median(np.diff(times)))
    if not 0.1 <= rate <= 10_000:
        raise ModelError(f"the rows are {1 / rate:.3g} s apart, {rate:.3g} frames/s: no times in seconds")
    near = min(NOMINAL, key=lambda nominal: abs(float(nominal) - rate))
    if abs(float(near) - rate) <= MAX_RATE_ERROR * rate:
        return near
    return Fraction(round(rate)) if rate >= 1 else Fraction(rate).limit_denominator(1000)


def find_gaps(times: Float64, rate: Fraction) -> list[tuple[float, float]]:
    """Return gaps between rows at times (T,): the time of the row before each, and its length in seconds."""
    steps = np.diff(times)
    return [(float(times[row]), float(steps[row])) for row in np.flatnonzero(steps * float(rate) >= GAP)]


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
    """Return arrays of values (T, ...) at times (T,), interpolated linearly at other times (F,).

    In a gap longer than `MAX_BRIDGED` values stay, and change at its end. Before the first row and after the
    last, they are those of that row.
    """
    width = sum(array[0].size for array in values) if len(times) else 0
    limits.check_bytes(
        CELL_BYTES * width * len(at), "the capture, resampled,", source=CELL_BYTES * width * len(times)
    )
    after = np.clip(np.searchsorted(times, at), 1, max(len(times) - 1, 1))
    before = after - 1
    after = np.minimum(after, len(times) - 1)
    length = times[after] - times[before]
    spread = np.where(length > MAX_BRIDGED, RETURN_SECONDS, length)
    share = np.clip(1 - (times[after] - at) / np.where(spread > 0, spread, 1.0), 0.0, 1.0)
    result = []
    for array in values:
        weight = share.reshape(-1, *[1] * (array.ndim - 1))
        result.append(array[before] * (1 - weight) + array[after] * weight)
    return result


def regular_times(count: int, rate: Fraction, first: float = 0.0) -> Float64:
    """Return the times of frames at a constant rate: float64 (count,), seconds."""
    return first + np.arange(count, dtype=np.float64) * np.float64(1 / rate)


def smoothstep(value: npt.ArrayLike) -> Float64:
    """Return a float64 array of value's shape: 0 up to 0, 1 from 1 on, 3 t^2 - 2 t^3 between."""
    t = np.clip(np.asarray(value, dtype=np.float64), 0.0, 1.0)
    result: Float64 = t * t * (3.0 - 2.0 * t)
    return result

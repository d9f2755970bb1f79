"""Header fields of a stream: frame rate and time code."""

from __future__ import annotations

import math
import warnings
from fractions import Fraction

from fba.codec._stream.clock import nearest_frame
from fba.codec.settings import FrameRate, TimeCode
from fba.errors import FbaWarning, RangeError, Remedy

_HOURS = 32


def frame_rate(rate: Fraction) -> FrameRate:
    """Return the header fields for a rate. Raises RangeError if the syntax cannot carry it."""
    fields = FrameRate.from_fraction(rate)
    if fields is None:
        nearest = max(Fraction(round(rate * 16), 16), Fraction(1, 16))
        raise RangeError(
            f"{rate} frames/s cannot be coded: a rate is n/16 below 256, or 1000/1001 of that"
        ).with_remedies(
            Remedy(
                "rate", "resample first, e.g. with {}", f"{float(min(nearest, Fraction(4095, 16))):g}",
                "Animation.resample",
            )
        )  # fmt: skip
    return fields


def first_time_code(index: int, rate: Fraction) -> TimeCode | None:
    """Return the time code with which a decoder shows the first plane at this index; None for index 0.

    If no time code gives the index, returns None with an FbaWarning.
    """
    if index == 0:
        return None
    code = time_code(index, rate)
    if code is None:
        warnings.warn(
            f"the animation starts at {float(index / rate):g} s, which no time code says; the stream starts "
            "at 0",
            FbaWarning,
            stacklevel=3,
        )
    return code


def time_code(index: int, rate: Fraction) -> TimeCode | None:
    """Return the time code of the frame with an index, or None.

    Time codes are whole seconds below 32 hours, and name the nearest frame.
    """
    seconds = math.floor(index / rate + Fraction(1, 2))
    if 0 <= seconds < _HOURS * 3600 and nearest_frame(seconds, rate) == index:
        return TimeCode(seconds // 3600, seconds // 60 % 60, seconds % 60)
    return None


def last_named_frame(index: float, rate: Fraction) -> int:
    """Return the last frame up to an index that a time code names."""
    seconds = math.floor(index / rate) + 1
    while nearest_frame(seconds, rate) > index:
        seconds -= 1
    return nearest_frame(seconds, rate)

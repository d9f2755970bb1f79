"""Choose header fields for the encoder: mask types, frame rate and time code."""

from __future__ import annotations

import math
import warnings
from fractions import Fraction
from functools import lru_cache

from fba.arrays import Bool
from fba.codec._plane import slots, syntax
from fba.codec.settings import FrameRate, TimeCode
from fba.errors import FbaWarning, RangeError, Remedy

_HOURS = 32


def mask_types(part: int, mask: Bool, interpolated: Bool | None, unsent: str) -> tuple[int, ...]:
    """Return the mask type of every group: none, all, or masked.

    mask: bool (68,) or (296,), what is sent. interpolated: bool (68,), the FAPs that the animation wants
    interpolated, or None. unsent: "keep" or "interpolate", for groups in which the animation does not want
    all unsent FAPs interpolated. Unsent BAPs always keep their values.
    """
    return _mask_types(
        part, mask.tobytes(), interpolated.tobytes() if interpolated is not None else b"", unsent
    )


@lru_cache(maxsize=64)
def _mask_types(part: int, mask: bytes, interpolated: bytes, unsent: str) -> tuple[int, ...]:
    """Do the same with bytes, so that results can be cached: an encoder asks for every frame."""
    masked = (
        syntax.MASK_INTERPOLATE if unsent == "interpolate" and part == slots.FACE_BIT else syntax.MASK_KEEP
    )
    types = []
    for group in syntax.groups(part):
        sent = [mask[number - 1] for number in group]
        if all(sent):
            types.append(syntax.MASK_ALL)
        elif interpolated and all(mask[number - 1] or interpolated[number - 1] for number in group):
            types.append(syntax.MASK_INTERPOLATE)
        else:
            types.append(masked if any(sent) else syntax.MASK_NONE)
    return tuple(types)


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


def time_code(index: int, rate: Fraction) -> TimeCode | None:
    """Return the time code with which a decoder shows the first plane at this index; None for index 0.

    Time codes are whole seconds below 32 hours. If none gives the index, returns None with an FbaWarning.
    """
    if index == 0:
        return None
    seconds = math.floor(index / rate + Fraction(1, 2))
    if 0 <= seconds < _HOURS * 3600 and math.floor(seconds * rate + Fraction(1, 2)) == index:
        return TimeCode(seconds // 3600, seconds // 60 % 60, seconds % 60)
    warnings.warn(
        f"the animation starts at {float(index / rate):g} s, which no time code says; the stream starts at 0",
        FbaWarning,
        stacklevel=3,
    )
    return None

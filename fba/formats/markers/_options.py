"""What readers of markers share: the frame rate of a file."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

import numpy as np

from fba.errors import FormatError, Remedy
from fba.formats.text.frame_rates import parse_rate
from fba.source import Path

MIN_RATE = 0.001
"""Lowest rate, in frames per second; a lower one is damage."""
MAX_RATE = 100_000
"""Highest rate, in frames per second; a higher one is damage."""
GIVE_RATE = Remedy("source_rate", "give one with {}", "100")


def file_rate(stored: float | str, source_rate: Fraction | int | str | None, path: Path) -> Fraction:
    """Return the frame rate of a file: what it says, or `source_rate` if it says 0 or nothing.

    Raises FormatError for anything but a positive number.
    """
    try:
        number = float(stored) if stored != "" else 0.0
    except ValueError:
        number = float("nan")
    if number == 0:
        if source_rate is None:
            raise FormatError("has no frame rate", path=path).with_remedies(GIVE_RATE)
        return Fraction(source_rate)
    if not MIN_RATE <= number <= MAX_RATE:
        raise FormatError(f"its frame rate must be {MIN_RATE} to {MAX_RATE}", path=path, token=str(stored))
    return parse_rate(f"{number:.6f}".rstrip("0").rstrip("."))


def rate_of_times(times: Sequence[float]) -> float:
    """Return the rate of frames at these times, rounded if nearly whole; 0 for fewer than two."""
    if len(times) < 2:
        return 0.0
    steps = np.diff(np.asarray(times, dtype=np.float64))
    usual = float(np.median(steps))
    if not usual > 0:
        return 0.0
    rate = 1 / usual
    return float(round(rate)) if abs(rate - round(rate)) < 0.005 * rate and round(rate) else rate

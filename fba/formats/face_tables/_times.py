"""Times of rows: time codes, seconds, milliseconds and numbers of frames, to seconds from the first row."""

from __future__ import annotations

import re
from fractions import Fraction

import numpy as np

from fba.arrays import Float64
from fba.errors import FormatError
from fba.source import Path

DAY = 86_400.0
TIME_CODE = re.compile(r"(\d{1,2})[:;](\d{1,2})[:;](\d{1,2})(?:[:;.](\d{1,3}(?:\.\d{1,9})?))?")
RATES = (24, 25, 30, 48, 50, 60, 120, 240)
"""Frames that time codes count in a second."""
USUAL = 60
"""Frames in a second where a recording is too short to show it."""
NOON = DAY / 2
MOST_MILLISECONDS = 5.0
"""Median step from which on times are milliseconds: no capture is that slow in seconds."""


def read_time_codes(cells: list[str], lines: list[int], path: Path) -> tuple[Float64, Fraction, float]:
    """Return times (T,) of time codes, seconds from the first; frames a second; the first's time of day.

    "18:48:59:39.473" is 39.473 frames after 18:48:59. Codes may pass midnight. Raises FormatError for text
    that is no time code.
    """
    parts = np.empty((len(cells), 4))
    for row, cell in enumerate(cells):
        match = TIME_CODE.fullmatch(cell)
        if match is None:
            raise FormatError(
                "this is no time code; expected HH:MM:SS:FF.fff, as 18:48:59:39.473",
                path=path, line=lines[row], token=cell,
            )  # fmt: skip
        parts[row] = [float(part or 0) for part in match.groups()]
    rate = _counted_rate(parts)
    seconds = parts[:, 0] * 3600 + parts[:, 1] * 60 + parts[:, 2] + parts[:, 3] / rate
    midnights = np.cumsum(np.diff(seconds, prepend=seconds[0]) < -NOON) * DAY
    return seconds + midnights - seconds[0], Fraction(rate), float(seconds[0])


def _counted_rate(parts: Float64) -> int:
    """Return frames that a second has, from time codes (T, 4): the count before it starts again."""
    whole = np.diff(parts[:, 2]) != 0
    largest = int(parts[:, 3].max())
    if not whole.any() and largest < USUAL:
        return USUAL
    return next((rate for rate in RATES if largest < rate), largest + 1)


def check_order(times: Float64, lines: list[int], path: Path) -> None:
    """Raise FormatError for a row that is not later than the one before."""
    early = np.flatnonzero(~(np.diff(times) > 0))
    if not len(early):
        return
    row = int(early[0]) + 1
    back = float(times[row - 1] - times[row])
    said = f"{back:.3f} s before" if back > 0 else "at the same time as"
    count = f"; so are {len(early) - 1} others" if len(early) > 1 else ""
    raise FormatError(
        f"the row is {said} the one before it{count}: the file is damaged, or holds several recordings or "
        "faces; cut it into pieces of one each",
        path=path, line=lines[row],
    )  # fmt: skip


def seconds_of(times: Float64) -> Float64:
    """Return times (T,) in seconds from the first row on, of times in seconds or in milliseconds."""
    start = times - times[0]
    step = float(np.median(np.diff(start))) if len(start) > 1 else 0.0
    result: Float64 = start / 1000 if step >= MOST_MILLISECONDS else start
    return result

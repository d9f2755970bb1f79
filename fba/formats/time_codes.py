"""Time codes and times of day: when a recording was made, to the frame.

By SMPTE ST 12-1, codes count frames from 0 on in each second. Drop-frame codes, with a semicolon before the
frame, leave out the numbers 0 and 1 (of 30) in nine minutes of ten, to keep up with the clock at 30000/1001
frames/s.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import ceil

import numpy as np

from fba.arrays import Float64
from fba.errors import FormatError
from fba.source import Path

DAY = 86_400.0
"""Seconds in a day."""
NOON = DAY / 2
"""Seconds from midnight to noon."""
TIME_CODE = re.compile(r"(\d{1,2})[:;](\d{1,2})[:;](\d{1,2})(?:([:;.])(\d{1,3}(?:\.\d{1,9})?))?")
TIME_OF_DAY = re.compile(r"\b(\d{1,2})[:.](\d{2})[:.](\d{2}\.\d{1,9})\s*([AaPp])?[Mm]?")
"""A clock's time with parts of a second; whole seconds are too coarse to put two recordings together."""
EXPECTED = "expected HH:MM:SS:FF.fff, as 18:48:59:39.473"
RATES = (24, 25, 30, 48, 50, 60, 120, 240)
"""Frames per second that time codes count."""
DEFAULT_COUNT = 60
"""Frames per second of time codes in a recording that is too short to show it."""
DROPPED = {30: 2, 60: 4, 120: 8}
"""Numbers that drop-frame codes leave out in a minute, by frames per second."""


@dataclass(frozen=True, eq=False)
class TimeCodes:
    """Times of frames. seconds: (T,), from the first frame. start: time of day of the first frame."""

    seconds: Float64
    rate: Fraction
    start: float


def read_time_codes(cells: Sequence[str], lines: Sequence[int], path: Path) -> TimeCodes:
    """Return the times of time codes.

    "18:48:59:39.473" is 39.473 frames after 18:48:59. Codes may pass midnight. lines: the line of each code.
    Raises FormatError for text that is no time code, and for a code that no clock shows.
    """
    parts = np.empty((len(cells), 4))
    drop = False
    for row, cell in enumerate(cells):
        read = _parse(cell)
        if read is None:
            what = "is a time that no clock shows" if TIME_CODE.fullmatch(cell) else "is no time code"
            raise FormatError(f"this {what}; {EXPECTED}", path=path, line=lines[row], token=cell)
        parts[row] = read[0]
        drop = drop or read[1]
    counted = _counted_rate(parts)
    drop = drop and counted in DROPPED
    seconds = _drop_frame_seconds(parts, counted) if drop else _seconds(parts, counted)
    midnights = np.cumsum(np.diff(seconds, prepend=seconds[0]) < -NOON) * DAY
    rate = Fraction(counted * 1000, 1001) if drop else Fraction(counted)
    return TimeCodes(seconds + midnights - seconds[0], rate, float(seconds[0]))


def parse_time_code(text: str, rate: Fraction | None = None) -> float | None:
    """Return the time of day, in seconds, of one time code; None for other text.

    rate: of the frames that it counts; None for `DEFAULT_COUNT`.
    """
    read = _parse(text.strip())
    counted = DEFAULT_COUNT if rate is None else ceil(rate)
    if read is None or read[0][3] >= counted:
        return None
    parts = np.array([read[0]])
    drop = read[1] and counted in DROPPED
    return float((_drop_frame_seconds(parts, counted) if drop else _seconds(parts, counted))[0])


def _parse(text: str) -> tuple[list[float], bool] | None:
    """Return hours, minutes, seconds and frames of a time code, and whether it is drop-frame; else None."""
    match = TIME_CODE.fullmatch(text)
    if match is None or int(match[1]) > 23 or int(match[2]) > 59 or int(match[3]) > 59:
        return None
    return [float(part or 0) for part in (*match.groups()[:3], match[5])], match[4] == ";"


def parse_time_of_day(text: str) -> float | None:
    """Return the time of day, in seconds, in a date and time such as "2018-05-18 12.06.28.340 PM".

    None without one, or where it has whole seconds only.
    """
    match = TIME_OF_DAY.search(text)
    if match is None or int(match[1]) > 23 or int(match[2]) > 59 or float(match[3]) >= 60:
        return None
    hours = int(match[1])
    if match[4]:
        hours = hours % 12 + (12 if match[4] in "Pp" else 0)
    return 3600.0 * hours + 60 * int(match[2]) + float(match[3])


def seconds_between(first: float, second: float) -> float:
    """Return the seconds from a time of day to another: less than half a day, negative if it is earlier."""
    return (second - first + NOON) % DAY - NOON


def _seconds(parts: Float64, counted: int) -> Float64:
    """Return seconds (T,) of hours, minutes, seconds and frames (T, 4)."""
    result: Float64 = parts @ np.array([3600.0, 60.0, 1.0, 1.0 / counted])
    return result


def _drop_frame_seconds(parts: Float64, counted: int) -> Float64:
    """Return the same for drop-frame codes."""
    minutes = parts[:, 0] * 60 + parts[:, 1]
    frames = (minutes * 60 + parts[:, 2]) * counted + parts[:, 3]
    frames -= DROPPED[counted] * (minutes - minutes // 10)
    result: Float64 = frames * 1.001 / counted
    return result


def _counted_rate(parts: Float64) -> int:
    """Return the frames per second that time codes (T, 4) count: the least usual rate above all counts."""
    changes = np.diff(parts[:, 2]) != 0
    largest = int(parts[:, 3].max())
    if not changes.any() and largest < DEFAULT_COUNT:
        return DEFAULT_COUNT
    return next((rate for rate in RATES if largest < rate), largest + 1)

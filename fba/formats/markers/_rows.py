"""Text files of numbers in columns: lines, and rows of numbers with gaps."""

from __future__ import annotations

import warnings
from fractions import Fraction

import numpy as np

from fba.arrays import Float64
from fba.capture import MarkerMotion
from fba.capture.markers.motion import MAX_MARKERS, regular_times
from fba.errors import FbaWarning, FormatError, ModelError
from fba.formats.markers._names import unique_names
from fba.limits import Limits
from fba.recognition import HEAD_BYTES, recognition_hint
from fba.source import Path, read_whole

MISSING = ("", "nan", "null", "none", "-", "na", "n/a")
"""Words, in lower case, that stand for a number that is not there."""
REGULAR = 0.1
"""Times that are off those of a constant rate by less than this share of a frame were rounded."""
MOST_COLUMNS = 20 * MAX_MARKERS


def read_lines(path: Path, what: str) -> list[str]:
    """Return the lines of a text file. what: "a TRC file", for the error if it is no text."""
    data = read_whole(path)
    kind = recognition_hint(data[:HEAD_BYTES])
    if b"\0" in data[:HEAD_BYTES]:
        raise FormatError(f"{what} is text, but this is not{kind}", path=path)
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    return text.replace("\r\n", "\n").replace("\r", "\n").split("\n")


def parse_rows(
    lines: list[str],
    first: int,
    delimiter: str,
    columns: int,
    path: Path,
    limits: Limits,
    *,
    last: int | None = None,
) -> tuple[Float64, list[int]]:
    """Return rows of numbers, float64 (T, columns), NaN for gaps, and each one's line (1-based).

    first, last: the lines from and before which to read; empty ones are passed over. Cells that a row lacks
    at its end are gaps. Raises FormatError for a cell that is no number, and for more cells than columns.
    """
    if columns > MOST_COLUMNS:
        raise FormatError(f"has {columns} columns, more than the {MOST_COLUMNS} that are read", path=path)
    numbers = [n for n in range(first, len(lines) if last is None else last) if lines[n].strip(" \t,;")]
    limits.check_frames(len(numbers), f"{path}: a capture")
    source = sum(len(lines[n]) + 1 for n in numbers)
    limits.check_bytes(2 * 8 * columns * len(numbers), f"{path}: a capture", source=source)
    rows = np.full((len(numbers), columns), np.nan)
    for row, number in enumerate(numbers):
        cells = lines[number].split(delimiter)
        if len(cells) > columns:
            if any(cell.strip() for cell in cells[columns:]):
                raise FormatError(
                    f"this line has {len(cells)} cells, but there are {columns} columns",
                    path=path,
                    line=number + 1,
                )
            del cells[columns:]
        try:
            rows[row, : len(cells)] = [float(cell) if cell else np.nan for cell in cells]
        except ValueError:
            rows[row, : len(cells)] = [_number(cell, delimiter, path, number + 1) for cell in cells]
    return rows, [number + 1 for number in numbers]


def _number(cell: str, delimiter: str, path: Path, line: int) -> float:
    """Return the number in a cell, with a decimal point or comma; NaN where it is missing."""
    text = cell.strip().strip('"')
    if text.lower() in MISSING:
        return float("nan")
    try:
        return float(text.replace(",", ".") if delimiter != "," else text)
    except ValueError:
        raise FormatError(
            "expected a number, or nothing for a gap", path=path, line=line, token=text
        ) from None


def own_times(times: Float64, rate: Fraction) -> Float64:
    """Return times of frames, those of a constant rate where they were rounded to a few digits."""
    if not np.isfinite(times).all():
        return regular_times(len(times), rate)
    regular = regular_times(len(times), rate, float(times[0]) if len(times) else 0.0)
    off = float(np.abs(times - regular).max(initial=0.0))
    return regular if off < REGULAR / float(rate) else times


def build_motion(
    labels: list[str],
    positions: Float64,
    times: Float64,
    rate: Fraction,
    *,
    metres: float,
    unit: str,
    up: str,
    name: str,
    path: Path,
    lines: list[int],
    start: float | None = None,
) -> MarkerMotion:
    """Return the motion; metres: of the file's unit. lines: of each frame, for errors. FormatError.

    start: time of day of the first frame, in seconds.
    """
    back = np.flatnonzero(np.diff(times) <= 0)
    if len(back):
        frame = int(back[0]) + 1
        raise FormatError(
            f"time runs backwards: {times[frame]:g} s after {times[frame - 1]:g} s",
            path=path,
            line=lines[frame],
        )
    try:
        return MarkerMotion(
            tuple(unique_names(labels, len(labels))),
            positions * metres,
            times,
            rate,
            unit=unit,
            up=up,
            name=name,
            start=start,
        )
    except ModelError as error:
        raise FormatError(error.finding, path=path) from error


def warn_if_cut(path: Path, told: float, there: int) -> None:
    """Warn (FbaWarning) if a file holds another number of frames than it says."""
    if np.isfinite(told) and told != there:
        warnings.warn(
            f"{path}: says that it has {told:g} frames, but holds {there}; these are read",
            FbaWarning,
            stacklevel=3,
        )

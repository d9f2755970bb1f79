"""What readers of markers share: lines and rows of numbers, names of markers, and the frame rate."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

import numpy as np

from fba.arrays import Float64
from fba.capture import MarkerMotion
from fba.choices import FileUpAxis
from fba.errors import FormatError, Remedy, warn
from fba.formats.text.frame_rates import Rate, parse_rate
from fba.limits import Limits
from fba.recognition import HEAD_BYTES, recognition_hint
from fba.sampling import regular_times
from fba.source import Path, naming_file, read_whole, stem_of

MISSING = ("", "nan", "null", "none", "-", "na", "n/a")
"""Words, in lower case, that stand for a number that is not there."""
ROUNDING = 0.1
"""Share of a frame by which rounded times may differ from those of a constant rate."""
MOST_COLUMNS = 20 * MarkerMotion.MAX_MARKERS
METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001, "dm": 0.1, "in": 0.0254, "ft": 0.3048}
"""Units of length, in metres."""
MIN_FRAME_RATE = 0.001
"""Lowest rate, in frames per second; a lower one is damage."""
MAX_FRAME_RATE = 100_000
"""Highest rate, in frames per second; a higher one is damage."""


def read_lines(path: Path, what: str) -> list[str]:
    """Return the lines of a text file. what: its kind, "a TRC file", for the error about binary data."""
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
    """Return rows of numbers, float64 (T, columns), NaN for gaps, and the line of each row (1-based).

    first, last: the first line to read, and the line at which to stop. Empty lines are skipped. Missing cells
    at the end of a row are gaps. Raises FormatError for a cell that is no number, for too many cells, and
    without rows.
    """
    if columns > MOST_COLUMNS:
        raise FormatError(f"has {columns} columns, more than the {MOST_COLUMNS} that are read", path=path)
    numbers = [n for n in range(first, len(lines) if last is None else last) if lines[n].strip(" \t,;")]
    if not numbers:
        raise FormatError("holds no frames", path=path)
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


def frame_times(times: Float64, rate: Fraction) -> Float64:
    """Return times of frames; times that were rounded to a few digits become those of a constant rate."""
    if not np.isfinite(times).all():
        return regular_times(len(times), rate)
    regular = regular_times(len(times), rate, float(times[0]) if len(times) else 0.0)
    off = float(np.abs(times - regular).max(initial=0.0))
    return regular if off < ROUNDING / float(rate) else times


def build_motion(
    labels: list[str],
    positions: Float64,
    times: Float64,
    rate: Fraction,
    *,
    metres: float,
    unit: str,
    up: FileUpAxis,
    path: Path,
    lines: list[int],
    name: str = "",
    start: float | None = None,
) -> MarkerMotion:
    """Return the motion. Raises FormatError.

    metres: length of the file's unit. lines: the line of each frame, for errors. start: time of day of the
    first frame, in seconds. name: by default the file's.
    """
    back = np.flatnonzero(np.diff(times) <= 0)
    if len(back):
        frame = int(back[0]) + 1
        raise FormatError(
            f"time runs backwards: {times[frame]:g} s after {times[frame - 1]:g} s",
            path=path,
            line=lines[frame],
        )
    names = tuple(unique_names(labels, len(labels)))
    with naming_file(path):
        return MarkerMotion(
            names, positions * metres, times, rate, unit=unit, up=up, name=name or stem_of(path), start=start
        )


def warn_if_cut(path: Path, stated: float, count: int) -> None:
    """Warn (FbaWarning) if a file does not hold as many frames as it states; NaN where it states nothing."""
    if np.isfinite(stated) and stated != count:
        warn(f"{path}: says that it has {stated:g} frames, but holds {count}; these are read", stacklevel=3)


def file_rate(stored: float | str, source_rate: Rate | None, path: Path) -> Fraction:
    """Return the frame rate of a file: the stored rate, or `source_rate` if that is 0 or missing.

    Raises FormatError for a stored rate that is no positive number.
    """
    try:
        number = float(stored) if stored != "" else 0.0
    except ValueError:
        number = float("nan")
    if number == 0:
        if source_rate is None:
            raise FormatError("has no frame rate", path=path).with_remedies(
                Remedy("source_rate", "give one with {}", "100")
            )
        return Fraction(source_rate)
    if not MIN_FRAME_RATE <= number <= MAX_FRAME_RATE:
        raise FormatError(
            f"its frame rate must be {MIN_FRAME_RATE} to {MAX_FRAME_RATE}", path=path, token=str(stored)
        )
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


def unique_names(labels: Sequence[str], count: int) -> list[str]:
    """Return `count` names: labels; "marker 7" where a label is missing, "name (2)" where it is repeated."""
    result: list[str] = []
    taken: dict[str, int] = {}
    used = set(labels)
    for number in range(count):
        label = (labels[number].strip() if number < len(labels) else "") or f"marker {number + 1}"
        taken[label] = taken.get(label, 0) + 1
        name = label
        while taken[label] > 1 and (name := f"{label} ({taken[label]})") in used:
            taken[label] += 1
        used.add(name)
        result.append(name)
    return result


def without_subject(labels: list[str]) -> list[str]:
    """Return names without the subject that all of them share: "Anna:Chin" -> "Chin"."""
    subjects = {
        label.partition(":")[0] if ":" in label else "" for label in labels if label[:1] not in ("", "*")
    }
    if len(subjects) != 1 or "" in subjects:
        return labels
    return [label.partition(":")[2] or label for label in labels]

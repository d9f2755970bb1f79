"""Read plain tables of markers: wide, columns "Chin_x", "Chin_y", "Chin_z"; or long, a row for each marker.

Cells are separated by commas, semicolons or tabs. A column "time" or "frame" is optional. The unit of length
follows from the size of the face, unless a header names it: "Chin_x (mm)".
"""

from __future__ import annotations

import csv
import re
from fractions import Fraction

import numpy as np

from fba.arrays import Float64
from fba.capture import MarkerMotion
from fba.errors import FormatError
from fba.formats.markers._rows import (
    METRES,
    build_motion,
    file_rate,
    frame_times,
    parse_rows,
    rate_of_times,
    read_lines,
)
from fba.formats.text.frame_rates import Rate
from fba.limits import DEFAULT_LIMITS, Limits
from fba.sampling import regular_times
from fba.source import Path

TIMES = ("time", "times", "timestamp", "t", "seconds", "sec", "time (s)", "time (seconds)", "time_s")
FRAMES = ("frame", "frames", "frame#", "index", "")
NAMES = ("marker", "name", "label", "marker_name")
AXIS = re.compile(r"(.+?)[ _.:\-]?([xyz])(?:\s*[\[(](m|cm|mm)[\])])?", re.IGNORECASE)
MIN_SHARE = 0.5
"""Smallest share of the columns that belong to markers: other tables have columns x, y, z, too."""
MIN_MARKERS = 3
"""Smallest number of markers in a wide table."""


def sniff(head: bytes, suffix: str) -> bool:
    """Whether the first line of a file names markers."""
    line = head.lstrip(b"\xef\xbb\xbf").split(b"\n", 1)[0].strip(b"\r")
    try:
        cells = _cells(line.decode(), _delimiter(line.decode()))
    except UnicodeDecodeError:
        return False
    count = len(_triples(cells))
    return _is_long(cells) or (count >= MIN_MARKERS and 3 * count >= MIN_SHARE * len(cells))


def read_markers(
    path: Path, *, source_rate: Rate | None = None, limits: Limits = DEFAULT_LIMITS
) -> MarkerMotion:
    """Return the markers of a table. source_rate: the rate of a file without times.

    Raises FormatError, LimitError.
    """
    lines = read_lines(path, "a table of markers")
    delimiter = _delimiter(lines[0])
    cells = _cells(lines[0], delimiter)
    if _is_long(cells):
        labels, positions, times, numbers = _read_long(lines, cells, delimiter, path, limits)
        unit = ""
    else:
        triples = _triples(cells)
        if not triples:
            raise FormatError(
                "names no markers in its first line: expected columns such as Chin_x, Chin_y, Chin_z, or "
                "frame, marker, x, y, z", path=path, line=1,
            )  # fmt: skip
        rows, numbers = parse_rows(lines, 1, delimiter, len(cells), path, limits)
        labels = [label for label, _, _ in triples]
        positions = rows[:, np.array([places for _, places, _ in triples])]
        unit = triples[0][2]
        place = next((n for n, cell in enumerate(cells) if cell.lower() in TIMES), None)
        times = rows[:, place] if place is not None else np.full(len(rows), np.nan)
    if np.isfinite(times).all():
        back = np.flatnonzero(np.diff(times) <= 0)
        rate = file_rate(
            rate_of_times(times.tolist()) if not len(back) else 0, source_rate or Fraction(1), path
        )
        times = frame_times(times, rate)
    else:
        rate = file_rate("", source_rate, path)
        times = regular_times(len(positions), rate)
    return build_motion(
        labels, positions, times, rate, metres=METRES.get(unit, 1.0), unit=unit, up="", path=path,
        lines=numbers,
    )  # fmt: skip


def _delimiter(line: str) -> str:
    return max("\t;,", key=line.count)


def _cells(line: str, delimiter: str) -> list[str]:
    try:
        return [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter), [])]
    except csv.Error:  # a line break in a cell, or a cell of 131,072 characters
        return []


def _is_long(cells: list[str]) -> bool:
    words = [cell.lower() for cell in cells]
    return {"x", "y", "z"} <= set(words) and any(name in words for name in NAMES)


def _triples(cells: list[str]) -> list[tuple[str, tuple[int, int, int], str]]:
    """Return name, columns of x, y, z, and unit of each marker, in the order of the columns."""
    found: dict[str, dict[str, int]] = {}
    units: dict[str, str] = {}
    for n, cell in enumerate(cells):
        match = AXIS.fullmatch(cell)
        if match is None or cell.lower() in (*TIMES, *FRAMES):
            continue
        found.setdefault(match[1], {})[match[2].lower()] = n
        units[match[1]] = (match[3] or "").lower()
    return [
        (label, (axes["x"], axes["y"], axes["z"]), units[label])
        for label, axes in found.items()
        if len(axes) == 3
    ]


def _read_long(
    lines: list[str], cells: list[str], delimiter: str, path: Path, limits: Limits
) -> tuple[list[str], Float64, Float64, list[int]]:
    """Return names, positions (T, M, 3), times (T,) and lines of a table with a row for each marker."""
    words = [cell.lower() for cell in cells]
    label = next(n for n, word in enumerate(words) if word in NAMES)
    axes = [words.index(axis) for axis in "xyz"]
    by_time = next((n for n, word in enumerate(words) if word in TIMES), None)
    by_frame = next((n for n, word in enumerate(words) if word and word in FRAMES), None)
    key = by_frame if by_frame is not None else by_time
    if key is None:
        raise FormatError("has no column time or frame", path=path, line=1)
    names: dict[str, int] = {}
    owner: list[int] = []
    body = [""]
    for line in lines[1:]:
        row = line.split(delimiter)
        if len(row) > label and line.strip():
            owner.append(names.setdefault(row[label].strip().strip('"'), len(names)))
            row[label] = ""
        body.append(delimiter.join(row))
    if len(names) > MarkerMotion.MAX_MARKERS:
        raise FormatError(
            f"names {len(names)} markers, more than the {MarkerMotion.MAX_MARKERS} that are read", path=path
        )
    rows, numbers = parse_rows(body, 1, delimiter, len(cells), path, limits)
    if len(owner) != len(rows):
        raise FormatError("a row names no marker", path=path)
    keys = rows[:, key]
    if not np.isfinite(keys).all():
        raise FormatError(
            f"a row has no {words[key]}", path=path, line=numbers[int(np.argmin(np.isfinite(keys)))]
        )
    starts = np.flatnonzero(np.concatenate([[True], np.diff(keys) != 0]))
    frame = np.cumsum(np.concatenate([[True], np.diff(keys) != 0])) - 1
    limits.check_bytes(24 * 2 * len(starts) * len(names), f"{path}: a capture", source=sum(map(len, lines)))
    positions = np.full((len(starts), len(names), 3), np.nan)
    positions[frame, owner] = rows[:, axes]
    times = rows[starts, by_time] if by_time is not None else np.full(len(starts), np.nan)
    return list(names), positions, times, [numbers[n] for n in starts]

"""Read TRC (track row column), the marker format of Motion Analysis and OpenSim: a table with tabs.

Programs differ: some write no empty line before the data, no two empty cells after each name, columns
"name_x", tabs at the end of lines, frames counted from 0, or empty cells for missing markers.
"""

from __future__ import annotations

import re

import numpy as np

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
    warn_if_cut,
    without_subject,
)
from fba.formats.text.frame_rates import Rate
from fba.limits import DEFAULT_LIMITS, Limits
from fba.source import Path

HEADER_LINES = 12
"""Most lines before the data."""


def sniff(head: bytes, suffix: str) -> bool:
    """Whether the first bytes of a file look like TRC."""
    return re.match(rb"(?:\xef\xbb\xbf)?\s*PathFileType\b", head) is not None


def read_markers(
    path: Path, *, source_rate: Rate | None = None, limits: Limits = DEFAULT_LIMITS
) -> MarkerMotion:
    """Return the markers of a TRC file. source_rate: the rate of a file that has none.

    Raises FormatError, LimitError; warns (FbaWarning) of a wrong number of frames.
    """
    lines = read_lines(path, "a TRC file")
    if not sniff(lines[0].encode(), ""):
        raise FormatError("a TRC file begins with PathFileType", path=path, line=1)
    row = next((n for n, line in enumerate(lines[:HEADER_LINES]) if _is_names(line)), None)
    if row is None or row < 2:
        raise FormatError(
            "has no line of names that begins with Frame#, after two lines of a header", path=path
        )
    delimiter = "\t" if "\t" in lines[row] else ","
    header = _header(lines[row - 2], lines[row - 1], delimiter)
    first = row + 1
    while first < min(len(lines), HEADER_LINES) and not re.match(r"\s*[-+\d]", lines[first]):
        first += 1
    labels = _labels(lines[row].split(delimiter)[2:], lines[row + 1 : first], delimiter, path, row + 1)
    rows, numbers = parse_rows(lines, first, delimiter, 2 + 3 * len(labels), path, limits)
    warn_if_cut(path, _number(header.get("numframes", "")), len(rows))
    times = rows[:, 1]
    stored = header.get("datarate", "") or (
        rate_of_times(times.tolist()) if np.isfinite(times).all() else 0.0
    )
    rate = file_rate(stored, source_rate, path)
    unit = header.get("units", "").lower()
    return build_motion(
        without_subject(labels), rows[:, 2:].reshape(len(rows), -1, 3), frame_times(times, rate), rate,
        metres=METRES.get(unit, 0.001), unit=unit if unit in METRES else "", up="",
        path=path, lines=numbers,
    )  # fmt: skip


def _is_names(line: str) -> bool:
    return re.match(r"\s*Frame\s*#?\s*(\t|,|$)", line, re.IGNORECASE) is not None


def _header(keys: str, values: str, delimiter: str) -> dict[str, str]:
    """Return the values of the header by lower-case key."""
    words = [word.strip() for word in values.split(delimiter) if word.strip()]
    names = [key.strip().lower() for key in keys.split(delimiter) if key.strip()]
    if len(words) != len(names):
        words, names = values.split(), keys.lower().split()
    return dict(zip(names, words, strict=False))


def _labels(cells: list[str], below: list[str], delimiter: str, path: Path, line: int) -> list[str]:
    """Return the names of markers, three columns each. below: lines between names and data."""
    cells = [cell.strip() for cell in cells]
    while cells and not cells[-1]:
        cells.pop()
    axes = [re.fullmatch(r"(.+?)[ _.:]?([xyz])", cell, re.IGNORECASE) for cell in cells]
    if len(cells) % 3 == 0 and all(axes):
        triples = [[match[1] for match in axes[n : n + 3] if match] for n in range(0, len(axes), 3)]
        if all(len(set(triple)) == 1 for triple in triples):
            return [triple[0] for triple in triples]
    filled = [n for n, cell in enumerate(cells) if cell]
    if not filled:
        raise FormatError("names no markers", path=path, line=line)
    if len(filled) == 1 or not any(n % 3 for n in filled):
        columns = max((len([c for c in text.split(delimiter) if c.strip()]) for text in below), default=0)
        count = max(filled[-1] // 3 + 1, columns // 3)
        return [cells[3 * n] if 3 * n < len(cells) else "" for n in range(count)]
    if len(filled) < len(cells):
        raise FormatError("names stand in columns that are no multiple of three apart", path=path, line=line)
    return cells


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return float("nan")

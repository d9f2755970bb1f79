"""Read the CSV export of OptiTrack Motive, versions 1.2 to 1.25: markers by name, y up.

The first columns vary (a frame, a time, a time code), so rows and columns are found by their labels.
"""

from __future__ import annotations

import csv
import re
from contextlib import suppress

import numpy as np

from fba.arrays import Float64
from fba.capture import MarkerMotion
from fba.errors import FormatError, warn
from fba.formats.markers._rows import (
    METRES,
    build_motion,
    file_rate,
    frame_times,
    parse_rows,
    rate_of_times,
    read_lines,
    without_subject,
)
from fba.formats.text.frame_rates import Rate
from fba.formats.time_codes import parse_time_of_day, read_time_codes
from fba.limits import DEFAULT_LIMITS, Limits
from fba.source import Path

UNIT_NAMES = {"meters": "m", "centimeters": "cm", "millimeters": "mm", "inches": "in", "feet": "ft"}
KINDS = (("marker",), ("rigid body marker", "bone marker"))
"""Types of columns with markers, measured ones first: the others are read only without these."""
HEADER_LINES = 12
"""Most lines before the data."""
TYPES = {"marker", "rigid body", "rigid body marker", "bone", "bone marker", "skeleton", "trained markerset"}


def sniff(head: bytes, suffix: str) -> bool:
    """Whether the first bytes of a file look like an export of Motive."""
    return re.match(rb'(?:\xef\xbb\xbf)?"?Format Version"?\s*,', head, re.IGNORECASE) is not None


def read_markers(
    path: Path, *, source_rate: Rate | None = None, limits: Limits = DEFAULT_LIMITS
) -> MarkerMotion:
    """Return the markers of a CSV export of Motive; unlabelled ones only where no marker has a label.

    source_rate: the rate of a file that has none. Raises FormatError, LimitError; warns (FbaWarning) of
    markers that are left out.
    """
    lines = read_lines(path, "a CSV export of Motive")
    if not sniff(lines[0].encode(), ""):
        raise FormatError("a CSV export of Motive begins with Format Version", path=path, line=1)
    try:
        head = list(csv.reader(lines[:HEADER_LINES]))
    except csv.Error as error:
        raise FormatError(f"its header is no table: {error}", path=path) from error
    # csv.reader keeps empty lines, so the number of a row is that of its line
    row = next((n for n, cells in enumerate(head) if cells and cells[0].strip().lower() == "frame"), None)
    if row is None:
        raise FormatError("has no line of columns that begins with Frame", path=path)
    settings = {
        key.strip().lower(): value.strip() for key, value in zip(head[0][::2], head[0][1::2], strict=False)
    }
    columns = [cell.strip() for cell in head[row]]
    while columns and not columns[-1]:
        columns.pop()
    chosen = _find_markers(head[1:row], columns, path)
    rows, numbers = parse_rows(
        _without_codes(lines, row + 1, columns), row + 1, ",", len(columns), path, limits
    )
    second = next((n for n, cell in enumerate(columns) if cell.lower().startswith("time (")), None)
    times = rows[:, second] if second is not None else np.full(len(rows), np.nan)
    stored: str | float = settings.get("export frame rate", "") or settings.get("capture frame rate", "")
    rate = file_rate(stored or rate_of_times(times[np.isfinite(times)].tolist()), source_rate, path)
    places = np.array([start for _, start in chosen])[:, None] + np.arange(3)
    unit = UNIT_NAMES.get(settings.get("length units", "meters").lower(), "")
    return build_motion(
        without_subject([label for label, _ in chosen]), rows[:, places], frame_times(times, rate), rate,
        metres=METRES.get(unit, 1.0), unit=unit, up="+y",
        name=settings.get("take name", ""), path=path, lines=numbers,
        start=_find_start(settings, columns, lines, numbers, times, path),
    )  # fmt: skip


def _find_start(
    settings: dict[str, str],
    columns: list[str],
    lines: list[str],
    numbers: list[int],
    times: Float64,
    path: Path,
) -> float | None:
    """Return the time of day of the first frame, in seconds; None if the file does not say it.

    It is the frame's time code; without time codes, the start of the take plus the frame's time. numbers: the
    line of each frame, 1-based.
    """
    place = _code_column(columns)
    if place is not None:
        codes = ["".join(lines[number - 1].split(",")[place : place + 1]).strip() for number in numbers]
        if codes[0]:
            filled = [code or codes[0] for code in codes]
            with suppress(FormatError):  # codes of another kind
                return read_time_codes(filled, numbers, path).start
    begun = parse_time_of_day(settings.get("capture start time", ""))
    return None if begun is None else begun + float(np.nan_to_num(times[0]))


def _code_column(columns: list[str]) -> int | None:
    return next((n for n, cell in enumerate(columns) if cell.lower() == "timecode"), None)


def _find_markers(rows: list[list[str]], columns: list[str], path: Path) -> list[tuple[str, int]]:
    """Return the name and the first column of each marker. rows: the header's, without its first."""
    cells = [[cell.strip() for cell in row] + [""] * (len(columns) - len(row)) for row in rows if any(row)]
    types = next((row for row in cells if any(cell.lower() in TYPES for cell in row[2:])), None)
    kinds = next((row for row in cells if any(cell.lower() == "position" for cell in row)), None)
    if types is None or kinds is None:
        raise FormatError("has no rows that say which columns are the positions of markers", path=path)
    names = next((row for row in cells if "name" in (cell.lower() for cell in row[:2])), None)
    names = names or cells[cells.index(types) + 1]
    found = [
        (types[n].lower(), names[n], n)
        for n in range(len(columns) - 2)
        if kinds[n].lower() == "position" and [cell.lower() for cell in columns[n : n + 3]] == ["x", "y", "z"]
    ]
    for wanted in KINDS:
        markers = [(name, n) for kind, name, n in found if kind in wanted]
        if not markers:
            continue
        labelled = [one for one in markers if not re.match(r"(.*:)?unlabell?ed\b", one[0], re.IGNORECASE)]
        if labelled and len(labelled) < len(markers):
            warn(
                f"{path}: {len(markers) - len(labelled)} columns of markers without a label are left out",
                stacklevel=3,
            )
        return labelled or markers
    raise FormatError(
        "holds no markers, only rigid bodies or bones; export markers from Motive as well", path=path
    )


def _without_codes(lines: list[str], first: int, columns: list[str]) -> list[str]:
    """Return lines without time codes, which are no numbers."""
    place = _code_column(columns)
    if place is None:
        return lines
    result = lines[:first]
    for line in lines[first:]:
        cells = line.split(",", place + 1)
        if len(cells) > place:
            cells[place] = ""
        result.append(",".join(cells))
    return result

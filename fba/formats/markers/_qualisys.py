"""Read the TSV export of Qualisys Track Manager: lines of settings, then columns X, Y, Z; millimetres, z up.

An unseen marker has three zeros or three empty cells. Columns for frame and time are optional.
"""

from __future__ import annotations

import re

import numpy as np

from fba.capture import MarkerMotion
from fba.errors import FormatError
from fba.formats.markers._rows import (
    build_motion,
    file_rate,
    frame_times,
    parse_rows,
    read_lines,
    warn_if_cut,
)
from fba.formats.text.frame_rates import Rate
from fba.formats.time_codes import parse_time_of_day
from fba.limits import DEFAULT_LIMITS, Limits
from fba.sampling import regular_times
from fba.source import Path

MAX_SETTINGS = 30
"""Most lines of settings that are read."""


def sniff(head: bytes, suffix: str) -> bool:
    """Whether the first bytes of a file look like an export of Qualisys."""
    return re.match(rb"(?:\xef\xbb\xbf)?\s*NO_OF_FRAMES\t", head) is not None


def read_markers(
    path: Path, *, source_rate: Rate | None = None, limits: Limits = DEFAULT_LIMITS
) -> MarkerMotion:
    """Return the markers of a TSV export of Qualisys Track Manager.

    source_rate: the rate of a file that has none. Raises FormatError, LimitError; warns (FbaWarning) of a
    wrong number of frames.
    """
    lines = read_lines(path, "a TSV export of Qualisys")
    if not sniff(lines[0].encode() + b"\t", ""):
        raise FormatError("a TSV export of Qualisys begins with NO_OF_FRAMES", path=path, line=1)
    settings: dict[str, list[str]] = {}
    first = 0
    while first < min(len(lines), MAX_SETTINGS) and re.match(r"\s*[A-Z][A-Z_]{3,}(\t|\s*$)", lines[first]):
        key, *values = lines[first].strip().split("\t")
        # a second line of a key describes the export
        settings.setdefault(key.strip(), [value.strip() for value in values])
        first += 1
    labels = [label for label in settings.get("MARKER_NAMES", ()) if label]
    if not labels:
        raise FormatError(
            "has no line MARKER_NAMES; six-dimensional exports hold bodies, not markers", path=path
        )
    stated = _first_number(settings, "NO_OF_MARKERS")
    if np.isfinite(stated) and stated != len(labels):
        raise FormatError(f"says that it has {stated:g} markers, but names {len(labels)}", path=path)
    leading = 0
    if first < len(lines) and re.match(r"\s*[A-Za-z]", lines[first]):  # a row of columns
        cells = [cell.strip().lower() for cell in lines[first].split("\t")]
        leading = next((n for n, cell in enumerate(cells) if cell not in ("frame", "time")), 0)
        first += 1
    elif first < len(lines):
        leading = len(lines[first].rstrip("\r\n\t").split("\t")) - 3 * len(labels)
        leading = leading if leading in (1, 2) else 0
    rows, numbers = parse_rows(lines, first, "\t", leading + 3 * len(labels), path, limits)
    warn_if_cut(path, _first_number(settings, "NO_OF_FRAMES"), len(rows))
    rate = file_rate((settings.get("FREQUENCY") or [""])[0], source_rate, path)
    positions = rows[:, leading:].reshape(len(rows), -1, 3)
    positions[(positions == 0).all(axis=2)] = np.nan
    times = frame_times(rows[:, 1], rate) if leading == 2 else regular_times(len(rows), rate)
    begun = parse_time_of_day(" ".join(settings.get("TIME_STAMP", ())[:1]))
    return build_motion(
        labels, positions, times, rate, metres=0.001, unit="mm", up="+z", path=path,
        lines=numbers, start=None if begun is None else begun + float(times[0]),
    )  # fmt: skip


def _first_number(settings: dict[str, list[str]], key: str) -> float:
    try:
        return float((settings.get(key) or ["nan"])[0])
    except ValueError:
        return float("nan")

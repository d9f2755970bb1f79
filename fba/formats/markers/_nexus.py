"""Read the section Trajectories of a CSV export of Vicon Nexus; z up.

A section has a line with its name, a line with the rate, a row of names over every third column, a row of
axes, a row of units, the data, and an empty line.
"""

from __future__ import annotations

import re

import numpy as np

from fba.capture import MarkerMotion
from fba.errors import FormatError
from fba.formats.markers._rows import METRES, build_motion, file_rate, parse_rows, read_lines, without_subject
from fba.formats.text.frame_rates import Rate
from fba.limits import DEFAULT_LIMITS, Limits
from fba.source import Path

SECTION = re.compile(r"\s*\"?(Trajectories|Markers)\"?[\s,;]*", re.IGNORECASE)
OTHERS = rb"(?:Trajectories|Markers|Devices|Model Outputs|Joints|Segments|Events)"


def sniff(head: bytes, suffix: str) -> bool:
    """Whether the first bytes of a file look like an export of Nexus."""
    if not re.match(rb"(?:\xef\xbb\xbf)?\s*\"?" + OTHERS + rb"\"?[\s,;]*[\r\n]", head, re.IGNORECASE):
        return False
    return re.search(rb"Frame[,;\t]\"?Sub Frame", head, re.IGNORECASE) is not None or len(head) >= 65536


def read_markers(
    path: Path, *, source_rate: Rate | None = None, limits: Limits = DEFAULT_LIMITS
) -> MarkerMotion:
    """Return the trajectories of a CSV export of Nexus. source_rate: the rate of a file that has none.

    Raises FormatError, LimitError.
    """
    lines = read_lines(path, "a CSV export of Nexus")
    start = next((n for n, line in enumerate(lines) if SECTION.fullmatch(line)), None)
    if start is None or start + 4 >= len(lines):
        raise FormatError("has no section Trajectories; export trajectories from Nexus", path=path)
    heads = lines[start + 3]
    delimiter = next((one for one in ",\t;" if one in heads), ",")
    names = [cell.strip().strip('"') for cell in lines[start + 2].split(delimiter)]
    axes = [cell.strip().strip('"').lower() for cell in heads.split(delimiter)]
    while axes and not axes[-1]:
        axes.pop()
    if not axes or axes[0] != "frame":
        raise FormatError("expected a row that begins with Frame,Sub Frame", path=path, line=start + 4)
    places = [n for n, axis in enumerate(axes) if n > 0 and axes[n : n + 3] == ["x", "y", "z"]]
    if not places:
        raise FormatError("no columns are called X, Y, Z", path=path, line=start + 4)
    units = [cell.strip().strip('"').lower() for cell in lines[start + 4].split(delimiter)]
    unit = units[places[0]] if places[0] < len(units) else ""
    end = start + 5
    while end < len(lines) and lines[end].strip(" \t,;"):
        end += 1
    if end == start + 5:
        raise FormatError("the section Trajectories holds no frames", path=path, line=start + 6)
    rows, numbers = parse_rows(lines, start + 5, delimiter, len(axes), path, limits, last=end)
    rate = file_rate(lines[start + 1].strip(' \t,;"'), source_rate, path)
    frames = rows[:, 0]
    if not np.isfinite(frames).all():
        raise FormatError(
            "a frame has no number", path=path, line=numbers[int(np.argmin(np.isfinite(frames)))]
        )
    times = (frames - frames[0]) / float(rate)
    columns = np.array(places)[:, None] + np.arange(3)
    labels = [names[n] if n < len(names) else "" for n in places]
    return build_motion(
        without_subject(labels), rows[:, columns], times, rate,
        metres=METRES.get(unit, 0.001), unit=unit if unit in METRES else "", up="+z",
        path=path, lines=numbers,
    )  # fmt: skip

"""Times of rows: seconds and milliseconds to seconds from the first row, and their order."""

from __future__ import annotations

import numpy as np

from fba.arrays import Float64
from fba.errors import FormatError
from fba.source import Path

MOST_MILLISECONDS = 5.0
"""Median step above which times are milliseconds: no capture is that slow in seconds."""


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

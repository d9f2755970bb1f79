"""Results: rows of numbers, each of one way to code all subjects of a kind, and CSV files of them."""

from __future__ import annotations

import csv
import io
from dataclasses import asdict, dataclass, fields
from pathlib import Path

from fba.errors import FormatError

HEADER_BYTES = 40
"""IP version 4, UDP and RTP: 20, 8 and 12 bytes in front of every packet."""


ALL, SENT = "all", "sent"
"""Which numbers rivals code."""
EVERYTHING = "all"
"""The subject of results that sum up all subjects."""


@dataclass(frozen=True)
class Result:
    """What all subjects of a kind take together, coded in one way.

    data: what was measured, in words. subject: `EVERYTHING`, or the name of the one file that it is of.
    kind: "face" or "body". method: who codes. point: the setting, "quantiser 4"; of rivals, the one whose
    values they code, "FBA compact, quantiser 4". numbers: which of them rivals code, "all" or "sent"; "" for
    this codec. subjects, frames, seconds: of the sources. packets: live. file_bytes; live_bytes: without
    packet headers, None where there is no live form. max_mm, p99_mm, under: largest error, 99th percentile,
    share of samples within `THRESHOLDS`. degrees: the largest error of the head's rotation. feet_mm: of soles
    that stand. units: the largest of a parameter.
    """

    data: str
    subject: str
    kind: str
    method: str
    point: str
    numbers: str
    subjects: int
    frames: int
    seconds: float
    packets: int
    file_bytes: int | None
    live_bytes: int | None
    max_mm: float
    p99_mm: float
    under: float
    degrees: float
    feet_mm: float
    units: float

    @property
    def file_rate(self) -> float | None:
        """Kilobits a second as a file."""
        return None if self.file_bytes is None else 8e-3 * self.file_bytes / self.seconds

    @property
    def live_rate(self) -> float | None:
        """Kilobits a second live, without packet headers."""
        return None if self.live_bytes is None else 8e-3 * self.live_bytes / self.seconds

    @property
    def header_rate(self) -> float:
        """Kilobits a second of packet headers."""
        return 8e-3 * HEADER_BYTES * self.packets / self.seconds


_ROUNDED = {"seconds": 3, "max_mm": 4, "p99_mm": 4, "under": 6, "degrees": 4, "feet_mm": 3, "units": 1}
_NAMES = tuple(field.name for field in fields(Result))
_TEXT = ("data", "subject", "kind", "method", "point", "numbers")
_RATES = ("file_kbit_s", "live_kbit_s")


def results_csv(results: list[Result]) -> str:
    """Return results as CSV; its last columns are their bit rates."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([*_NAMES, *_RATES])
    for result in results:
        row = asdict(result)
        cells = [_cell(row[name], _ROUNDED.get(name)) for name in _NAMES]
        writer.writerow([*cells, _cell(result.file_rate, 3), _cell(result.live_rate, 3)])
    return text.getvalue()


def _cell(value: object, digits: int | None) -> object:
    if value is None:
        return ""
    return f"{value:.{digits}f}" if digits is not None else value


def read_results(path: Path) -> list[Result]:
    """Return the results of a CSV file; FormatError for one that `results_csv` did not write."""
    rows = list(csv.reader(io.StringIO(path.read_text(encoding="utf-8"))))
    if not rows or tuple(rows[0]) != (*_NAMES, *_RATES):
        raise FormatError("no results of `./dev bitrate`: the header is another", path=path, line=1)
    return [_parse(dict(zip(_NAMES, row, strict=False)), path, line) for line, row in enumerate(rows[1:], 2)]


def _parse(cells: dict[str, str], path: Path, line: int) -> Result:
    values: dict[str, object] = {}
    try:
        for name in _NAMES:
            text = cells[name]
            if name in _TEXT:
                values[name] = text
            elif name in _ROUNDED:
                values[name] = float(text)
            else:
                values[name] = int(text) if text else None
    except (KeyError, ValueError) as error:
        raise FormatError(f"a row with {len(cells)} good cells", path=path, line=line) from error
    return Result(**values)  # type: ignore[arg-type]

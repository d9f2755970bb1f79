"""Tables of numbers as text, a header with names of columns, then a row for each moment; times of rows."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from itertools import islice

import numpy as np

from fba.arrays import Float64
from fba.errors import FormatError
from fba.limits import Limits
from fba.recognition import HEAD_BYTES, recognition_hint
from fba.sampling import find_rate
from fba.source import Path, naming_file, read_whole

MOST_COLUMNS = 20_000
"""Most columns of a table; no tracker writes as many."""
CELL_BYTES = 16
"""Memory of a number of a table while it is read."""
SEPARATORS = ",;\t"
MISSING = ("", "nan", "na", "n/a", "null", "none", "-nan", "nan(ind)", "-nan(ind)")
"""Words, in lower case, that stand for a missing number."""
NAMED = 6
"""Most names in a message."""
MOST_MILLISECONDS = 5.0
"""Median step above which times are milliseconds: no capture is that slow in seconds."""


@dataclass(frozen=True, eq=False)
class Table:
    """A table.

    names: of the columns, without surrounding blanks. rows: cells as text. lines: the line of each row. cut:
    whether an incomplete last row was left out.
    """

    path: Path
    names: tuple[str, ...]
    rows: list[list[str]]
    lines: list[int]
    cut: bool = False

    @cached_property
    def columns(self) -> dict[str, int]:
        """The number of each column by name; of two columns with one name, the first."""
        return {name: number for number, name in reversed(list(enumerate(self.names)))}

    def column(self, number: int) -> list[str]:
        """Return the cells of a column, without surrounding blanks."""
        return [row[number].strip() for row in self.rows]

    def numbers(self, columns: list[int]) -> Float64:
        """Return numbers (T, N) of columns; NaN for missing ones. Raises FormatError for other text."""
        result = np.empty((len(self.rows), len(columns)))
        adjacent = columns == list(range(columns[0], columns[0] + len(columns))) if columns else False
        for number, row in enumerate(self.rows):
            cells = row[columns[0] : columns[0] + len(columns)] if adjacent else [row[c] for c in columns]
            try:
                result[number] = list(map(float, cells))
            except ValueError:
                result[number] = [self._number(number, column) for column in columns]
        result[np.isinf(result)] = np.nan
        return result

    def _number(self, row: int, column: int) -> float:
        text = self.rows[row][column].strip()
        if text.lower() in MISSING:
            return float("nan")
        try:
            return float(text)
        except ValueError:
            raise FormatError(
                f"column {self.names[column]!r} holds no number; expected one, or an empty cell",
                path=self.path,
                line=self.lines[row],
                token=text,
            ) from None


def header_names(head: bytes) -> list[str]:
    """Return the cells of the first line, without blanks and quotes. head: the beginning of a file."""
    line = head.removeprefix(b"\xef\xbb\xbf").lstrip().split(b"\n", 1)[0]
    text = line.decode("utf-8", errors="replace").strip()
    return _cells(text, _separator(text))


def read_table(path: Path, limits: Limits) -> Table:
    """Return a table of UTF-8 text whose cells are separated by commas, semicolons or tabs.

    Decimal commas are read where cells are not separated by commas. An incomplete last row, which a recording
    has that was cut off, is left out. Raises FormatError for other files, LimitError.
    """
    data = read_whole(path)
    if b"\0" in data:
        hint = recognition_hint(data[:HEAD_BYTES])
        raise FormatError(f"holds NUL bytes: no table of text{hint}", path=path)
    text = data.decode("utf-8-sig", errors="replace")
    lines = text.splitlines()
    first = next((number for number, line in enumerate(lines) if line.strip()), None)
    if first is None:
        raise FormatError("holds only blanks; expected a header with names of columns", path=path)
    separator = _separator(lines[first])
    names = tuple(_cells(lines[first], separator))
    if not 2 <= len(names) <= MOST_COLUMNS:
        raise FormatError(
            f"the first line has {len(names)} columns; expected names of columns between commas",
            path=path,
            line=first + 1,
        )
    limits.check_bytes(CELL_BYTES * text.count(separator), f"{path}: the table", source=len(data))
    rows, numbers, cut = [], [], False
    for number, line in enumerate(islice(lines, first + 1, None), first + 2):
        if not line.strip():
            continue
        cells = line.split(separator)
        if len(cells) == len(names) + 1 and not cells[-1].strip():
            cells.pop()  # a separator at the end
        if len(cells) != len(names):
            if number >= len(lines) and len(cells) < len(names):
                cut = True
                break
            raise FormatError(
                f"the row has {len(cells)} cells, and the header {len(names)} names", path=path, line=number
            )
        rows.append(cells)
        numbers.append(number)
    if separator != "," and "," in text:
        rows = [[cell.replace(",", ".") for cell in row] for row in rows]
    if not rows:
        raise FormatError("has no row behind the header; there is nothing to read", path=path)
    limits.check_frames(len(rows), f"{path}: the table")
    return Table(path, names, rows, numbers, cut)


def named(names: list[str]) -> str:
    """Return the first names for a message, and the count of the others."""
    more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
    return ", ".join(names[:NAMED]) + more


def check_order(times: Float64, lines: list[int], path: Path) -> None:
    """Raise FormatError for a row that is not later than the row before."""
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
    """Return seconds (T,) from the first row on. times: (T,), in seconds or milliseconds."""
    start = times - times[0]
    step = float(np.median(np.diff(start))) if len(start) > 1 else 0.0
    result: Float64 = start / 1000 if step >= MOST_MILLISECONDS else start
    return result


def regular_seconds(times: Float64, lines: list[int], path: Path) -> tuple[Float64, Fraction]:
    """Return seconds (T,) of rows, as `seconds_of`, and their nominal rate. Raises FormatError."""
    seconds = seconds_of(times)
    check_order(seconds, lines, path)
    with naming_file(path):
        return seconds, find_rate(seconds)


def _separator(line: str) -> str:
    return max(SEPARATORS, key=line.count)


def _cells(line: str, separator: str) -> list[str]:
    return [cell.strip().strip('"').strip() for cell in line.rstrip("\r\n").split(separator)]

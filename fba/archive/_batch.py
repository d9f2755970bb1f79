"""Conversion of many files into a folder: what is done is recorded, so that it need not be done again."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from hashlib import sha256
from pathlib import Path
from typing import Any

from fba.archive._pool import Outcome
from fba.archive._sources import Source
from fba.atomic import atomic, write_error
from fba.errors import FormatError
from fba.source import read_whole

RECORD = "conversions.csv"
"""Name of the table of conversions, in the folder of the results."""
COLUMNS = ("source", "output", "key", "bytes", "error")
MOST_RECORD_BYTES = 1 << 30

Convert = Callable[[Path, Path], object]
"""Converts a file into another, which appears whole or not at all."""
ForEach = Callable[[Callable[[Any], Any], Iterable[Any]], Iterator[Outcome[Any, Any]]]
"""As `for_each` of several processes, or of a cluster."""


@dataclass(frozen=True)
class Conversion:
    """A file and what became of it.

    source: its name below its folder. output: the same of the result. key: SHA-256 of the file and of the
    settings. size: bytes of the result. error: the reason of a failure, or "". unchanged: it was there
    before. warnings: about the file.
    """

    source: str
    output: str
    key: str = ""
    size: int = 0
    error: str = ""
    unchanged: bool = False
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True)
class _Task:
    """A file to convert. known: what the record says of it."""

    source: Source
    target: Path
    known: Conversion | None


def convert_batch(
    sources: Sequence[Source],
    folder: str | os.PathLike[str],
    suffix: str,
    convert: Convert,
    *,
    settings: str,
    for_each: ForEach,
) -> Iterator[Conversion]:
    """Convert files into a folder, with the folders that they lie in; yield each as soon as it is done.

    sources: of `find_sources`. suffix: of the results. convert: converts one file; it runs in other
    processes, where `for_each` has any. settings: text that stands for all settings of `convert`.

    The table `conversions.csv` in the folder says what was done, and why what failed did. A file whose
    content and settings are those of the table, and whose result is there, is not converted again: so a batch
    that was interrupted goes on where it stopped. Raises FormatError where the folder or the table cannot be
    written, and for another file in place of the table.
    """
    root = Path(folder)
    try:
        root.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise write_error(root, error, "cannot be made") from error
    path = root / RECORD
    known = _read_record(path)
    _write_record(path, known)
    tasks = [_Task(one, root / (one.name + suffix), known.get(one.shown)) for one in sources]
    work = partial(_convert_one, convert=convert, settings=settings)
    try:
        with open(path, "a", encoding="utf-8", errors="surrogateescape", newline="") as file:
            table = csv.writer(file)
            for outcome in for_each(work, tasks):
                done = _conversion(outcome, root)
                known[done.source] = done
                if not done.unchanged:
                    table.writerow(_row(done))
                    file.flush()
                yield done
    except OSError as error:
        raise write_error(path, error) from error
    _write_record(path, known)


def _convert_one(task: _Task, *, convert: Convert, settings: str) -> tuple[str, int, bool]:
    """Convert a file; return its key, the bytes of the result, and whether it was there before."""
    path, target, known = task.source.path, task.target, task.known
    key = sha256(settings.encode() + b"\0" + read_whole(path)).hexdigest()
    if known is not None and known.key == key and not known.error and _size(target) == known.size:
        return key, known.size, True
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise write_error(target.parent, error, "cannot be made") from error
    convert(path, target)
    return key, _size(target), False


def _size(path: Path) -> int:
    """Return the size of a file; -1 without it."""
    try:
        return path.stat().st_size
    except OSError:
        return -1


def _conversion(outcome: Outcome[_Task, tuple[str, int, bool]], root: Path) -> Conversion:
    source, target = outcome.item.source, outcome.item.target
    key, size, unchanged = outcome.value or ("", 0, False)
    output = target.relative_to(root).as_posix()
    return Conversion(source.shown, output, key, size, outcome.error, unchanged, outcome.warnings)


def _row(done: Conversion) -> list[str]:
    return [done.source, done.output, done.key, str(done.size), done.error]


def _read_record(path: Path) -> dict[str, Conversion]:
    """Return the conversions of a table by source; those that were added last count.

    A line that was cut off, as by a full disk, is left out. Raises FormatError for what is no such table.
    """
    if not path.exists():
        return {}
    if _size(path) > MOST_RECORD_BYTES:
        raise FormatError(f"is larger than {MOST_RECORD_BYTES} bytes; delete it, to begin again", path=path)
    found: dict[str, Conversion] = {}
    try:
        with open(path, encoding="utf-8", errors="surrogateescape", newline="") as file:
            reader = csv.reader(file)
            if tuple(next(reader, ())) != COLUMNS:
                raise FormatError(
                    "is no table of conversions of fba; give another folder, or move it away", path=path
                )
            for cells in reader:
                if len(cells) == len(COLUMNS) and cells[3].isascii() and cells[3].isdigit():
                    source, output, key, size, error = cells
                    found[source] = Conversion(source, output, key, int(size[:18]), error)
    except (OSError, ValueError, csv.Error) as error:
        if isinstance(error, FormatError):
            raise
        raise FormatError(f"cannot be read: {error}; delete it, to begin again", path=path) from error
    return found


def _write_record(path: Path, known: dict[str, Conversion]) -> None:
    """Write the table anew, whole or not at all, by source."""
    text = io.StringIO()
    table = csv.writer(text)
    table.writerow(COLUMNS)
    table.writerows(_row(known[name]) for name in sorted(known))
    with atomic(path) as file:
        file.write(text.getvalue().encode(errors="surrogateescape"))

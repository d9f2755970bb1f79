"""Conversion of many files into a folder: what is done is recorded, so that it need not be done again."""

from __future__ import annotations

import csv
import io
import os
import tempfile
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from hashlib import sha256
from pathlib import Path
from typing import Any

from fba.archive._locations import Location, RemotePath, find_location, make_folder, size_of, written
from fba.archive._pool import Outcome
from fba.archive._sources import Source
from fba.atomic import write_error
from fba.errors import FbaError, FbaWarning, FormatError
from fba.source import read_whole

RECORD = "conversions.csv"
"""Name of the table of conversions, in the folder of the results."""
COLUMNS = ("source", "output", "key", "bytes", "error", "warnings")
MOST_RECORD_BYTES = 1 << 30
RECORDED_AT_ONCE = 500
"""Conversions after which a table that lies elsewhere, where nothing is appended, is written again."""

Convert = Callable[[Path, Path], object]
"""Converts a file into another, which appears whole or not at all."""
ForEach = Callable[[Callable[[Any], Any], Iterable[Any]], Iterator[Outcome[Any, Any]]]
"""As `for_each` of several processes, or of a cluster."""


@dataclass(frozen=True)
class Conversion:
    """A file and what became of it.

    source: its name below its folder. output: the same of the result. key: SHA-256 of the file and of the
    settings. size: bytes of the result. error: the reason of a failure, or "". unchanged: it was there
    before. warnings: about the file, without its name; of an unchanged one, those of its conversion.
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
    target: Location
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

    Both folders may be addresses that the package fsspec opens. Then `convert` gets files of this machine:
    a file that lies elsewhere is fetched with the sound beside it, and a result is brought there whole.

    The table `conversions.csv` in the folder says what was done, and why what failed did. A file whose
    content and settings are those of the table, and whose result is there, is not converted again: so a batch
    that was interrupted goes on where it stopped. Raises FormatError where the folder or the table cannot be
    written, and for another file in place of the table.
    """
    root = find_location(folder)
    make_folder(root)
    path = root / RECORD
    known = _read_record(path)
    _write_record(path, known)
    tasks = [_Task(one, root / (one.name + suffix), known.get(one.shown)) for one in sources]
    work = partial(_convert_one, convert=convert, settings=settings)
    try:
        for number, outcome in enumerate(for_each(work, tasks), 1):
            done = _conversion(outcome, suffix)
            known[done.source] = done
            if isinstance(path, RemotePath):
                if number % RECORDED_AT_ONCE == 0:
                    _write_record(path, known)
            elif not done.unchanged:
                _append_record(path, done)
            yield done
    finally:  # an interruption too
        _write_record(path, known)


def _convert_one(task: _Task, *, convert: Convert, settings: str) -> tuple[str, int, bool]:
    """Convert a file; return its key, the bytes of the result, and whether it was there before."""
    source, target, known = task.source, task.target, task.known
    with _here(source, target) as (path, local):
        key = sha256(settings.encode() + b"\0" + read_whole(path)).hexdigest()
        if known is not None and known.key == key and not known.error and _size(target) == known.size:
            return key, known.size, True
        make_folder(local.parent)
        convert(path, local)
        if isinstance(target, RemotePath):
            target.parent.mkdir()
            target.upload(str(local))
        return key, size_of(local), False


@contextmanager
def _here(source: Source, target: Location) -> Iterator[tuple[Path, Path]]:
    """Yield the paths of a file and of its result, both on this machine.

    What lies elsewhere has a copy in a temporary folder, a file together with the sound beside it.
    """
    if isinstance(source.path, Path) and isinstance(target, Path):
        yield source.path, target
        return
    with tempfile.TemporaryDirectory(prefix="fba-") as folder:
        path, local = Path(folder, "in", source.path.name), Path(folder, "out", target.name)
        path.parent.mkdir()
        for one in (source.path, source.sound):
            if isinstance(one, RemotePath):
                one.download(str(path.with_name(one.name)))
        path = source.path if isinstance(source.path, Path) else path
        local = target if isinstance(target, Path) else local
        with _naming({path: source.path, local: target}):
            yield path, local


@contextmanager
def _naming(places: Mapping[Path, Location]) -> Iterator[None]:
    """Name files that lie elsewhere in errors and warnings about their copies here."""

    def renamed(text: object) -> str:
        result = str(text)
        for here, there in places.items():
            result = result.replace(str(here), str(there))
        return result

    with warnings.catch_warnings(record=True, action="always", category=FbaWarning) as odd:
        try:
            yield
        except FbaError as error:
            raise FbaError(renamed(error)) from error
    for one in odd:
        warnings.warn(renamed(one.message), one.category, stacklevel=2)


def _size(place: Location) -> int:
    """Return the size of a file; -1 without it."""
    try:
        return size_of(place)
    except (OSError, FormatError):
        return -1


def _conversion(outcome: Outcome[_Task, tuple[str, int, bool]], suffix: str) -> Conversion:
    task, source = outcome.item, outcome.item.source
    key, size, unchanged = outcome.value or ("", 0, False)
    if unchanged and task.known is not None:
        return replace(task.known, unchanged=True)
    told = tuple(" ".join(text.removeprefix(f"{source.path}: ").split()) for text in outcome.warnings)
    return Conversion(source.shown, source.name + suffix, key, size, outcome.error, unchanged, told)


def _row(done: Conversion) -> list[str]:
    return [done.source, done.output, done.key, str(done.size), done.error, "\n".join(done.warnings)]


def _read_record(path: Location) -> dict[str, Conversion]:
    """Return the conversions of a table by source; those that were added last count.

    A line that was cut off, as by a full disk, is left out. Raises FormatError for what is no such table.
    """
    if not (path.is_file() if isinstance(path, RemotePath) else path.exists()):
        return {}
    if _size(path) > MOST_RECORD_BYTES:
        raise FormatError(f"is larger than {MOST_RECORD_BYTES} bytes; delete it, to begin again", path=path)
    found: dict[str, Conversion] = {}
    try:
        data = path.read_bytes()
        text = io.StringIO(data.decode(errors="surrogateescape"), newline="")
        reader = csv.reader(text)
        if tuple(next(reader, ())) != COLUMNS:
            raise FormatError(
                "is no table of conversions of fba; give another folder, or move it away", path=path
            )
        for cells in reader:
            if len(cells) == len(COLUMNS) and cells[3].isascii() and cells[3].isdigit():
                source, output, key, size, error, told = cells
                warned = tuple(told.split("\n")) if told else ()
                found[source] = Conversion(source, output, key, int(size[:18]), error, warnings=warned)
    except (OSError, ValueError, csv.Error) as error:
        if isinstance(error, FormatError):
            raise
        raise FormatError(f"cannot be read: {error}; delete it, to begin again", path=path) from error
    return found


def _append_record(path: Path, done: Conversion) -> None:
    """Add a line to the table."""
    try:
        with open(path, "a", encoding="utf-8", errors="surrogateescape", newline="") as file:
            csv.writer(file).writerow(_row(done))
    except OSError as error:
        raise write_error(path, error) from error


def _write_record(path: Location, known: dict[str, Conversion]) -> None:
    """Write the table anew, whole or not at all, by source."""
    text = io.StringIO()
    table = csv.writer(text)
    table.writerow(COLUMNS)
    table.writerows(_row(known[name]) for name in sorted(known))
    with written(path) as file:
        file.write(text.getvalue().encode(errors="surrogateescape"))

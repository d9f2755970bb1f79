"""Make archives of files, extract them again, check and describe them."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path, PurePosixPath
from typing import Any, Literal

from fba.archive._locations import Location, find_location, make_folder, size_of
from fba.archive._performance import (
    MOST_BYTES,
    UNITS,
    Coding,
    Made,
    Performance,
    check_performance,
    key_of,
    make_performance,
)
from fba.archive._pool import Outcome, for_each
from fba.archive._shards import SHARD_BYTES, SHARD_ROWS, Archive, find_shards, next_number, write_shard
from fba.archive._sources import Source
from fba.atomic import atomic
from fba.errors import FbaError, FormatError, LimitError
from fba.source import read_whole

Sound = Literal["none", "reference", "inside"]


@dataclass(frozen=True)
class Report:
    """What `make_archive` did with a file.

    error: why it is not in the archive, or "". unchanged: it was there before. rounded: values that the
    stream does not hold exactly. warnings: about the file.
    """

    source: Source
    error: str = ""
    unchanged: bool = False
    rounded: int = 0
    warnings: tuple[str, ...] = ()


def make_archive(
    sources: Sequence[Source],
    folder: str | os.PathLike[str],
    *,
    coding: Coding = Coding(),  # noqa: B008 - immutable
    sound: Sound = "reference",
    units: dict[str, float] | None = None,
    shard_bytes: int = SHARD_BYTES,
    jobs: int = 1,
) -> Iterator[Report]:
    """Write performances into shards in a folder; yield a report on each file, while the work goes on.

    sources: of `find_sources`. folder: a path, or an address that the package fsspec opens, such as
    "s3://bucket/archive". coding: how files become streams. sound: of sound files beside them, their
    names, their bytes too, or nothing. units: metres of a face that FAPs are scaled by; default: those of
    the built-in head. shard_bytes: size from which a new shard begins. jobs: number of processes.

    What the folder holds already stays: files whose content, labels and settings are the same are not
    encoded again, so that a make that was interrupted goes on where it stopped. A file of the same name with
    another content, and one that cannot be read, is reported, and left out. A shard appears whole or not at
    all; where the caller takes no more reports, the last one is not written.

    Raises FormatError where a shard cannot be written, and FbaError without the package pyarrow.
    """
    target = find_location(folder)
    make_folder(target)
    shards = find_shards(target)
    known: dict[str, str] = {}
    if shards:
        known = {cells["name"]: cells["key"] for _, cells in Archive(target).cells(["name", "key"])}
    number = next_number(shards)
    make = partial(_make, coding=coding, units=units or default_units())
    waiting: list[Performance] = []
    reports: list[Report] = []
    size = 0
    items = ((source, known.get(source.name)) for source in sources)
    for outcome in for_each(make, items, jobs=jobs):
        report, made = _report(outcome)
        if made is not None:
            try:
                performance = _with_sound(made.performance, outcome.item[0], sound)
            except FbaError as error:
                report, made = replace(report, error=str(error)), None
        if made is None:
            yield report
            continue
        reports.append(report)
        waiting.append(performance)
        size += performance.size
        if size >= shard_bytes or len(waiting) == SHARD_ROWS:
            write_shard(target, number, waiting)
            yield from reports
            number, waiting, reports, size = number + 1, [], [], 0
    if waiting:
        write_shard(target, number, waiting)
        yield from reports


def default_units() -> dict[str, float]:
    """Return the FAPU of the built-in head, metres."""
    from fba.face import FaceModel

    return units_of(FaceModel.default())


def units_of(model: Any) -> dict[str, float]:
    """Return the FAPU of a face model that are lengths, metres."""
    return {unit: float(model.fapu[unit]) for unit in UNITS}


def _make(item: tuple[Source, str | None], *, coding: Coding, units: dict[str, float]) -> Made | None:
    """Return the performance of a file; None if it is in the archive. Runs in a process of the pool."""
    source, known = item
    key = key_of(source, read_whole(source.path), coding, units)
    if key == known:
        return None
    if known is not None:
        raise FormatError(
            f"the archive has another {source.name}: its content, its labels or the settings have changed; "
            "make a new archive, or give the file another name",
            path=source.path,
        )
    return make_performance(source, coding, units, key)


def _report(outcome: Outcome[tuple[Source, str | None], Made | None]) -> tuple[Report, Made | None]:
    source, made = outcome.item[0], outcome.value
    unchanged = made is None and not outcome.error
    rounded = made.rounded if made is not None else 0
    return Report(source, outcome.error, unchanged, rounded, outcome.warnings), made


def _with_sound(performance: Performance, source: Source, sound: Sound) -> Performance:
    """Return the performance with as much of its sound as is wanted."""
    if sound == "none" or source.sound is None:
        return replace(performance, sound_name=None)
    if sound == "reference":
        return performance
    data = read_whole(source.sound)
    if len(data) > MOST_BYTES:
        raise LimitError(
            f"{source.sound} has {len(data)} bytes, more than the {MOST_BYTES} of a row; keep sounds as "
            "files, beside the archive",
            limit="bytes", found=len(data), allowed=MOST_BYTES,
        )  # fmt: skip
    return replace(performance, sound=data)


def describe_archive(archive: Archive) -> dict[str, Any]:
    """Return what an archive holds, as plain numbers and strings: counts, hours, bytes, subjects, labels."""
    columns = ["subject", "labels", "seconds", "frames", "face", "body", "start_frames", "rate"]
    performances = frames = faces = bodies = starts = 0
    seconds = 0.0
    subjects: set[str] = set()
    labels: dict[str, set[str]] = {}
    rates: set[float] = set()
    for _, cells in archive.cells(columns):
        performances += 1
        frames += cells["frames"] or 0
        seconds += cells["seconds"] or 0.0
        faces += bool(cells["face"])
        bodies += bool(cells["body"])
        starts += len(cells["start_frames"] or ())
        rates.add(cells["rate"])
        if cells["subject"]:
            subjects.add(cells["subject"])
        for name, value in cells["labels"] or ():
            labels.setdefault(name, set()).add(value)
    return {
        "shards": len(archive.shards),
        "bytes": sum(map(size_of, archive.shards)),
        "performances": performances,
        "seconds": round(seconds, 3),
        "frames": frames,
        "starts": starts,
        "faces": faces,
        "bodies": bodies,
        "rates": sorted(rate for rate in rates if rate is not None),
        "subjects": len(subjects),
        "labels": {name: len(values) for name, values in sorted(labels.items())},
    }


def extract(archive: Archive, names: Sequence[str], folder: str | os.PathLike[str]) -> Iterator[Path]:
    """Write performances as .fba files, with their names, and sounds that the archive holds; yield the paths.

    names: empty for all. The streams are those of the archive, byte for byte. Raises FormatError for a name
    that leads out of the folder, and for one that is not there.
    """
    root = Path(folder)
    for performance in (archive[name] for name in names) if names else archive:
        written = [(f"{performance.name}.fba", performance.stream)]
        if performance.sound is not None and performance.sound_name is not None:
            written.append((performance.sound_name, performance.sound))
        for name, data in written:
            path = _inside(root, name, archive.folder)
            make_folder(path.parent)
            with atomic(path) as file:
                file.write(data)
            yield path


def _inside(root: Path, name: str, archive: Location) -> Path:
    """Return the path of a name below a folder. Raises FormatError for one that leads elsewhere."""
    parts = PurePosixPath(name).parts
    bad = not parts or name.startswith("/") or any(part in ("..", ".") for part in parts)
    if bad or any(character in name for character in "\\\0:") or len(name) > 1024:
        raise FormatError(
            f"{name[:80]!r} is no name of a file below a folder; it is not extracted", path=archive
        )
    path = root.joinpath(*parts)
    if root.resolve() not in path.resolve().parents:
        raise FormatError(f"{name!r} leads out of {root} through a link; it is not extracted", path=archive)
    return path


@dataclass(frozen=True)
class Check:
    """What `verify_archive` found of a performance, or of a part of a shard that cannot be read.

    name: of the performance; "" for a part of a shard. faults: what is wrong; empty if nothing is.
    """

    shard: Location
    name: str
    faults: tuple[str, ...]


def verify_archive(
    folder: str | os.PathLike[str], *, jobs: int = 1, begun: Callable[[int], None] | None = None
) -> Iterator[Check]:
    """Check an archive: yield a result for each performance, and for each part that cannot be read.

    Every stream is decoded and compared with its digest and its row; decoding is begun at every place that
    the row lists. A name that two rows have is a fault. begun: called with the number of row groups.
    """
    shards = find_shards(find_location(folder))
    if not shards:
        Archive(folder)  # raises the error
    items: list[tuple[Location, int]] = []
    for path in shards:
        try:
            items += [(path, group) for group in range(Archive(path.parent, shards=[path]).groups[0])]
        except FbaError as error:
            yield Check(path, "", (str(error),))
    if begun is not None:
        begun(len(items))
    seen: set[str] = set()
    for outcome in for_each(_check_group, items, jobs=jobs, chunk=1):
        if outcome.error:
            yield Check(outcome.item[0], "", (outcome.error,))
        for check in outcome.value or ():
            twice = ("another row has the same name",) if check.name in seen else ()
            seen.add(check.name)
            yield replace(check, faults=check.faults + twice)


def _check_group(item: tuple[Location, int]) -> list[Check]:
    path, group = item
    performances = Archive(path.parent, shards=[path]).group(0, group, sound=True)
    return [Check(path, one.name, tuple(check_performance(one))) for one in performances]

"""Shards: Parquet files of performances, written whole, and read a row group at a time."""

from __future__ import annotations

import os
import re
from collections import OrderedDict
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction
from hashlib import sha256
from pathlib import Path
from typing import Any

from fba.archive._locations import Location, RemotePath, find_location, written
from fba.archive._performance import MOST_BYTES, UNITS, Performance
from fba.atomic import write_error
from fba.errors import FbaError, FormatError, LimitError, did_you_mean
from fba.parameters import BAP_STEP_TABLES

MARK = b"fba.archive"
"""Key of the metadata of a shard; its value is the version of the columns."""
SHARD_VERSION = b"1"
PATTERN = "shard-*.parquet"
GROUP_BYTES = 1 << 20
"""Bytes of streams, and of sounds, from which a new row group begins: what a random window reads at once."""
GROUP_ROWS = 256
SHARD_BYTES = 64 << 20
SHARD_ROWS = 20_000
KEPT_BYTES = 64 << 20
"""Bytes of row groups that a reader keeps."""
MOST_GROUP_BYTES = 4 * MOST_BYTES
"""Largest row group that is read: a stream and a sound of the largest size, and room."""
HEAVY = ("stream", "sound")
"""Columns that need not be read to list performances."""


def import_pyarrow() -> Any:
    """Return pyarrow, with `pyarrow.parquet`. Raises FbaError where it is not installed."""
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        raise FbaError(
            'the package pyarrow reads and writes archives: pip install "mpeg4-fba[archive]"'
        ) from None
    return pyarrow


def schema() -> Any:
    """Return the columns of a shard, as a pyarrow schema."""
    pa = import_pyarrow()
    text, whole, number, truth = pa.string(), pa.int64(), pa.float64(), pa.bool_()
    columns = [
        ("name", text), ("subject", text), ("labels", pa.map_(text, text)), ("stream", pa.binary()),
        ("seconds", number), ("rate", number), ("rate_exact", text), ("frames", whole), ("planes", whole),
        ("face", truth), ("body", truth), ("bap_steps", text),
        ("start_frames", pa.list_(whole)), ("start_bytes", pa.list_(whole)),
        ("fapu", pa.struct([(unit, number) for unit in UNITS])), ("digest", text),
        ("sound_name", text), ("sound", pa.binary()), ("source", text), ("key", text),
    ]  # fmt: skip
    return pa.schema(columns, metadata={MARK: SHARD_VERSION})


def _cells(performance: Performance) -> dict[str, Any]:
    """Return the cells of a row."""
    direct = (
        "name", "subject", "labels", "stream", "seconds", "frames", "planes", "face", "body", "bap_steps",
        "start_frames", "start_bytes", "digest", "sound_name", "sound", "source", "key",
    )  # fmt: skip
    cells = {name: getattr(performance, name) for name in direct}
    rate = performance.rate
    return cells | {
        "rate": float(rate), "rate_exact": str(rate), "fapu": performance.units or None,
        "labels": sorted(performance.labels.items()),
    }  # fmt: skip


def write_shard(folder: Location, number: int, performances: Sequence[Performance]) -> Location:
    """Write performances as a shard, whole or not at all; return its path.

    Its name has its number and a digest of the keys of its rows. Raises FormatError where it cannot be
    written.
    """
    pa = import_pyarrow()
    named = sha256("".join(one.key for one in performances).encode()).hexdigest()[:12]
    path = folder / f"shard-{number:05}-{named}.parquet"
    columns = schema()
    try:
        with written(path) as file:
            writer = pa.parquet.ParquetWriter(
                pa.PythonFile(file, "w"), columns, compression=_compression(columns.names),
                use_dictionary=["subject", "rate_exact", "bap_steps"], write_page_checksum=True,
            )  # fmt: skip
            with writer:
                for group in _groups(performances):
                    rows = [_cells(one) for one in group]
                    writer.write_table(pa.Table.from_pylist(rows, columns), row_group_size=len(rows))
    except pa.ArrowException as error:
        raise write_error(path, error) from error
    return path


def _compression(names: Sequence[str]) -> dict[str, str]:
    """Return the compression of columns: none of streams, which nothing makes smaller."""
    return {name: "NONE" if name in HEAVY else "ZSTD" for name in names}


def _groups(performances: Sequence[Performance]) -> Iterator[list[Performance]]:
    group: list[Performance] = []
    size = 0
    for one in performances:
        if group and (size + one.size > GROUP_BYTES or len(group) == GROUP_ROWS):
            yield group
            group, size = [], 0
        group.append(one)
        size += one.size
    if group:
        yield group


@dataclass(frozen=True)
class Place:
    """Where a performance is: the number of a shard, of a row group in it, and of a row of that."""

    shard: int
    group: int
    row: int


class Archive:
    """The performances of an archive: an iterable, whose `len` is their number.

    folder: with shards, or its address, "s3://bucket/archive" or another that the package fsspec opens.
    shards: those to read; default: all in the folder. groups: numbers of row groups in each.
    `archive["anna/take1"]` is the performance of a name. It pickles, and may be used in a forked process. Row
    groups that were read are kept, up to 64 MiB.

    Raises FormatError for a folder without shards, for a shard that is damaged or another program's, and for
    a name that is not there; FbaError without the package pyarrow.
    """

    def __init__(self, folder: str | os.PathLike[str], *, shards: Sequence[Location] | None = None) -> None:
        import_pyarrow()
        self.folder = find_location(folder)
        self.shards: list[Location] = find_shards(self.folder) if shards is None else list(shards)
        if not self.shards:
            raise FormatError(
                f"holds no shards ({PATTERN}); `fba archive make` writes them", path=self.folder
            )
        self._forget()
        self.groups = [self._file(number).num_row_groups for number in range(len(self.shards))]
        self._rows: int = sum(self._file(number).metadata.num_rows for number in range(len(self.shards)))
        self._places: dict[str, Place] | None = None

    def _forget(self) -> None:
        self._process = os.getpid()
        self._files: dict[int, Any] = {}
        self._kept: OrderedDict[tuple[int, int], list[Performance]] = OrderedDict()
        self._size = 0

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_files": {}, "_kept": OrderedDict(), "_size": 0, "_process": -1}

    def __len__(self) -> int:
        return self._rows

    def __iter__(self) -> Iterator[Performance]:
        for shard, groups in enumerate(self.groups):
            for group in range(groups):
                yield from self.group(shard, group, sound=True)

    def __getitem__(self, name: str) -> Performance:
        if self._places is None:
            self._places = {cells["name"]: place for place, cells in self.cells(["name"])}
        place = self._places.get(name)
        if place is None:
            near = did_you_mean(name, self._places)
            raise FormatError(f"has no performance {name!r}{near}", path=self.folder)
        return self.group(place.shard, place.group, sound=True)[place.row]

    def cells(self, columns: Sequence[str]) -> Iterator[tuple[Place, dict[str, Any]]]:
        """Yield the place and the cells of every row, in columns that are not heavy."""
        for shard, groups in enumerate(self.groups):
            for group in range(groups):
                for row, cells in enumerate(self._read(shard, group, columns)):
                    yield Place(shard, group, row), cells

    def group(self, shard: int, group: int, *, sound: bool = False) -> list[Performance]:
        """Return the performances of a row group. sound: with their sounds, and not from those kept."""
        if os.getpid() != self._process:
            self._forget()
        key = (shard, group)
        if sound or key not in self._kept:
            path = self.shards[shard]
            names = [name for name in schema().names if sound or name != "sound"]
            performances = [
                _performance(cells, path, group, row)
                for row, cells in enumerate(self._read(shard, group, names))
            ]
            if sound:
                return performances
            self._kept[key] = performances
            self._size += sum(one.size for one in performances)
            while self._size > KEPT_BYTES and len(self._kept) > 1:
                self._size -= sum(one.size for one in self._kept.popitem(last=False)[1])
        self._kept.move_to_end(key)
        return self._kept[key]

    def _read(self, shard: int, group: int, columns: Sequence[str]) -> list[dict[str, Any]]:
        """Return the cells of a row group. Raises FormatError for damage, LimitError for huge ones."""
        path = self.shards[shard]
        file = self._file(shard)
        with arrow_errors(path):
            about = file.metadata.row_group(group)
            chunks = [about.column(number) for number in range(about.num_columns)]
            size = sum(
                max(chunk.total_uncompressed_size, 0)
                for chunk in chunks
                if chunk.path_in_schema.split(".")[0] in columns
            )
            if size > MOST_GROUP_BYTES:
                raise LimitError(
                    f"{path}: row group {group} takes {size} bytes, more than the {MOST_GROUP_BYTES} that "
                    "are read; write the archive again, in smaller row groups",
                    limit="bytes", found=size, allowed=MOST_GROUP_BYTES,
                )  # fmt: skip
            rows: list[dict[str, Any]] = file.read_row_group(
                group, columns=list(columns), use_threads=False
            ).to_pylist()
        return rows

    def _file(self, shard: int) -> Any:
        if os.getpid() != self._process:
            self._forget()
        if shard not in self._files:
            if len(self._files) >= 64:  # a process may open some hundreds
                self._files.pop(next(iter(self._files))).close()
            self._files[shard] = _opened(self.shards[shard])
        return self._files[shard]


def find_shards(folder: Location) -> list[Location]:
    """Return the shards in a folder, in the order of their names. Raises FormatError without the folder.

    Elsewhere there may be no folders: they are but the beginnings of names.
    """
    if isinstance(folder, Path) and not folder.is_dir():
        raise FormatError("there is no such folder; check its name", path=folder)
    return sorted(folder.glob(PATTERN))


def next_number(shards: Sequence[Location]) -> int:
    """Return the number of the next shard."""
    numbers = [int(match[1]) for path in shards if (match := re.match(r"shard-(\d+)", path.name))]
    return max(numbers, default=-1) + 1


@contextmanager
def arrow_errors(path: Location) -> Iterator[None]:
    """Turn errors of pyarrow, and of storages elsewhere, into a FormatError about a file."""
    pa = import_pyarrow()
    damage = (pa.ArrowException, OSError, ValueError, KeyError, IndexError, OverflowError)
    try:
        yield
    except Exception as error:
        if isinstance(error, FbaError):
            raise
        reason = " ".join(str(error).split())[:200]
        if isinstance(path, RemotePath):
            raise FormatError(
                f"cannot be read, or is damaged, or is no Parquet file ({reason or type(error).__name__})",
                path=path,
            ) from error
        if not isinstance(error, damage):
            raise
        raise FormatError(
            f"is damaged, or no Parquet file ({reason}); make it again, or copy it again", path=path
        ) from error


def open_parquet(path: Location) -> Any:
    """Return a Parquet file, opened; its pages are compared with their checksums."""
    source, kept = path.open() if isinstance(path, RemotePath) else (path, None)
    file = import_pyarrow().parquet.ParquetFile(source, page_checksum_verification=True, pre_buffer=False)
    file.kept = kept
    return file


def _opened(path: Location) -> Any:
    """Return a shard, opened. Raises FormatError for damage, another program's file and missing columns."""
    with arrow_errors(path):
        file = open_parquet(path)
        found = file.schema_arrow
    wanted = schema()
    if (found.metadata or {}).get(MARK) is None:
        raise FormatError(
            "is a Parquet file of another program; an archive's shards are written by `fba archive make`",
            path=path,
        )
    version = found.metadata[MARK]
    if version != SHARD_VERSION:
        raise FormatError(
            f"is a shard of version {version.decode('ascii', 'replace')[:20]}; this program reads version "
            f"{SHARD_VERSION.decode()}; install a newer one",
            path=path,
        )
    for column in wanted:
        if column.name not in found.names:
            raise FormatError(f"has no column {column.name!r}, which a shard needs", path=path)
        kind = found.field(column.name).type
        if not kind.equals(column.type):
            raise FormatError(f"has a column {column.name!r} of {kind}; expected {column.type}", path=path)
    return file


def _performance(cells: dict[str, Any], path: Location, group: int, row: int) -> Performance:
    """Return the performance of a row. Raises FormatError for cells that contradict each other."""
    where = f"row {row} of row group {group}"

    def check(good: object, what: str) -> None:
        if not good:
            named = f" ({cells['name']})" if cells["name"] else ""
            raise FormatError(f"{where}{named}: {what}; make the archive again", path=path)

    needed = (
        "name", "stream", "rate_exact", "frames", "planes", "face", "body", "bap_steps", "start_frames",
        "start_bytes", "digest", "key", "source",
    )  # fmt: skip
    for name in needed:
        check(cells[name] not in (None, ""), f"its {name} is missing")
    rate_text = cells["rate_exact"]
    check(re.fullmatch(r"[0-9]{1,18}(/[0-9]{1,18})?", rate_text), f"{rate_text[:40]!r} is no frame rate")
    check(not rate_text.endswith("/0") and int(rate_text.split("/")[0]) > 0, "the frame rate is not positive")
    check(0 < len(cells["stream"]) <= MOST_BYTES, f"the stream has {len(cells['stream'])} bytes")
    check(
        1 <= cells["planes"] <= cells["frames"], "its numbers of frames and of planes contradict each other"
    )
    check(
        cells["bap_steps"] in BAP_STEP_TABLES, f"there is no table of BAP steps {cells['bap_steps'][:40]!r}"
    )
    frames, places = cells["start_frames"], cells["start_bytes"]
    check(None not in frames and None not in places, "a number of its I planes is missing")
    check(len(frames) == len(places) >= 1 and frames[0] == 0, "its I planes are not listed from the first on")
    check(frames == sorted(set(frames)) and places == sorted(set(places)), "its I planes are not in order")
    check(frames[-1] < cells["frames"], "an I plane comes behind its last frame")
    check(places[0] >= 0 and places[-1] < len(cells["stream"]), "an I plane lies outside of its stream")
    names = ("name", "stream", "frames", "planes", "face", "body", "bap_steps", "digest", "subject", "source",
             "key", "sound_name")  # fmt: skip
    return Performance(
        **{name: cells[name] for name in names},
        rate=Fraction(rate_text), start_frames=tuple(frames), start_bytes=tuple(places),
        labels={key: value or "" for key, value in cells["labels"] or ()},
        units={unit: value for unit, value in (cells["fapu"] or {}).items() if value is not None},
        sound=cells.get("sound"),
    )  # fmt: skip

"""The index of an archive, and queries over it: SQL conditions that can neither write nor read files."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from fba.archive._description import describe
from fba.archive._locations import Location, find_location, written
from fba.archive._pool import for_each
from fba.archive._shards import Archive, arrow_errors, import_pyarrow, open_parquet
from fba.errors import FbaError, FormatError, OptionError, did_you_mean, warn

INDEX = "index.parquet"
"""Name of the index, in the folder of the archive."""
MARK = b"fba.archive.index"
INDEX_VERSION = b"1"
MOST_ROW_BYTES = 1 << 30
"""Largest index that is read, in bytes of its columns."""
QUERY_SECONDS = 60.0
"""Longest time that a query may take."""
QUERY_MEMORY = "1GB"


def _schema() -> Any:
    pa = import_pyarrow()
    text, whole, number, truth = pa.string(), pa.int64(), pa.float64(), pa.bool_()
    span = pa.struct([("kind", text), ("frame", whole), ("frames", whole)])
    columns = [
        ("name", text), ("subject", text), ("labels", pa.map_(text, text)), ("seconds", number),
        ("rate", number), ("frames", whole), ("planes", whole), ("face", truth), ("body", truth),
        ("bytes", whole), ("bits_per_second", number), ("starts", whole),
        ("motion", pa.map_(text, number)), ("bits", pa.map_(text, number)),
        ("limit_frames", whole), ("jump_frames", whole), ("frozen_frames", whole),
        ("doubtful", pa.list_(span)), ("blinks", whole), ("emotion", text),
        ("emotions", pa.map_(text, number)), ("source", text), ("key", text),
    ]  # fmt: skip
    return pa.schema(columns, metadata={MARK: INDEX_VERSION})


@dataclass(frozen=True)
class Indexed:
    """A performance that `index_archive` described; error: why it could not, or ""."""

    name: str
    error: str = ""


def index_archive(
    folder: str | os.PathLike[str], *, jobs: int = 1, begun: Callable[[int], None] | None = None
) -> Iterator[Indexed]:
    """Write the index of an archive, `index.parquet` in its folder; yield each performance that is new in it.

    Rows of an earlier index stay if their performances do. The index appears when all reports are taken.
    jobs: number of processes. begun: called with the number of row groups to describe. A performance whose
    stream is damaged has no row. Raises FormatError as `Archive` does, and where the index cannot be written.
    """
    pa = import_pyarrow()
    archive = Archive(folder)
    path = archive.folder / INDEX
    earlier = {row["key"]: row for row in _read(path).to_pylist()} if path.is_file() else {}
    rows: list[dict[str, Any]] = []
    wanted: list[tuple[Location, int, frozenset[str]]] = []
    new: dict[tuple[int, int], set[str]] = {}
    for place, cells in archive.cells(["key"]):
        row = earlier.get(cells["key"])
        if row is not None:
            rows.append(row)
        else:
            new.setdefault((place.shard, place.group), set()).add(cells["key"])
    wanted = [(archive.shards[shard], group, frozenset(keys)) for (shard, group), keys in new.items()]
    if begun is not None:
        begun(len(wanted))
    for outcome in for_each(_describe_group, wanted, jobs=jobs, chunk=1):
        if outcome.error:
            yield Indexed(f"{outcome.item[0]}, row group {outcome.item[1]}", outcome.error)
        for name, described, error in outcome.value or ():
            if described is not None:
                rows.append(described)
            yield Indexed(name, error)
    rows.sort(key=lambda row: str(row["name"]))
    with written(path) as file:
        table = pa.Table.from_pylist(rows, _schema())
        pa.parquet.write_table(table, pa.PythonFile(file, "w"), compression="ZSTD", write_page_checksum=True)


def _describe_group(
    item: tuple[Location, int, frozenset[str]],
) -> list[tuple[str, dict[str, Any] | None, str]]:
    """Return the rows of performances of a row group, by name, or the reason of a failure."""
    path, group, keys = item
    found: list[tuple[str, dict[str, Any] | None, str]] = []
    for performance in Archive(path.parent, shards=[path]).group(0, group):
        if performance.key in keys:
            try:
                found.append((performance.name, describe(performance), ""))
            except FbaError as error:
                found.append((performance.name, None, str(error)))
    return found


def _read(path: Location) -> Any:
    """Return an index, as a pyarrow table. Raises FormatError for another file."""
    with arrow_errors(path):
        file = open_parquet(path)
        with file:
            found = file.schema_arrow
            groups = [file.metadata.row_group(number) for number in range(file.num_row_groups)]
            size = sum(max(group.total_byte_size, 0) for group in groups)
            known = (found.metadata or {}).get(MARK) == INDEX_VERSION and found.equals(_schema())
            if not known or size > MOST_ROW_BYTES:
                raise FormatError(
                    "is no index of this program's version; delete it, and make it with `fba archive index`",
                    path=path,
                )
            return file.read(use_threads=False)


def query(
    folder: str | os.PathLike[str],
    condition: str = "true",
    *,
    columns: Sequence[str] | None = None,
    sort: str | None = None,
    limit: int | None = None,
) -> Any:
    """Return the rows of an archive's index that a condition is true of, as a `pyarrow.Table`.

    condition: of SQL, as DuckDB has it: "blinks > 10 and seconds < 60", "labels['emotion'] = 'joy'",
    "motion['open_jaw'] > 100". columns: those to return, default all. sort: a column, ascending; "-seconds"
    descending. limit: most rows.

    The condition sees the index alone: it can write no file, read no other, and load no extension. Raises
    OptionError for what is no condition, or takes too much time or memory, and for unknown columns;
    FormatError without an index; FbaError without the packages pyarrow and duckdb. Warns (FbaWarning) if the
    archive has performances that the index lacks.
    """
    try:
        import duckdb
    except ImportError:
        raise FbaError(
            'archives are searched by the package duckdb: pip install "mpeg4-fba[archive]"'
        ) from None
    path = find_location(folder) / INDEX
    if not path.is_file():
        Archive(folder)  # raises the error of a folder that is no archive
        raise FormatError("has no index yet; make one with `fba archive index`", path=folder)
    table = _read(path)
    _warn_of_missing(folder, set(table.column("key").to_pylist()))
    chosen = ", ".join(_quoted(name, table) for name in columns) if columns else "*"
    text = f"SELECT {chosen} FROM performances WHERE (\n{condition}\n)"
    if sort is not None:
        text += f" ORDER BY {_quoted(sort.removeprefix('-'), table)}{' DESC' if sort.startswith('-') else ''}"
    if limit is not None:
        text += f" LIMIT {int(limit)}"
    connection = duckdb.connect(
        ":memory:", config={"memory_limit": QUERY_MEMORY, "threads": "1", "temp_directory": ""}
    )
    try:
        connection.register("given", table)
        connection.execute("CREATE TABLE performances AS SELECT * FROM given")
        connection.unregister("given")
        for setting in (
            "enable_external_access = false", "python_enable_replacements = false",
            "lock_configuration = true",
        ):  # fmt: skip
            connection.execute(f"SET {setting}")
        return _run(connection, text, duckdb)
    finally:
        connection.close()


def _run(connection: Any, text: str, duckdb: Any) -> Any:
    """Return the result of one SELECT. Raises OptionError for other text, and for one that fails."""
    timer = threading.Timer(QUERY_SECONDS, connection.interrupt)
    try:
        statements = connection.extract_statements(text)
        if len(statements) != 1 or statements[0].type != duckdb.StatementType.SELECT:
            raise OptionError("the condition is more than a condition; write one as in blinks > 10")
        timer.start()
        return connection.sql(text).to_arrow_table()
    except duckdb.InterruptException as error:
        raise OptionError(f"the query takes longer than {QUERY_SECONDS:.0f} s; ask for less") from error
    except (duckdb.Error, OverflowError, ValueError) as error:
        reason = str(error).split("\n\nLINE")[0].split("\nLINE")[0]
        raise OptionError(f"the condition cannot be answered: {' '.join(reason.split())}") from error
    finally:
        timer.cancel()


def _quoted(name: str, table: Any) -> str:
    if name not in table.column_names:
        near = did_you_mean(name, table.column_names)
        raise OptionError(f"there is no column {name!r}{near}; there are {', '.join(table.column_names)}")
    return f'"{name}"'


def _warn_of_missing(folder: str | os.PathLike[str], keys: set[str]) -> None:
    missing = sum(cells["key"] not in keys for _, cells in Archive(folder).cells(["key"]))
    if missing:
        warn(
            f"{folder}: the index lacks {missing} performances of the archive; `fba archive index` adds them",
            stacklevel=3,
        )

"""Archives that are damaged, foreign, contradictory or huge, and disks that are full: a clear error each."""

import errno
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import archived
import fba
from fba.archive import Archive, Windows, extract, index_archive, query, verify_archive
from fba.archive._shards import schema, write_shard
from fba.errors import BitstreamError, FbaError, FormatError, LimitError


@pytest.fixture
def shard(archive: Path, tmp_path: Path) -> Path:
    """The shard of an archive, to be damaged."""
    (source,) = archive.glob("shard-*.parquet")
    target = tmp_path / source.name
    target.write_bytes(source.read_bytes())
    return target


def rewrite(shard: Path, edit: Callable[[dict[str, Any]], object], columns: Any = None) -> None:
    """Change the rows of a shard, as another program might."""
    rows = pq.read_table(shard).to_pylist()
    for row in rows:
        edit(row)
    pq.write_table(pa.Table.from_pylist(rows, columns or schema()), shard)


def cut(shard: Path) -> None:
    shard.write_bytes(shard.read_bytes()[:-100])


def flip(shard: Path) -> None:
    """Flip a bit of a stream, in the middle of the file."""
    data = bytearray(shard.read_bytes())
    data[len(data) // 3] ^= 4
    shard.write_bytes(data)


def foreign(shard: Path) -> None:
    pq.write_table(pa.table({"name": ["a"], "stream": [b"b"]}), shard)


def other_version(shard: Path) -> None:
    table = pq.read_table(shard)
    pq.write_table(table.replace_schema_metadata({b"fba.archive": b"9"}), shard)


def without_stream(shard: Path) -> None:
    table = pq.read_table(shard)
    pq.write_table(table.drop_columns(["stream"]), shard)


def with_text_frames(shard: Path) -> None:
    table = pq.read_table(shard)
    at = table.schema.get_field_index("frames")
    pq.write_table(table.set_column(at, "frames", table.column("frames").cast(pa.string())), shard)


SHARDS = [
    (cut, "is damaged, or no Parquet file"),
    (lambda shard: shard.write_bytes(b"PAR1" + bytes(50) + b"PAR1"), "is damaged, or no Parquet file"),
    (lambda shard: shard.write_bytes(b""), "is damaged, or no Parquet file"),
    (lambda shard: shard.write_bytes(b"hello"), "is damaged, or no Parquet file"),
    (flip, "is damaged, or no Parquet file"),
    (foreign, "is a Parquet file of another program"),
    (other_version, "is a shard of version 9; this program reads version 1"),
    (without_stream, "has no column 'stream'"),
    (with_text_frames, "has a column 'frames' of string; expected int64"),
]


@pytest.mark.parametrize(("damage", "message"), SHARDS)
def test_damaged_shards(shard: Path, damage: Callable[[Path], object], message: str) -> None:
    damage(shard)
    with pytest.raises(FormatError, match=message) as raised:
        list(Archive(shard.parent))
    assert str(shard) in str(raised.value)
    with pytest.raises(FormatError, match=message):
        list(Windows(shard.parent, 50))
    (check,) = [one for one in verify_archive(shard.parent) if one.faults]
    assert message in check.faults[0]


ROWS = [
    ({"stream": None}, "its stream is missing"),
    ({"stream": b""}, "the stream has 0 bytes"),
    ({"rate_exact": "25/0"}, "the frame rate is not positive"),
    ({"rate_exact": "1e9"}, "'1e9' is no frame rate"),
    ({"rate_exact": "9" * 50}, "is no frame rate"),
    ({"frames": 0}, "numbers of frames and of planes contradict"),
    ({"planes": 10**15}, "numbers of frames and of planes contradict"),
    ({"bap_steps": "other"}, "no table of BAP steps 'other'"),
    ({"start_frames": []}, "not listed from the first on"),
    ({"start_frames": [0, 2, 1], "start_bytes": [4, 5, 6]}, "not in order"),
    ({"start_frames": [0, None], "start_bytes": [4, 5]}, "is missing"),
    ({"start_frames": [0, 10**12], "start_bytes": [4, 9]}, "behind its last frame"),
    ({"start_frames": [0], "start_bytes": [-1]}, "outside of its stream"),
    ({"start_frames": [0, 9], "start_bytes": [4, 10**12]}, "outside of its stream"),
    ({"name": None}, "its name is missing"),
    ({"name": ""}, "its name is missing"),
]


@pytest.mark.parametrize(("cells", "message"), ROWS)
def test_rows_that_contradict_themselves(shard: Path, cells: dict[str, Any], message: str) -> None:
    rewrite(shard, lambda row: row.update(cells) if row["name"] == "anna/joy/talk" else None)
    with pytest.raises(FormatError, match=message) as raised:
        list(Archive(shard.parent))
    assert "row 1 of row group 0" in str(raised.value)
    assert any(message in fault for check in verify_archive(shard.parent) for fault in check.faults)


def wrong_stream(row: dict[str, Any]) -> None:
    row["stream"] = fba.encode(archived.performance(8))
    row["start_frames"], row["start_bytes"] = [0], [4]


def half_stream(row: dict[str, Any]) -> None:
    row["stream"] = row["stream"][: len(row["stream"]) // 2]
    row["start_frames"], row["start_bytes"] = [0], [4]


def no_stream(row: dict[str, Any]) -> None:
    row["stream"] = bytes(len(row["stream"]))


CONTENTS = [
    (lambda row: row.update(digest="0" * 64), "not those of its digest"),
    (wrong_stream, "not those of its digest"),
    (half_stream, "cut off"),
    (no_stream, "no FBA stream"),
    (lambda row: row.update(frames=5000, planes=5000), "rate, frames or parts are not those"),
    (lambda row: row.update(body=True), "rate, frames or parts are not those"),
    (
        lambda row: row["start_bytes"].__setitem__(1, row["start_bytes"][1] + 1),
        "decoding cannot begin at frame 100",
    ),
    (lambda row: row["start_frames"].__setitem__(1, 90), "decoding from frame 90 gives other values"),
]


@pytest.mark.parametrize(("edit", "message"), CONTENTS)
def test_streams_that_are_not_what_their_rows_say(
    shard: Path, edit: Callable[[dict[str, Any]], object], message: str
) -> None:
    rewrite(shard, lambda row: edit(row) if row["name"] == "anna/joy/talk" else None)
    checks = {check.name: check.faults for check in verify_archive(shard.parent)}
    assert message in " ".join(checks.pop("anna/joy/talk"))
    assert set(checks.values()) == {()}
    for position in range(len(windows := Windows(shard.parent, 60, 60, as_="faps"))):
        try:
            assert windows[position].shape == (60, 68)
        except (BitstreamError, FormatError, LimitError) as error:
            assert "anna/joy/talk" in str(error)  # noqa: PT017 - any window may be whole


def test_a_name_twice(shard: Path) -> None:
    (shard.parent / "shard-00001-copy.parquet").write_bytes(shard.read_bytes())
    checks = list(verify_archive(shard.parent))
    assert [check.faults for check in checks] == [()] * 4 + [("another row has the same name",)] * 4


@pytest.mark.parametrize(
    "name", ["../evil", "/etc/evil", "a/../../evil", "a\\..\\evil", "C:evil", "a\0b", "x" * 2000]
)
def test_names_that_lead_elsewhere_are_not_extracted(shard: Path, tmp_path: Path, name: str) -> None:
    rewrite(shard, lambda row: row.update(name=name) if row["name"] == "anna/joy/both" else None)
    target = tmp_path / "out" / "deep"
    target.mkdir(parents=True)
    with pytest.raises(FormatError, match="is no name of a file below a folder"):
        list(extract(Archive(shard.parent), [], target))
    assert list(tmp_path.rglob("*evil*")) == []


@pytest.mark.skipif(sys.platform == "win32", reason="links")
def test_links_that_lead_elsewhere_are_not_followed(archive: Path, tmp_path: Path) -> None:
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "anna").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(FormatError, match="leads out of"):
        list(extract(Archive(archive), ["anna/joy/both"], tmp_path / "out"))
    assert list((tmp_path / "elsewhere").iterdir()) == []


def test_a_huge_row_group_is_not_read(archive: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A file of some kilobytes with many more: equal bytes, compressed by another program."""
    monkeypatch.setattr("fba.archive._shards.MOST_GROUP_BYTES", 1 << 20)
    one = Archive(archive)["anna/joy/talk"]
    write_shard(tmp_path, 0, [replace(one, stream=one.stream)])
    (shard,) = tmp_path.iterdir()
    row = pq.read_table(shard).to_pylist()[0]
    row["sound"] = bytes(1 << 18)
    table = pa.Table.from_pylist([{**row, "name": str(number)} for number in range(5)], schema())
    pq.write_table(table, shard, compression="ZSTD", use_dictionary=False)
    assert shard.stat().st_size < 500_000
    with pytest.raises(LimitError, match="row group 0 takes 13"):
        list(Archive(tmp_path))
    assert Windows(tmp_path, 50)[0].shape == (50, 68)  # which do not read sounds


def test_a_full_disk(takes: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("fba.atomic.os.replace", full)
    with pytest.raises(FormatError, match="No space left on device"):
        archived.make(takes / "anna", tmp_path)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no full device")
def test_a_disk_that_fills_up_while_a_shard_is_written(
    archive: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from contextlib import contextmanager

    @contextmanager
    def full(_: object) -> Any:
        with open("/dev/full", "wb", buffering=0) as file:
            yield file

    monkeypatch.setattr("fba.archive._locations.atomic", full)
    with pytest.raises((FbaError, OSError), match="No space left"):
        write_shard(Path("nowhere"), 0, list(Archive(archive)))


def index_it(folder: Path) -> None:
    list(index_archive(folder))


def verify_it(folder: Path) -> None:
    list(verify_archive(folder))


@pytest.mark.parametrize("function", [Archive, Windows, index_it, query, verify_it])
def test_folders_that_are_no_archives(tmp_path: Path, function: Callable[[Path], object]) -> None:
    with pytest.raises(FormatError, match="holds no shards"):
        function(tmp_path)
    with pytest.raises(FormatError, match="there is no such folder"):
        function(tmp_path / "none")


@pytest.mark.parametrize("package", ["pyarrow", "duckdb"])
def test_missing_packages(archive: Path, monkeypatch: pytest.MonkeyPatch, package: str) -> None:
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(FbaError, match=r"mpeg4-fba\[archive\]"):
        query(archive)


def test_bits_flipped_anywhere_give_errors_of_ours(archive: Path, tmp_path: Path) -> None:
    """Pages have checksums; what has none, the footer, leads to an error, or to nothing."""
    (source,) = archive.glob("shard-*.parquet")
    whole = source.read_bytes()
    expected = [one.digest for one in Archive(archive)]
    random = np.random.default_rng(1)
    for _ in range(60):
        data = bytearray(whole)
        footer = int.from_bytes(whole[-8:-4], "little")
        low = 0 if random.random() < 0.5 else len(data) - footer - 8
        data[int(random.integers(low, len(data)))] ^= 1 << int(random.integers(8))
        (tmp_path / source.name).write_bytes(data)
        try:
            assert [one.digest for one in Archive(tmp_path)] == expected
        except FbaError as error:
            assert source.name in str(error)  # noqa: PT017

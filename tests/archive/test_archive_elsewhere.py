"""Archives that lie elsewhere, opened by fsspec: in its memory, in a folder by address, in a ZIP file."""

import pickle
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("fsspec")
pytest.importorskip("duckdb")

import fsspec

import archived
from fba.archive import Archive, Windows, describe_archive, extract, index_archive, query, verify_archive
from fba.errors import FbaError, FormatError, OptionError

ADDRESS = "memory://elsewhere/archive"


@pytest.fixture
def memory() -> Iterator[Any]:
    """fsspec's file system in memory, empty before and after."""
    storage = fsspec.filesystem("memory")
    storage.store.clear()
    storage.pseudo_dirs[:] = [""]
    yield storage
    storage.store.clear()
    storage.pseudo_dirs[:] = [""]


def test_all_that_one_does_with_an_archive(memory: Any, takes: Path, archive: Path, tmp_path: Path) -> None:
    assert [one.error for one in archived.make(takes, ADDRESS)] == [""] * 4
    assert [one.unchanged for one in archived.make(takes, ADDRESS)] == [True] * 4
    here, there = Archive(archive), Archive(ADDRESS)
    assert list(there) == list(here)
    assert describe_archive(there) == describe_archive(here)
    assert there["ben/sad/walk"] == here["ben/sad/walk"]
    assert [(one.name, one.faults) for one in verify_archive(ADDRESS)] == [
        (one.name, one.faults) for one in verify_archive(archive)
    ]
    with pytest.raises(FormatError, match=rf"{ADDRESS}: has no index yet"):
        query(ADDRESS)
    assert [one.error for one in index_archive(ADDRESS)] == [""] * 4
    assert query(ADDRESS, "subject = 'ben'").num_rows == 2
    (path,) = extract(there, ["anna/joy/talk"], tmp_path)
    assert path.read_bytes() == here["anna/joy/talk"].stream
    names = sorted(name.rpartition("/")[2] for name in memory.store)
    assert [name.partition("-")[0] for name in names] == ["index.parquet", "shard"]  # and nothing temporary


def test_windows_from_elsewhere(memory: Any, archive: Path, tmp_path: Path) -> None:
    memory.put(str(archive), "/elsewhere/archive", recursive=True)
    shutil.make_archive(str(tmp_path / "all"), "zip", archive.parent, archive.name)
    zipped = f"zip://{archive.name}::{tmp_path / 'all.zip'}"
    expected = list(Windows(archive, 60, 23))
    for address in (
        ADDRESS,
        f"file://{archive}",
        zipped,
        f"zip://{archive.name}/::file://{tmp_path}/all.zip",
    ):
        windows = Windows(address, 60, 23)
        for position in (3, 0, len(windows) - 1):
            np.testing.assert_array_equal(windows[position], expected[position])
        data = pickle.dumps(windows)
        assert len(data) < 10_000
        np.testing.assert_array_equal(pickle.loads(data)[1], expected[1])


@pytest.mark.parametrize("step", ["put_file", "mv"])
def test_nothing_half_written(memory: Any, takes: Path, monkeypatch: pytest.MonkeyPatch, step: str) -> None:
    def fail(*_: Any, **__: Any) -> None:
        memory.pipe("/elsewhere/archive/.fba-0.tmp", b"half")
        raise OSError("the line is dead")

    monkeypatch.setattr(type(memory), step, fail)
    monkeypatch.setattr("secrets.token_hex", lambda _: "0")
    with pytest.raises(FormatError, match=r"shard-.*: could not be written: the line is dead"):
        archived.make(takes, ADDRESS)
    assert list(memory.store) == []


def test_damage(memory: Any, archive: Path) -> None:
    (shard,) = archive.glob("shard-*")
    data = bytearray(shard.read_bytes())
    data[len(data) // 4] ^= 1
    memory.pipe(f"/elsewhere/archive/{shard.name}", bytes(data))
    (check,) = verify_archive(ADDRESS)
    assert (str(check.shard), check.name) == (f"{ADDRESS}/{shard.name}", "")
    assert "or is damaged" in check.faults[0]
    memory.pipe(f"/elsewhere/archive/{shard.name}", bytes(data[:1000]))
    with pytest.raises(FormatError, match=r"memory://.*parquet: cannot be read, or is damaged, or is no"):
        Archive(ADDRESS)


def test_a_storage_that_fails_while_it_is_read(
    memory: Any, archive: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each storage has errors of its own."""

    class LostError(Exception):
        pass

    def fail(*_: Any, **__: Any) -> None:
        raise LostError("the line is dead")

    (shard,) = archive.glob("shard-*")
    memory.pipe(f"/elsewhere/archive/{shard.name}", shard.read_bytes())
    windows = Windows(ADDRESS, 60)
    file = type(memory.open(f"/elsewhere/archive/{shard.name}"))
    monkeypatch.setattr(file, "read", fail, raising=False)
    monkeypatch.setattr(file, "readinto", fail, raising=False)
    with pytest.raises(FormatError, match=r"memory://.*parquet: cannot be read, or .*\(the line is dead\)"):
        windows[0]
    monkeypatch.setattr(type(memory), "ls", fail)
    with pytest.raises(FormatError, match=rf"{ADDRESS}: cannot be listed: the line is dead"):
        Archive(ADDRESS)


def test_wrong_addresses(memory: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(FormatError, match=rf"{ADDRESS}: holds no shards"):
        Archive(ADDRESS)
    with pytest.raises(OptionError, match=r"nowhere://a is no address of a folder: Protocol not known"):
        Archive("nowhere://a")
    fsspec.register_implementation("lost", "no_such_package.Storage", errtxt="Install lostfs", clobber=True)
    with pytest.raises(FbaError, match=r"lost://a: a package is missing: Install lostfs"):
        Archive("lost://a")
    monkeypatch.setitem(sys.modules, "fsspec.core", None)
    with pytest.raises(FbaError, match="are opened by the package fsspec"):
        Archive(ADDRESS)

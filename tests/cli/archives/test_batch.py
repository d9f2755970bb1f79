"""`fba convert --batch`: the same results as one by one, failures, interruptions, and going on."""

import csv
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import archived
import fba
from command_line import Run
from fba.archive import RECORD
from ready_programs import BIN

SAMPLES = Path(fba.__file__).parent / "samples"


@pytest.fixture
def captures(tmp_path: Path) -> Path:
    """Two files that can be read, in folders, and two that cannot."""
    folder = tmp_path / "captures"
    (folder / "anna").mkdir(parents=True)
    shutil.copy(SAMPLES / "hello.fap", folder / "anna")
    fba.write(folder / "turn.bap", archived.performance(3, face=False, body=True, frames=20))
    (folder / "bad.fap").write_text("x")
    (folder / "empty.bvh").write_bytes(b"")
    return folder


def record(folder: Path) -> dict[str, list[str]]:
    with open(folder / RECORD, newline="") as file:
        rows = list(csv.reader(file))
    assert rows[0] == ["source", "output", "key", "bytes", "error", "warnings"]
    return {row[0]: row[1:] for row in rows[1:]}


def files(folder: Path) -> list[str]:
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file())


def test_the_same_as_one_by_one(run: Run, captures: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    printed = run("convert", "--batch", captures, out, "--to", "fba", "--jobs", 1, code=1).out  # two failed
    assert "2 converted, 0 there before, 2 failed; conversions.csv lists all" in printed
    assert "bad.fap" in printed
    assert files(out) == ["anna/hello.fba", RECORD, "turn.fba"]
    for name in ("anna/hello.fap", "turn.bap"):
        run("convert", captures / name, tmp_path / "one.fba")
        assert (out / name).with_suffix(".fba").read_bytes() == (tmp_path / "one.fba").read_bytes()
    rows = record(out)
    assert rows["anna/hello.fap"][0] == "anna/hello.fba"
    assert int(rows["turn.bap"][2]) == (out / "turn.fba").stat().st_size
    assert "expected a header" in rows["bad.fap"][3]
    assert "is empty" in rows["empty.bvh"][3]


def test_what_is_done_is_not_done_again(run: Run, captures: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    arguments = ("convert", "--batch", captures, out, "--to", "fba", "--jobs", 1)
    run(*arguments, code=1)
    times = {name: (out / name).stat().st_mtime_ns for name in files(out)}
    assert "0 converted, 2 there before" in run(*arguments, code=1).out
    assert (out / "turn.fba").stat().st_mtime_ns == times["turn.fba"]
    (out / "turn.fba").unlink()  # a result that is gone, a source that has changed, other settings
    assert "1 converted, 1 there before" in run(*arguments, code=1).out
    fba.write(captures / "anna" / "hello.fap", archived.performance(1, frames=20))
    assert "1 converted, 1 there before" in run(*arguments, code=1).out
    assert "2 converted, 0 there before" in run(*arguments, "--fps", 10, code=1).out
    shutil.copy(SAMPLES / "hello.fap", captures / "bad.fap")
    assert "1 converted, 2 there before, 1 failed" in run(*arguments, "--fps", 10, code=1).out
    assert record(out)["bad.fap"][3] == ""


def test_processes_do_the_same(run: Run, captures: Path, tmp_path: Path) -> None:
    for jobs in (1, 2):
        run("convert", "--batch", captures, tmp_path / str(jobs), "--to", "bap", "--jobs", jobs, code=1)
    assert files(tmp_path / "1") == files(tmp_path / "2") == [RECORD, "turn.bap"]
    assert (tmp_path / "1" / "turn.bap").read_bytes() == (tmp_path / "2" / "turn.bap").read_bytes()
    assert record(tmp_path / "1")["turn.bap"] == record(tmp_path / "2")["turn.bap"]
    assert "only a face" in record(tmp_path / "1")["anna/hello.fap"][3]


@pytest.mark.usefixtures("interruptible")
@pytest.mark.skipif(sys.platform == "win32", reason="signals")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_an_interruption_leaves_whole_files(run: Run, tmp_path: Path, number: signal.Signals) -> None:
    captures, out = tmp_path / "captures", tmp_path / "out"
    captures.mkdir()
    for name in range(300):
        shutil.copy(SAMPLES / "hello.fap", captures / f"talk{name:03}.fap")
    command = [BIN / "fba", "convert", "--batch", captures, out, "--to", "fba", "--jobs", "2"]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True
    ) as process:
        while not list(out.glob("*.fba")):
            assert process.poll() is None
            time.sleep(0.01)
        os.killpg(process.pid, number)  # as a terminal does
        process.communicate()
    assert process.returncode == (130 if number == signal.SIGINT else -signal.SIGKILL)
    done = list(out.glob("*.fba"))
    assert 0 < len(done) < 300
    if number == signal.SIGINT:
        assert files(out) == sorted([RECORD, *(path.name for path in done)])
    digests = {fba.codec.digest(fba.read(path)) for path in done}
    assert len(digests) == 1
    for name in range(30, 300):  # the rest, in less time
        (captures / f"talk{name:03}.fap").unlink()
    assert "0 failed" in run("convert", "--batch", captures, out, "--to", "fba", "--jobs", 1).out
    assert {f"talk{name:03}.fba" for name in range(30)} <= set(files(out))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--batch", "captures", "out"], "--batch needs the format of the results"),
        (["--batch", "captures", "captures/out", "--to", "fba"], "neither of them in the other"),
        (["--batch", "captures", "captures", "--to", "fba"], "neither of them in the other"),
        (["--batch", "captures/bad.fap", "out", "--to", "fba"], "is a file"),
        (["--batch", "captures", "captures/bad.fap", "--to", "fba"], "with --batch, give a folder"),
        (["captures/turn.bap", "out.fba", "--jobs", "2"], "--jobs goes with --batch"),
        (["captures/turn.bap", "out.fba", "--scheduler", "tcp://a:1"], "--scheduler goes with --batch"),
        (["captures", "out.fba"], "is a directory"),
        (
            ["--batch", "captures", "out", "--to", "fba", "--jobs", "2", "--scheduler", "tcp://a:1"],
            "--jobs and --scheduler contradict each other",
        ),
    ],
)
def test_wrong_usage(
    run: Run, captures: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str], message: str
) -> None:
    monkeypatch.chdir(captures.parent)
    assert message in " ".join(run("convert", *arguments, code=2).err.split())
    assert not (captures.parent / "out").exists()


@pytest.mark.parametrize(
    ("content", "message"), [("a,b\n1,2\n", "is no table of conversions"), ("", "is no table of conversions")]
)
def test_another_table_in_the_folder(
    run: Run, captures: Path, tmp_path: Path, content: str, message: str
) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / RECORD).write_text(content)
    err = run("convert", "--batch", captures, tmp_path / "out", "--to", "fba", "--jobs", 1, code=1).err
    assert message in err
    assert (tmp_path / "out" / RECORD).read_text() == content


def test_a_table_that_was_cut_off(run: Run, captures: Path, tmp_path: Path) -> None:
    arguments = ("convert", "--batch", captures, tmp_path / "out", "--to", "fba", "--jobs", 1)
    run(*arguments, code=1)
    table = tmp_path / "out" / RECORD
    table.write_text(table.read_text() + 'turn.bap,"tu')
    assert "0 converted, 2 there before" in run(*arguments, code=1).out


def write_still_heads(folder: Path, count: int) -> None:
    """Write tables of Live Link whose heads never turn: a warning for each."""
    talk = fba.read(SAMPLES / "hello.fap")
    values = talk.face.values.copy()
    values[:, 22:26] = values[:, 47:50] = 0
    still = replace(talk, face=replace(talk.face, values=values))
    folder.mkdir()
    for number in range(count):
        fba.write(folder / f"take{number}.csv", still)


@pytest.mark.parametrize("jobs", [1, 2])
def test_a_warning_of_many_files_is_said_once(run: Run, tmp_path: Path, jobs: int) -> None:
    write_still_heads(tmp_path / "in", 5)
    shutil.copy(SAMPLES / "hello.fap", tmp_path / "in")
    arguments = ("convert", "--batch", tmp_path / "in", tmp_path / "out", "--to", "fba", "--jobs", jobs)
    err = run(*arguments).err
    said = [line for line in err.splitlines() if "all angles of head and eyes are 0" in line]
    assert len(said) == 2
    assert said[0].startswith("fba: warning: take0.csv: all angles")
    assert said[1].startswith("fba: warning: in 4 more files, as conversions.csv lists: all angles")
    assert str(tmp_path) not in err
    rows = record(tmp_path / "out")
    assert all("all angles of head and eyes are 0" in rows[f"take{number}.csv"][4] for number in range(5))
    assert rows["hello.fap"][4] == ""
    assert run(*arguments).err == ""  # they are not read again
    assert record(tmp_path / "out") == rows


@pytest.fixture
def memory() -> Iterator[Any]:
    """fsspec's file system in memory, empty before and after."""
    storage = pytest.importorskip("fsspec").filesystem("memory")
    storage.store.clear()
    yield storage
    storage.store.clear()


def test_folders_elsewhere(run: Run, captures: Path, tmp_path: Path, memory: Any) -> None:
    (captures / ".hidden").mkdir()
    shutil.copy(SAMPLES / "hello.fap", captures / ".hidden")
    here = tmp_path / "here"
    run("convert", "--batch", captures, here, "--to", "fba", "--jobs", 1, code=1)
    memory.put(str(captures) + "/", "/far/captures", recursive=True)
    shutil.make_archive(str(tmp_path / "all"), "zip", captures.parent, captures.name)
    pairs = [
        ("memory://far/captures", "memory://far/out"),
        (captures, "memory://far/other"),
        (f"zip://captures::{tmp_path}/all.zip", f"file://{tmp_path}/unzipped"),
        ("memory://far/captures/", tmp_path / "fetched"),
    ]
    for source, target in pairs:
        arguments = ("convert", "--batch", source, target, "--to", "fba", "--jobs", 1)
        printed = run(*arguments, code=1).out
        assert "2 converted, 0 there before, 2 failed" in printed
        assert "0 converted, 2 there before, 2 failed" in run(*arguments, code=1).out
        if "://" in str(source):
            assert f"{str(source).rstrip('/')}/bad.fap" in " ".join(printed.split()) or "::" in str(source)
    for found in (
        {name.removeprefix("/far/out/"): memory.cat(name) for name in memory.find("/far/out")},
        {name.removeprefix("/far/other/"): memory.cat(name) for name in memory.find("/far/other")},
        {name: (tmp_path / "unzipped" / name).read_bytes() for name in files(tmp_path / "unzipped")},
        {name: (tmp_path / "fetched" / name).read_bytes() for name in files(tmp_path / "fetched")},
    ):
        assert sorted(found) == files(here)  # and nothing temporary
        assert {name: data for name, data in found.items() if name != RECORD} == {
            name: (here / name).read_bytes() for name in files(here) if name != RECORD
        }


def test_processes_read_and_write_elsewhere(run: Run, captures: Path, tmp_path: Path) -> None:
    pytest.importorskip("fsspec")
    source, target = f"file://{captures}", f"file://{tmp_path}/out"
    printed = run("convert", "--batch", source, target, "--to", "fba", "--jobs", 2, code=1).out
    assert "2 converted, 0 there before, 2 failed" in printed
    assert files(tmp_path / "out") == ["anna/hello.fba", RECORD, "turn.fba"]
    assert f"{source}/bad.fap" in record(tmp_path / "out")["bad.fap"][3]


def test_a_storage_that_takes_nothing(
    run: Run, captures: Path, memory: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A result that cannot be brought is a failure of its file, and leaves nothing."""
    put = type(memory).put_file

    def fail(self: Any, local: str, remote: str, **more: Any) -> None:
        if Path(local).suffix == ".fba":
            raise OSError("the line is dead")
        put(self, local, remote, **more)

    monkeypatch.setattr(type(memory), "put_file", fail)
    arguments = ("convert", "--batch", captures, "memory://far/out", "--to", "fba", "--jobs", 1)
    printed = run(*arguments, code=1).out
    assert "0 converted, 0 there before, 4 failed" in printed
    assert "could not be written: the line is dead" in " ".join(printed.split())
    assert [name.rpartition("/")[2] for name in memory.find("/far/out")] == [RECORD]
    monkeypatch.undo()
    assert "2 converted, 0 there before, 2 failed" in run(*arguments, code=1).out


def test_addresses_that_contain_each_other(run: Run, captures: Path, memory: Any) -> None:
    memory.put(str(captures) + "/", "/far/captures", recursive=True)
    for target in ("memory://far/captures", "memory://far/captures/out"):
        err = run("convert", "--batch", "memory://far/captures", target, "--to", "fba", code=2).err
        assert "neither of them in the other" in " ".join(err.split())
    err = run("convert", "--batch", "nowhere://a", "memory://far/out", "--to", "fba", code=None).err
    assert "Protocol not known" in err


def test_a_folder_without_anything_to_read(run: Run, tmp_path: Path) -> None:
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "notes.md").write_text("x")
    err = run("convert", "--batch", tmp_path / "in", tmp_path / "out", "--to", "fba", code=1).err
    assert "holds no file of a format that is read" in err

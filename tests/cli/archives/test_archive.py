"""`fba archive`: reports for people and programs, exit codes, wrong usage."""

import json
from pathlib import Path

import pytest

pytest.importorskip("pyarrow")
pytest.importorskip("duckdb")

import archived
import fba
from command_line import Run


@pytest.fixture
def takes(tmp_path: Path) -> Path:
    (tmp_path / "takes" / "anna").mkdir(parents=True)
    fba.write(tmp_path / "takes" / "anna" / "one.fap", archived.performance(1, frames=50))
    (tmp_path / "takes" / "bad.fap").write_text("x")
    return tmp_path / "takes"


def test_from_files_to_answers(run: Run, takes: Path, tmp_path: Path) -> None:
    out = tmp_path / "archive"
    printed = run("archive", "make", takes, "-o", out, "--jobs", 1, code=1).out
    assert "1 performances added, 0 there before, 1 failed" in printed
    assert "bad.fap" in printed
    (takes / "bad.fap").unlink()
    assert json.loads(run("archive", "make", takes, "-o", out, "--jobs", 1, "--json").out) == {
        "added": 0,
        "unchanged": 1,
        "rounded": 0,
        "failed": [],
    }
    about = json.loads(run("archive", "info", out, "--json").out)
    assert (about["performances"], about["subjects"], about["seconds"], about["rates"]) == (1, 1, 2.0, [25.0])
    assert "1 performances intact, 0 faults" in run("archive", "verify", out, "--jobs", 1).out
    run("archive", "index", out, "--jobs", 1)
    _, printed, err = run("archive", "query", out, "seconds > 1", "--json", "--columns", "all")
    (row,) = json.loads(printed)
    assert err == "1 performances\n"
    assert row["name"] == "anna/one"
    assert len(row["motion"]) > 3
    assert run("archive", "query", out, "seconds > 9").out == ""
    run("archive", "extract", out, "anna/one", "-o", tmp_path / "back")
    assert fba.read(tmp_path / "back" / "anna" / "one.fba") == fba.read(takes / "anna" / "one.fap")


def test_damage_ends_with_1(run: Run, takes: Path, tmp_path: Path) -> None:
    out = tmp_path / "archive"
    run("archive", "make", takes / "anna", "-o", out, "--jobs", 1)
    (shard,) = out.iterdir()
    data = bytearray(shard.read_bytes())
    data[len(data) // 4] ^= 1
    shard.write_bytes(data)
    assert "0 performances intact, 1 faults" in run("archive", "verify", out, "--jobs", 1, code=1).out
    err = run("archive", "extract", out, "-o", tmp_path / "back", code=1).err
    assert err.startswith(f"fba: error: {shard}: is damaged")


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["make", "takes"], 2, "'--output'"),
        (["make", "none", "-o", "out"], 2, "does not exist"),
        (["make", "takes", "-o", "out", "--folders", "a,,b"], 2, "name the levels of folders"),
        (["make", "takes", "-o", "out", "--tolerance", "3"], 2, "has no unit"),
        (["make", "takes", "-o", "takes/bad.fap"], 2, "is a file"),
        (["make", "empty", "-o", "out"], 1, "holds no file of a format that is read"),
        (["info", "empty"], 1, "holds no shards (shard-*.parquet); `fba archive make` writes them"),
        (["query", "empty", "x"], 1, "holds no shards"),
    ],
)
def test_wrong_usage_of_archives(
    run: Run, takes: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str], code: int, message: str
) -> None:
    monkeypatch.chdir(takes.parent)
    Path("empty").mkdir()
    assert message in " ".join(run("archive", *arguments, code=code)[2].split())
    assert not Path("out").exists()


def test_an_archive_by_its_address(run: Run, takes: Path, tmp_path: Path) -> None:
    pytest.importorskip("fsspec")
    out = f"file://{tmp_path}/far/archive"
    assert (
        run("archive", "make", takes / "anna", "-o", out, "--jobs", 1).out
        == f"{out}: 1 performances added, 0 there before, 0 failed\n"
    )
    assert [path.suffix for path in (tmp_path / "far" / "archive").iterdir()] == [".parquet"]
    assert json.loads(run("archive", "info", out, "--json").out)["performances"] == 1
    assert f"{out}: 1 performances intact" in run("archive", "verify", out, "--jobs", 2).out
    assert f"{out}: 1 performances described" in run("archive", "index", out, "--jobs", 1).out
    run("archive", "query", out, "seconds > 1", "--json")
    run("archive", "extract", out, "-o", tmp_path / "back")
    assert fba.read(tmp_path / "back" / "one.fba") == fba.read(takes / "anna" / "one.fap")
    assert run("archive", "info", f"file://{tmp_path}/none", code=1).err == (
f"fba: error: file://{tmp_path}/none: holds no shards (shard-*.parquet); "
                              "`fba archive make` writes them\n"
)  # fmt: skip

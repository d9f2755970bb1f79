"""Exit codes, one-line errors, help.

`fba demo`: what it leaves behind. Drawing is left out here: .ci/run makes the whole film.
"""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

import fba
from command_line import Run
from fba import Animation
from fba.cli.commands import demo
from fba.cli.main import _COMMANDS, group

SAMPLES = Path(fba.__file__).parent / "samples"


def test_help_lists_every_command_with_examples(run: Run) -> None:
    out = run("--help").out
    assert "Examples:" in out
    for name in _COMMANDS:
        assert f"\n  {name} " in out


@pytest.mark.parametrize("name", _COMMANDS)
def test_help_of_every_command(run: Run, name: str) -> None:
    out = run(name, "--help").out
    assert out.startswith(f"Usage: fba {name}")
    assert f"fba {name}" in out.split("Examples:")[1]
    assert "--debug" in out


def test_version(run: Run) -> None:
    assert run("--version") == (0, f"fba, version {fba.__version__}\n", "")


@pytest.mark.parametrize(
    "arguments",
    [
        ["nonsense"],
        ["encode"],
        ["info", "/no/such/file"],
        ["encode", "x", "--quant", "32"],
        ["info", "--nonsense"],
    ],
)
def test_bad_usage_exits_with_2(run: Run, arguments: list[str]) -> None:
    _, out, err = run(*arguments, code=2)
    assert out == ""
    assert "Error" in err


def test_bad_data_is_one_line_and_exit_1(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "broken.fba"
    path.write_bytes(b"\x00\x00\x01\xba\xff")
    err = run("decode", path, "--fap", tmp_path / "out.fap", code=1).err
    assert err.startswith("fba: error: ")
    assert err.count("\n") == 1
    assert "ends inside this plane" in err
    assert not (tmp_path / "out.fap").exists()


def test_debug_shows_the_traceback(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "broken.fba"
    path.write_bytes(b"\x00\x00\x01\xba\xff")
    program = [sys.executable, "-m", "fba", "decode", str(path), "--fap", str(tmp_path / "o.fap"), "--debug"]
    result = subprocess.run(program, capture_output=True, text=True, check=False)
    assert result.returncode == 1
    assert "Traceback" in result.stderr


def test_a_directory_is_no_file(run: Run, tmp_path: Path) -> None:
    assert "directory" in run("info", tmp_path, code=2).err


@pytest.mark.skipif(os.name != "posix", reason="pipes of a POSIX shell")
def test_a_reader_that_has_seen_enough_is_no_error(tmp_path: Path, face: Animation) -> None:
    path = tmp_path / "face.fba"
    fba.write(path, face)
    shell = f"'{sys.executable}' -m fba info --trace '{path}' | head -n 1"
    result = subprocess.run(["sh", "-c", shell], capture_output=True, text=True, check=False)
    assert (result.stdout.splitlines(), result.stderr) == (["      bit   bits  plane  element"], "")


def test_the_folder_has_the_samples_and_the_stream_made_of_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(demo, "_render", lambda *_: None)
    folder = tmp_path / "demo"
    result = CliRunner().invoke(group, ["demo", "--no-play", "--out", str(folder)])
    assert result.exit_code == 0, result.output
    names = sorted(path.name for path in SAMPLES.iterdir() if path.suffix != ".txt")
    assert names == ["hello.bvh", "hello.fap", "hello.wav", "talk.c3d"]
    for name in names:
        assert (folder / name).read_bytes() == (SAMPLES / name).read_bytes()
        assert str(folder / name) in result.output
    stream = fba.read(folder / "hello.fba", bap_steps="visage")
    assert len(stream) == len(fba.read(folder / "hello.fap"))
    assert stream.face is not None
    assert stream.body is not None
    talk = fba.read(folder / "talk.fba")
    assert float(talk.duration) == pytest.approx(6.0)
    assert talk.face is not None
    assert talk.body is not None
    assert "talk.c3d, 6.00 s" in result.output

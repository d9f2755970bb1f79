"""`fba gait`: what it writes and prints, and how it fails."""

import json
from pathlib import Path

import numpy as np
import pytest

import fba
from command_line import Run
from fba.body import gait


def test_writes_a_walk(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "walk.bap"
    _, out, err = run("gait", "--stride", 0.7, "--character", "bored", "-o", path)
    assert err == ""
    assert "bored" in out
    assert "2.80 m at 0.50 m/s" in out
    wanted = gait.walk(0.7, "bored")
    np.testing.assert_array_equal(fba.read(path).body.values, wanted.body.values)


def test_writes_streams_and_says_what_their_steps_do(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "walk.fba"
    assert "--bap-steps visage" in run("gait", "--cycles", 1, "-o", path, "--bap-steps", "iso").err
    assert len(fba.read(path)) == 33
    assert run("gait", "--cycles", 1, "-o", path).err == ""
    decoded = fba.read(path).body.values.astype(int)
    apart = np.abs(decoded - gait.walk(cycles=1).body.values)
    assert apart[:, 180:183].max() <= 1  # steps of 2 mm
    assert apart.max() <= 128  # and of 256 x 1e-5 rad


def test_lengths_and_rates(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "walk.bap"
    run("gait", "--seconds", 2, "--fps", 25, "-o", path)
    walk = fba.read(path)
    assert (len(walk), walk.rate) == (50, 25)
    assert "m/s" not in run("gait", "--in-place", "--cycles", 1, "-o", path).out


def test_lists_characters(run: Run) -> None:
    assert [line.split()[0] for line in run("gait", "--list").out.splitlines()] == list(gait.characters())
    assert [row["name"] for row in json.loads(run("gait", "--list", "--json").out)] == list(gait.characters())


def test_finds_steps(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "walk.bap"
    run("gait", "--cycles", 2, "-o", path)
    assert run("gait", "--find", path).out.startswith("4 steps, 3 cycles")
    found = json.loads(run("gait", "--find", path, "--json").out)
    assert [step["side"] for step in found["steps"]] == ["right", "left", "right", "left"]
    assert found["cycles"][0]["seconds"] == pytest.approx(32 / 30)


@pytest.mark.parametrize(
    ("arguments", "code", "text"),
    [
        (["--stride", 5, "-o", "x.bap"], 1, "too long"),
        (["--stride", 2.1, "-o", "x.bap"], 1, "too long for 'normal'"),
        (["--stride", -1, "-o", "x.bap"], 1, "at least 0.1 m"),
        (["--stride", "nan", "-o", "x.bap"], 1, "at least 0.1 m"),
        (["--stride", "far", "-o", "x.bap"], 2, "far"),
        (["--character", "cheerful", "-o", "x.bap"], 1, "normal, bored, proud"),
        (["--cycles", 0, "-o", "x.bap"], 2, "--cycles must be a positive number"),
        (["--seconds", "nan", "-o", "x.bap"], 2, "--seconds must be a positive number"),
        (["--cycles", 1, "--seconds", 1, "-o", "x.bap"], 2, "either --cycles or --seconds, not both"),
        (["--list", "--stride", 1], 2, "--stride goes with -o"),
        (["--fps", 2, "-o", "x.bap"], 2, "it needs 8 to 100000"),
        (["-o", "x.unknown"], 1, "suffix"),
        ([], 2, "give one of"),
        (["--list", "-o", "x.bap"], 2, "give one of"),
        (["--json", "-o", "x.bap"], 2, "--json"),
    ],
)
def test_errors_are_one_line(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[object], code: int, text: str
) -> None:
    monkeypatch.chdir(tmp_path)
    assert text in run("gait", *arguments, code=code).err.splitlines()[-1]
    assert not list(tmp_path.iterdir())


def test_a_face_does_not_walk(run: Run, tmp_path: Path, face: fba.Animation) -> None:
    path = tmp_path / "face.fap"
    fba.write(path, face)
    assert "no body" in run("gait", "--find", path, code=1).err

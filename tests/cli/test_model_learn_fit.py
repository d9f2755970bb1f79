"""`fba model learn-fit`: what it prints and writes, and how it fails."""

import json
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

import fba
from command_line import Run
from fba import Animation, FaceTrack
from fba.face import FaceModel, InterpolationTable, resolve
from fba.face.learning import send_sources
from small_face import small_face

JAW, CHIN, CORNER, LIP = 2, 17, 5, 3


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder, with head.glb, monday.fap, tuesday.fap: the lip is half the jaw."""
    monkeypatch.chdir(tmp_path)
    small_face().save("head.glb")
    for name, seed in (("monday", 1), ("tuesday", 2)):
        rng = np.random.default_rng(seed)
        values = np.zeros((40, 68), dtype=np.int32)
        values[:, [JAW, CHIN, CORNER]] = rng.integers(-100, 100, (40, 3)) * 4
        values[:, LIP] = values[:, JAW] // 2
        mask = np.tile(values.any(axis=0), (40, 1))
        fba.write(f"{name}.fap", Animation(Fraction(25), np.arange(40), FaceTrack(values, mask)))
    return tmp_path


def test_a_table_is_learned_stored_and_written(run: Run, here: Path) -> None:
    _, out, err = run(
        "model", "learn-fit", "monday.fap", "tuesday.fap", "--faps", 3, "--model", "head.glb",
        "-o", "ada.glb", "--fit", "ada.json",
    )  # fmt: skip
    assert "the model does not show FAP 4 lower_t_midlip, 6 stretch_l_cornerlip, 18 depress_chin" in err
    assert "a FIT learned from 80 frames" in out
    assert "3 FAPs to send: " in out
    assert "lower_t_midlip " in out
    head = FaceModel.load("ada.glb")
    assert head.fit is not None
    assert head.fit == InterpolationTable.from_node(json.loads(Path("ada.json").read_text()))
    monday = fba.read("monday.fap").face
    shown = resolve(send_sources(monday, head.fit), head)
    assert shown[:, LIP] == pytest.approx(monday.values[:, LIP], abs=1)
    assert "its own table" in run("model", "info", "ada.glb").out
    _, out, _ = run("model", "learn-fit", "monday.fap", "--faps", 3, "--model", "ada.glb", "-o", "again.glb")
    assert "in place of its own" in out


def test_figures_for_programs(run: Run, here: Path) -> None:
    line = [
        "model", "learn-fit", "monday.fap", "tuesday.fap", "--model", "head.glb", "-o", "ada.glb", "--json",
    ]  # fmt: skip
    out = run(*line, "--tolerance", "0.5mm").out
    said = json.loads(out)
    assert said["output"] == "ada.glb"
    assert (said["frames"], said["streams"]) == (80, 2)
    assert said["held_out"]["millimetres"]["percentile_99"] <= 0.5
    assert {one["fap"] for one in said["held_out"]["faps"]} == set(said["computed"])


@pytest.mark.parametrize(
    ("options", "status", "message"),
    [
        (["--faps", "3", "--tolerance", "1mm"], 2, "--faps and --tolerance contradict each other"),
        (["--tolerance", "-1mm"], 2, "-1mm is not positive"),
        (["--tolerance", "nan"], 2, "'nan' is not a length"),
        (["--faps", "60"], 1, "different poses"),
        (["walk.bap"], 1, "walk.bap: there is no face in it"),
        (["still.fap"], 1, "nothing to learn from"),
    ],
)
def test_mistakes(run: Run, here: Path, options: list[str], status: int, message: str) -> None:
    body = fba.BodyTrack(np.zeros((5, 296), dtype=np.int32), np.ones((5, 296), dtype=bool))
    fba.write("walk.bap", Animation(Fraction(25), np.arange(5), body=body))
    still = FaceTrack(np.zeros((5, 68), dtype=np.int32), np.tile(np.arange(68) > 1, (5, 1)))
    fba.write("still.fap", Animation(Fraction(25), np.arange(5), still))
    streams = [] if options[0].endswith("ap") and not options[0].startswith("--") else ["monday.fap"]
    err = run(
        "model", "learn-fit", *streams, *options, "--model", "head.glb", "-o", "ada.glb", code=status
    ).err
    assert message in " ".join(err.split())
    assert not Path("ada.glb").exists()


def test_a_model_is_named_as_one(run: Run, here: Path) -> None:
    assert "name it ada.glb" in run("model", "learn-fit", "monday.fap", "-o", "ada.json", code=2).err


def test_a_stream_leaves_to_the_head_what_it_computes(run: Run, here: Path) -> None:
    run(
        "model", "learn-fit", "monday.fap", "tuesday.fap", "--faps", 3, "--model", "head.glb", "-o", "ada.glb"
    )
    _, out, err = run("encode", "monday.fap", "-o", "small.fba", "--fit", "ada.glb", "--json")
    assert err == ""
    said = json.loads(out)["fit"]
    assert (len(said["sent"]), said["added"]) == (3, [])
    assert said["millimetres"]["largest"] <= 0.01  # the small head shows the jaw alone
    run("encode", "monday.fap", "-o", "all.fba", "--preset", "compact")
    assert Path("small.fba").stat().st_size < Path("all.fba").stat().st_size
    shown = resolve(fba.read("small.fba").face, FaceModel.load("ada.glb"))
    assert shown[:, LIP] == pytest.approx(fba.read("monday.fap").face.values[:, LIP], abs=1)
    assert "3 FAPs sent; the head computes the others" in run(
        "encode", "monday.fap", "-o", "small.fba", "--fit", "ada.glb"
    ).out  # fmt: skip


def test_a_stream_for_a_head_without_a_table_is_refused(run: Run, here: Path) -> None:
    err = run("encode", "monday.fap", "-o", "small.fba", "--fit", "head.glb", code=1).err
    assert "has no interpolation table (FIT)" in " ".join(err.split())
    err = run(
        "encode", "monday.fap", "-o", "small.fba", "--fit", "head.glb", "--preset", "compact", code=2
    ).err
    assert "the table of the head decides what is sent" in " ".join(err.split())

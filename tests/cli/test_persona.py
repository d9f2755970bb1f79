"""`fba persona`: learn, info and play; files that are none, of other versions, or damaged."""

import io
import json
import zipfile
from pathlib import Path

import numpy as np
import pytest

import fba
from command_line import Run
from fba.errors import FormatError, LimitError, UnsupportedError
from fba.face import FaceModel
from fba.persona import Persona, read_recording, write_recording
from fba.persona.points.layout import PARTS
from tools.captures import point_files
from tools.captures.tracked_actor import film
from tools.persona.actors import Style, act

SCRIPT = [("E_HAPPY", 0.6), ("E_HAPPY", 0.9), ("LFAU_27", 0.8), ("UFAU_43", 1.0)]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """actor.npz and user.npz."""
    here = tmp_path_factory.mktemp("persona")
    write_recording(here / "actor.npz", act(SCRIPT, Style(lopsided=0.5), seed=7).face)
    write_recording(here / "user.npz", act(SCRIPT[1:3], seed=8).face)
    return here


@pytest.fixture
def persona(folder: Path, run: Run) -> Path:
    path = folder / "actor.persona"
    if not path.exists():
        run("persona", "learn", folder / "actor.npz", "-o", path)
    return path


def test_learn_says_what_is_missing_and_writes_a_report(folder: Path, run: Run, tmp_path: Path) -> None:
    out, page = tmp_path / "a.persona", tmp_path / "a.html"
    _, said, err = run("persona", "learn", folder / "actor.npz", "-o", out, "--report", page, "--name", "Ann")
    assert err == ""
    frames = len(read_recording(folder / "actor.npz"))
    assert said.splitlines()[0] == f"{out}: {frames} of {frames} frames"
    assert "mouth: " in said
    assert "missing: " in said
    assert "LFAU_22" in said
    assert "<svg" in page.read_text()
    assert Persona.load(out).name == "Ann"


def test_info_lists_masks(persona: Path, run: Run) -> None:
    said = run("persona", "info", persona).out
    assert "masks of mouth: " in said
    report = json.loads(run("persona", "info", persona, "--json").out)
    assert report["name"] == "actor"
    assert report["parts"]["mouth"]["masks"]["E_HAPPY"] >= 1
    assert "LFAU_22" in report["parts"]["mouth"]["missing"]
    assert report["bytes"] < 100_000
    assert report["motion"]["left_over_right"]["mouth"] > 1.3  # the actor's left side moves more
    assert f"left over right: mouth {report['motion']['left_over_right']['mouth']:.2f}, eyes " in said


def test_a_persona_of_version_1_is_read_and_what_it_lacks_is_said(
    folder: Path, persona: Path, run: Run, tmp_path: Path
) -> None:
    lacks = {f"_{part}.{name}": None for part in PARTS for name in ("seconds", "spread", "speed")}
    old = repacked(persona, tmp_path / "old.persona", version=1, **lacks)
    assert Persona.load(old).motions is None
    assert "motion: not known, as the file is of version 1; learn it again" in run("persona", "info", old).out
    play = ("persona", "play", folder / "user.npz", "--persona")
    assert "no statistics of motion" in run(*play, old, "-o", tmp_path / "old.fap").err
    assert run(*play, persona, "--means", "curves", "-o", tmp_path / "new.fap").err == ""
    old_lines, new_lines = (
        (tmp_path / f"{name}.fap").read_text().splitlines()[1:] for name in ("old", "new")
    )
    assert old_lines == new_lines


def test_play_writes_faps_in_the_actors_way(folder: Path, persona: Path, run: Run, tmp_path: Path) -> None:
    for name, options in (("own.fap", []), ("acted.fap", ["--persona", persona])):
        _, said, err = run("persona", "play", folder / "user.npz", *options, "-o", tmp_path / name)
        assert err == ""
        assert f"{name}: " in said
    own, acted = (fba.read(tmp_path / name).face for name in ("own.fap", "acted.fap"))
    assert own is not None
    assert acted is not None
    smile = slice(45, 60)
    uneven = [float((one.values[smile, 11] - one.values[smile, 12]).mean()) for one in (own, acted)]
    assert uneven[1] > uneven[0] + 50
    err = run("persona", "play", folder / "user.npz", "-o", tmp_path / "a.fba", "--user", persona, code=2).err
    assert "--user goes with --persona" in err


def test_points_of_other_trackers_are_read(persona: Path, run: Run, tmp_path: Path) -> None:
    motion = film(FaceModel.default(), 68, frames=60, flat=True, turn=0.3).motion
    (tmp_path / "user.csv").write_bytes(point_files.wide(motion))
    err = run("persona", "play", tmp_path / "user.csv", "--persona", persona, "-o", tmp_path / "a.fap").err
    assert err == ""
    assert len(fba.read(tmp_path / "a.fap")) == 60


def test_the_aspect_of_a_picture_may_be_given(persona: Path, run: Run, tmp_path: Path) -> None:
    motion = film(FaceModel.default(), 478, frames=40, share=True, turn=0.3).motion
    (tmp_path / "user.csv").write_bytes(point_files.wide(motion))
    play = ("persona", "play", tmp_path / "user.csv", "--persona", persona, "-o", tmp_path / "a.fap")
    assert "give its aspect with --aspect 1.778" in run(*play).err
    assert run(*play, "--aspect", "16:9").err == ""


def test_files_without_tracked_points_are_refused(persona: Path, run: Run, tmp_path: Path) -> None:
    (tmp_path / "a.fap").write_text("2.1 a 25 1\n" + "0 " * 67 + "0\n0\n")
    err = run("persona", "learn", tmp_path / "a.fap", "-o", tmp_path / "a.persona", code=1).err
    assert "is not a file of tracked points" in err
    np.savez(tmp_path / "short.npz", points=np.zeros((9, 64, 2)), angles=np.zeros((4, 3)))
    with pytest.raises(FormatError, match=r"9 frames of points, but angles \(4, 3\)"):
        read_recording(tmp_path / "short.npz")
    np.savez(tmp_path / "rate.npz", points=np.zeros((9, 64, 2)), fps=np.array([25.0, 30.0]))
    with pytest.raises(FormatError, match="fps must be one number"):
        read_recording(tmp_path / "rate.npz")
    run("persona", "learn", persona, "-o", tmp_path / "b.persona", code=1)


def test_a_user_who_looks_away(folder: Path, persona: Path, run: Run, tmp_path: Path) -> None:
    face = read_recording(folder / "user.npz")
    np.savez(tmp_path / "away.npz", points=face.points, angles=face.angles + np.array([0, 0.8, 0]), fps=30.0)
    err = run(
        "persona", "play", tmp_path / "away.npz", "--persona", persona, "-o", tmp_path / "a.fba", code=1
    ).err
    assert "with a head turned by more than 30 degrees" in err
    assert not (tmp_path / "a.fba").exists()


def repacked(path: Path, target: Path, **changed: object) -> Path:
    """Write a Persona with another header, or other arrays; None leaves one out."""
    with zipfile.ZipFile(path) as old, zipfile.ZipFile(target, "w") as new:
        for name in old.namelist():
            data = old.read(name)
            if name == "header.json":
                header = json.loads(data) | {key: one for key, one in changed.items() if key[0] != "_"}
                data = json.dumps(header).encode()
            array = changed.get("_" + name.removesuffix(".npy"), ...)
            if array is None:
                continue
            if array is not ...:
                file = io.BytesIO()
                np.save(file, np.asarray(array), allow_pickle=True)
                data = file.getvalue()
            new.writestr(name, data)
    return target


@pytest.mark.parametrize(
    ("changed", "error", "said"),
    [
        ({"kind": "other"}, FormatError, "is not a persona file"),
        ({"version": 3}, UnsupportedError, "version 3; this is 2: make it again"),
        ({"version": 0}, UnsupportedError, "version 0; this is 2: make it again"),
        ({"version": True}, UnsupportedError, "version True"),
        ({"version": "1"}, UnsupportedError, "version '1'"),
        ({"name": 7}, FormatError, "name must be a text"),
        ({"frames": -1}, FormatError, "whole numbers"),
        ({"frames": 1e300}, FormatError, "whole numbers"),
        ({"mouth.labels": ["E_HAPPY"]}, FormatError, "mouth.moved has shape"),
        ({"mouth.classes": ["a"]}, FormatError, "other classes"),
        ({"_mouth.moved": None}, FormatError, "lacks the array mouth.moved"),
        ({"_neutral": np.full((64, 2), np.nan)}, FormatError, "not finite"),
        ({"_neutral": np.zeros((64, 2))}, FormatError, "the neutral face is impossible"),
        ({"_neutral": np.array([{}])}, FormatError, "Python objects"),
        ({"_mouth.known": np.zeros(3)}, FormatError, "mouth.known has shape"),
        ({"_mouth.spread": None}, FormatError, "lacks the array mouth.spread"),
        ({"_mouth.spread": np.zeros((3, 54))}, FormatError, "mouth.spread has shape"),
        ({"_mouth.speed": np.zeros(3)}, FormatError, "mouth.speed has shape"),
        ({"_left_brow.speed": np.full(5, np.inf)}, FormatError, "left_brow.speed has"),
        ({"_left_brow.spread": np.full((5, 12), 1e3)}, FormatError, "from -10 to 10"),
        ({"_left_brow.speed": np.full(5, -1e3)}, FormatError, "from -10 to 10"),
        ({"_left_brow.seconds": np.full(5, -1.0)}, FormatError, "seconds must be from 0"),
        ({"_left_eye.curves": np.full((4, 5, 18), 1e6)}, FormatError, "more than 500 mm"),
    ],
)
def test_hostile_personas(
    persona: Path, tmp_path: Path, changed: dict[str, object], error: type[Exception], said: str
) -> None:
    with pytest.raises(error, match=said):
        Persona.load(repacked(persona, tmp_path / "a.persona", **changed))


def test_damaged_personas(persona: Path, run: Run, tmp_path: Path) -> None:
    data, path = persona.read_bytes(), tmp_path / "a.persona"
    for part in (data[: len(data) // 2], data[:3000] + b"?" * 500 + data[3500:], b"PK\x03\x04", b"text"):
        path.write_bytes(part)
        with pytest.raises(FormatError, match=r"a\.persona: "):
            Persona.load(path)
    assert run("persona", "info", path, code=1).err == f"fba: error: {path}: is not a persona file\n"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("header.json", json.dumps({"kind": "persona", "version": 1}))
        archive.writestr("neutral.npy", b"0" * 300_000_000)
    with pytest.raises(LimitError, match=r"a\.persona: neutral\.npy"):
        Persona.load(path)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("header.json", b" " * 3_000_000)
    with pytest.raises(FormatError, match="header of 3000000 bytes"):
        Persona.load(path)

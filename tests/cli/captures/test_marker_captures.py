"""`fba encode` and `fba info` of captures of markers."""

import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import fba
from command_line import Run, pipe_in
from fba.face import FaceModel
from tools.captures import marker_files
from tools.captures.marked_actor import Take, perform


@cache
def take() -> Take:
    """The built-in head's: half the frames would do, but blinks must be among them."""
    return perform(FaceModel.default(), 200)


@pytest.fixture
def capture(tmp_path: Path) -> Path:
    return marker_files.write(tmp_path, "float.c3d", take().motion)


def test_encode(run: Run, capture: Path, tmp_path: Path) -> None:
    out = tmp_path / "a.fba"
    everything = ("--preset", "reference")
    done = run("encode", capture, "-o", out, "--fps", "25", "--map-out", tmp_path / "a.toml", *everything)
    assert "50 frames, 2.00 s at 25 frames/s" in done.out
    assert "34 markers of" in done.out
    animation = fba.read(out)
    np.testing.assert_allclose(animation.face.values[:, 50], take().faps[::4, 50], atol=8)
    assert animation.body is not None
    text = (tmp_path / "a.toml").read_text()
    (tmp_path / "b.toml").write_text(text.replace('"LCR" = "8.4"\n', ""))
    options = ("--map", tmp_path / "b.toml", "--no-head-path", "--gaze", "camera", *everything)
    run("encode", capture, "-o", out, *options)
    animation = fba.read(out)
    assert animation.body is None
    sent = set(np.flatnonzero(animation.face.mask.any(axis=0)) + 1)
    assert 53 in sent
    assert 54 not in sent
    assert {23, 24, 25, 26} <= sent


def test_pairs(run: Run, capture: Path, tmp_path: Path) -> None:
    out = tmp_path / "a.fba"
    run("encode", capture, "-o", out, "--map", "LCL=", "--map", "CHC=head", "--neutral", "0.0-0.2")
    animation = fba.read(out)
    assert not animation.face.mask[:, 52].any()
    for wrong, message in (
        ("XYZ=2.1", "the capture has no marker 'XYZ'"),
        ("LCL=2.1", None),  # the chin's marker loses its place
        ("LCL=77.1", "there is no place '77.1'"),
        ("LCL=6.1", "no marker can be at feature point 6.1"),
    ):
        done = run("encode", capture, "-o", out, "--map", wrong, code=2 if message else None)
        assert (message or "") in done.err
    assert "two times in seconds" in run("encode", capture, "-o", out, "--neutral", "soon", code=2).err


def test_info(run: Run, capture: Path) -> None:
    done = run("info", capture)
    assert done.out.splitlines() == [
        f"{capture}: C3D, {capture.stat().st_size} bytes",
        "  time     200 frames, 2.00 s at 100 frames/s",
        "  markers  50, in mm, +y up: FHC, FHL, FHR, FHM, FHM2, FHL2, FHR2, BRL1, ...",
        "  gaps     none",
        "  face     34 markers have a place by the names (regions50)",
    ]
    report = json.loads(run("info", "--json", capture).out)
    assert report["markers"]["map"] == "regions50"


def test_no_face(run: Run, tmp_path: Path) -> None:
    names = "".join(f",M{n}_x,M{n}_y,M{n}_z" for n in range(4))
    path = tmp_path / "a.csv"
    path.write_text(f"time{names}\n" + "".join(f"{n / 10}{',1,2,3' * 4}\n" for n in range(9)))
    done = run("info", path)
    assert "face     not found; fba encode --map says which marker is where" in done.out
    done = run("encode", path, "-o", tmp_path / "a.fba", code=1)
    assert "too few to find a face by its shape; say which marker is where with --map Chin=2.1" in done.err
    assert not (tmp_path / "a.fba").exists()


def test_convert(run: Run, capture: Path, tmp_path: Path) -> None:
    run("convert", capture, tmp_path / "a.fap")
    assert len(fba.read(tmp_path / "a.fap").face) == 200


def test_standard_input_gives_the_same_stream(
    run: Run, capture: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Steps of BAPs and clamping go by the content, of which the name "-" says nothing."""
    from_file, from_input = tmp_path / "a.fba", tmp_path / "b.fba"
    run("encode", capture, "-o", from_file)
    pipe_in(monkeypatch, capture.read_bytes())
    run("encode", "-", "-o", from_input)
    assert from_input.read_bytes()[-40:] == from_file.read_bytes()[-40:]
    mine, theirs = fba.read(from_input), fba.read(from_file)
    assert mine == theirs

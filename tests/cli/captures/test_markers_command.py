"""`fba markers`: pictures, films, animated heads and mappings without a window; what is refused."""

import re
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from command_line import Run
from fba.capture.markers._motion import MarkerMotion
from fba.capture.markers._targets import target_points
from fba.capture.virtual_markers import move_head, read_head, read_mapping
from fba.face.feature_points import names
from fba.formats.gltf.moved_head import write_moved_head
from fba.parameters import point_rows
from mesh_files import write_obj
from small_head import small_head
from tools.captures.marker_files import wide

MARKED = ("2.1", "2.10", "4.1", "4.2", "5.1", "5.2", "8.1", "8.2", "8.3", "8.4", "9.3", "11.1", "11.2",
          "11.3")  # fmt: skip


def capture() -> MarkerMotion:
    """Markers at points of the small head; that of the lower lip goes down by 8 mm, and the head turns."""
    places = target_points(small_head().points)
    positions = np.repeat(np.array([places[name] for name in MARKED])[None], 20, axis=0)
    positions[10:, MARKED.index("8.2"), 1] -= 0.008
    turn = np.array([[0.96, 0.0, 0.28], [0.0, 1.0, 0.0], [-0.28, 0.0, 0.96]])
    positions[15:] = positions[15:] @ turn.T
    return MarkerMotion(MARKED, positions, np.arange(20) / 50, Fraction(50), "m", "+y", "lip")


@pytest.fixture
def files(tmp_path: Path) -> tuple[Path, Path]:
    """A capture, and a head with its feature points beside it."""
    (tmp_path / "lip.csv").write_bytes(wide(capture()))
    write_obj(tmp_path / "head.obj", small_head().parts)
    points = small_head().points
    lines = [
        f"{name},{','.join(map(str, points[point_rows()[name]]))}"
        for name in names()
        if np.isfinite(points[point_rows()[name]]).all()
    ]
    (tmp_path / "head.points.csv").write_text("\n".join(["name,x,y,z", *lines]) + "\n")
    return tmp_path / "lip.csv", tmp_path / "head.obj"


def test_a_proposed_mapping_is_written_changed_and_used(
    run: Run, files: tuple[Path, Path], tmp_path: Path
) -> None:
    first, second = tmp_path / "first.toml", tmp_path / "second.toml"
    _, out, err = run("markers", *files, "-o", first)
    assert err == ""
    assert out == f"{first}: 16 virtual markers, 3 of them fixed\n"
    proposed = read_mapping(first)
    assert proposed.made_for.name == "head.obj"
    assert proposed.markers["8.2"].vertex == small_head().bound[point_rows()["8.2"]]
    err = run(
        "markers", *files, "--map", first, "--map", "8.2=7", "--map", "9.3=", "--overlap", "add",
        "--gaze", "camera", "--squint", "30", "-o", second,
    ).err  # fmt: skip
    assert err == ""
    changed = read_mapping(second)
    assert (changed.overlap, changed.gaze, changed.squint) == ("add", "camera", 0.3)
    assert changed.markers["8.2"] == replace(proposed.markers["8.2"], vertex=7)
    assert set(proposed.markers) - set(changed.markers) == {"9.3"}
    assert "exists" in run("markers", *files, "--map", first, "-o", second, "--no-clobber", code=1).err


def test_a_head_with_its_animation(run: Run, files: tuple[Path, Path], tmp_path: Path) -> None:
    moved = tmp_path / "moved.glb"
    _, out, err = run("markers", *files, "-o", moved, "--map-out", tmp_path / "m.toml")
    assert err == ""
    assert f"{moved}: 20 frames, 16 virtual markers" in out
    shown = move_head(capture(), read_head(files[1]), read_mapping(tmp_path / "m.toml"))
    write_moved_head(tmp_path / "again.glb", shown, "lip")
    assert moved.stat().st_size == (tmp_path / "again.glb").stat().st_size  # numbers of the table are rounded


def test_a_picture_and_a_film(run: Run, files: tuple[Path, Path], tmp_path: Path, opengl: None) -> None:
    pytest.importorskip("av")
    from PIL import Image

    _, out, err = run("markers", *files, "-o", tmp_path / "a.png", "--marker", "8.2", "--size", "320x200")
    assert err == ""
    assert out == f"{tmp_path / 'a.png'}: 320x200\n"
    pixels = np.asarray(Image.open(tmp_path / "a.png").convert("RGB")).astype(int)
    assert ((pixels[..., 0] - pixels[..., 2]) > 60).sum() > 20  # the lip is red, and dots are orange
    err = run("markers", *files, "-o", tmp_path / "a.mp4", "--cloud", "none", "--size", "160x120",
                         "--fps", "25", "--end", "0.2").err  # fmt: skip
    assert err == ""
    assert (tmp_path / "a.mp4").stat().st_size > 500


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["-o", "a.fba"], "name a picture .*a film .*a head with its animation .*a mapping"),
        (["-o", "a.toml", "--time", "1"], "--time is for a picture or a film, not for a.toml"),
        (["-o", "a.png", "--fps", "25"], "--fps is for a film; a picture has a --time"),
        (["-o", "a.mp4", "--time", "1"], "--time is for a picture; a film has a --start"),
        (["--cloud", "over"], "--cloud is for a picture or a film: give -o"),
        (["-o", "a.png", "--marker", "Lip"], "--marker Lip: the capture has no such marker; it has 2.1"),
        (["-o", "a.png", "--map", "Lip=2.1"], "--map: the capture has no marker Lip; it has 2.1"),
        (["-o", "a.png", "--map", "8.2=99.1"], "there is no place '99.1'"),
        (["-o", "-"], "--output -: give the name of a file"),
        (["-o", "a.png", "--map-out", "a.csv"], "mappings are TOML; name it a.toml"),
    ],
)  # fmt: skip
def test_wrong_usage_is_said(
    options: list[str], words: str, run: Run, files: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(files[0].parent)
    err = run("markers", *files, *options, code=2).err
    assert re.search(words, " ".join(err.split())), err


def test_mappings_of_another_head_or_capture_are_refused(
    run: Run, files: tuple[Path, Path], tmp_path: Path
) -> None:
    mapping = tmp_path / "m.toml"
    run("markers", *files, "-o", mapping)
    err = run("markers", *files, "--map", "8.2=99999", "-o", tmp_path / "a.glb", code=1).err
    assert "virtual marker '8.2' is at vertex 99999, but head.obj has" in err
    other = replace(capture(), names=("Chin", *MARKED[1:]))
    (tmp_path / "other.csv").write_bytes(wide(other))
    err = run(
        "markers", tmp_path / "other.csv", files[1], "--map", mapping, "-o", tmp_path / "a.glb", code=1
    ).err
    assert "the capture has no marker 2.1, which the mapping names; it has Chin, 2.10" in err
    few = replace(capture(), names=MARKED[:3], positions=capture().positions[:, :3])
    (tmp_path / "few.csv").write_bytes(wide(few))
    err = run("markers", tmp_path / "few.csv", files[1], "-o", tmp_path / "a.glb", code=1).err
    assert "3 are too few to find a face by its shape" in err
    err = run("markers", *files, "--map", mapping, "--map", "11.1=", "-o", tmp_path / "a.glb", code=1).err
    assert "the head's motion needs 3 fixed markers" in err
    text = files[1].read_text().rstrip()
    files[1].write_text(text[: text.rindex("\n")] + "\n")  # a triangle less
    err = run("markers", *files, "--map", mapping, "-o", tmp_path / "a.glb", code=1).err
    assert "the mapping was made for another mesh (head.obj) than head.obj" in err
    run("markers", files[1], files[1], "-o", tmp_path / "a.glb", code=1)
    assert not (tmp_path / "a.glb").exists()

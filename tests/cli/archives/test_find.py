"""`fba find`: building an index, and what it prints and writes for pictures."""

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import fba
from command_line import Run
from fba.outlines import Index
from outlined import nodding, raising


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with performances, their index, and three pictures of silhouettes from the front."""
    from fba.outlines import Choice, build_index

    folder = tmp_path_factory.mktemp("made")
    fba.write(folder / "raising.fba", raising())
    fba.write(folder / "nodding.fap", nodding())
    index = build_index([("raising.fba", raising()), ("nodding.fap", nodding())], Choice(views=4, every=1))
    index.save(folder / "index.npz")
    for number in (0, 2, 5):
        silhouette = ~index.silhouette(4 * number)
        Image.fromarray(silhouette.astype(np.uint8) * np.uint8(255)).save(folder / f"{number}.png")
    return folder


def test_an_index_is_built(run: Run, made: Path, tmp_path: Path) -> None:
    inputs = (made / "raising.fba", made / "nodding.fap")
    how = ("--views", 4, "--every", 2, "--pitch", 0, "--pitch", 40)
    out = run("find", "--build", tmp_path / "new.npz", *inputs, *how).out
    assert "40 silhouettes, 5 poses from 8 sides, of raising.fba, nodding.fap" in out
    index = Index.load(tmp_path / "new.npz")
    assert {view.pitch for view in index.views} == {0, 40}
    assert [stream.name for stream in index.streams] == ["raising.fba", "nodding.fap"]
    assert (
        "exists already" in run("find", "--build", tmp_path / "new.npz", *inputs, "--no-clobber", code=1).err
    )
    report = run("find", "--build", tmp_path / "j.npz", inputs[1], "--views", 1, "--json").out
    assert json.loads(report)["silhouettes"] == 1


def test_a_picture_is_found(run: Run, made: Path) -> None:
    out = run("find", made / "5.png", made / "index.npz", "--count", 3).out
    assert "5.png: raising.fba, frame 5 (2.00 s), from its front (0 degrees), distance 0.00" in out
    assert "from another side: raising.fba, frame" in out
    assert len(out.splitlines()) == 6  # a head and three rows
    (report,) = json.loads(run("find", made / "5.png", made / "index.npz", "--json").out)
    assert (report["found"]["side"], len(report["nearest"])) == ("front", 10)
    assert abs(report["other_side"]["yaw"]) >= 60


def test_pictures_become_an_animation(run: Run, made: Path, tmp_path: Path) -> None:
    pictures = [made / f"{number}.png" for number in (0, 2, 5)]
    for target in ("out.bap", "out.fba"):
        out = run(
            "find", *pictures, made / "index.npz", "-o", tmp_path / target, "--fps", 5, "--in-order"
        ).out
        assert f"{target}: 3 frames" in out
        back, source = fba.read(tmp_path / target), raising()
        assert back.rate == 5
        off = back.body.values.astype(int) - source.body.values[[0, 2, 5]]
        assert np.abs(off).max() <= 170  # half a step of BAPs in streams


def test_the_best_are_drawn(run: Run, made: Path, tmp_path: Path) -> None:
    for name, kind in (("best.png", "PNG"), ("best.jpg", "JPEG")):
        run("find", made / "0.png", made / "2.png", made / "index.npz", "-o", tmp_path / name)
        with Image.open(tmp_path / name) as image:
            assert (image.format, image.size) == (kind, (11 * 150, 2 * 184))


@pytest.mark.parametrize(
    ("line", "text"),
    [
        ("5.png", "give a picture and an index"),
        ("--build new.npz", "needs the files of performances"),
        ("--build new.npz raising.fba --in-order", "--in-order goes with pictures"),
        ("--build new.npz raising.fba --views 0", "0 is not in the range"),
        ("5.png index.npz --views 3", "--views goes with --build"),
        ("5.png index.npz --pitch 3", "--pitch goes with --build"),
        ("--build new.npz raising.fba --pitch nan", "'nan' is not a number"),
        ("5.png index.npz --fps 3", "--fps goes with -o and an animation"),
        ("5.png index.npz -o x.png --fps 3", "--fps goes with -o and an animation"),
    ],
)
def test_wrong_usage(run: Run, made: Path, monkeypatch: pytest.MonkeyPatch, line: str, text: str) -> None:
    monkeypatch.chdir(made)
    _, out, err = run("find", *line.split(), code=2)
    assert out == ""
    assert text in " ".join(err.split())


def test_bad_files(run: Run, made: Path, tmp_path: Path) -> None:
    err = run("find", made / "5.png", made / "raising.fba", code=1).err
    assert "is not an index of outlines" in err
    assert "fba find --build" in err
    assert "cannot be read as a picture" in run("find", made / "raising.fba", made / "index.npz", code=1).err
    Image.new("RGB", (7000, 6000)).save(tmp_path / "large.png")
    err = run("find", tmp_path / "large.png", made / "index.npz", "--limit", "pixels=1000000", code=1).err
    assert "--limit pixels=" in err

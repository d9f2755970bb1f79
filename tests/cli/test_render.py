"""`fba render` without a file: faces by FAPs, visemes and expressions, and contact sheets."""

from __future__ import annotations

import ctypes.util
import os
from collections.abc import Callable
from importlib.resources import files
from pathlib import Path

import click
import numpy as np
import pytest
from PIL import Image

from fba.cli.still import still
from fba.errors import DisplayError

Run = Callable[..., tuple[int, str, str]]
SMALL = ("--size", "96x72")


@pytest.fixture
def opengl() -> None:
    """OpenGL works without a display here."""
    from player.context import offscreen_context

    try:
        offscreen_context().release()
    except DisplayError as error:
        if os.environ.get("CI") and ctypes.util.find_library("EGL"):
            raise
        pytest.skip(f"no OpenGL without a display: {error}")


def pixels(path: Path) -> np.ndarray:
    with Image.open(path) as image:
        return np.asarray(image.convert("RGB")).astype(int)


# --- what the words mean -------------------------------------------------------------------------------


def test_faps_by_name_and_number() -> None:
    track = still(("open_jaw=800", "49=-2000"), (), ()).face
    assert track is not None
    assert np.flatnonzero(track.mask[0]).tolist() == [2, 48]
    assert (track.values[0, 2], track.values[0, 48]) == (800, -2000)


@pytest.mark.parametrize(
    ("visemes", "fields"),
    [
        (("4",), (4, 0, 63)),
        (("k g",), (5, 0, 63)),
        (("A:=20",), (10, 0, 20)),
        (("T",), (3, 0, 63)),
        (("t",), (4, 0, 63)),
        (("1", "U"), (1, 14, 32)),
        (("1=50", "U"), (1, 14, 50)),
        (("1", "U=50"), (1, 14, 13)),
        (("1=60", "14=3"), (1, 14, 60)),
    ],
)
def test_visemes(visemes: tuple[str, ...], fields: tuple[int, int, int]) -> None:
    track = still((), visemes, ()).face
    assert track is not None
    assert tuple(track.viseme[0]) == (*fields, 0)
    assert track.mask[0, 0]
    assert not track.mask[0, 1:].any()


def test_expressions() -> None:
    track = still((), (), ("joy=50", "2")).face
    assert track is not None
    assert tuple(track.expression[0]) == (1, 50, 2, 63, 0, 0)
    assert np.flatnonzero(track.mask[0]).tolist() == [1]


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ((("opn_jaw=3",), (), ()), "no FAP 'opn_jaw' (near: open_jaw)"),
        ((("open_jaw",), (), ()), "write e.g. --fap open_jaw=200"),
        ((("open_jaw=much",), (), ()), "no whole number"),
        ((("open_jaw=99999999999",), (), ()), "no whole number"),
        ((("69=1",), (), ()), "numbers 3..68"),
        ((("viseme=1",), (), ()), "options of their own"),
        ((("3=1", "open_jaw=2"), (), ()), "FAP 3 is given twice"),
        (((), ("15",), ()), "no viseme '15'"),
        (((), ("4=64",), ()), "from 0 to 63"),
        (((), ("1", "2", "3"), ()), "at most 2"),
        (((), ("1=30", "2=30"), ()), "add up to 63"),
        (((), (), ("joi",)), "no expression 'joi' (near: joy)"),
        (((), (), ("joy=-1",)), "from 0 to 63"),
        (((), (), ("none",)), "no expression 'none'"),
    ],
)
def test_mistakes_are_explained(given: tuple[tuple[str, ...], ...], text: str) -> None:
    with pytest.raises(click.UsageError) as error:
        still(*given)  # type: ignore[arg-type]
    assert text in str(error.value)


# --- the command ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ((), "give a file, or a face"),
        (("--fap", "3=1", "--frame", "2"), "--frame goes with a file"),
        (("--contact-sheet", "faps", "--fap", "3=1"), "poses and cameras of its own"),
        (("--contact-sheet", "eyebrows"), "'faps', 'visemes', 'expressions', 'all'"),
        (("--contact-sheet", "faps", "--size", "8x8"), "at least 16x16"),
        (("--fap", "3=1", "--model", "nobody.glb"), "nobody.glb"),
    ],
)
def test_usage(run: Run, tmp_path: Path, arguments: tuple[str, ...], text: str) -> None:
    output = tmp_path / "out.png"
    code, _, err = run("render", *arguments, "-o", output)
    assert code == 2
    assert text in err
    assert not output.exists()


def test_a_pose_is_no_film_and_goes_with_no_file(run: Run, tmp_path: Path) -> None:
    code, _, err = run("render", "--fap", "3=1", "-o", tmp_path / "out.mp4")
    assert (code, "write it to a .png" in err) == (2, True)
    sample = files("fba") / "samples" / "hello.fap"
    code, _, err = run("render", sample, "--viseme", "1", "-o", tmp_path / "out.png")
    assert (code, "--viseme makes a picture without a file" in err) == (2, True)


@pytest.mark.usefixtures("opengl")
def test_a_face_is_drawn_as_asked(run: Run, tmp_path: Path) -> None:
    found = {}
    for name, arguments in {
        "neutral": ("--fap", "3=0"),
        "posed": ("--fap", "open_jaw=800", "--viseme", "4", "--expression", "joy=50"),
        "again": ("--fap", "open_jaw=800", "--viseme", "4", "--expression", "joy=50"),
        "aside": ("--fap", "3=0", "--camera", "profile"),
    }.items():
        path = tmp_path / f"{name}.png"
        assert run("render", *arguments, "-o", path, *SMALL) == (0, f"{path}: 96x72\n", "")
        found[name] = pixels(path)
    assert found["neutral"].shape == (72, 96, 3)
    np.testing.assert_array_equal(found["posed"], found["again"])
    changed = np.abs(found["posed"] - found["neutral"]).max(axis=2) > 10
    assert changed.any()
    assert changed[36:].sum() > 0.8 * changed.sum()  # the mouth is in the lower half
    assert (np.abs(found["aside"] - found["neutral"]).max(axis=2) > 10).mean() > 0.1


@pytest.mark.usefixtures("opengl")
def test_another_face_from_a_file(run: Run, tmp_path: Path) -> None:
    from dataclasses import replace

    from fba.face.model import FaceModel

    model = FaceModel.default()
    painted = [replace(p, colours=None, material=replace(p.material, colour=(0.02, 0.02, 0.9), texture=None))
               if p.kind == "skin" else p for p in model.parts]  # fmt: skip
    replace(model, parts=tuple(painted)).save(tmp_path / "blue.glb")
    output = tmp_path / "out.jpg"
    code, _, err = run("render", "--fap", "3=0", "--model", tmp_path / "blue.glb", "-o", output, *SMALL)
    assert (code, err) == (0, "")
    middle = pixels(output)[36:44, 44:52].mean(axis=(0, 1))
    assert middle[2] > middle[0] + 40


@pytest.mark.usefixtures("opengl")
def test_a_sheet_holds_every_expression(run: Run, tmp_path: Path) -> None:
    output = tmp_path / "sheet.png"
    code, out, err = run("render", "--contact-sheet", "expressions", "--size", "64x64", "-o", output)
    assert (code, err) == (0, "")
    sheet = pixels(output)
    assert out == f"{output}: {sheet.shape[1]}x{sheet.shape[0]}\n"
    step_x, step_y = (sheet.shape[1] - 4) // 3, (sheet.shape[0] - 4) // 2
    tiles = [sheet[4 + y * step_y :, 4 + x * step_x :][:64, :64] for y in range(2) for x in range(3)]
    for number, one in enumerate(tiles):
        for other in tiles[number + 1 :]:
            assert np.abs(one - other).max() > 25  # six different faces, at the same place
        below = sheet[4 + (number // 3) * step_y + 64 :, 4 + (number % 3) * step_x :][: step_y - 64, :64]
        assert below.max() > 120  # with a name

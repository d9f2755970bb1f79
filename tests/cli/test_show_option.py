"""`--show`: switches of the player, in pictures from the command line."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from command_line import Run

FACE = ("--fap", "open_jaw=200", "--size", "64x48", "--camera", "front")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("wirefame", "near: wireframe"),
        ("influence", "influence=open_jaw"),
        ("influence=open_jav", "near: open_jaw"),
        ("skeleton=bones", "off, through, only"),
        ("eyes=perhaps", "on or off"),
    ],
)
@pytest.mark.parametrize("command", ["render", "play"])
def test_unknown_switches_are_bad_usage(run: Run, tmp_path: Path, command: str, text: str, said: str) -> None:
    file = tmp_path / "none.fap"
    file.write_text("2.1 none 25 0\n")
    output = ("-o", tmp_path / "out.png") if command == "render" else ()
    assert said in run(command, file, *output, "--show", text, code=2).err
    assert not (tmp_path / "out.png").exists()


@pytest.mark.usefixtures("opengl")
def test_switches_are_in_the_picture(run: Run, tmp_path: Path) -> None:
    plain, dressed = tmp_path / "plain.png", tmp_path / "dressed.png"
    run("render", *FACE, "-o", plain)
    shown = ("--show", "influence=open_jaw", "--show", "eyes=off", "--show", "background=grey")
    run("render", *FACE, *shown, "-o", dressed)
    before, after = (np.asarray(Image.open(path)).astype(int) for path in (plain, dressed))
    assert (np.ptp(after[:8, :8, :3], axis=(0, 1)) == 0).all()  # a plain background
    middle = after[14:24, 26:38, :3]
    assert np.abs(middle[..., 0] - middle[..., 2]).mean() < 12  # grey where nothing moves
    assert (before[14:24, 26:38, 0] - before[14:24, 26:38, 2]).mean() > 30  # skin


@pytest.mark.usefixtures("opengl")
def test_a_transparent_background_is_in_the_file(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "clear.png"
    run("render", *FACE, "--show", "background=transparent", "-o", path)
    pixels = np.asarray(Image.open(path))
    assert pixels.shape == (48, 64, 4)
    assert pixels[2, 2, 3] == 0
    assert pixels[24, 32, 3] == 255

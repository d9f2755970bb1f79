"""Where nothing can be drawn: what does not draw works, and what draws says in one line what is missing."""

import shutil
import subprocess
from pathlib import Path

import pytest
from PIL import Image

import fba
from fba import Animation

# A Python without anything that draws, as none of it can be loaded without the system libraries.
BARE = """
import sys
for name in ("moderngl", "glcontext", "glfw", "imgui_bundle", "OpenGL"):
    sys.modules[name] = None
from fba.cli.main import main
main()
"""


PLAIN = BARE.replace('"moderngl", "glcontext", ', '"av", "miniaudio", ')
"""A Python without the extras: it draws, but has no films, sound or windows."""


def bare(programs: Path, folder: Path, *arguments: str, code: str = BARE) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [programs / "python", "-c", code, *arguments], cwd=folder, capture_output=True, text=True, check=False
    )


@pytest.fixture
def stream(tmp_path: Path, face: Animation) -> Path:
    fba.write(tmp_path / "face.fba", face)
    return tmp_path / "face.fba"


@pytest.mark.slow
@pytest.mark.parametrize(
    "line",
    [
        "info face.fba",
        "stats face.fba",
        "decode face.fba --fap face.fap",
        "convert face.fba face.fap",
        "model info --default",
        "play --help",
        "render --help",
    ],
)
def test_commands_without_pictures_work(line: str, stream: Path, programs: Path) -> None:
    done = bare(programs, stream.parent, *line.split())
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout or line.startswith(("decode", "convert"))


@pytest.mark.slow
@pytest.mark.parametrize(
    "line",
    [
        "play face.fba",
        "play --model NONE",
        "render face.fba -o face.png",
        "render --contact-sheet faps -o a.png",
    ],
)
def test_commands_with_pictures_name_the_missing_package(line: str, stream: Path, programs: Path) -> None:
    head = fba.__path__[0] + "/face/builtin/head.glb"
    done = bare(programs, stream.parent, *line.replace("NONE", head).split())
    assert done.returncode == 1
    (said,) = done.stderr.splitlines()
    assert said.startswith("fba: error: ")
    assert said.endswith(('"mpeg4-fba[player]"', "install moderngl"))
    assert sorted(path.name for path in stream.parent.iterdir()) == ["face.fba"]


@pytest.mark.parametrize(
    ("line", "extra"),
    [
        ("play face.fba", "player"),
        ("markers talk.c3d", "player"),
        ("render face.fba -o face.mp4 --size 64x48", "films"),
        ("render face.fba -o face.gif --size 64x48", "films"),
    ],
)
def test_errors_name_a_missing_extra(line: str, extra: str, stream: Path, programs: Path) -> None:
    shutil.copy(Path(fba.__path__[0]) / "samples" / "talk.c3d", stream.parent)
    done = bare(programs, stream.parent, *line.split(), code=PLAIN)
    assert done.returncode == 1
    (said,) = done.stderr.splitlines()
    assert said.startswith("fba: error: ")
    assert f'"mpeg4-fba[{extra}]"' in said
    assert sorted(path.name for path in stream.parent.iterdir()) == ["face.fba", "talk.c3d"]


def test_the_plain_package_draws_a_picture(stream: Path, programs: Path, opengl: None) -> None:
    line = "render face.fba -o face.png --size 64x48"
    done = bare(programs, stream.parent, *line.split(), code=PLAIN)
    assert (done.returncode, done.stderr) == (0, "")
    with Image.open(stream.parent / "face.png") as picture:
        assert picture.size == (64, 48)
        assert len(picture.getcolors(64 * 48) or ()) > 100  # something is drawn


@pytest.mark.slow
def test_the_demo_of_the_plain_package_says_why_there_is_no_film(
    tmp_path: Path, programs: Path, opengl: None
) -> None:
    done = bare(programs, tmp_path, "demo", "--no-play", "--out", "demo", code=PLAIN)
    assert done.returncode == 0, done.stderr
    assert "rendered: demo/hello.png; no film: films need" in done.stdout
    assert '"mpeg4-fba[films]"' in done.stdout
    assert not (tmp_path / "demo" / "hello.mp4").exists()


def test_the_player_can_be_imported_and_its_figures_move(tmp_path: Path, programs: Path) -> None:
    code = (
        BARE.replace("from fba.cli.main import main\nmain()", "")
        + """
import fba
from fba import player
from importlib.resources import files
scene = player.Scene(fba.read(files("fba") / "samples" / "hello.fap"))
print(len(scene.view_at(1.0).faces), player.play.__name__, player.render.__name__)
try:
    player.Offscreen(scene)
except fba.DisplayError as error:
    print("DisplayError")
"""
    )
    done = subprocess.run(
        [programs / "python", "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.split()[-3:] == ["play", "render", "DisplayError"]
    assert int(done.stdout.split()[0]) > 0

"""`fba emote`: moods on the command line, over time, from keys, side by side."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import fba
import graphics
from command_line import Run
from fba.arrays import Float32
from fba.emotion import expression
from fba.face import resolve

BROW = 30
"""Column of raise_l_i_eyebrow."""


@pytest.fixture
def still(tmp_path: Path) -> Path:
    """Four seconds of a face that does nothing."""
    mask = np.zeros((100, 68), dtype=bool)
    mask[:, 2:] = True
    face = fba.FaceTrack(np.zeros((100, 68), dtype=np.int32), mask)
    path = tmp_path / "still.fap"
    fba.write(path, fba.Animation(25, np.arange(100), face))
    return path


def brow(path: Path) -> Float32:
    """Left inner brow over time, of anger's."""
    face = fba.read(path).face
    assert face is not None
    shares: Float32 = resolve(face)[:, BROW] / expression("anger").faps[BROW]
    return shares


def test_a_mood_for_a_while(run: Run, still: Path, tmp_path: Path) -> None:
    out = tmp_path / "out.fba"
    done = run(
        "emote",
        still,
        "-o",
        out,
        "--emotion",
        "angry=70",
        "--start",
        "1s",
        "--end",
        "3000ms",
        "--ease",
        "0.5s",
    )
    assert done.err == ""
    assert "anger; 100 frames, 4.00 s" in done.out
    np.testing.assert_allclose(brow(out)[[0, 24, 50, 76, 99]], [0, 0, 0.7, 0, 0], atol=0.02)


def test_moods_with_times_of_their_own(run: Run, still: Path, tmp_path: Path) -> None:
    out = tmp_path / "out.fap"
    moods = ["--emotion", "angry=100@-1s", "--emotion", "sad=100@3s-", "--ease", "100ms"]
    run("emote", still, "-o", out, *moods)
    sad = expression("sadness").faps[BROW] / expression("anger").faps[BROW]
    np.testing.assert_allclose(brow(out)[[0, 10, 50, 90, 99]], [1, 1, 0, sad, sad], atol=0.02)


def test_keys(run: Run, still: Path, tmp_path: Path) -> None:
    keys, out = tmp_path / "keys.csv", tmp_path / "out.fap"
    keys.write_text("seconds,emotion,intensity\n0,angry,0\n2,angry,80\n3,angry,20\n")
    run("emote", still, "-o", out, "--keys", keys)
    np.testing.assert_allclose(brow(out)[[0, 50, 75, 99]], [0, 0.8, 0.2, 0.2], atol=0.02)


def test_side_by_side(run: Run, still: Path, tmp_path: Path) -> None:
    if graphics.missing_opengl():
        graphics.skip(graphics.missing_opengl())
    out = tmp_path / "moods.png"
    moods = [part for name in ("neutral", "angry=90", "happy=80") for part in ("--emotion", name)]
    run("emote", still, "-o", out, "--side-by-side", "--size", "96x96", *moods)
    with Image.open(out) as picture:
        pixels = np.asarray(picture).astype(int)
    tiles = [pixels[4:100, 4 + 100 * k : 100 + 100 * k] for k in range(3)]
    for one, other in ((0, 1), (0, 2), (1, 2)):
        assert np.abs(tiles[one] - tiles[other]).max() > 40
        assert np.median(np.abs(tiles[one] - tiles[other])) == 0  # the same but for the face


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ((), "give a mood"),
        (("--emotion", "angre=50"), "did you mean 'angry'"),
        (("--emotion", "angry=150"), "0 to 100"),
        (("--emotion", "angry=5@2"), "write times as @2s-6s"),
        (("--emotion", "angry=5", "--start", "soon"), "is no time"),
        (("--emotion", "angry=5", "--start", "3", "--end", "2"), "give an end after that"),
        (("--emotion", "angry=5", "--start", "50s"), "'anger' begins at 50 s, but the performance ends at"),
        (("--emotion", "angry=5", "--end", "-2s"), "'anger' ends at -2 s: the performance begins at 0 s"),
        (("--emotion", "angry=5", "--emotion", "anger=9"), "at the same time"),
        (("--emotion", "angry=5", "--size", "64x64"), "--size goes with a picture"),
        (("--emotion", "angry=5", "--side-by-side"), "--side-by-side goes with a picture"),
    ],
)
def test_mistakes(run: Run, still: Path, tmp_path: Path, given: tuple[str, ...], said: str) -> None:
    out = tmp_path / "out.fba"
    assert said in " ".join(run("emote", still, "-o", out, *given, code=2).err.split())
    assert not out.exists()


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ("time,emotion\n1,angry\n", "the column 'seconds' is missing"),
        ("seconds,emotion,intensity\n1,angry,much\n", "keys.csv:2: seconds and intensity must be numbers"),
        ("seconds,emotion,intensity\n", "no keys behind the header"),
        ("seconds,emotion,intensity\n1\n", "must be numbers"),
        ("", "the column 'seconds' is missing"),
        ("\0\0", "the column 'seconds' is missing"),
        ("seconds,emotion,intensity\n1,\udcff,5\n", "is not UTF-8 text (byte 28); save it as UTF-8"),
    ],
)
def test_damaged_tables_of_keys(run: Run, still: Path, tmp_path: Path, table: str, said: str) -> None:
    keys, out = tmp_path / "keys.csv", tmp_path / "out.fba"
    keys.write_text(table, encoding="utf-8", errors="surrogateescape")
    assert said in " ".join(run("emote", still, "-o", out, "--keys", keys, code=1).err.split())
    assert not out.exists()


@pytest.mark.parametrize("times", [(50, 60), (-9, -5)])
def test_keys_outside_the_performance(run: Run, still: Path, tmp_path: Path, times: tuple[int, int]) -> None:
    keys, out = tmp_path / "keys.csv", tmp_path / "out.fba"
    keys.write_text("seconds,emotion,intensity\n" + "".join(f"{time},joy,80\n" for time in times))
    done = run("emote", still, "-o", out, "--keys", keys, code=2)
    assert f"the keys of 'joy' are at {times[0]} to {times[1]} s, outside" in " ".join(done.err.split())
    assert not out.exists()


def test_a_body_has_no_mood(run: Run, tmp_path: Path) -> None:
    body = fba.BodyTrack(np.zeros((1, 296), dtype=np.int32), np.ones((1, 296), dtype=bool))
    path = tmp_path / "body.bap"
    fba.write(path, fba.Animation(25, np.arange(1), None, body))
    assert "no face" in run("emote", path, "-o", tmp_path / "out.fba", "--emotion", "angry=5", code=2).err

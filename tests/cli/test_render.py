"""`fba render`: files, and without one faces by FAPs, visemes and expressions, and contact sheets.

`--show`: switches of the player, in pictures from the command line.
"""

import signal
import subprocess
import sys
import time
from importlib.resources import as_file, files
from pathlib import Path

import click
import numpy as np
import pytest
from PIL import Image

import fba
from command_line import Run
from fba import Animation
from fba.body import gait
from fba.cli.pose_options import Pose, still_animation
from sound_clicks import write_wave
from started_programs import started

FACE = ("--fap", "open_jaw=200", "--size", "64x48", "--camera", "front")
SMALL = ("--size", "96x72")


def pixels(path: Path) -> np.ndarray:
    with Image.open(path) as image:
        return np.asarray(image.convert("RGB")).astype(int)


# --- what the words mean -------------------------------------------------------------------------------


def test_faps_by_name_and_number() -> None:
    track = still_animation(Pose(("open_jaw=800", "49=-2000"))).face
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
    track = still_animation(Pose(visemes=visemes)).face
    assert tuple(track.viseme[0]) == (*fields, 0)
    assert track.mask[0, 0]
    assert not track.mask[0, 1:].any()


def test_expressions() -> None:
    track = still_animation(Pose(expressions=("joy=50", "2"))).face
    assert tuple(track.expression[0]) == (1, 50, 2, 63, 0, 0)
    assert np.flatnonzero(track.mask[0]).tolist() == [1]


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ((("opn_jaw=3",), (), ()), "no FAP 'opn_jaw' (near: open_jaw)"),
        ((("open_jaw",), (), ()), "write e.g. --fap open_jaw=200"),
        ((("open_jaw=much",), (), ()), "no whole number"),
        ((("open_jaw=99999999999",), (), ()), "no whole number"),
        ((("69=1",), (), ()), "a number 3..68"),
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
        still_animation(Pose(*given))
    assert text in str(error.value)


# --- the command ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ((), "give a file, or a face"),
        (("--fap", "3=1", "--frame", "2"), "--frame goes with a file"),
        (("--open-mouth", "50", "--frame", "2"), "--frame goes with a file"),
        (("--contact-sheet", "faps", "--fap", "3=1"), "poses and cameras of its own"),
        (("--contact-sheet", "eyebrows"), "'faps', 'visemes', 'expressions', 'all'"),
        (("--contact-sheet", "faps", "--size", "8x8"), "at least 16x16"),
        (("--fap", "3=1", "--model", "nobody.glb"), "nobody.glb"),
    ],
)
def test_usage(run: Run, tmp_path: Path, arguments: tuple[str, ...], text: str) -> None:
    output = tmp_path / "out.png"
    assert text in run("render", *arguments, "-o", output, code=2).err
    assert not output.exists()


def test_a_pose_is_no_film_and_goes_with_no_file(run: Run, tmp_path: Path) -> None:
    assert "write it to a .png" in run("render", "--fap", "3=1", "-o", tmp_path / "out.mp4", code=2).err
    sample = files("fba") / "samples" / "hello.fap"
    assert (
        "--viseme makes a picture without a file"
        in run("render", sample, "--viseme", "1", "-o", tmp_path / "out.png", code=2).err
    )


@pytest.mark.usefixtures("opengl")
def test_a_face_is_drawn_as_asked(run: Run, tmp_path: Path) -> None:
    found = {}
    for name, arguments in {
        "neutral": ("--fap", "3=0"),
        "posed": ("--fap", "open_jaw=800", "--viseme", "4", "--expression", "joy=50"),
        "again": ("--fap", "open_jaw=800", "--viseme", "4", "--expression", "joy=50"),
        "aside": ("--fap", "3=0", "--camera", "profile"),
        "shut": ("--open-mouth", "0"),
        "open": ("--open-mouth", "100"),
        "held": ("--open-mouth", "100", "--fap", "open_jaw=0"),
    }.items():
        path = tmp_path / f"{name}.png"
        assert run("render", *arguments, "-o", path, *SMALL, "--lod", "0") == (0, f"{path}: 96x72\n", "")
        found[name] = pixels(path)
    assert found["neutral"].shape == (72, 96, 3)
    np.testing.assert_array_equal(found["posed"], found["again"])
    np.testing.assert_array_equal(found["shut"], found["neutral"])
    assert (found["open"] != found["shut"]).any()
    assert (found["held"] != found["open"]).any()
    changed = np.abs(found["posed"] - found["neutral"]).max(axis=2) > 10
    assert changed.any()
    assert changed[36:].sum() > 0.7 * changed.sum()  # the mouth is in the lower half, the brows are not
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
    err = run("render", "--fap", "3=0", "--model", tmp_path / "blue.glb", "-o", output, *SMALL).err
    assert err == ""
    middle = pixels(output)[36:44, 44:52].mean(axis=(0, 1))
    assert middle[2] > middle[0] + 40


@pytest.mark.usefixtures("opengl")
def test_a_sheet_holds_every_expression(run: Run, tmp_path: Path) -> None:
    output = tmp_path / "sheet.png"
    _, out, err = run("render", "--contact-sheet", "expressions", "--size", "64x64", "-o", output)
    assert err == ""
    sheet = pixels(output)
    assert out == f"{output}: {sheet.shape[1]}x{sheet.shape[0]}\n"
    step_x, step_y = (sheet.shape[1] - 4) // 3, (sheet.shape[0] - 4) // 2
    tiles = [sheet[4 + y * step_y :, 4 + x * step_x :][:64, :64] for y in range(2) for x in range(3)]
    for number, one in enumerate(tiles):
        for other in tiles[number + 1 :]:
            assert np.abs(one - other).max() > 25  # six different faces, at the same place
        below = sheet[4 + (number // 3) * step_y + 64 :, 4 + (number % 3) * step_x :][: step_y - 64, :64]
        assert below.max() > 120  # with a name


# --- files ---------------------------------------------------------------------------------------------


@pytest.fixture
def clip(tmp_path: Path, face: Animation) -> Path:
    """Six frames at 25 frames/s."""
    path = tmp_path / "clip.fba"
    fba.write(path, face[:6])
    return path


def write_tone(path: Path, seconds: float) -> None:
    write_wave(path, np.rint(9000 * np.sin(np.arange(round(seconds * 16000)) / 5)))


def streams(path: Path) -> tuple[int, int]:
    """How many frames a film has, and samples of sound."""
    av = pytest.importorskip("av")
    with av.open(str(path)) as film:
        frames = len(list(film.decode(video=0)))
    with av.open(str(path)) as film:
        samples = sum(frame.samples for frame in film.decode(audio=0)) if film.streams.audio else 0
    return frames, samples


@pytest.mark.usefixtures("opengl")
def test_the_sound_beside_a_file_goes_along(run: Run, clip: Path, tmp_path: Path) -> None:
    film = tmp_path / "film.mp4"
    assert run("render", clip, "-o", film, *SMALL) == (0, f"{film}: 96x72\n", "")
    assert streams(film) == (6, 0)
    write_tone(clip.with_suffix(".wav"), 3.0)
    said = f"{film}: 96x72, with the sound of {clip.with_suffix('.wav')}\n"
    assert run("render", clip, "-o", film, *SMALL) == (0, said, "")
    frames, samples = streams(film)
    assert frames == 6
    assert samples / 16000 == pytest.approx(6 / 25, abs=0.07)  # AAC counts by 1024 samples
    run("render", clip, "-o", film, "--no-audio", *SMALL)
    assert streams(film) == (6, 0)
    write_tone(tmp_path / "other.wav", 0.1)
    result = run("render", clip, "-o", film, "--audio", tmp_path / "other.wav", "--end", "0.12", *SMALL)
    assert "other.wav" in result.out
    assert streams(film)[0] == 3
    assert streams(film)[1] > 0


@pytest.mark.usefixtures("opengl")
@pytest.mark.parametrize("offset", [0.12, -0.08])
def test_the_sound_begins_later_or_earlier(run: Run, clip: Path, tmp_path: Path, offset: float) -> None:
    av = pytest.importorskip("av")
    silence = np.zeros(16000, "<i2")
    silence[1600:1632] = 30000  # a click at 0.1 s
    write_wave(clip.with_suffix(".wav"), silence)
    path = tmp_path / "film.mp4"
    run("render", clip, "-o", path, "--audio-offset", str(offset), *SMALL)
    with av.open(str(path)) as film:
        samples = np.concatenate([frame.to_ndarray()[0] for frame in film.decode(audio=0)])
    loud = np.abs(samples)
    assert np.argmax(loud > loud.max() / 2) / 16000 == pytest.approx(0.1 + offset, abs=0.006)


@pytest.mark.usefixtures("opengl")
def test_sound_that_cannot_be_read(run: Run, clip: Path, tmp_path: Path) -> None:
    broken = clip.with_suffix(".wav")
    broken.write_bytes(b"no sound")
    _, out, err = run("render", clip, "-o", tmp_path / "a.mp4", *SMALL)
    assert out == f"{tmp_path / 'a.mp4'}: 96x72\n"
    assert err.startswith(f"fba: warning: the film has no sound: {broken}")
    _, out, err = run("render", clip, "-o", tmp_path / "b.mp4", "--audio", broken, *SMALL, code=1)
    assert out == ""
    assert "cannot be read as sound" in err
    assert not (tmp_path / "b.mp4").exists()


@pytest.mark.usefixtures("opengl")
def test_numbered_pictures_and_gifs(run: Run, clip: Path, tmp_path: Path) -> None:
    folder = tmp_path / "frames"
    arguments = ("render", clip, "-o", f"{folder}/", "--transparent", *SMALL)
    assert run(*arguments) == (0, f"{folder}: 96x72\n", "")
    assert sorted(path.name for path in folder.iterdir()) == [f"{number:05d}.png" for number in range(6)]
    with Image.open(folder / "00000.png") as picture:
        assert (picture.mode, picture.getextrema()[3]) == ("RGBA", (0, 255))
    assert "00000.png to 00005.png (6 pictures) are in this folder already" in run(*arguments, code=1).err
    run(*arguments, "--replace")
    gif = tmp_path / "a.gif"
    assert run("render", clip, "-o", gif, "--end", "0.08", *SMALL) == (0, f"{gif}: 96x72\n", "")
    with Image.open(gif) as picture:
        assert (picture.n_frames, picture.info["loop"]) == (2, 0)


@pytest.mark.usefixtures("opengl")
def test_a_sheet_of_frames(run: Run, clip: Path, tmp_path: Path) -> None:
    sheet = tmp_path / "sheet.png"
    _, out, err = run("render", clip, "-o", sheet, "--contact-sheet", "6", "--size", "40x30")
    assert err == ""
    height, width = pixels(sheet).shape[:2]
    assert out == f"{sheet}: {width}x{height}\n"
    columns, rows = (width - 4) // 44, (height - 4) // (30 + 11 + 4)
    assert columns * rows == 6


@pytest.mark.usefixtures("opengl")
def test_several_files_stand_in_one_picture(run: Run, clip: Path, tmp_path: Path) -> None:
    found = {}
    for name, arguments in (
        ("one", (clip,)),
        ("side", (clip, clip)),
        ("over", (clip, clip, "--arrange", "over")),
        ("colour", (clip, clip, "--arrange", "colour", "--root", "common")),
        ("wipe", (clip, clip, "--arrange", "wipe")),
    ):
        output = tmp_path / f"{name}.png"
        size = ("--size", "160x80", "--camera", "front", "--transparent")
        assert run("render", *arguments, "-o", output, *size) == (0, f"{output}: 160x80\n", "")
        with Image.open(output) as picture:
            found[name] = np.asarray(picture)
    heads = {
        name: int((np.diff((shown[30, :, 3] > 127).astype(int)) > 0).sum()) for name, shown in found.items()
    }
    assert heads == {"one": 1, "side": 2, "over": 1, "colour": 2, "wipe": 1}
    assert (found["one"] != found["over"]).any()


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (("-o", "a.png", "--arrange", "over"), "--arrange needs two files or more"),
        (("-o", "a.png", "--root", "common"), "--root needs two files or more"),
        (("-o", "a.png", "clip.fba", "clip.fba", "--arrange", "wipe"), "wipe needs two files; 3 are given"),
        (("-o", "a.png", *["clip.fba"] * 8), "9 files are too many"),
        (("-o", "a.mp4", "--audio", "clip.fba", "--no-audio"), "contradict"),
        (("-o", "a.gif", "--audio", "clip.fba"), "--audio goes into an .mp4"),
        (("-o", "a.png", "--audio-offset", "0.1"), "--audio-offset goes into an .mp4"),
        (("-o", "a.mp4", "--audio-offset", "0.1"), "needs a sound: give one with --audio"),
        (("-o", "a.mp4", "--audio-offset", "nan"), "'nan' is not a number of seconds"),
        (("-o", "a.png", "--contact-sheet", "0"), "neither a number of frames nor one of 'faps'"),
        (("-o", "a.png", "--contact-sheet", "faps"), "--contact-sheet faps makes a picture without a file"),
        (("-o", "a.mp4", "--contact-sheet", "3"), "makes one picture"),
        (("-o", "a.png", "--contact-sheet", "3", "--frame", "2"), "makes one picture"),
        (("-o", "a.mp4", "--frame", "2"), "frame and time choose a single picture"),
        (("-o", "a.mp4", "--fps", "1001"), "at most at 1000"),
        (("-o", "a.png", "--start", "0", "--time", "0"), "belong to a film"),
    ],
)
def test_options_that_contradict_each_other(
    run: Run, clip: Path, monkeypatch: pytest.MonkeyPatch, arguments: tuple[str, ...], text: str
) -> None:
    monkeypatch.chdir(clip.parent)
    _, out, err = run("render", clip.name, *arguments, code=2)
    assert out == ""
    assert text in err
    assert [path.name for path in clip.parent.iterdir()] == ["clip.fba"]


@pytest.mark.usefixtures("opengl")
@pytest.mark.parametrize("name", ["a.avi", "a", "frames/%d-%d.png", "a.jpg"])
def test_names_that_nothing_can_be_written_to(run: Run, clip: Path, tmp_path: Path, name: str) -> None:
    _, out, err = run("render", clip, "-o", tmp_path / name, "--transparent", *SMALL, code=1)
    assert out == ""
    assert ".png" in err
    assert list(tmp_path.iterdir()) == [clip]


THREE = """
import sys, fba
from fba import player
for output in sys.argv[2:]:
    player.render(fba.read(sys.argv[1]), output, size=(96, 72))
"""


@pytest.mark.slow
@pytest.mark.usefixtures("opengl")
def test_pictures_and_films_are_the_same_from_run_to_run(run: Run, clip: Path, tmp_path: Path) -> None:
    """In this process, and in one of its own."""
    av = pytest.importorskip("av")
    found = []
    for number in range(2):
        outputs = [tmp_path / f"{number}{suffix}" for suffix in (".mp4", ".png", ".gif")]
        if number:
            subprocess.run([sys.executable, "-c", THREE, clip, *outputs], check=True, timeout=300)
        else:
            assert all(run("render", clip, "-o", output, *SMALL).code == 0 for output in outputs)
        with av.open(str(outputs[0])) as film:
            frames = [frame.to_ndarray(format="rgb24") for frame in film.decode(video=0)]
        found.append((outputs[1].read_bytes(), outputs[2].read_bytes(), frames))
    assert found[0][0] == found[1][0]
    assert found[0][1] == found[1][1]
    np.testing.assert_array_equal(found[0][2], found[1][2])


@pytest.mark.slow
@pytest.mark.usefixtures("opengl")
@pytest.mark.skipif(sys.platform == "win32", reason="signals are those of Unix")
@pytest.mark.parametrize(
    ("suffix", "name", "end"),
    [
        (".mp4", "SIGINT", (130, "fba: interrupted")),
        (".gif", "SIGINT", (130, "fba: interrupted")),
        (".mp4", "SIGTERM", (143, "fba: terminated")),
        (".gif", "SIGHUP", (129, "fba: terminated")),
    ],
)
def test_ctrl_c_and_kill_leave_nothing_half_written(
    clip: Path, tmp_path: Path, suffix: str, name: str, end: tuple[int, str]
) -> None:
    output = tmp_path / f"film{suffix}"
    output.write_bytes(b"old")
    # Where the tests run in the background, a shell may have made them, and what they start, deaf to SIGINT.
    code = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n"
    code += "signal.signal(signal.SIGHUP, signal.SIG_DFL)\n"
    code += "from fba.cli.main import main; main()"
    command = [sys.executable, "-c", code, "render", str(clip), "-o", str(output), "--fps", "90"]
    with started(command) as process:
        while len(list(tmp_path.iterdir())) < 3 and process.poll() is None:
            time.sleep(0.01)  # until the temporary file is there: it has begun
        process.send_signal(getattr(signal, name))
        _, err = process.communicate()
    assert (process.returncode, err.strip()) == end
    assert output.read_bytes() == b"old"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["clip.fba", output.name]


@pytest.mark.usefixtures("opengl")
def test_a_model_alone_is_shown_at_rest(run: Run, tmp_path: Path) -> None:
    with as_file(files("fba") / "face" / "builtin" / "head.glb") as head:
        for name, rest in (("model", ("--model", head)), ("neutral", ("--fap", "open_jaw=0"))):
            run("render", *rest, "-o", tmp_path / f"{name}.png", "--size", "80x60", "--lod", "full")
        run("render", "--model", head, "--frame", 1, "-o", tmp_path / "a.png", code=2)
    np.testing.assert_array_equal(pixels(tmp_path / "model.png"), pixels(tmp_path / "neutral.png"))


@pytest.mark.usefixtures("opengl")
def test_a_camera_at_the_face_goes_along_with_it(run: Run, tmp_path: Path) -> None:
    """Somebody who has walked 2 metres is where the camera looks, not out of the picture."""
    walk = tmp_path / "walk.bap"
    fba.write(walk, gait.walk(cycles=1.5))
    for frame in (0, -1):
        run("render", walk, "--frame", frame, "--camera", "front", "-o", tmp_path / f"{frame}.png",
                   "--size", "80x60")  # fmt: skip
    first, last = (pixels(tmp_path / f"{frame}.png").astype(int) for frame in (0, -1))
    face = slice(20, 40), slice(30, 50)
    assert np.abs(first[face] - last[face]).mean() < 12
    assert np.abs(last[face] - last[2, 2]).mean() > 20


@pytest.mark.parametrize(
    ("rate", "options", "said"),
    [
        (120, (), ", 60 frames/s, 120 in the file (another rate: --fps)"),
        (120, ("--fps", "120"), ""),
        (50, (), ""),
    ],
)
def test_a_film_of_a_fast_capture_has_a_usual_rate(
    rate: int, options: tuple[str, ...], said: str, run: Run, opengl: None, tmp_path: Path
) -> None:
    fba.write(tmp_path / "fast.fba", Animation(rate, np.arange(rate // 5), fba.FaceTrack.empty(rate // 5)))
    out = tmp_path / "pictures" / "%03d.png"
    text = run("render", tmp_path / "fast.fba", "-o", out, *SMALL, *options).out
    assert text == f"{tmp_path / 'pictures'}: 96x72{said}\n"
    shown = rate if options or not said else 60
    assert len(list((tmp_path / "pictures").iterdir())) == shown // 5


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
    assert (pixels.shape, pixels[2, 2, 3], pixels[24, 32, 3]) == ((48, 64, 4), 0, 255)

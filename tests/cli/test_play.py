"""`fba play`: what it hands to the window, and what it refuses.

`fba play` without a file: a neutral figure to move by hand.
"""

import os
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fba
from command_line import Run, pipe_in
from fba import Animation, player
from fba.body import BodyModel
from fba.face import FaceModel
from fba_player.playback.live import LiveAnimation
from fba_player.scene.compare import CompareScene
from sound_clicks import write_wave


class Window:
    """Stands in for the window; keeps what it was to show."""

    def __init__(self) -> None:
        self.scene: Any = None
        self.options: dict[str, Any] = {}
        self.meanwhile: Callable[[Any], None] = lambda scene: None
        self.dropped: list[tuple[Path, ...]] = []
        self.titles: list[str] = []
        self.surfaces: list[Any] = []

    def __call__(self, scene: Any, **options: Any) -> tuple[Path, ...]:
        self.scene, self.options = scene(), options
        self.surfaces.append(options.pop("surface"))
        self.titles.append(options["title"])
        self.meanwhile(self.scene)
        return self.dropped.pop(0) if self.dropped else ()


@pytest.fixture
def window(monkeypatch: pytest.MonkeyPatch) -> Window:
    stand_in = Window()
    monkeypatch.setattr(player, "play", stand_in)
    monkeypatch.setattr(player, "check_display", lambda: None)
    monkeypatch.setattr(player.Surface, "open", lambda *_: None)
    return stand_in


@pytest.fixture
def talk(tmp_path: Path, face: Animation) -> Path:
    fba.write(tmp_path / "talk.fba", face)
    return tmp_path / "talk.fba"


def test_a_file_is_played(run: Run, window: Window, talk: Path) -> None:
    run("play", talk)
    assert window.scene.timeline.frames == 50
    assert window.options == {
        "title": "talk.fba", "size": (1280, 720), "camera": None, "loop": False, "speed": 1.0, "start": None,
        "paused": False, "interpolate": True, "audio": None, "audio_offset": 0.0, "file": talk,
        "bap_steps": "iso", "warnings": (), "panels": (), "life": False,
    }  # fmt: skip


def test_options_reach_the_window(run: Run, window: Window, talk: Path) -> None:
    words = "--speed 0.5 --loop --start 1.2 --paused --no-interpolate"
    words += " --size 640x480 --camera profile --view points"
    run("play", talk, *words.split())
    taken = {
        name: window.options[name] for name in ("speed", "loop", "start", "paused", "interpolate", "camera")
    }
    assert list(taken.values()) == [0.5, True, 1.2, True, False, "profile"]
    assert (window.options["size"], window.scene.view) == ((640, 480), "points")


def test_the_sound_beside_it_is_found(run: Run, window: Window, talk: Path, tmp_path: Path) -> None:
    sound = write_wave(tmp_path / "talk.wav", [0] * 800, 8000)
    run("play", talk)
    assert window.options["audio"] == sound
    run("play", talk, "--audio-offset", "-0.25")
    assert (window.options["audio"], window.options["audio_offset"]) == (sound, -0.25)
    run("play", talk, "--no-audio")
    assert window.options["audio"] is None
    other = write_wave(tmp_path / "other.wav", [0] * 800, 8000)
    run("play", talk, "--audio", other)
    assert window.options["audio"] == other


def test_broken_sound(run: Run, window: Window, talk: Path, tmp_path: Path) -> None:
    broken = tmp_path / "talk.wav"
    broken.write_bytes(b"no sound at all")
    assert "played without sound" in run("play", talk).err
    assert window.options["audio"] is None
    window.scene = None
    assert "talk.wav: cannot be read as sound" in run("play", talk, "--audio", broken, code=1).err
    assert window.scene is None


def test_dropped_files_are_played_next(run: Run, window: Window, talk: Path, tmp_path: Path) -> None:
    other = tmp_path / "other.fba"
    other.write_bytes(talk.read_bytes())
    write_wave(tmp_path / "other.wav", [0] * 800, 8000)
    window.dropped = [(other,), (talk, other)]
    run("play", talk, "--start", "1.2", "--paused", "--speed", "2")
    assert window.titles == ["talk.fba", "other.fba", "talk.fba | other.fba"]
    assert (window.options["speed"], window.options["start"]) == (2.0, None)
    assert window.options["audio"] == tmp_path / "other.wav"
    assert isinstance(window.scene, CompareScene)
    assert len(set(map(id, window.surfaces))) == 1  # all in the same window


def test_files_of_the_same_name_are_told_apart(run: Run, window: Window, talk: Path, tmp_path: Path) -> None:
    (tmp_path / "coarse").mkdir()
    other = tmp_path / "coarse" / "talk.fba"
    other.write_bytes(talk.read_bytes())
    run("play", talk, other)
    assert window.scene.names == (f"{tmp_path.name}/talk.fba", "coarse/talk.fba")


def test_several_files_are_shown_together(
    run: Run, window: Window, talk: Path, tmp_path: Path, body: Animation
) -> None:
    fba.write(tmp_path / "walk.fba", body)
    run("play", talk, tmp_path / "walk.fba")
    assert isinstance(window.scene, CompareScene)
    assert (window.scene.arrangement, window.scene.names) == ("side", ("talk.fba", "walk.fba"))
    assert (window.options["title"], window.options["panels"], window.options["file"]) == (
        "talk.fba | walk.fba", (), None,
    )  # fmt: skip


def test_comparing(run: Run, window: Window, talk: Path, tmp_path: Path, face: Animation) -> None:
    fba.write(tmp_path / "coarse.fba", face, fap_quant=31)
    run("play", talk, tmp_path / "coarse.fba", "--compare")
    assert (window.scene.arrangement, window.options["panels"]) == ("over", ("differences",))
    assert {one.number for one in window.scene.differences().largest()} <= {3, 48}
    run("play", talk, talk, "--compare", "--arrange", "side")
    assert (window.scene.arrangement, window.scene.differences().largest()) == ("side", [])


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--compare",), "--compare needs two files"),
        (("--arrange", "over"), "--arrange needs two files"),
        (("--start", "2.5"), "from 0 s to 2 s"),
        (("--speed", "9"), "9"),
        (("--camera", "below"), "below"),
        (("missing.fba",), "missing.fba"),
        (("-", "-"), "standard input"),
    ],
)
def test_contradictory_options_are_refused(
    run: Run, window: Window, talk: Path, words: tuple[str, ...], said: str
) -> None:
    assert said in run("play", talk, *words, code=2).err
    assert window.scene is None


def test_sound_and_no_sound_contradict(run: Run, window: Window, talk: Path, tmp_path: Path) -> None:
    refused = run(
        "play", talk, "--audio", write_wave(tmp_path / "a.wav", [0] * 800, 8000), "--no-audio", code=2
    )
    assert "contradict" in refused.err


def test_too_many_files(run: Run, window: Window, talk: Path) -> None:
    assert "at most 8" in run("play", *[talk] * 9, code=2).err


def test_a_stream_on_standard_input(
    run: Run, window: Window, talk: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pipe_in(monkeypatch, talk.read_bytes())
    run("play", "-")
    assert isinstance(window.scene.animation, LiveAnimation)
    assert (window.options["title"], window.options["file"]) == ("standard input", None)
    assert not window.scene.timeline.growing
    assert window.scene.animation.snapshot() == fba.read(talk)


def test_a_stream_that_is_cut_off_says_so(
    run: Run, window: Window, talk: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    planes, _, _ = talk.read_bytes().partition(b"\0\0\1\xb1")
    pipe_in(monkeypatch, planes[:-16])
    window.meanwhile = lambda scene: scene.animation.wait_end(300)
    cut = run("play", "-")
    assert "warning: standard input: " in cut.err
    assert "cut off" in cut.err
    assert 20 < window.scene.timeline.frames < 50


def test_a_stream_from_a_fifo_is_shown_while_it_arrives(
    run: Run, window: Window, talk: Path, tmp_path: Path
) -> None:
    fifo = tmp_path / "fifo"
    os.mkfifo(fifo)
    data = talk.read_bytes()
    more = threading.Event()

    def send() -> None:
        with fifo.open("wb", buffering=0) as file:
            file.write(data[: len(data) // 2])
            more.wait(20)
            file.write(data[len(data) // 2 :])

    seen: list[tuple[bool, int]] = []

    def meanwhile(scene: Any) -> None:
        seen.append((scene.timeline.growing, scene.timeline.frames))
        more.set()
        sender.join(20)
        while scene.timeline.growing:
            time.sleep(0.002)
        seen.append((scene.timeline.growing, scene.timeline.frames))

    window.meanwhile = meanwhile
    sender = threading.Thread(target=send, daemon=True)
    sender.start()
    run("play", fifo)
    assert seen[0][0]
    assert 7 < seen[0][1] < 50
    assert seen[1] == (False, 50)


def test_other_formats_on_standard_input_are_read_to_their_end(
    run: Run, window: Window, tmp_path: Path, face: Animation, monkeypatch: pytest.MonkeyPatch
) -> None:
    fba.write(tmp_path / "face.fap", face)
    pipe_in(monkeypatch, (tmp_path / "face.fap").read_bytes())
    run("play", "-")
    assert isinstance(window.scene.animation, Animation)
    assert window.scene.timeline.frames == 50


def test_nothing_on_standard_input(run: Run, window: Window, monkeypatch: pytest.MonkeyPatch) -> None:
    pipe_in(monkeypatch, b"")
    assert "standard input: is empty" in run("play", "-", code=1).err
    pipe_in(monkeypatch, b"\0\0\1\xbarubbish")
    assert "plane" in run("play", "-", code=1).err
    pipe_in(monkeypatch, b"neither numbers nor bits\n")
    assert "error: standard input: is in no format known here" in run("play", "-", code=1).err
    pipe_in(monkeypatch, b"", terminal=True)
    assert "keyboard" in run("play", "-", code=2).err
    assert window.scene is None


def test_a_body_from_a_file(run: Run, window: Window, tmp_path: Path, talk: Path) -> None:
    (tmp_path / "body.glb").write_bytes(b"no glTF")
    assert "body.glb" in run("play", talk, "--body", tmp_path / "body.glb", code=1).err


def test_a_face_alone(run: Run, window: Window, tmp_path: Path) -> None:
    FaceModel.default().save(tmp_path / "mine.glb")
    run("play", "--model", tmp_path / "mine.glb", "--size", "640x480")
    scene, options = window.scene, window.options
    assert not scene.has_body
    assert not np.any(scene.timeline.faps(0.0))
    assert (options["panels"], options["paused"], options["size"]) == (("puppet",), True, (640, 480))
    assert options["title"] == "mine.glb"


def test_a_body_with_a_face(run: Run, window: Window, tmp_path: Path) -> None:
    BodyModel.default().save(tmp_path / "body.glb")
    run("play", "--body", tmp_path / "body.glb", "--show", "grid")
    scene = window.scene
    assert scene.has_body
    assert scene.switches["grid"]
    assert scene.view_for(scene.timeline.faps(0.0), scene.timeline.baps(0.0)).faces


def test_without_anything_the_built_in_person(run: Run, window: Window) -> None:
    run("play")
    scene, options = window.scene, window.options
    assert scene.has_body
    assert (options["panels"], options["title"]) == (("puppet",), "puppet")


def test_options_that_need_a_file(run: Run, window: Window, tmp_path: Path) -> None:
    (tmp_path / "mine.glb").write_bytes(b"")
    for words, said in (
        (("--compare", "--model", tmp_path / "mine.glb"), "--compare needs two files"),
        (("--model", tmp_path / "mine.glb", "--audio", tmp_path / "mine.glb"), "--audio goes with a file"),
    ):
        assert said in run("play", *words, code=2).err
    assert window.scene is None

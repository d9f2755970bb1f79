"""The window itself, under a virtual display where Xvfb is installed."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator

import numpy as np
import pytest

from fba.animation import Animation
from fba.errors import DisplayError
from player.scene import Scene
from player.window import Window, play

glfw = pytest.importorskip("glfw")


@pytest.fixture(scope="module")
def display() -> Iterator[str]:
    """A virtual display of its own."""
    if shutil.which("Xvfb") is None:
        pytest.skip("Xvfb is not installed (Debian, Ubuntu: apt-get install xvfb)")
    read, write = os.pipe()
    server = subprocess.Popen(
        ["Xvfb", "-displayfd", str(write), "-screen", "0", "900x700x24", "-nolisten", "tcp", "-noreset"],
        pass_fds=[write],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    os.close(write)
    pipe = os.fdopen(read)
    try:
        number = pipe.readline().strip()
        if not number:
            pytest.skip("Xvfb did not start")
        yield f":{number}"
    finally:
        pipe.close()
        server.terminate()
        server.wait(10)


@pytest.fixture
def window(display: str, talking: Animation, monkeypatch: pytest.MonkeyPatch) -> Iterator[Window]:
    monkeypatch.setenv("DISPLAY", display)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    try:
        opened = Window(Scene(talking), size=(320, 240))
    except DisplayError as error:
        if os.environ.get("CI"):
            raise
        pytest.skip(f"no OpenGL on the virtual display: {error}")
    with opened:
        opened.update()
        yield opened


def shown(window: Window) -> np.ndarray:
    width, height = window.controls.size
    pixels = np.frombuffer(window._gl.screen.read((0, 0, width, height), components=3, alignment=1), np.uint8)
    return pixels.reshape(height, width, 3)[::-1].astype(int)


def press(window: Window, key: int, action: int | None = None) -> None:
    window._on_key(window._window, key, 0, glfw.PRESS if action is None else action, 0)


def test_it_shows_the_face_and_the_timeline(window: Window) -> None:
    window._stale = True
    window.update()
    picture = shown(window)
    assert picture.shape == (240, 320, 3)
    assert (picture[80:120, 140:180, 0] - picture[80:120, 140:180, 2]).mean() > 25  # skin
    bar = picture[190:, :, :]
    assert bar.mean() < picture[:40].mean()
    assert (bar.min(axis=2) > 200).sum() > 20  # text and knob


def test_keys_step_play_and_close(window: Window) -> None:
    press(window, glfw.KEY_RIGHT)
    press(window, glfw.KEY_RIGHT, glfw.REPEAT)
    assert window.transport.frame == 2
    press(window, glfw.KEY_SPACE)
    press(window, glfw.KEY_SPACE, glfw.REPEAT)  # held keys do not play and pause in turn
    assert window.transport.playing
    press(window, glfw.KEY_SPACE)
    assert window.update()
    press(window, glfw.KEY_ESCAPE)
    assert not window.update()


def test_playing_draws_pictures_and_moves_on(window: Window) -> None:
    window.transport.play()
    before, begun = window.pictures, time.monotonic()
    while window.pictures < before + 3 and time.monotonic() - begun < 30:
        assert window.update()
    assert window.pictures >= before + 3
    assert window.transport.playing


def test_paused_it_draws_only_what_changed(window: Window) -> None:
    window.update()
    before = window.pictures
    for _ in range(3):
        window.update()
    assert window.pictures == before
    press(window, glfw.KEY_RIGHT)
    window.update()
    assert window.pictures == before + 1


def test_help_covers_the_middle(window: Window) -> None:
    window.update()
    plain = shown(window)
    press(window, glfw.KEY_F1)
    window.update()
    window._stale = True
    window.update()
    assert shown(window)[60:180, 60:260].mean() < plain[60:180, 60:260].mean() - 20


def test_p_shows_feature_points_and_the_figure_again(window: Window) -> None:
    window._stale = True
    window.update()
    figure = shown(window)
    press(window, glfw.KEY_P)
    window.update()
    points = shown(window)
    assert window.scene.view == "points"
    skin = (slice(80, 120), slice(140, 180))
    red = [(p[skin][..., 0] - p[skin][..., 2]).mean() for p in (figure, points)]
    assert red[0] > 25
    assert red[1] < 15
    press(window, glfw.KEY_P)
    press(window, glfw.KEY_P, glfw.REPEAT)  # held it does not flicker
    window.update()
    np.testing.assert_array_equal(shown(window), figure)


def test_mouse_seeks_and_orbits(window: Window) -> None:
    controls = window.controls
    controls.press("left", controls.bar()[1], 235)
    assert window.transport.frame == 9
    controls.release()
    yaw = controls.camera.yaw
    window._on_move(window._window, 100, 100)
    controls.press("left", 100, 100)
    window._on_move(window._window, 140, 100)
    assert controls.camera.yaw == pytest.approx(yaw - 14)
    window._on_button(window._window, glfw.MOUSE_BUTTON_LEFT, glfw.RELEASE, 0)


def test_resizing_while_playing(window: Window) -> None:
    window.transport.play()
    glfw.set_window_size(window._window, 401, 207)
    begun = time.monotonic()
    while window.controls.size != (401, 207) and time.monotonic() - begun < 20:
        assert window.update()
    assert window.controls.size == (401, 207)
    picture = shown(window)
    assert picture.shape == (207, 401, 3)
    assert (
        picture[60:100, 190:210, 0] - picture[60:100, 190:210, 2]
    ).mean() > 25  # the face in the new middle
    assert picture[170:].mean() < picture[:30].mean()  # the timeline at the new bottom


@pytest.mark.skipif(shutil.which("xdotool") is None, reason="xdotool is not installed")
def test_real_key_presses_reach_it(display: str) -> None:
    code = (
        "import numpy as np, player\n"
        "from fba.animation import Animation, FaceTrack\n"
        "track = FaceTrack(np.zeros((10, 68), int), np.ones((10, 68), bool))\n"
        "animation = Animation(25, np.arange(10), face=track, name='keys')\n"
        "player.play(animation, size=(200, 150), paused=True)\n"
        "print('closed')\n"
    )
    environment = {**os.environ, "DISPLAY": display}
    environment.pop("WAYLAND_DISPLAY", None)
    child = subprocess.Popen([sys.executable, "-c", code], env=environment, stdout=subprocess.PIPE, text=True)

    def xdotool(*words: str) -> str:
        run = subprocess.run(
            ["xdotool", *words], env=environment, capture_output=True, text=True, check=False
        )
        return run.stdout.strip()

    try:
        begun, found = time.monotonic(), ""
        while not found and time.monotonic() - begun < 60 and child.poll() is None:
            time.sleep(0.2)
            found = xdotool("search", "--name", "^keys")
        if child.poll() is not None:
            pytest.skip("no OpenGL on the virtual display")
        name = found.split()[0]
        xdotool("windowfocus", "--sync", name)
        titles = []
        for key, expected in (("Right", "frame 2 / 10"), ("End", "frame 10 / 10"), ("Home", "frame 1 / 10")):
            xdotool("key", "--window", "0", key)
            begun = time.monotonic()
            while expected not in xdotool("getwindowname", name) and time.monotonic() - begun < 20:
                time.sleep(0.05)
            titles.append(xdotool("getwindowname", name))
            assert expected in titles[-1]
        xdotool("key", "q")
        assert child.communicate(timeout=30)[0].strip() == "closed"
        assert child.returncode == 0
    finally:
        if child.poll() is None:
            child.kill()
            child.wait()


def test_no_display_says_what_to_do(talking: Animation, monkeypatch: pytest.MonkeyPatch) -> None:
    if sys.platform != "linux":
        pytest.skip("only X11 and Wayland can be absent")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with pytest.raises(DisplayError, match="fba render"):
        play(talking)


def test_arguments_are_checked(talking: Animation) -> None:
    with pytest.raises(ValueError, match="1x1"):
        play(talking, size=(0, 5))
    with pytest.raises(ValueError, match="preset"):
        play(talking, camera="behind")

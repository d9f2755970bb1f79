"""The window under a virtual display, with real keys and a real mouse, which xdotool presses and moves."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

import graphics
from fba.animation import Animation
from fba_player.window._window import Window
from open_windows import opened, settle, shown, until

glfw = graphics.imported("glfw")
graphics.imported("imgui_bundle")

if shutil.which("xdotool") is None:
    graphics.skip("xdotool is not installed (Debian, Ubuntu: apt-get install xdotool)")


class Hand:
    """Presses keys and moves the mouse over a window; places are in pixels from its upper left corner."""

    def __init__(self, window: Window) -> None:
        self.window = window
        self._number = str(glfw.get_x11_window(window._window))
        self.do("windowmove", self._number, "0", "0")
        self.do("windowfocus", self._number)
        until(window, lambda: bool(glfw.get_window_attrib(window._window, glfw.FOCUSED)))
        self.move(450, 60)  # where nothing is
        settle(window)

    def do(self, *words: str) -> None:
        subprocess.run(["xdotool", *words], check=True, capture_output=True, timeout=30)

    def key(self, name: str, reached: Callable[[], bool]) -> None:
        """Press a key, and draw until something holds."""
        self.do("key", name)
        until(self.window, reached)

    def move(self, x: float, y: float) -> None:
        """Move the mouse, and draw until the panels know."""
        self.do("mousemove", "--window", self._number, str(round(x)), str(round(y)))
        io = self.window._gui.io
        until(self.window, lambda: abs(io.mouse_pos.x - round(x)) < 1 and abs(io.mouse_pos.y - round(y)) < 1)

    def hold(self, number: int = 1) -> None:
        """Press a mouse button, and draw until the panels know."""
        self.do("mousedown", str(number))
        io = self.window._gui.io
        until(self.window, lambda: bool(io.mouse_down[{1: 0, 2: 2, 3: 1}[number]]))

    def let_go(self, number: int = 1) -> None:
        """Release it."""
        self.do("mouseup", str(number))
        io = self.window._gui.io
        until(self.window, lambda: not io.mouse_down[{1: 0, 2: 2, 3: 1}[number]])
        settle(self.window)

    def drag(self, start: tuple[float, float], end: tuple[float, float], number: int = 1) -> None:
        self.move(*start)
        self.hold(number)
        self.move(*end)
        self.let_go(number)


@pytest.fixture
def window(on_display: str, long: Animation, tmp_path: Path) -> Iterator[Window]:
    with opened(long, tmp_path, panels=True, size=(900, 600)) as one:
        settle(one)
        yield one


@pytest.fixture
def hand(window: Window) -> Hand:
    return Hand(window)


@pytest.fixture(scope="session")
def long(talking: Animation) -> Animation:
    """Ten seconds of a face, at 25 frames a second."""
    rows = np.arange(250) % 10
    assert talking.face is not None
    from fba.animation import FaceTrack

    face = FaceTrack(talking.face.values[rows], talking.face.mask[rows])
    return Animation(25, np.arange(250), face=face, name="long")


def on_timeline(window: Window, share: float) -> tuple[float, float]:
    left, top, right, bottom = window._gui.bar.area
    return left + share * (right - left), (top + bottom) / 2


def test_keys_play_step_and_stop(window: Window, hand: Hand) -> None:
    transport = window.transport
    hand.key("Right", lambda: transport.frame == 1)
    hand.key("End", lambda: transport.frame == 249)
    hand.key("shift+Left", lambda: transport.frame == 239)
    hand.key("Home", lambda: transport.frame == 0)
    hand.key("space", lambda: transport.playing and transport.frame > 3)
    hand.key("s", lambda: not transport.playing)
    assert transport.frame > 3  # stopped, it stays
    hand.key("plus", lambda: transport.speed == 1.25)
    hand.key("minus", lambda: transport.speed == 1.0)
    zoom = window.session.zoom
    whole = zoom.high - zoom.low
    hand.key("ctrl+plus", lambda: zoom.high - zoom.low < whole)
    hand.key("ctrl+0", lambda: zoom.high - zoom.low == whole)


def test_marks_by_keys_loop_the_range(window: Window, hand: Hand) -> None:
    transport = window.transport
    transport.seek(2.0)
    hand.key("bracketleft", lambda: transport.mark_in == 2.0)
    transport.seek(2.4)
    hand.key("bracketright", lambda: transport.mark_out == 2.4)
    seen: list[float] = []

    def turned_back() -> bool:
        seen.append(transport.time)
        return len(seen) > 1 and seen[-1] < seen[-2]

    hand.key("space", turned_back)
    assert min(seen[1:]) >= 2.0
    assert max(seen) <= 2.4
    hand.key("backslash", lambda: transport.mark_in is None and transport.mark_out is None)


def test_scrubbing_while_playing(window: Window, hand: Hand) -> None:
    transport = window.transport
    transport.play()
    hand.move(*on_timeline(window, 0.3))
    hand.hold()
    hand.move(*on_timeline(window, 0.5))
    assert transport.time == pytest.approx(0.5 * 249 / 25, abs=0.1)
    picture = shown(window)
    x, _ = on_timeline(window, 0.5)
    _, top, _, bottom = window._gui.bar.area
    assert picture[round(top) : round(bottom), round(x) - 1 : round(x) + 1].mean() > 180  # the play head
    held = transport.time
    hand.let_go()
    assert transport.playing
    until(window, lambda: transport.time > held)  # it goes on from there


def test_dragging_a_mark(window: Window, hand: Hand) -> None:
    transport = window.transport
    transport.mark_in = 0.2 * 249 / 25
    settle(window)
    hand.drag(on_timeline(window, 0.2), on_timeline(window, 0.4))
    assert transport.mark_in == pytest.approx(0.4 * 249 / 25, abs=0.05)
    assert transport.time == 0.0


def test_the_slider_of_speed(window: Window, hand: Hand) -> None:
    *_, bottom = window._gui.bar.area
    x0, x1 = window._gui.bar.buttons.slider
    hand.drag(((x0 + x1) / 2, bottom + 28), (x1 + 30, bottom + 28))
    assert window.transport.speed == 4.0
    hand.drag(((x0 + x1) / 2, bottom + 28), (x0 - 30, bottom + 28))
    assert window.transport.speed == 0.1


def test_keys_open_panels(window: Window, hand: Hand) -> None:
    settle(window)
    before = shown(window)
    hand.key("F2", lambda: window.session.open == {"file"})
    settle(window)
    assert (np.abs(shown(window) - before).sum(axis=2) > 40).mean() > 0.05
    hand.key("h", lambda: window.session.bare)
    settle(window)
    bare = shown(window)
    assert bare[560:].mean() > before[560:].mean() + 20  # the studio where the bar was
    hand.key("h", lambda: not window.session.bare)
    hand.key("F2", lambda: window.session.open == set())
    settle(window)
    np.testing.assert_array_equal(shown(window), before)


def test_the_mouse_turns_and_nears_the_view(window: Window, hand: Hand) -> None:
    viewpoint = window.session.viewpoint
    before = viewpoint.camera
    hand.drag((450, 250), (490, 250))
    assert viewpoint.camera.yaw == pytest.approx(before.yaw - 14)
    hand.do("click", "4")
    until(window, lambda: viewpoint.camera.distance < before.distance * 0.95)
    hand.key("r", lambda: viewpoint.camera == before)


def test_pictures_and_films_are_kept(window: Window, hand: Hand, tmp_path: Path) -> None:
    from PIL import Image

    hand.key("F12", (tmp_path / "long-0000.png").exists)
    with Image.open(tmp_path / "long-0000.png") as picture:
        assert (picture.size, picture.mode) == ((900, 600), "RGB")
    hand.key("shift+F12", (tmp_path / "long-0000-2.png").exists)
    with Image.open(tmp_path / "long-0000-2.png") as picture:
        alpha = np.asarray(picture)[..., 3]
    assert alpha[5, 5] == 0
    assert alpha[250, 450] == 255  # the head
    assert window.session.scene.switches["background"] == "studio"


def test_closing_while_recording_keeps_the_film(window: Window, hand: Hand, tmp_path: Path) -> None:
    av = pytest.importorskip("av")
    hand.key("ctrl+r", lambda: window.captures.recording)
    window.transport.play()
    until(window, lambda: (window.session.recording or 0) > 0.3)
    hand.do("key", "q")
    while window.update():
        pass
    window.close()
    with av.open(str(tmp_path / "long-film.mp4")) as film:
        assert sum(1 for _ in film.decode(video=0)) >= 3


def test_resizing_while_playing(window: Window, hand: Hand) -> None:
    window.transport.play()
    hand.do("windowsize", hand._number, "700", "420")
    until(window, lambda: window.session.size == (700, 420))
    settle(window)
    assert shown(window).shape == (420, 700, 3)
    assert window._gui.bar.area[2] == 700 - 18
    assert window.transport.playing


def test_full_screen_and_back(window: Window, hand: Hand) -> None:
    hand.key("f", lambda: window.session.size == (1000, 800))
    settle(window)
    assert shown(window).shape == (800, 1000, 3)
    assert window._gui.bar.area[2] == 1000 - 18
    hand.key("F11", lambda: window.session.size == (900, 600))


def test_the_window_is_closed_by_its_key(window: Window, hand: Hand) -> None:
    hand.do("key", "Escape")
    for _ in range(200):
        if not window.update():
            return
    pytest.fail("Escape did not close the window")


def test_dragging_a_slider_of_the_puppeteer(window: Window, hand: Hand) -> None:
    session = window.session
    hand.key("F7", lambda: "puppet" in session.open)
    settle(window)
    panel = next(panel for panel in window._gui.panels if panel.name == "puppet")
    left, right, y = panel.sliders["Jaw", 0]
    camera = session.viewpoint.camera
    hand.drag((left + 8, y), (left + 0.5 * (right - left), y))
    assert session.values[0][2] == pytest.approx(600, abs=60)  # half of what the slider has
    hand.key("Right", lambda: window.transport.frame == 1)
    settle(window)
    assert session.values[0][2] == pytest.approx(600, abs=60)
    assert session.viewpoint.camera == camera

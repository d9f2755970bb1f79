"""The window itself, under a virtual display where Xvfb is installed; events handed to its callbacks."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import graphics
from fba.animation import Animation
from fba.errors import DisplayError, FbaWarning
from fba_player.gl._context import import_moderngl, is_software
from fba_player.gl._renderer import Renderer
from fba_player.scene.scene import Scene
from fba_player.window._play import play
from fba_player.window._window import Window
from open_windows import opened, settle, shown, until

glfw = graphics.imported("glfw")


@pytest.fixture
def window(on_display: str, talking: Animation, tmp_path: Path) -> Iterator[Window]:
    """A window with panels."""
    with opened(talking, tmp_path, panels=True) as one:
        settle(one)
        yield one


@pytest.fixture
def plain(on_display: str, talking: Animation, tmp_path: Path) -> Iterator[Window]:
    """A window with the plain timeline."""
    with opened(talking, tmp_path, panels=False, size=(320, 240)) as one:
        settle(one)
        yield one


def press(window: Window, key: int, modifiers: int = 0, action: int | None = None) -> None:
    action = glfw.PRESS if action is None else action
    window.input.on_key(window._window, key, 0, action, modifiers)
    settle(window)


def test_it_shows_the_face_and_the_timeline(window: Window) -> None:
    window._redraw()
    settle(window)
    picture = shown(window)
    assert picture.shape == (480, 640, 3)
    assert (picture[150:240, 290:350, 0] - picture[150:240, 290:350, 2]).mean() > 25  # skin
    assert picture[370:].mean() < picture[:120, :100].mean() - 40  # the bar is darker than the studio
    assert (picture[370:].min(axis=2) > 200).sum() > 60  # text, signs


def test_something_is_shown_before_anything_is_prepared(
    on_display: str, talking: Animation, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Compiling shaders takes a second, in which the window was black."""
    done: list[np.ndarray | str] = []
    made: list[Any] = []
    swap = glfw.swap_buffers

    class Late(Renderer):
        def __init__(self, context: Any) -> None:
            done.append("prepared")
            super().__init__(context)

    def swapped(window: Any) -> None:
        data = made[-1].screen.read((0, 0, 640, 480), components=3)
        done.append(np.frombuffer(data, np.uint8).reshape(480, 640, 3))
        swap(window)

    monkeypatch.setattr(glfw, "swap_buffers", swapped)
    monkeypatch.setattr("fba_player.window._window.Renderer", Late)
    moderngl = import_moderngl()
    create = moderngl.create_context
    monkeypatch.setattr(moderngl, "create_context", lambda **how: made.append(create(**how)) or made[-1])
    with opened(talking, tmp_path, panels=False):
        first, _, then = done[:3]  # before and after the window appears
    assert then == "prepared"
    assert isinstance(first, np.ndarray)
    assert 100 < np.median(first) < 150  # the grey of the studio
    assert (first[220:260].min(axis=2) > 200).sum() > 60  # letters in the middle
    assert (first[20:60].min(axis=2) > 190).sum() > 60  # keys at the lower edge
    assert not (first[80:180].min(axis=2) > 190).any()


def test_the_plain_window_shows_the_face_and_the_timeline(plain: Window) -> None:
    picture = shown(plain)
    assert (picture[80:120, 140:180, 0] - picture[80:120, 140:180, 2]).mean() > 25
    assert picture[190:].mean() < picture[:40].mean()
    assert (picture[190:].min(axis=2) > 200).sum() > 20
    press(plain, glfw.KEY_F1)
    assert shown(plain)[60:180, 60:260].mean() < picture[60:180, 60:260].mean() - 20


def test_keys_step_play_and_close(window: Window) -> None:
    press(window, glfw.KEY_RIGHT)
    press(window, glfw.KEY_RIGHT, action=glfw.REPEAT)
    assert window.transport.frame == 2
    press(window, glfw.KEY_RIGHT, glfw.MOD_SHIFT)
    assert window.transport.frame == 9
    window.input.on_key(window._window, glfw.KEY_SPACE, 0, glfw.PRESS, 0)
    window.input.on_key(window._window, glfw.KEY_SPACE, 0, glfw.REPEAT, 0)  # held it does not flicker
    assert window.transport.playing
    press(window, glfw.KEY_S)
    assert not window.transport.playing
    press(window, glfw.KEY_ESCAPE)
    assert not window.update()


def test_playing_draws_pictures_and_moves_on(window: Window) -> None:
    window.transport.play()
    before = window.pictures
    until(window, lambda: window.pictures >= before + 3)
    assert window.transport.playing


def test_paused_it_draws_only_what_changed(window: Window) -> None:
    before = window.pictures
    for _ in range(3):
        window.update()
    assert window.pictures == before
    press(window, glfw.KEY_RIGHT)
    assert window.pictures > before


def test_p_shows_feature_points_and_the_figure_again(plain: Window) -> None:
    figure = shown(plain)
    press(plain, glfw.KEY_P)
    points = shown(plain)
    assert plain.session.scene.view == "points"
    skin = (slice(80, 120), slice(140, 180))
    red = [(p[skin][..., 0] - p[skin][..., 2]).mean() for p in (figure, points)]
    assert red[0] > 25
    assert red[1] < 15
    press(plain, glfw.KEY_P)
    np.testing.assert_array_equal(shown(plain)[:180], figure[:180])


def test_resizing_while_playing(plain: Window) -> None:
    plain.transport.play()
    glfw.set_window_size(plain._window, 401, 207)
    until(plain, lambda: plain.session.size == (401, 207))
    picture = shown(plain)
    assert (
        picture[60:100, 190:210, 0] - picture[60:100, 190:210, 2]
    ).mean() > 25  # the face in the new middle
    assert picture[170:].mean() < picture[:30].mean()  # the timeline at the new bottom


@pytest.mark.parametrize("size", [(1, 1), (40, 400), (400, 30), (200, 150)])
def test_any_size_is_drawn_with_all_panels_open(
    on_display: str, talking: Animation, tmp_path: Path, size: tuple[int, int]
) -> None:
    with opened(talking, tmp_path, panels=True, size=size) as window:
        window.session.open |= {"file", "view", "camera", "help"}
        window.session.say("a word")
        window._redraw()
        settle(window)
        assert window.pictures >= 4
        assert window._gl.error == "GL_NO_ERROR"


def hide(window: Window, monkeypatch: pytest.MonkeyPatch, attribute: int) -> None:
    """Let glfw say of the window what a window manager would: there is none on the virtual display."""
    ask = glfw.get_window_attrib
    monkeypatch.setattr(
        glfw,
        "get_window_attrib",
        lambda w, what: what == attribute or (what != glfw.ICONIFIED and ask(w, what)),
    )


@pytest.mark.parametrize("how", ["as X11 does", "as Windows does"])
def test_minimised_it_waits_and_goes_on(window: Window, monkeypatch: pytest.MonkeyPatch, how: str) -> None:
    window.transport.play()
    before = window.pictures
    with monkeypatch.context() as minimised:
        if how == "as X11 does":
            hide(window, minimised, glfw.ICONIFIED)
        else:
            minimised.setattr(type(window._surface), "pixels", property(lambda _: (0, 0)))
        for _ in range(3):
            assert window.update()
        assert window.pictures == before
        assert window.transport.playing
    window._redraw()
    assert window.update()
    assert window.pictures == before + 1


def test_minimised_it_still_records(window: Window, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("av")
    hide(window, monkeypatch, glfw.ICONIFIED)
    window.session.request("record")
    window._redraw()
    until(window, lambda: (window.session.recording or 0.0) > 0.1)
    window.session.request("record")
    until(window, lambda: window.session.recording is None)
    assert list(window.captures.folder.glob("*.mp4"))


def test_covered_by_another_window_it_waits(window: Window) -> None:
    window.transport.play()
    x, y = glfw.get_window_pos(window._window)
    glfw.window_hint(glfw.CLIENT_API, glfw.NO_API)
    glfw.window_hint(glfw.FOCUSED, False)
    over = glfw.create_window(900, 700, "over", None, None)
    glfw.set_window_pos(over, x - 20, y - 20)
    glfw.poll_events()
    until(window, lambda: window._hidden)
    before = window.pictures
    for _ in range(3):
        assert window.update()
    assert window.pictures == before
    glfw.destroy_window(over)
    until(window, lambda: window.pictures > before)


def test_frame_by_frame_it_draws_one_picture_for_each_frame(
    window: Window, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("fba_player.window._window.wall.perf_counter", lambda: now[0])
    now = [window._last + 10.0]
    window.transport.use_clock(lambda: now[0])
    window.transport.interpolate = False
    window.transport.play()
    settle(window)
    before = window.pictures
    for _ in range(40):  # 0.2 s in steps of 5 ms: five frames
        now[0] += 0.005
        window.update()
    assert 5 <= window.pictures - before <= 7


def test_a_lost_context_ends_with_an_explanation(window: Window, monkeypatch: pytest.MonkeyPatch) -> None:
    class Lost:
        error = "GL_UNKNOWN_ERROR"

        def __getattr__(self, name: str) -> object:
            return getattr(held, name)

    held = window._gl
    with monkeypatch.context() as lost:
        lost.setattr(window, "_gl", Lost())
        window._redraw()
        with pytest.raises(DisplayError, match="driver was reset"):
            window.update()


@pytest.mark.parametrize(
    ("failure", "said"),
    [
        ("No module named 'imgui_bundle'", r'"mpeg4-fba\[player\]"'),
        ("libX11.so.6: cannot open shared object file", "apt-get install libx11-6"),
    ],
    ids=["package", "library"],
)
def test_without_imgui_it_plays_and_says_so(
    on_display: str,
    talking: Animation,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    failure: str,
    said: str,
) -> None:
    (tmp_path / "imgui_bundle.py").write_text(f"raise ImportError({failure!r})", encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    for name in [name for name in sys.modules if name.startswith(("imgui_bundle", "fba_player._ui.gui"))]:
        monkeypatch.delitem(sys.modules, name)
    try:
        with pytest.warns(FbaWarning, match=said):
            one = Window(Scene(talking), size=(320, 240))
    except DisplayError as error:
        graphics.skip(f"no window on the virtual display: {error}")
    with one:
        settle(one)
        assert (shown(one)[190:].min(axis=2) > 200).sum() > 20
        press(one, glfw.KEY_RIGHT)
        assert one.transport.frame == 1


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


def test_files_dropped_onto_it_are_handed_on(window: Window, talking: Animation, tmp_path: Path) -> None:
    import fba

    broken, good = tmp_path / "broken.fba", tmp_path / "good.fba"
    broken.write_bytes(b"no stream")
    fba.write(good, talking)
    window.input.on_drop(window._window, [str(broken)])
    assert window.update()
    assert [notice.kind for notice in window.session.notices()] == ["error"]
    assert window.session.dropped == ()
    window.input.on_drop(window._window, [str(good)])
    assert not window.update()
    assert window.session.dropped == (good,)


def test_the_close_button_of_the_window_asks_if_work_is_unsaved(window: Window) -> None:
    window.session.unsaved.add("the last take")
    glfw.set_window_should_close(window._window, True)
    assert window.update()
    assert not glfw.window_should_close(window._window)
    assert [notice.kind for notice in window.session.notices()] == ["warning"]
    glfw.set_window_should_close(window._window, True)
    assert not window.update()


def test_a_window_is_fast_in_software_and_fine_where_it_is_told(plain: Window) -> None:
    for quality in ("auto", "fine", "fast"):
        plain.session.scene.show("quality", quality)
        plain._redraw()
        plain.update()
        usual = 0 if is_software(plain._gl) else 4
        assert plain._target.samples == {"auto": usual, "fine": 4, "fast": 0}[quality]
        assert np.ptp(shown(plain)[..., :3]) > 100  # it arrives on the screen


def test_a_paused_face_changes_its_level_of_detail_and_then_comes_to_rest(plain: Window) -> None:
    plain.transport.pause()
    settle(plain)
    plain.session.scene.show("lod", "0")  # so small, it is at a coarse one
    plain._redraw()
    until(plain, lambda: plain._renderer is not None and plain._renderer.morphing)
    settle(plain)
    assert not plain._renderer.morphing
    pictures = plain.pictures
    plain.update()
    assert plain.pictures == pictures

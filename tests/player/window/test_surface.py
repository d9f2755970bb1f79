"""A window in which scenes follow each other: dropped files, files that change on disk, the first hints."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from importlib.resources import files
from pathlib import Path
from typing import Any

import pytest

import fba
import graphics
from fba.animation import Animation
from fba.arrays import UInt8
from fba.compiled import announce_compilation
from fba.errors import DisplayError
from fba_player.scene.scene import Scene
from fba_player.session._memory import Memory
from fba_player.session._session import Notice
from fba_player.session._source import Source
from fba_player.window._play import play
from fba_player.window._window import Window
from fba_player.window.surface import ACCENT, COMPILING, FUNCTIONS_TOLD, Surface, opening_picture

SOUND = files("fba") / "samples" / "hello.wav"

graphics.imported("glfw")
graphics.imported("imgui_bundle")

Step = Callable[[Window], None]


@pytest.fixture
def surface(on_display: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Surface]:
    monkeypatch.setenv("FBA_CONFIG", str(tmp_path / "settings"))
    with Surface((640, 480)) as one:
        try:
            one.open("first")
        except DisplayError as error:
            graphics.skip(f"no window on the virtual display: {error}")
        yield one


@pytest.fixture
def talk(talking: Animation, tmp_path: Path) -> Path:
    fba.write(tmp_path / "talk.fba", talking)
    return tmp_path / "talk.fba"


def played(monkeypatch: pytest.MonkeyPatch, what: Any, step: Step, **options: Any) -> tuple[Path, ...]:
    """Play something; `step` gets the window in place of a user, after some pictures."""

    def run(window: Window) -> None:
        for _ in range(3):
            assert window.update()
        step(window)

    monkeypatch.setattr(Window, "run", run)
    return play(what, **options)


def close(window: Window) -> None:
    window.session.leave()
    assert not window.update()


def change(path: Path, animation: Animation) -> None:
    """Write a file again; its time is another, whatever the file system's clock."""
    fba.write(path, animation)
    stat = path.stat()
    os.utime(path, ns=(stat.st_atime_ns, stat.st_mtime_ns + 2_000_000_000))


def test_scenes_follow_each_other_in_one_window(
    surface: Surface, talking: Animation, talk: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = surface.window
    dropped = played(monkeypatch, talking, lambda window: window.session.drop((talk,)), surface=surface)
    assert dropped == (talk,)
    seen: list[bool] = []

    def look(window: Window) -> None:
        seen.append(window._window is before)
        close(window)

    assert played(monkeypatch, fba.read(talk), look, surface=surface, file=talk) == ()
    assert seen == [True]
    assert Memory().recent == [talk]


def test_the_scene_is_made_once_the_window_is_there(
    surface: Surface, talking: Animation, monkeypatch: pytest.MonkeyPatch
) -> None:
    surface.close()
    made: list[bool] = []

    def make() -> Scene:
        made.append(surface.window is not None)
        return Scene(talking)

    played(monkeypatch, make, close, surface=surface, title="talk")
    assert made == [True]


def test_an_error_of_the_scene_closes_no_surface_of_others(
    surface: Surface, monkeypatch: pytest.MonkeyPatch
) -> None:
    def make() -> Scene:
        raise ValueError("no scene")

    with pytest.raises(ValueError, match="no scene"):
        play(make, surface=surface)
    assert surface.window is not None


def test_a_file_that_changes_is_shown_again_where_it_was(
    surface: Surface, talking: Animation, talk: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("fba_player.window._window.LOOK_SECONDS", 0.0)
    monkeypatch.setattr("fba_player.sound._player.open_audio", lambda *_, **__: None)  # no sound device

    def edit(window: Window) -> None:
        assert ["no sound device" in notice.text for notice in window.session.notices()] == [True]
        window.transport.seek(0.2)
        window.session.viewpoint.camera = window.session.viewpoint.camera.orbit(30, 0)
        window.session.open.add("view")
        window.session.zoom.zoom(0.5, 0.0)
        change(talk, talking[:9])
        for _ in range(50):
            if not window.update():
                return
        raise AssertionError("it does not look")

    cameras = []
    options = {"surface": surface, "file": talk, "paused": True, "audio": SOUND}
    assert played(monkeypatch, fba.read(talk), edit, **options) == (talk,)
    state = surface.resumed
    assert state.time == pytest.approx(0.2)

    def look(window: Window) -> None:
        session = window.session
        cameras.append(session.viewpoint.camera)
        assert session.transport.time == pytest.approx(0.2)
        assert not session.transport.playing
        assert "view" in session.open
        assert session.zoom.high - session.zoom.low == pytest.approx(0.18)
        assert ["changed on disk" in notice.text for notice in session.notices()] == [True]
        assert not told_early  # a notice that begins before a slow first picture is not read
        close(window)

    told_early: list[Notice] = []
    update = Window.update

    def first(window: Window) -> bool:
        if not window.pictures:
            told_early.extend(window.session.notices())
        return update(window)

    monkeypatch.setattr(Window, "update", first)
    assert played(monkeypatch, fba.read(talk), look, **options) == ()
    assert cameras == [state.view]
    assert surface.resumed is None


def test_unsaved_work_is_not_lost_to_a_file_that_changes(
    surface: Surface, talking: Animation, talk: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("fba_player.window._window.LOOK_SECONDS", 0.0)

    def edit(window: Window) -> None:
        window.session.unsaved.add("the last take")
        change(talk, talking[:9])
        for _ in range(4):
            assert window.update()
        assert "save or discard the last take" in window.session.notices()[-1].text
        window.session.unsaved.clear()
        close(window)

    assert played(monkeypatch, fba.read(talk), edit, surface=surface, file=talk, paused=True) == ()


def test_a_file_counts_as_changed_once_it_is_left_alone(talking: Animation, talk: Path) -> None:
    source = Source(Scene(talking), talk)
    assert not source.changed()
    change(talk, talking[:9])
    assert not source.changed()  # it may still be being written
    change(talk, talking[:8])
    os.utime(talk, ns=(1, talk.stat().st_mtime_ns + 7_000_000_000))
    assert not source.changed()
    assert source.changed()
    assert not source.changed()  # told once
    talk.unlink()
    assert not source.changed()


def test_hints_are_shown_once(surface: Surface, talking: Animation, monkeypatch: pytest.MonkeyPatch) -> None:
    greeted: list[bool] = []

    def look(window: Window) -> None:
        greeted.append(window.session.greets)
        window.session.open.add("help")
        assert window.update()
        greeted.append(window.session.greets)
        close(window)

    played(monkeypatch, talking, look, surface=surface)
    played(monkeypatch, talking, look, surface=surface)
    assert greeted == [True, False, False, False]


def test_a_window_of_its_own_remembers_nothing(
    surface: Surface, talking: Animation, talk: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    surface.close()

    def look(window: Window) -> None:
        assert not window.session.greets
        assert not window.follows_file
        close(window)

    played(monkeypatch, talking, look, file=talk)
    assert not (tmp_path / "settings").exists()


def test_the_demo_goes_from_the_face_to_the_body(
    surface: Surface, walking: Animation, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("fba_player.session._camera_controller.FACE_SECONDS", 0.0)
    monkeypatch.setattr("fba_player.session._camera_controller.LEAVING_SECONDS", 1e-6)

    def look(window: Window) -> None:
        viewpoint = window.session.viewpoint
        whole = viewpoint.beginning
        for _ in range(3):
            assert window.update()
        assert viewpoint.camera.distance == pytest.approx(whole.distance, rel=0.01)
        assert window.session.life is not None
        close(window)

    played(monkeypatch, walking, look, surface=surface, life=True, from_face=True)


def test_from_the_face_it_stays_where_somebody_has_turned_it(walking: Animation) -> None:
    from fba_player.session._camera_controller import FACE_SECONDS, Viewpoint
    from set_clock import Clock

    clock = Clock()
    viewpoint = Viewpoint(Scene(walking), 16 / 9, clock=clock)
    whole = viewpoint.camera
    viewpoint.begin_with_face()
    near = viewpoint.camera_without_panels(0.0)
    assert near.distance < whole.distance / 2
    viewpoint.camera = viewpoint.camera.orbit(20, 0)
    clock.now += FACE_SECONDS + 0.1
    viewpoint.camera_without_panels(0.0)
    clock.now += 5
    assert viewpoint.camera.distance == pytest.approx(near.distance)
    viewpoint.begin_with_face()
    viewpoint.camera_without_panels(0.0)
    clock.now += FACE_SECONDS + 0.1
    viewpoint.camera_without_panels(0.0)
    clock.now += 5
    assert viewpoint.camera.distance == pytest.approx(whole.distance)


def test_the_opening_page_says_what_is_prepared_and_how_far(
    surface: Surface, talking: Animation, monkeypatch: pytest.MonkeyPatch
) -> None:
    told: list[tuple[str, str, float]] = []

    def picture(size: tuple[int, int], scale: float, name: str, step: str, done: float) -> UInt8:
        told.append((name, step, done))
        return opening_picture(size, scale, name, step, done)

    def make() -> Scene:
        for _ in range(FUNCTIONS_TOLD):
            announce_compilation()
        return Scene(talking)

    monkeypatch.setattr("fba_player.window.surface.opening_picture", picture)
    played(monkeypatch, make, lambda _: announce_compilation(), surface=surface, title="talk")
    steps, shares = [step for _, step, _ in told], [share for *_, share in told]
    assert {name for name, *_ in told} == {"talk"}
    assert shares == sorted(shares)
    assert len(set(steps)) == len(steps) >= 4
    assert COMPILING.format(FUNCTIONS_TOLD) in steps  # not the one after the first picture
    assert COMPILING.format(FUNCTIONS_TOLD + 1) not in steps


def test_a_window_closed_while_it_opens_shows_nothing_more(
    surface: Surface, talking: Animation, monkeypatch: pytest.MonkeyPatch
) -> None:
    def make() -> Scene:
        surface.glfw.set_window_should_close(surface.window, True)  # as a click does
        return Scene(talking)

    shown: list[Window] = []
    assert played(monkeypatch, make, shown.append, surface=surface) == ()
    assert not shown
    assert played(monkeypatch, talking, shown.append, surface=surface) == ()
    assert not shown  # nor what follows
    surface.open("again")
    played(monkeypatch, lambda: Scene(talking), shown.append, surface=surface)
    assert len(shown) == 1


@pytest.mark.parametrize(("size", "scale"), [((640, 480), 1.0), ((1280, 960), 2.0), ((90, 40), 1.0)])
def test_the_opening_page_has_its_parts(size: tuple[int, int], scale: float) -> None:
    half, whole = (
        opening_picture(size, scale, "a name as long as nobody gives", "step", done) for done in (0.5, 1.0)
    )
    assert half.shape == whole.shape == (size[1], size[0], 4)
    lit = [(page[..., :3] == ACCENT).all(axis=2).any(axis=0).sum() for page in (half, whole)]
    assert lit[1] == pytest.approx(220 * scale if size[1] > 40 else 0, abs=2)
    assert lit[0] == pytest.approx(lit[1] / 2, abs=2)
    assert (half[-1, :, :3] == half[-1, ::-1, :3]).all()
    assert half[-1].mean() > half[0].mean()  # lit from above

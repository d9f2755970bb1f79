"""The page for placing feature points: its inside drawn into memory, and one run of the window."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import graphics
from fba.errors import DisplayError
from fba.face.importers.head_surface import HeadSurface, read_head_surface
from fba.face.importers.points.points_file import read_points
from fba.parameters import point_rows
from fba_player.scene._placement_scene import CURRENT, PlacementScene
from fba_player.scene._point_placement import PointPlacement
from fba_player.session._session import Session
from mesh_files import write_obj
from open_windows import or_skip, press, settle
from small_head import small_head

glfw = graphics.imported("glfw")
graphics.imported("imgui_bundle")

from fba_player.window.pages import check_page, open_placement  # noqa: E402
from studio_hand import StudioHand  # noqa: E402
from tools.window_picture import Studio  # noqa: E402 - needs imgui

SIZE = (640, 480)


@pytest.fixture(scope="module")
def surface(tmp_path_factory: pytest.TempPathFactory) -> HeadSurface:
    path = tmp_path_factory.mktemp("head") / "head.obj"
    write_obj(path, small_head().parts)
    return read_head_surface(path)


@pytest.fixture
def studio(opengl: None, surface: HeadSurface, tmp_path: Path) -> Iterator[Studio]:
    session = Session(PlacementScene(PointPlacement(surface, tmp_path / "points.csv")), size=SIZE)
    session.open.add("points")
    with Studio(session) as made:
        made.draw(4)
        yield made


def placement_of(session: Session) -> PointPlacement:
    assert isinstance(session.scene, PlacementScene)
    return session.scene.placement


def pixel_of(session: Session, name: str) -> tuple[float, float]:
    """Where a feature point of the small head is in the picture."""
    scene, camera = session.scene, session.camera(0.0)
    assert isinstance(scene, PlacementScene)
    head = small_head()
    world = np.append(scene.to_world(head.points[point_rows()[name]][None].astype(float))[0], 1.0)
    clip = camera.projection_matrix(SIZE[0] / SIZE[1]) @ camera.view_matrix() @ world
    seen = clip[:2] / clip[3]
    return float((seen[0] + 1) * SIZE[0] / 2), float((1 - seen[1]) * SIZE[1] / 2)


def test_a_click_places_a_point_and_a_drag_turns_the_head(studio: Studio) -> None:
    session, placement = studio.session, placement_of(studio.session)
    placement.choose("9.3")
    at = pixel_of(session, "9.3")
    camera = session.viewpoint.camera
    StudioHand(studio).drag(at, (at[0] + 2, at[1]))
    assert placement.places["9.3"] == small_head().bound[point_rows()["9.3"]]
    assert session.viewpoint.camera == camera
    assert session.unsaved == {"the points"}
    before = dict(placement.places)
    StudioHand(studio).drag(at, (at[0] + 40, at[1]))
    assert session.viewpoint.camera.yaw < -5
    assert placement.places == before
    StudioHand(studio).drag((3, 3), (3, 3))  # beside the head
    assert placement.places == before
    assert "Click on the head" in session.notices()[-1].text


def test_the_current_point_is_drawn_and_the_player_s_bar_is_not(studio: Studio) -> None:
    session, placement = studio.session, placement_of(studio.session)
    blue = np.array([round(255 * one) for one in CURRENT[:3]])

    def blue_near_nose() -> int:
        x, y = (round(one) for one in pixel_of(session, "9.3"))
        near = studio.draw(2)[y - 6 : y + 7, x - 6 : x + 7, :3].astype(int)
        return int((np.abs(near - blue).max(axis=2) < 40).sum())

    placement.choose("9.3")
    placement.places.pop("9.3", None)
    assert blue_near_nose() < 5
    placement.place(int(small_head().bound[point_rows()["9.3"]]))
    assert blue_near_nose() > 20
    assert studio.draw(2)[440:, :300, :3].mean() > 90  # the background, where the bar would be dark


def test_the_list_stays_open(studio: Studio) -> None:
    studio.session.open.clear()
    studio.draw(3)
    assert studio.session.open == {"points"}


def test_keys_work_through_the_points(on_display: str, surface: HeadSurface, tmp_path: Path) -> None:
    placement = PointPlacement(surface, tmp_path / "points.csv")
    with or_skip(lambda: open_placement(placement, size=SIZE)) as window:
        settle(window)
        head = small_head().bound
        first = placement.names
        press(window, glfw.KEY_DOWN)
        assert placement.current == first[1]
        press(window, glfw.KEY_UP)
        press(window, glfw.KEY_UP)
        assert placement.current == first[-1]
        press(window, glfw.KEY_SPACE)
        assert placement.current == placement.missing[0]
        placement.choose("8.3")
        window.controls.press("left", *pixel_of(window.session, "8.3"))
        window.controls.release()
        assert placement.places["8.3"] == head[point_rows()["8.3"]]
        press(window, glfw.KEY_M)
        assert placement.places["8.4"] == head[point_rows()["8.4"]]
        press(window, glfw.KEY_Z, glfw.MOD_CONTROL)
        assert "8.4" not in placement.places
        press(window, glfw.KEY_M, glfw.MOD_CONTROL)
        assert placement.places["8.4"] == head[point_rows()["8.4"]]
        press(window, glfw.KEY_P)  # of the player, which has no meaning here
        press(window, glfw.KEY_F2)
        assert window.session.open == {"points"}
        press(window, glfw.KEY_Q)
        assert not window.session.closing  # not saved
        press(window, glfw.KEY_S, glfw.MOD_CONTROL)
        assert read_points(placement.path).vertices["8.4"] == head[point_rows()["8.4"]]
        press(window, glfw.KEY_DELETE)
        assert "8.3" not in placement.places
        press(window, glfw.KEY_Z, glfw.MOD_CONTROL)
        press(window, glfw.KEY_Q)
        assert window.session.closing
        assert not window.update()


def test_an_unwritable_file_is_said_in_the_window(surface: HeadSurface, tmp_path: Path) -> None:
    from fba_player.session._pages import PLACING

    placement = PointPlacement(surface, tmp_path / "nowhere" / "points.csv")
    session = Session(PlacementScene(placement), size=SIZE)
    assert PLACING.press_key(session, "ctrl+s")
    assert session.notices()[-1].text.startswith("Not saved: ")
    assert not placement.written
    assert not PLACING.press_key(session, "p")


@pytest.mark.parametrize(
    ("subject", "instead"),
    [
        ("points", "lines 'name,vertex'.*'name,x,y,z'"),
        ("markers", "-o FILE.png"),
        ("photos", "write the file by hand"),
    ],
)
def test_without_a_display_or_imgui_it_says_how_to_do_without(
    monkeypatch: pytest.MonkeyPatch, subject: str, instead: str
) -> None:
    monkeypatch.setenv("DISPLAY", ":990")
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with pytest.raises(DisplayError, match=f"no window can be opened.*{instead}"):
        check_page(subject)
    monkeypatch.setitem(sys.modules, "imgui_bundle", None)
    with pytest.raises(DisplayError, match=f"{subject} needs imgui.*{instead}"):
        check_page(subject)

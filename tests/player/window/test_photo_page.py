"""The page for points on photographs: points are dragged, placed and saved."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import graphics
from fba.face.fitting import Photograph, read_photo_points
from fba_player.scene._photo_scene import PhotoEditing, PhotoScene
from fba_player.session._pages import PHOTOS
from fba_player.session._session import Session
from fba_player.view._geometry import project

graphics.imported("glfw")
graphics.imported("imgui_bundle")

from studio_hand import StudioHand  # noqa: E402
from tools.window_picture import Studio  # noqa: E402 - needs imgui

SIZE = (640, 480)


def editing_in(folder: Path) -> PhotoEditing:
    pixels = np.full((200, 160, 3), (180, 60, 60), dtype=np.uint8)
    photographs = [Photograph(pixels, (320, 400), "front.jpg"), Photograph(pixels, (160, 200), "side.jpg")]
    places = {"front": {"3.5": (200.0, 150.0), "9.3": (160.0, 220.0)}, "side": {"9.3": (20.0, 110.0)}}
    return PhotoEditing(photographs, places, folder / "points.json")


@pytest.fixture
def studio(opengl: None, tmp_path: Path) -> Iterator[Studio]:
    session = Session(PhotoScene(editing_in(tmp_path)), size=SIZE)
    session.open.add("photos")
    with Studio(session) as made:
        made.draw(4)
        yield made


def scene_of(session: Session) -> PhotoScene:
    assert isinstance(session.scene, PhotoScene)
    return session.scene


def pixel_of(session: Session, item: str, spot: tuple[float, float]) -> tuple[float, float]:
    scene = scene_of(session)
    matrix = session.camera(0.0).clip_matrix(SIZE)
    x, y = project(scene.to_world(item, spot)[None], matrix, SIZE)[0][0]
    return float(x), float(y)


def test_points_are_dragged_and_clicks_place_them(studio: Studio) -> None:
    session, editing = studio.session, scene_of(studio.session).editing
    camera = session.viewpoint.camera
    StudioHand(studio).drag(
        pixel_of(session, "front 9.3", (160, 220)), pixel_of(session, "front 9.3", (120, 260))
    )
    assert editing.current == "front 9.3"
    assert editing.state["front 9.3"] == pytest.approx((120, 260), abs=1)
    assert session.viewpoint.camera == camera
    assert session.unsaved == {"the points"}
    editing.choose("side 2.10")
    at = pixel_of(session, "side 2.10", (100, 30))
    StudioHand(studio).drag(at, at)
    assert editing.state["side 2.10"] == pytest.approx((100, 30), abs=1)
    assert PHOTOS.press_key(session, "ctrl+z")
    assert "side 2.10" not in editing.state
    assert PHOTOS.press_key(session, "ctrl+z")
    assert editing.state["front 9.3"] == (160.0, 220.0)
    StudioHand(studio).drag(
        pixel_of(session, "front 9.3", (40, 40)), pixel_of(session, "front 9.3", (60, 60))
    )
    assert session.viewpoint.camera.target != camera.target  # the picture was moved, not turned
    assert session.viewpoint.camera.yaw == camera.yaw
    assert editing.state["front 9.3"] == (160.0, 220.0)


def test_the_photographs_and_their_points_are_drawn(studio: Studio) -> None:
    session = studio.session
    shown = studio.draw(2)[..., :3].astype(int)
    x, y = (round(one) for one in pixel_of(session, "front 3.5", (60, 60)))
    red, green, blue = shown[y, x]
    assert red > green + 40 < blue + 80
    x, y = (round(one) for one in pixel_of(session, "front 9.3", (160, 220)))
    near = shown[y - 5 : y + 6, x - 5 : x + 6]
    assert (np.abs(near - shown[y + 40, x]).max(axis=2) > 50).sum() > 10


def test_points_are_saved(studio: Studio) -> None:
    session, editing = studio.session, scene_of(studio.session).editing
    assert PHOTOS.press_key(session, "ctrl+s")
    assert editing.written
    assert read_photo_points(editing.path) == editing.by_view()
    assert PHOTOS.press_key(session, "delete")
    assert PHOTOS.press_key(session, "space")
    assert editing.current in editing.missing
    assert not PHOTOS.press_key(session, "p")

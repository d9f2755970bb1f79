"""The page for mapping markers: what it draws, clicks, keys and its panel, and one run of the window."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import graphics
from fba.capture.markers._motion import MarkerMotion
from fba.capture.markers._targets import target_points
from fba.capture.virtual_markers import MarkedHead, MarkerMapping, propose_mapping, read_head, read_mapping
from fba.errors import OptionError
from fba_player.scene.marker_editing import MarkerEditing
from fba_player.scene.markers_scene import CURRENT, MarkersScene
from fba_player.session._session import Session
from mesh_files import write_obj
from open_windows import or_skip, press, settle
from small_head import small_head

glfw = graphics.imported("glfw")
graphics.imported("imgui_bundle")

from fba_player.window.pages import open_markers  # noqa: E402
from studio_hand import StudioHand  # noqa: E402
from tools.window_picture import Studio  # noqa: E402 - needs imgui

SIZE = (900, 560)
MARKED = ("2.1", "2.10", "4.1", "4.2", "5.1", "5.2", "8.1", "8.2", "8.3", "8.4", "9.3", "11.1", "11.2",
          "11.3", "l_tragion", "r_tragion")  # fmt: skip


@cache
def motion() -> MarkerMotion:
    """Markers at points of the small head; that of the lower lip goes down by 8 mm."""
    places = target_points(small_head().points)
    positions = np.repeat(np.array([places[name] for name in MARKED])[None], 30, axis=0)
    positions[15:, MARKED.index("8.2"), 1] -= 0.008
    return MarkerMotion(MARKED, positions, np.arange(30) / 50, Fraction(50), "m", "+y", "lip")


@pytest.fixture(scope="module")
def head(tmp_path_factory: pytest.TempPathFactory) -> MarkedHead:
    path = tmp_path_factory.mktemp("head") / "head.obj"
    write_obj(path, small_head().parts)
    return read_head(path, points=small_head().points)


@cache
def proposed(head: MarkedHead) -> MarkerMapping:
    return propose_mapping(motion(), head)


@pytest.fixture
def editing(head: MarkedHead, tmp_path: Path) -> MarkerEditing:
    return MarkerEditing(motion(), head, proposed(head), tmp_path / "mapping.toml")


@pytest.fixture
def studio(opengl: None, editing: MarkerEditing) -> Iterator[Studio]:
    session = Session(MarkersScene(editing), size=SIZE)
    session.open.add("markers")
    with Studio(session) as made:
        made.draw(4)
        yield made


def pixel_of(session: Session, place: np.ndarray) -> tuple[float, float]:
    camera = session.camera(session.transport.time)
    clip = camera.projection_matrix(SIZE[0] / SIZE[1]) @ camera.view_matrix() @ np.append(place, 1.0)
    seen = clip[:2] / clip[3]
    return float((seen[0] + 1) * SIZE[0] / 2), float((1 - seen[1]) * SIZE[1] / 2)


def on_head(session: Session, vertex: int) -> tuple[float, float]:
    scene = session.scene
    assert isinstance(scene, MarkersScene)
    return pixel_of(session, scene.to_world(scene.editing.head.vertices[vertex]))


def in_cloud(session: Session, name: str) -> tuple[float, float]:
    scene = session.scene
    assert isinstance(scene, MarkersScene)
    return pixel_of(session, scene._cloud(0, 0, 0.0)[MARKED.index(name)])


def test_clicks_choose_a_marker_and_put_it_on_the_head(studio: Studio, editing: MarkerEditing) -> None:
    session = studio.session
    StudioHand(studio).click(*in_cloud(session, "8.2"))
    assert editing.current == "8.2"
    before = editing.mapping.markers["8.2"]
    camera = session.viewpoint.camera
    bound = small_head().bound
    assert before.vertex is not None
    centres = editing.head.vertices[[one.vertex for one in editing.mapping.centres.values() if one.vertex]]
    front = [vertex for vertex in editing.head.face if editing.head.vertices[vertex, 2] > 0]
    apart = np.linalg.norm(editing.head.vertices[front][:, None, :2] - centres[None, :, :2], axis=2)
    free = front[int(apart.min(axis=1).argmax())]
    StudioHand(studio).click(*on_head(session, int(free)))
    assert editing.mapping.markers["8.2"].vertex != before.vertex
    assert editing.mapping.markers["8.2"].radius == before.radius
    assert session.unsaved == {"the mapping"}
    assert session.viewpoint.camera == camera
    assert editing.undo()
    assert editing.mapping.markers["8.2"] == before
    other = editing.mapping.markers["9.3"].vertex
    assert other == bound[small_row("9.3")]
    StudioHand(studio).click(*on_head(session, int(other)))  # on the dot of another: chooses it
    assert editing.current == "9.3"
    StudioHand(studio).click(3, SIZE[1] - 200)
    assert "Click on a marker" in session.notices()[-1].text


def small_row(name: str) -> int:
    from fba.parameters import point_rows

    return point_rows()[name]


def test_the_head_moves_as_the_marker_and_shows_its_reach(studio: Studio, editing: MarkerEditing) -> None:
    session, scene = studio.session, studio.session.scene
    assert isinstance(scene, MarkersScene)
    assert editing.performance is not None
    rest, moved = (scene.view_at(time).faces[0].positions for time in (0.0, 0.5))
    assert float((moved - rest)[:, 1].min()) == pytest.approx(-0.008, rel=0.1)
    vertex = editing.mapping.markers["8.2"].vertex
    assert vertex is not None
    editing.choose("8.2")
    x, y = (round(one) for one in on_head(session, vertex))
    painted = studio.draw(2)[y - 12 : y + 13, x - 12 : x + 13, :3].astype(int)
    blue = np.array([round(255 * one) for one in CURRENT[:3]])
    assert (np.abs(painted - blue).max(axis=2) < 40).sum() > 20
    assert (painted[..., 0] - painted[..., 2] > 60).sum() > 20  # red to yellow near the centre
    editing.shows_weights = False
    plain = studio.draw(2)[y - 12 : y + 13, x - 12 : x + 13, :3].astype(int)
    assert (plain[..., 0] - plain[..., 2] > 60).sum() < 10


def test_over_the_head_the_cloud_is_where_it_was_captured(editing: MarkerEditing) -> None:
    scene = MarkersScene(editing)
    beside = scene._cloud(0, 0, 0.0)
    editing.beside = False
    over = scene._cloud(0, 0, 0.0)
    assert (beside - over)[0, 0] < -0.1
    placed = {name: one for name, one in editing.mapping.centres.items() if not one.follows}
    assert set(MARKED) - set(placed) == {"l_tragion", "r_tragion"}  # this head is a mask without ears
    centres = scene.to_world(editing.head.vertices[[one.vertex or 0 for one in placed.values()]])
    assert np.abs(over[[MARKED.index(name) for name in placed]] - centres).max() < 0.004
    assert len(scene.view_at(0.0).extras.dots) == 4  # type: ignore[union-attr]
    scene.place_cloud("none")
    scene.shows_current = False
    assert scene.view_at(0.0).extras.dots == ()  # type: ignore[union-attr]


def test_changes_are_made_undone_and_saved(editing: MarkerEditing, head: MarkedHead) -> None:
    editing.choose("8.2")
    for size in (0.011, 0.012, 0.013):  # a slider that is dragged is one step
        editing.resize(size, 0.02)
    assert editing.mapping.markers["8.2"].radius == 0.013
    reach = editing.influence
    editing.assign("exclusive")
    alone = editing.influence
    assert len(alone.vertices) < len(reach.vertices)
    editing.add_up("add")
    editing.fix(True)
    assert not editing.performance.displacements[:, editing.performance.names.index("8.2")].any()
    editing.save()
    saved = read_mapping(editing.path or "")
    assert saved == editing.mapping.for_head(head)
    assert not editing.changed
    assert [editing.undo() for _ in range(5)] == [True] * 4 + [False]
    assert editing.mapping == proposed(head)
    editing.path = None
    with pytest.raises(OptionError, match="no file was named"):
        editing.save()


def test_a_mapping_begun_by_hand_says_what_it_lacks(head: MarkedHead) -> None:
    editing = MarkerEditing(motion(), head, MarkerMapping())
    assert editing.performance is None
    assert "needs 3 fixed markers" in editing.problem
    scene = MarkersScene(editing)
    assert len(scene.view_at(0.0).faces) == len(head.parts)
    assert np.isfinite(scene._cloud(0, 0, 0.0)).all()
    for name in ("11.1", "11.2", "11.3"):
        editing.choose(name)
        editing.fix(True)
    assert editing.performance is None
    assert "all markers of the mapping are fixed" in editing.problem
    for name in ("11.1", "11.2", "11.3", "8.2"):
        editing.choose(name)
        vertex = proposed(head).markers[name].vertex
        assert vertex is not None
        editing.place(vertex)
    assert editing.performance is not None
    assert (editing.problem, editing.mapping.fixed) == ("", ("11.1", "11.2", "11.3"))
    editing.next_missing()
    assert editing.current not in editing.mapping.markers
    editing.fix(False)
    editing.remove()
    with pytest.raises(ValueError, match="no marker 'Hat'"):
        editing.choose("Hat")


def test_a_gap_hides_the_marker(editing: MarkerEditing, head: MarkedHead) -> None:
    positions = motion().positions.copy()
    positions[3:9, MARKED.index("8.2")] = np.nan
    gappy = MarkerEditing(replace(motion(), positions=positions), head, proposed(head))
    gappy.choose("8.2")
    scene = MarkersScene(gappy)
    assert scene.view_at(0.0).extras.lines  # type: ignore[union-attr]
    assert not scene.view_at(0.1).extras.lines  # type: ignore[union-attr]
    assert np.isfinite(scene.view_at(0.1).faces[0].positions).all()


def test_keys_of_the_window(on_display: str, editing: MarkerEditing) -> None:
    with or_skip(lambda: open_markers(editing, "face.csv on head.obj", size=SIZE)) as window:
        settle(window)
        editing.choose("8.2")
        press(window, glfw.KEY_DOWN)
        assert editing.current == "8.3"
        press(window, glfw.KEY_UP)
        press(window, glfw.KEY_X)
        assert editing.mapping.markers["8.2"].fixed
        press(window, glfw.KEY_Z, glfw.MOD_CONTROL)
        assert not editing.mapping.markers["8.2"].fixed
        press(window, glfw.KEY_O)
        press(window, glfw.KEY_W)
        assert (editing.beside, editing.shows_weights) == (False, False)
        press(window, glfw.KEY_SPACE)
        assert window.transport.playing
        press(window, glfw.KEY_SPACE)
        press(window, glfw.KEY_F2)  # panels of the player have no meaning here
        assert window.session.open == {"markers"}
        press(window, glfw.KEY_DELETE)
        assert "8.2" not in editing.mapping.markers
        press(window, glfw.KEY_ENTER)
        assert editing.current == "8.2"
        press(window, glfw.KEY_Q)
        assert not window.session.closing  # not saved
        press(window, glfw.KEY_S, glfw.MOD_CONTROL)
        assert "8.2" not in read_mapping(editing.path or "").markers
        settle(window)
        press(window, glfw.KEY_Q)
        assert window.session.closing

"""Keys and mouse, without a window; the table of keys and its documentation."""

import math
import re
from pathlib import Path

import numpy as np
import pytest

import graphics
from fba.animation import Animation
from fba_player.scene.compare import CompareScene
from fba_player.scene.scene import SWITCHES, Scene
from fba_player.session._camera_controller import GLIDE_SECONDS
from fba_player.session._controls import Controls
from fba_player.session._keys import by_name, key_of, keys, mouse
from fba_player.session._memory import Memory
from fba_player.session._session import Session
from fba_player.view._camera import Camera, Subject


@pytest.fixture
def controls(talking: Animation) -> Controls:
    return Controls(Session(Scene(talking), size=(1000, 600)), plain=True)


def test_the_line_of_a_wipe_is_dragged(talking: Animation) -> None:
    scene = CompareScene([Scene(talking), Scene(talking)], arrangement="wipe")
    session = Session(scene, size=(1000, 600))
    controls = Controls(session, plain=True)
    before = session.viewpoint.camera
    for start, end, found in ((505, 700, 0.7), (690, 1400, 1.0), (999, -5, 0.0)):
        controls.press("left", start, 200)
        controls.move(end, 220)
        controls.release()
        assert scene.wipe == pytest.approx(found)
        assert session.viewpoint.camera == before
    controls.press("left", 500, 200)  # elsewhere, it turns the camera
    controls.move(600, 200)
    assert (scene.wipe, session.viewpoint.camera.yaw) != (0.0, before.yaw)
    assert scene.wipe == 0.0
    scene.wipe = 0.5
    session.viewpoint.uncover(0.0, 0.3)  # a panel opens: the figures move, and the line with them
    assert scene.wipe == pytest.approx(0.35)
    session.viewpoint.uncover(0.0, 0.0)
    assert scene.wipe == pytest.approx(0.5)


def test_keys_drive_the_transport(controls: Controls) -> None:
    transport = controls.session.transport
    controls.key("right")
    assert transport.frame == 1
    controls.key("end")
    assert transport.frame == 9
    controls.key("left")
    assert transport.frame == 8
    controls.key("home")
    assert transport.frame == 0
    controls.key("space")
    assert transport.playing
    controls.key("s")
    assert not transport.playing
    controls.key("+")
    assert transport.speed == 1.25
    controls.key("0")
    assert transport.speed == 1.0
    loop = transport.loop
    controls.key("l")
    assert transport.loop is not loop
    controls.key("i")
    assert not transport.interpolate


def test_keys_set_and_clear_the_marks(controls: Controls) -> None:
    transport = controls.session.transport
    transport.seek(0.12)
    controls.key("[")
    controls.key("end")
    controls.key("]")
    assert (transport.mark_in, transport.mark_out) == (0.12, 0.36)
    controls.key("\\")
    assert (transport.mark_in, transport.mark_out) == (None, None)


def test_only_some_keys_repeat_while_held(controls: Controls) -> None:
    assert controls.key("right", held=True)
    assert controls.session.transport.frame == 1
    assert not controls.key("space", held=True)
    assert not controls.session.transport.playing
    assert not controls.key("w", held=True)


def test_who_finds_the_lanes_is_greeted_no_more(controls: Controls, tmp_path: Path) -> None:
    controls.session.memory = Memory(tmp_path)
    controls.key("t")
    assert controls.session.lanes == "all"
    assert Memory(tmp_path).welcomed


def test_panels_closing_and_wishes(controls: Controls) -> None:
    session = controls.session
    controls.key("f2")
    assert session.open == {"file"}
    controls.key("h")
    assert session.bare
    controls.key("f2")  # shows all again, and what was asked for
    assert not session.bare
    assert session.open == {"file"}
    controls.key("f2")
    assert session.open == set()
    controls.key("f12")
    controls.key("ctrl+shift+s")
    controls.key("ctrl+r")
    assert list(session.requests) == ["screenshot", "transparent", "record"]
    assert not controls.key("x")
    assert not session.closing
    controls.key("q")
    assert session.closing


def test_every_key_of_the_table_does_something(controls: Controls) -> None:
    for name, row in by_name().items():
        assert controls.key(name), (name, row.action)


def test_no_switch_has_a_key_of_the_window() -> None:
    taken = [one.name for one in SWITCHES.values() if one.key.lower() in by_name()]
    assert taken == []


def test_keys_of_switches_press_them(controls: Controls) -> None:
    assert controls.session.scene.switches["wireframe"] is False
    assert controls.key("w")
    assert controls.session.scene.switches["wireframe"] is True
    assert [notice.text for notice in controls.session.notices()] == ["wireframe: on"]


def test_the_timeline_seeks_by_click_and_drag(controls: Controls) -> None:
    low, high = controls.bar()
    session = controls.session
    controls.press("left", (low + high) / 2, 590)
    assert session.transport.share == pytest.approx(0.5)
    camera = session.viewpoint.camera
    controls.move(high + 200, 100)  # dragged off the bar it still seeks
    assert session.transport.share == 1.0
    controls.release()
    controls.move(low, 595)
    assert session.transport.share == 1.0
    assert session.viewpoint.camera == camera


def test_the_mouse_moves_the_camera(talking: Animation) -> None:
    now = [0.0]
    session = Session(Scene(talking), size=(1000, 600), clock=lambda: now[0])
    controls, viewpoint = Controls(session), session.viewpoint
    before = viewpoint.camera
    controls.press("left", 500, 300)
    controls.move(600, 330)
    controls.release()
    assert viewpoint.camera.yaw == pytest.approx(before.yaw - 35)
    assert viewpoint.camera.pitch == pytest.approx(before.pitch + 10.5)
    controls.press("right", 500, 300)
    controls.move(500, 400)
    controls.release()
    assert viewpoint.camera.target[1] > before.target[1]
    controls.scroll(1)
    assert viewpoint.camera.distance == pytest.approx(before.distance * 0.9)
    controls.key("r")
    assert viewpoint.camera != before  # on its way
    now[0] += GLIDE_SECONDS
    assert viewpoint.camera == before
    controls.key("3")
    now[0] += GLIDE_SECONDS
    assert viewpoint.camera.yaw == 90


def test_a_drag_from_the_bar_turns_nothing_where_there_are_panels(talking: Animation) -> None:
    session = Session(Scene(talking), size=(1000, 600))
    controls = Controls(session)
    controls.press("left", 500, 590)
    assert session.transport.time == 0.0
    assert controls.holding


def test_camera_looks_where_it_should() -> None:
    front = Camera(target=(0, 1, 0), distance=2)
    np.testing.assert_allclose(front.eye, [0, 1, 2])
    np.testing.assert_allclose(Camera(yaw=90, distance=2).eye, [2, 0, 0], atol=1e-12)  # the subject's left
    np.testing.assert_allclose(Camera(pitch=30, distance=2).eye, [0, 1, math.sqrt(3)], atol=1e-12)
    clip = front.projection_matrix(1.5) @ front.view_matrix() @ [0, 1, 0, 1]
    np.testing.assert_allclose(clip[:2] / clip[3], [0, 0], atol=1e-12)
    left = front.projection_matrix(1.5) @ front.view_matrix() @ [0.1, 1.1, 0, 1]
    assert left[0] / left[3] > 0  # the subject's left is on the right of a picture from the front
    assert left[1] / left[3] > 0


@pytest.mark.parametrize("aspect", [0.5, 1.0, 16 / 9])
@pytest.mark.parametrize("preset", ["front", "three-quarter", "profile", "body"])
def test_presets_have_the_subject_in_view(preset: str, aspect: float) -> None:
    subject = Subject((0.5, 1.0, -0.3), 0.8, 0.6)
    camera = Camera.preset(preset, subject, aspect)
    matrix = camera.projection_matrix(aspect) @ camera.view_matrix()
    for offset in ((0, 0.8, 0), (0, -0.8, 0)):
        clip = matrix @ [*(np.array(subject.centre) + offset), 1]
        assert abs(clip[1] / clip[3]) <= 1.05
        assert abs(clip[1] / clip[3]) > 0.3 or aspect < 1


def test_camera_limits() -> None:
    camera = Camera().orbit(720 + 200, 500)
    assert (camera.yaw, camera.pitch) == (-160, 89)
    for _ in range(200):
        camera = camera.zoom(0.5)
    assert camera.distance == 0.05
    with pytest.raises(ValueError, match="three-quarter"):
        Camera.preset("behind", Subject((0, 0, 0), 1, 1))


ROOT = Path(__file__).parents[3]


def documented() -> list[tuple[str, str]]:
    text = (ROOT / "docs" / "play.md").read_text(encoding="utf-8")
    part = re.split(r"^## ", text, flags=re.MULTILINE)
    section = next(one for one in part if one.startswith("Keys and mouse"))
    rows = re.findall(r"^\| (.+?) \| (.+?) \|$", section, flags=re.MULTILINE)
    return [(keys.replace("`", ""), does) for keys, does in rows]


def test_the_documentation_has_every_key_in_order() -> None:
    wanted = [(row.shown, row.does) for row in keys()]
    wanted += [(one.key, one.label) for one in SWITCHES.values() if one.key]
    assert documented() == wanted + list(mouse())


def test_no_key_does_two_things() -> None:
    names = [name.lower() for row in keys() for name in row.keys]
    assert len(names) == len(set(names)) == len(by_name())


def test_keys_are_shown_as_people_write_them() -> None:
    assert key_of("toggle") == "Space"
    assert key_of("transparent") == "Shift+F12"
    assert key_of("faster") == "+"
    assert key_of("panel file") == "F2"
    assert key_of("no such thing") == ""
    assert [row.shown for row in keys() if row.action == "fullscreen"] == ["F, F11"]


def test_every_panel_has_a_key_and_every_key_its_panel() -> None:
    graphics.imported("imgui_bundle")
    from fba_player._ui.panels.registry import make_panels

    panels = [panel.name for panel in make_panels()]
    opened = [row.action.removeprefix("panel ") for row in keys() if row.action.startswith("panel ")]
    assert sorted(panels) == sorted(opened)
    assert len(set(panels)) == len(panels)

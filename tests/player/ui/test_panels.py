"""The panels over the picture, drawn into memory; the mouse is imgui's own queue of events."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import fba
import graphics
from fba.animation import Animation
from fba_player.playback._transport import Transport
from fba_player.scene.scene import Scene
from fba_player.session._memory import Memory
from fba_player.session._session import Session
from fba_player.session._source import Source
from fba_player.view.switches import Quality
from set_clock import Clock

imgui = graphics.imported("imgui_bundle").imgui

from studio_hand import StudioHand  # noqa: E402
from tools.window_picture import Studio  # noqa: E402 - needs imgui

SIZE = (900, 600)


@pytest.fixture
def studio(opengl: None, talking: Animation, tmp_path: Path, clock: Clock) -> Iterator[Studio]:
    """A window's inside that shows a stream from a file, ten frames at 25 a second."""
    path = tmp_path / "talk.fba"
    fba.write(path, talking)
    scene = Scene(talking)
    session = Session(
        scene, Transport(scene.timeline, clock=clock), source=Source(scene, path), size=SIZE, clock=clock
    )
    session.source.probe(wait=True)
    with Studio(session) as made:
        made.gui.hides = True
        made.draw(4)
        yield made


def place(studio: Studio, share: float) -> tuple[float, float]:
    """A point of the timeline: 0 the first frame, 1 the last."""
    left, top, right, bottom = studio.gui.bar.area
    return left + share * (right - left), (top + bottom) / 2


def test_scrubbing_follows_the_mouse_and_goes_on_playing(studio: Studio, clock: Clock) -> None:
    transport = studio.session.transport
    camera = studio.session.viewpoint.camera
    transport.play()
    StudioHand(studio).move(*place(studio, 0.25))
    StudioHand(studio).button(True)
    assert transport.time == pytest.approx(0.09, abs=0.002)
    StudioHand(studio).move(*place(studio, 0.75))
    assert transport.time == pytest.approx(0.27, abs=0.002)
    clock.now += 0.05  # the mouse holds it where it is
    studio.settle(1)
    assert transport.time == pytest.approx(0.27, abs=0.002)
    StudioHand(studio).button(False)
    clock.now += 0.05
    assert transport.playing
    assert transport.time == pytest.approx(0.32, abs=0.002)
    assert studio.session.viewpoint.camera == camera  # nothing of it turned the view


def test_dragging_beyond_the_timeline_stops_at_its_ends(studio: Studio) -> None:
    StudioHand(studio).drag(place(studio, 0.5), (SIZE[0] + 50, 20))
    assert studio.session.transport.frame == 9
    StudioHand(studio).drag(place(studio, 0.5), (-40, 20))
    assert studio.session.transport.frame == 0


def test_marks_are_drawn_and_dragged(studio: Studio) -> None:
    transport = studio.session.transport
    before = studio.draw(2).astype(int)
    transport.mark_in, transport.mark_out = 0.08, 0.28
    after = studio.draw(2).astype(int)
    left, top, right, bottom = (round(v) for v in studio.gui.bar.area)
    changed = np.abs(after - before)[top:bottom, left:right, :3].sum(axis=2) > 20
    outside = np.r_[0 : round(0.2 * (right - left)), round(0.8 * (right - left)) : right - left]
    assert changed[:, outside].mean() > 0.5  # darker outside the loop
    transport.seek(0.2)
    StudioHand(studio).drag(place(studio, 0.08 / 0.36), place(studio, 0.5))
    assert transport.mark_in == pytest.approx(0.18, abs=0.002)
    StudioHand(studio).drag(place(studio, 0.28 / 0.36), place(studio, 0.1))  # not before the other one
    assert transport.mark_out is not None
    assert transport.mark_in == pytest.approx(0.18, abs=0.002)
    assert transport.mark_in < transport.mark_out < 0.2
    assert transport.time == pytest.approx(0.2)


def test_a_right_drag_sets_both_marks(studio: Studio) -> None:
    transport = studio.session.transport
    StudioHand(studio).drag(place(studio, 0.75), place(studio, 0.25), 1)
    assert transport.mark_in == pytest.approx(0.09, abs=0.002)
    assert transport.mark_out == pytest.approx(0.27, abs=0.002)


def test_the_picture_turns_only_where_no_panel_is(studio: Studio) -> None:
    session = studio.session
    session.open.add("file")
    studio.settle(4)
    before = session.viewpoint.camera
    StudioHand(studio).drag((60, 200), (160, 200))  # on the panel
    assert session.viewpoint.camera == before
    StudioHand(studio).drag((600, 300), (700, 300))
    assert session.viewpoint.camera.yaw == pytest.approx(before.yaw - 35)
    studio.gui.io.add_mouse_wheel_event(0, 1)
    studio.settle(2)
    assert session.viewpoint.camera.distance == pytest.approx(before.distance * 0.9)


def test_buttons_open_and_close_panels(studio: Studio) -> None:
    session = studio.session
    plain = studio.draw(2).astype(int)
    StudioHand(studio).click(855, 31)  # the last of the buttons above
    opened = session.open.copy()
    assert len(opened) == 1
    assert (np.abs(studio.draw(3).astype(int) - plain).sum(axis=2) > 30).mean() > 0.05
    StudioHand(studio).click(855, 31)
    assert session.open == set()


def test_play_button(studio: Studio) -> None:
    _, _, _, bottom = studio.gui.bar.area
    StudioHand(studio).click(SIZE[0] / 2, bottom + 28)
    assert studio.session.transport.playing
    StudioHand(studio).click(SIZE[0] / 2, bottom + 28)
    assert not studio.session.transport.playing


def test_the_bar_hides_itself_while_playing_and_comes_back(studio: Studio, clock: Clock) -> None:
    session = studio.session
    StudioHand(studio).move(450, 200)
    shown = studio.draw(1).astype(int)
    clock.now += 60
    paused = studio.draw(30).astype(int)
    np.testing.assert_array_equal(paused[-90:], shown[-90:])  # paused it stays
    session.transport.loop = True
    session.transport.play()
    clock.now += 60
    studio.settle(30)
    assert studio.gui.shown == 0.0
    session.transport.pause()
    session.transport.seek(0.0)
    session.transport.play()
    hidden = studio.draw(1).astype(int)
    assert hidden[-100:].mean() > shown[-100:].mean() + 20  # the studio floor is lighter than the bar
    session.touched()
    studio.settle(30)
    assert studio.gui.shown == 1.0


def test_the_first_window_keeps_its_bar_and_nothing_covers_the_hints(
    studio: Studio, clock: Clock, tmp_path: Path
) -> None:
    session = studio.session
    session.memory = Memory(tmp_path)
    session.transport.loop = True
    session.transport.play()
    clock.now += 60
    studio.settle(30)
    assert studio.gui.shown == 1.0
    session.transport.pause()
    left, top, right, _ = studio.gui.bar.area
    StudioHand(studio).move(left, top - 500)
    row = slice(round(top) - 66, round(top) - 28)  # the strip of hints
    strip = studio.draw(1)[row].astype(int)
    StudioHand(studio).move((left + right) / 2, top + 5)
    session.say("a notice")
    np.testing.assert_array_equal(studio.draw(2)[row], strip)
    session.memory.welcome()
    session.transport.play()
    clock.now += 60
    studio.settle(30)
    assert studio.gui.shown == 0.0


def test_recording_is_shown_while_the_bar_is_hidden(studio: Studio, clock: Clock) -> None:
    session = studio.session
    session.transport.loop = True
    session.transport.play()
    session.recording = 1.0
    clock.now += 60
    picture = studio.draw(30).astype(int)
    assert studio.gui.shown == 0.0
    corner = picture[20:42, 14:34]
    assert (corner[..., 0] - corner[..., 2] > 80).sum() > 60  # the red dot


def test_bare_shows_the_picture_alone(studio: Studio) -> None:
    session = studio.session
    session.open |= {"file", "view"}
    session.bare = True
    from fba_player.export._offscreen import Offscreen

    samples = Quality.FAST.samples  # as in a window without a graphics card
    with Offscreen(session.scene, SIZE, session.viewpoint.camera, samples=samples) as plain:
        wanted = plain.frame(0.0)
    np.testing.assert_array_equal(studio.draw(3)[..., :3], wanted[..., :3])


def test_a_notice_appears_and_disappears(studio: Studio, clock: Clock) -> None:
    before = studio.draw(1).astype(int)
    studio.session.say("Saved as talk-0000.png")
    during = studio.draw(1).astype(int)
    assert (np.abs(during - before).sum(axis=2) > 30).sum() > 2000
    clock.now += 10
    np.testing.assert_array_equal(studio.draw(2), before)


def test_the_trace_marks_the_intra_planes(studio: Studio) -> None:
    info = studio.session.source.info
    assert info.plane_intra.tolist() == [True] + [False] * 9
    picture = studio.draw(1).astype(int)
    left, top, right, bottom = (round(v) for v in studio.gui.bar.area)
    wide = right - left
    warm = picture[top:bottom, left:right, 0] - picture[top:bottom, left:right, 2]
    assert (warm[:, 5 : wide // 12] > 60).mean() > 0.5  # the only I plane, the first
    assert not (warm[:, wide // 8 :] > 60).any()


def test_hooks_change_what_is_shown(studio: Studio) -> None:
    before = studio.draw(1).astype(int)

    def hook(faps: np.ndarray, baps: np.ndarray) -> None:
        faps[2] = 1000  # open_jaw

    studio.session.before_frame.append(hook)
    open_mouth = studio.draw(1).astype(int)
    assert (np.abs(open_mouth - before).sum(axis=2) > 60).sum() > 300
    assert studio.session.values[0][2] == 1000
    studio.session.before_frame.remove(hook)
    np.testing.assert_array_equal(studio.draw(1), before)


@pytest.mark.parametrize("scale", [1.0, 1.5, 2.0])
def test_on_dense_displays_all_is_larger(opengl: None, talking: Animation, scale: float) -> None:
    size = (round(450 * scale), round(300 * scale))
    with Studio(Session(Scene(talking), size=size, scale=scale)) as studio:
        picture = studio.draw(4)
        left, top, right, bottom = studio.gui.bar.area
        assert (bottom - top, right) == (40, 450 - 18)  # points
        row = picture[round((top + bottom) / 2 * scale), :, :3].astype(int).sum(axis=1)
        edge = round(left * scale)
        assert abs(row[edge + 3] - row[edge - 3]) > 8  # the track begins where it says, in pixels
        assert studio._gl.error == "GL_NO_ERROR"


def test_windows_share_nothing(opengl: None, talking: Animation) -> None:
    first, second = Session(Scene(talking), size=(400, 300)), Session(Scene(talking), size=(500, 300))
    with Studio(first) as one, Studio(second) as other:
        alone = one.draw(3).copy()
        second.open.add("help")
        other.draw(3)
        np.testing.assert_array_equal(one.draw(1), alone)


def test_no_texture_stays_behind_when_it_is_resized(studio: Studio) -> None:
    studio.draw(1)
    before = len(studio.gui._renderer._textures)
    for wide in range(700, 900, 40):
        studio.session.size = (wide, 500)
        studio.draw(2)
    assert len(studio.gui._renderer._textures) == before


def test_a_panel_that_has_nothing_to_show_says_so(studio: Studio) -> None:
    session = studio.session
    session.toggle_panel("differences")  # of a single file
    studio.draw(2)
    assert session.open == set()
    assert [notice.kind for notice in session.notices()] == ["warning"]


def test_panels_open_where_there_is_room(studio: Studio) -> None:
    session = studio.session
    session.open |= {"camera", "curves"}
    studio.draw(6)
    places = [
        (*imgui.internal.find_window_by_name(name).pos, *imgui.internal.find_window_by_name(name).size)
        for name in ("###camera", "###curves")
    ]
    (x0, y0, w0, h0), (x1, y1, w1, h1) = places
    assert x0 + w0 <= x1 or x1 + w1 <= x0 or y0 + h0 <= y1 or y1 + h1 <= y0
    for x, y, wide, high in places:
        assert 0 <= x <= x + wide <= SIZE[0]
        assert 0 <= y <= y + high <= SIZE[1] - 124


def test_it_rests_while_nothing_changes(studio: Studio, clock: Clock) -> None:
    session = studio.session
    assert not session.restless
    session.say("a word", seconds=4.0)
    assert not session.restless  # it stands still until it fades
    clock.now += 3.8
    assert session.restless
    clock.now += 1.0
    studio.draw(1)
    assert not session.restless
    session.viewpoint.preset("profile")
    assert session.restless


@pytest.fixture
def speaking(opengl: None, tmp_path: Path, clock: Clock) -> Iterator[Studio]:
    """Four seconds that send one viseme, then another, and joy that grows."""
    mask = np.zeros((100, 68), dtype=bool)
    mask[:, :2] = True
    viseme, expression = np.zeros((100, 4), np.int16), np.zeros((100, 6), np.int16)
    viseme[:, 0], viseme[50:, 0], viseme[:, 2] = 10, 1, 63
    expression[:, 0], expression[:, 1] = 1, np.arange(100) * 63 // 99
    face = fba.FaceTrack(np.zeros((100, 68), np.int32), mask, viseme, expression)
    scene = Scene(Animation(25, np.arange(100), face, None, "speaking"))  # type: ignore[arg-type]
    session = Session(scene, Transport(scene.timeline, clock=clock), size=SIZE, clock=clock)
    session.source.probe(wait=True)
    with Studio(session) as made:
        made.draw(4)
        yield made


def lane_part(studio: Studio, name: str, low: float, high: float) -> np.ndarray:
    """Pixels of a lane between two shares of its width."""
    left, top, right, bottom = studio.gui.bar.lanes.areas[name]
    wide = right - left
    part = studio.draw(1)[
        round(top) : round(bottom), round(left + low * wide) : round(left + high * wide), :3
    ]
    return part.astype(int)


def test_lanes_show_what_is_said_and_felt(speaking: Studio) -> None:
    from fba_player._ui import theme

    areas = speaking.gui.bar.lanes.areas
    assert list(areas)[:2] == ["visemes", "expressions"]
    assert areas["visemes"][3] <= areas["expressions"][1] < speaking.gui.bar.area[1]
    ground = np.median(lane_part(speaking, "expressions", 0.0, 0.02), axis=(0, 1))
    for name, low in (("A:", 0.2), ("p b m", 0.7)):
        colour = np.array(theme.name_colour(name)[:3]) * 255
        seen = np.median(lane_part(speaking, "visemes", low, low + 0.2), axis=(0, 1))
        assert np.abs(seen - (0.8 * colour + 0.2 * ground)).max() < 20
    soft, strong = (lane_part(speaking, "expressions", low, low + 0.1) for low in (0.25, 0.85))
    tall = [(np.abs(part - ground).sum(axis=2) > 60).mean() for part in (soft, strong)]
    assert tall[0] == pytest.approx(0.3, abs=0.1)
    assert tall[1] == pytest.approx(0.9, abs=0.1)


def test_the_text_at_the_mouse_names_what_is_said(speaking: Studio) -> None:
    text = speaking.gui.bar.lanes.text(speaking.session, 3.0)
    assert text.startswith("visemes: p b m 100%   expressions: joy 47 of 63")
    assert "moving" not in text
    speaking.session.lanes = "all"
    left, top, right, bottom = speaking.gui.bar.lanes.areas["visemes"]
    before = speaking.draw(1).astype(int)
    StudioHand(speaking).move((left + right) / 2, (top + bottom) / 2)
    changed = np.abs(speaking.draw(1).astype(int) - before).sum(axis=2) > 30
    assert changed[: round(top) - 30].sum() > 2000


def test_lanes_are_chosen_and_leave_room_for_the_figure(speaking: Studio) -> None:
    from fba_player.session._actions import act

    session, bar = speaking.session, speaking.gui.bar
    with_content = bar.height(session, SIZE)
    act(session, "lanes")
    assert session.lanes == "all"
    assert bar.height(session, SIZE) > with_content
    speaking.settle(2)
    assert list(bar.lanes.areas)[-1] == "groups"
    act(session, "lanes")
    assert bar.height(session, SIZE) < with_content
    left = bar.area[0]
    speaking.settle(2)
    assert bar.area[0] < left  # without lanes, their names need no room
    act(session, "lanes")
    assert session.lanes == "content"
    assert bar.height(session, (900, 380)) < with_content  # a low window has none
    session.size = (900, 380)
    speaking.draw(2)


def test_a_drag_on_a_lane_seeks(speaking: Studio) -> None:
    left, top, right, bottom = speaking.gui.bar.lanes.areas["expressions"]
    StudioHand(speaking).drag((left + 5, (top + bottom) / 2), ((left + right) / 2, (top + bottom) / 2))
    assert speaking.session.transport.time == pytest.approx(1.98, abs=0.02)


def test_the_wheel_enlarges_the_timeline_about_the_mouse(speaking: Studio) -> None:
    session, zoom = speaking.session, speaking.session.zoom
    camera = session.viewpoint.camera
    StudioHand(speaking).move(*place(speaking, 0.25))
    speaking.gui.io.add_mouse_wheel_event(0, 5)
    speaking.settle(2)
    assert zoom.high - zoom.low == pytest.approx(3.96 * 0.8**5)
    assert zoom.low + 0.25 * (zoom.high - zoom.low) == pytest.approx(0.99, abs=0.02)
    assert session.viewpoint.camera == camera
    StudioHand(speaking).click(*place(speaking, 0.5))
    assert session.transport.time == pytest.approx((zoom.low + zoom.high) / 2, abs=0.02)
    low = zoom.low
    speaking.gui.io.add_mouse_wheel_event(-1, 0)  # sideways
    speaking.settle(2)
    assert zoom.low == pytest.approx(low + 0.1 * (zoom.high - zoom.low), abs=0.01)
    StudioHand(speaking).drag(place(speaking, 0.5), place(speaking, 0.75), 2)  # with the middle button
    assert zoom.low < low
    speaking.settle(1)
    x, y = speaking.gui.bar.zoom_bar
    StudioHand(speaking).drag((x, y), (SIZE[0], y))
    assert zoom.high == pytest.approx(3.96)


def test_the_enlarged_timeline_follows_the_time_and_fits_again(speaking: Studio) -> None:
    from fba_player.session._actions import act

    session, zoom = speaking.session, speaking.session.zoom
    for _ in range(3):
        act(session, "zoom_in")
    assert (zoom.low, zoom.high) == (0.0, pytest.approx(3.96 / 8))
    session.transport.seek(3.0)
    speaking.settle(1)
    assert zoom.low < 3.0 < zoom.high
    act(session, "page_back")
    act(session, "page_back")
    speaking.settle(1)
    assert zoom.high < 3.0  # the user looks elsewhere
    session.transport.step(1)
    speaking.settle(1)
    assert zoom.shows(session.transport.time)
    act(session, "zoom_fit")
    assert zoom.shows_all


@pytest.mark.parametrize("wide", [640, 760, 860, 900, 960, 1000, 1100, 1280, 2560])
def test_the_speed_stands_beside_its_slider(studio: Studio, wide: int) -> None:
    studio.session.size = (wide, 600)
    studio.session.transport.set_speed(0.25)
    studio.draw(2)
    buttons = studio.gui.bar.buttons
    left, right = buttons.slider
    assert (right - left >= 60) == (wide >= 900)
    assert (buttons.speed[1] > 0) == (wide >= 960)
    if buttons.speed[1]:
        assert buttons.taken[1] < buttons.speed[0] < buttons.speed[1] < left
    elif right:
        assert buttons.taken[1] < left

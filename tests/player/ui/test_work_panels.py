"""Curves, bit rate and puppeteer, drawn into memory and used with imgui's own mouse."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fba
import graphics
from fba.animation import Animation
from fba_player.playback._transport import Transport
from fba_player.scene.scene import Scene
from fba_player.session._session import Session
from fba_player.session._source import Source
from set_clock import Clock
from studio_hand import StudioHand, panel_of

imgui = graphics.imported("imgui_bundle").imgui

from tools.window_picture import Studio  # noqa: E402 - needs imgui

SIZE = (1000, 640)


Opened = Callable[..., Studio]


@pytest.fixture
def opened(opengl: None, tmp_path: Path, clock: Clock, monkeypatch: pytest.MonkeyPatch) -> Iterator[Opened]:
    """A window's inside that shows an animation, with panels open."""
    studios = []
    monkeypatch.chdir(tmp_path)

    def make(
        animation: Animation, *panels: str, path: Path | None = None, size: tuple[int, int] = SIZE
    ) -> Studio:
        scene = Scene(animation)
        transport = Transport(scene.timeline, clock=clock)
        session = Session(scene, transport, source=Source(scene, path), size=size, clock=clock)
        session.source.probe(wait=True)
        session.open |= set(panels)
        studio = Studio(session)
        studios.append(studio)
        studio.draw(6)
        return studio

    yield make
    for studio in studios:
        assert studio._gl.error == "GL_NO_ERROR"
        studio.close()


def coloured(
    picture: np.ndarray, place: tuple[float, float, float, float], colour: tuple[float, ...]
) -> np.ndarray:
    """Where, within a place, pixels have about a colour."""
    left, top, right, bottom = (round(v) for v in place)
    part = picture[top:bottom, left:right, :3].astype(float)
    return np.abs(part - np.array(colour[:3]) * 255).max(axis=2) < 40


def test_curves_that_move_most_are_there_at_once(opened: Opened, talking: Animation) -> None:
    studio = opened(talking, "curves")
    assert studio.session.selection.faps == [5, 3, 31]  # 540 of 600, 630 of 800, 180 of 240
    panel = panel_of(studio, "curves")
    from fba_player._ui.panels._curve_plot import COLOURS

    line = coloured(studio.draw(1), panel.lanes.area, COLOURS[0])
    rows = [np.flatnonzero(line[:, x]).mean() for x in (20, line.shape[1] // 2, line.shape[1] - 20)]
    assert rows[0] + 8 < rows[1] < rows[2] - 8  # it falls


def test_a_click_on_a_curve_seeks_and_the_wheel_zooms(opened: Opened, talking: Animation) -> None:
    studio = opened(talking, "curves")
    hand, panel = StudioHand(studio), panel_of(studio, "curves")
    left, top, right, bottom = panel.lanes.area
    transport = studio.session.transport
    hand.drag(((left + right) / 2, (top + bottom) / 2), (left + 0.75 * (right - left), (top + bottom) / 2))
    assert transport.time == pytest.approx(0.27, abs=0.003)
    camera = studio.session.viewpoint.camera
    hand.move((left + right) / 2, (top + bottom) / 2)
    hand.wheel(3)
    assert panel.time_zoom.high - panel.time_zoom.low == pytest.approx(0.36 * 0.8**3)
    assert (panel.time_zoom.high + panel.time_zoom.low) / 2 == pytest.approx(0.18, abs=0.002)
    assert studio.session.viewpoint.camera == camera
    before = panel.time_zoom.low
    hand.drag(((left + right) / 2, top + 5), ((left + right) / 2 + 100, top + 5), 1)
    assert panel.time_zoom.low == pytest.approx(before - 100 / (right - left) * 0.36 * 0.8**3, abs=0.002)
    hand.double_click((left + right) / 2, top + 5, 1)
    assert panel.time_zoom.shows_all


def test_choosing_from_the_list(opened: Opened, walking: Animation) -> None:
    studio = opened(walking, "curves")
    session, hand, panel = studio.session, StudioHand(studio), panel_of(studio, "curves")
    session.selection.faps, session.selection.baps = [], []
    left, top, _, _ = panel.lanes.area
    hand.click(left + 30, top - 45)  # the button
    hand.write("left knee")
    assert panel.chooser.query == "left knee"
    panel.chooser.query = "l_knee flexion"
    studio.settle(3)
    hand.click(*panel.chooser.first_row)
    assert session.selection.baps == [10]
    hand.click(*panel.chooser.first_row)
    assert session.selection.baps == []


def test_stretches_that_were_not_sent_are_thin(opened: Opened, talking: Animation) -> None:
    from fba_player._ui.panels._curve_plot import COLOURS

    mask = talking.face.mask.copy()
    mask[3:, 2] = False
    half = Animation(25, talking.index, fba.FaceTrack(np.where(mask, talking.face.values, 0), mask))  # type: ignore[arg-type]
    studio = opened(half, "curves")
    studio.session.selection.faps = [3]
    line = coloured(studio.draw(3), panel_of(studio, "curves").lanes.area, COLOURS[0])
    wide = line.shape[1]
    assert line[:, : wide // 5].any(axis=0).mean() > 0.9
    assert line[:, wide // 4 :].any(axis=0).mean() < 0.1  # faint


def test_the_bit_rate_of_a_stream(opened: Opened, talking: Animation, tmp_path: Path) -> None:
    path = tmp_path / "talk.fba"
    fba.write(path, talking, intra_period=0.2)
    studio = opened(talking, "rate", path=path)
    panel, hand = panel_of(studio, "rate"), StudioHand(studio)
    from fba_player._ui import theme

    left, _, right, bottom = panel.bars
    warm = coloured(studio.draw(1), panel.bars, theme.WARM).any(axis=0)
    assert np.flatnonzero(np.diff(np.r_[False, warm].astype(int)) == 1) == pytest.approx(
        [0, (right - left) / 2], abs=2
    )  # the two I planes, 0 and 5 of 10
    hand.click(left + 0.75 * (right - left), bottom - 3)
    assert studio.session.transport.time == pytest.approx(0.27, abs=0.003)


def test_the_bit_rate_of_a_stream_that_arrives(opengl: None, talking: Animation) -> None:
    from io import BufferedReader, BytesIO

    from fba_player.playback.live import LiveAnimation, LiveTimeline

    live = LiveAnimation(BufferedReader(BytesIO(fba.encode(talking))))  # type: ignore[arg-type]
    assert live.wait(300)
    assert live.wait_end(300)
    scene = Scene(live, timeline=LiveTimeline(live))  # type: ignore[arg-type]
    session = Session(scene, Transport(scene.timeline), source=Source(scene), size=SIZE)  # type: ignore[arg-type]
    session.open.add("rate")
    with Studio(session) as studio:
        picture = studio.draw(4)
        left, top, right, bottom = (round(v) for v in panel_of(studio, "rate").bars)
        bars = picture[top:bottom, left:right, :3].astype(int)
        x0, y0, x1, y1 = (round(v) for v in studio.gui.bar.area)
        line = picture[y0:y1, x0:x1, :3].astype(int)
    for part in (bars, line):
        warm = part[..., 0] - part[..., 2]
        wide = part.shape[1]
        assert (warm[:, 3 : wide // 12] > 60).mean() > 0.5  # the I plane, the first of ten
        assert not (warm[:, wide // 8 :] > 60).any()


def test_losses_are_told_while_the_bar_is_hidden(opengl: None, talking: Animation) -> None:
    from io import BufferedReader, BytesIO

    from fba_player.playback.live import LiveAnimation, LiveTimeline

    live = LiveAnimation(BufferedReader(BytesIO(fba.encode(talking))))  # type: ignore[arg-type]
    assert live.wait_end(300)
    now = [100.0]
    scene = Scene(live, timeline=LiveTimeline(live))  # type: ignore[arg-type]
    transport = Transport(scene.timeline, loop=True, clock=lambda: now[0])
    session = Session(scene, transport, source=Source(scene), size=SIZE, clock=lambda: now[0])  # type: ignore[arg-type]
    with Studio(session) as studio:
        studio.gui.hides = True
        transport.play()
        for words, shown in (("", 0.0), ("packets lost, 3 so far: the pose is held", 1.0)):
            now[0] += 60
            live.tell(words)
            studio.settle(30)
            assert studio.gui.shown == shown
        now[0] += 60
        studio.settle(30)
        assert studio.gui.shown == 0.0


def test_the_bit_rate_of_what_is_no_stream_yet(opened: Opened, talking: Animation) -> None:
    studio = opened(talking)
    studio.session.open.add("rate")
    panel = panel_of(studio, "rate")
    studio.settle(1)
    assert studio.session.restless or panel._encoded[1]  # pictures go on until it is known
    for _ in range(600):
        studio.settle(1)
        if panel._encoded is not None and panel._encoded[1]:
            break
        import time

        time.sleep(0.02)
    studio.settle(2)
    assert panel.bars[2] > panel.bars[0] > 0
    assert panel._rates[1].totals[0].planes == 1
    assert not studio.session.restless


def test_pictures_go_on_until_all_curves_are_known(
    opened: Opened, talking: Animation, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("fba_player._ui.panels._curve_data.RESOLVED_AT_ONCE", 1)
    studio = opened(talking, "curves")
    session = studio.session
    assert session.restless
    assert session.selection.faps == []  # which move most is not known yet
    session.open.clear()
    studio.draw(1)
    assert not session.restless
    session.open.add("curves")
    studio.draw(10)
    assert session.selection.faps == [5, 3, 31]
    assert not session.restless


def slider(studio: Studio, group: str, row: int, share: float) -> tuple[float, float]:
    left, right, y = panel_of(studio, "puppet").sliders[group, row]
    return left + share * (right - left), y


def test_a_slider_moves_the_face_until_it_is_released(opened: Opened, talking: Animation) -> None:
    studio = opened(talking, "puppet")
    session, hand = studio.session, StudioHand(studio)
    before = studio.draw(1).astype(int)
    hand.drag(slider(studio, "Jaw", 0, 0.05), slider(studio, "Jaw", 0, 0.6))
    performer = panel_of(studio, "puppet").performer(session)
    studio.draw(1)
    assert session.values[0][2] == pytest.approx(0.6 * 1200, abs=40)  # 0 to 1.5 times the gallery's 800
    session.transport.seek(0.2)
    studio.draw(1)
    assert session.values[0][2] == pytest.approx(0.6 * 1200, abs=40)
    assert session.values[0][4] == pytest.approx(-300)  # what was not touched is played: 5 at frame 5
    session.transport.seek(0.0)
    open_mouth = studio.draw(1).astype(int)
    middle = np.s_[:, 300:600]
    assert (np.abs(open_mouth - before)[middle].sum(axis=2) > 60).sum() > 300
    hand.double_click(*slider(studio, "Jaw", 0, 0.5))
    studio.draw(1)
    assert performer.puppet.fap_moved[2]
    assert session.values[0][2] == 0
    _, right, y = panel_of(studio, "puppet").sliders["Jaw", 0]
    hand.click(right + 68 + 9, y)  # the cross behind the value
    assert performer.puppet.idle


def test_left_and_right_move_together_or_alone(opened: Opened, walking: Animation) -> None:
    from fba_player._ui.panels._puppet_rows import groups

    studio = opened(walking, "puppet")
    panel = panel_of(studio, "puppet")
    puppet = panel.performer(studio.session).puppet
    by_name = {group.name: group for group in groups()}
    arms, brows = by_name["Arms"], by_name["Brows"]
    performer = panel.performer(studio.session)
    panel._move(performer, brows, brows.rows[0], 120.0)
    faps, baps = np.zeros(68, np.float32), np.zeros(296)
    puppet(faps, baps)
    assert (faps[30], faps[31]) == (120, 120)
    abduct = next(n for n, row in enumerate(arms.rows) if row.title == "upper arm abduction L")
    panel._move(performer, arms, arms.rows[abduct], 60.0)
    puppet(faps, baps)
    assert np.degrees(baps[33:35] * 1e-5) == pytest.approx([60, -60])  # both turn about +Z: mirrored
    panel.together = False
    panel._move(performer, brows, brows.rows[1], -50.0)
    puppet(faps, baps)
    assert (faps[30], faps[31]) == (120, -50)


def test_recording_and_saving_by_hand(
    opened: Opened, talking: Animation, clock: Clock, tmp_path: Path
) -> None:
    studio = opened(talking, "puppet")
    session, hand, panel = studio.session, StudioHand(studio), panel_of(studio, "puppet")
    performer = panel.performer(session)
    hand.click(*panel.buttons["record"])
    assert performer.recording is not None
    assert session.restless
    for step in range(26):
        performer.puppet.move_fap(3, 20 * step)
        clock.now += 1 / 25
        studio.draw(1)
    hand.click(*panel.buttons["record"])
    assert performer.recording is None
    take = performer.takes.last
    assert len(take) == 27
    assert take.face.values[1:, 2].tolist() == [20 * step for step in range(26)]
    assert take.face.values[0, 4] == 0
    studio.draw(2)
    hand.click(*panel.buttons["Save"])
    back = fba.read(tmp_path / "take.fba")
    assert np.abs(back.face.values - take.face.values)[:, 2].max() <= 4  # a step of open_jaw
    hand.click(*panel.buttons["Save"])  # again: nothing is overwritten, and the user is told
    assert [one.kind for one in session.notices()] == ["done", "error"]
    hand.click(*panel.buttons["Undo"])
    assert performer.takes.last is None
    assert (tmp_path / "take.fba").exists()


def test_a_take_is_shown_once(opened: Opened, talking: Animation, clock: Clock) -> None:
    studio = opened(talking, "puppet")
    session = studio.session
    performer = panel_of(studio, "puppet").performer(session)
    performer.record()
    studio.draw(1)
    performer.puppet.move_fap(3, 900)
    clock.now += 0.1
    studio.draw(1)
    performer.stop()
    performer.puppet.release_all()
    studio.draw(1)
    assert session.values[0][2] == 0
    performer.show()
    clock.now += 0.08
    studio.draw(1)
    assert session.values[0][2] > 600
    clock.now += 1.0
    studio.draw(1)
    assert not performer.showing
    assert not session.restless
    assert session.values[0][2] == 0


@pytest.mark.parametrize("size", [(1280, 720), (900, 600)])
def test_open_panels_do_not_cover_each_other(
    opened: Opened, walking: Animation, size: tuple[int, int]
) -> None:
    studio = opened(walking, "curves", "rate", "puppet", size=size)
    imgui.set_current_context(studio.gui._context)
    boxes = []
    for name in ("curves", "rate", "puppet"):
        panel = panel_of(studio, name)
        window = imgui.internal.find_window_by_name(f"{panel.title}###{name}")
        boxes.append((window.pos.x, window.pos.y, window.pos.x + window.size.x, window.pos.y + window.size.y))
    for number, one in enumerate(boxes):
        assert one[0] >= 0
        assert one[2] <= size[0]
        assert one[3] <= size[1] - 124  # the timeline
        for other in boxes[:number]:
            apart = one[0] >= other[2] or other[0] >= one[2] or one[1] >= other[3] or other[1] >= one[3]
            assert apart


@pytest.mark.parametrize("size", [(1, 1), (160, 120), (320, 240)])
def test_tiny_windows(opened: Opened, walking: Animation, size: tuple[int, int]) -> None:
    studio = opened(walking, "curves", "rate", "puppet", size=size)
    assert studio.draw(3).shape == (size[1], size[0], 4)


def test_a_take_of_what_is_played_is_what_was_played(
    opened: Opened, talking: Animation, clock: Clock
) -> None:
    studio = opened(talking, "puppet")
    session = studio.session
    session.transport.loop = False
    performer = panel_of(studio, "puppet").performer(session)
    performer.record()
    session.transport.play()
    for _ in range(22):  # 60 pictures a second, 0.36 s
        studio.draw(1)
        clock.now += 1 / 60
    performer.stop()
    take = performer.takes.last
    assert take.rate == talking.rate
    sent = [2, 4, 30]
    assert np.abs(take.face.values[:9, sent] - talking.face.values[:9, sent]).max() <= 1
    assert take.face.values[5, 51] == take.face.values[5, 4]  # the outer lip, which the face filled in


def _window(studio: Studio, name: str) -> Any:
    imgui.set_current_context(studio.gui._context)
    return imgui.internal.find_window_by_name(f"{panel_of(studio, name).title}###{name}")


def test_a_folded_panel_opens_by_its_title(opened: Opened, talking: Animation) -> None:
    studio = opened(talking, "file", "view", "camera", "curves", "rate", "puppet", size=(900, 600))
    hand = StudioHand(studio)
    names = ("file", "view", "camera", "curves", "rate", "puppet")
    studio.draw(2)
    folded = [name for name in names if _window(studio, name).size.y < 40]
    assert folded
    window = _window(studio, folded[0])
    hand.move(window.pos.x + 60, window.pos.y + 12)
    for down in (True, False):  # a quick click: down and up come with the same picture
        studio.gui.io.add_mouse_button_event(0, down)
    studio.draw(5)
    assert _window(studio, folded[0]).size.y > 100


def test_a_panel_is_taken_out_of_its_column_and_brought_back(opened: Opened, talking: Animation) -> None:
    studio = opened(talking, "camera")
    hand = StudioHand(studio)
    docked = tuple(_window(studio, "camera").pos)
    hand.move(docked[0] + 60, docked[1] + 12)
    hand.button(True)
    hand.move(docked[0] - 40, docked[1] + 52)  # dragged over some pictures
    hand.move(docked[0] - 240, docked[1] + 112)
    hand.button(False)
    x, y = _window(studio, "camera").pos
    assert (x, y) == pytest.approx((docked[0] - 300, docked[1] + 100), abs=2)
    viewpoint = studio.session.viewpoint
    assert viewpoint.camera_at(0.0) == viewpoint.camera_without_panels(0.0)  # no column is there
    hand.double_click(x + 60, y + 12)
    studio.draw(2)
    assert tuple(_window(studio, "camera").pos) == docked


def test_escape_closes_a_list_before_the_window(opened: Opened, talking: Animation) -> None:
    studio = opened(talking, "view")
    session, window = studio.session, _window(studio, "view")
    hand = StudioHand(studio)
    for row in range(8):  # the first list of the panel
        hand.click(window.pos.x + 60, window.pos.y + 120 + 25 * row)
        if session.popup:
            break
    assert session.popup
    studio.gui.controls.key("esc")
    studio.draw(2)
    assert not session.popup
    assert not session.closing
    studio.gui.controls.key("esc")
    assert session.closing


def test_a_take_that_is_not_saved_is_not_lost_by_one_key(
    opened: Opened, talking: Animation, clock: Clock, tmp_path: Path
) -> None:
    studio = opened(talking, "puppet")
    session = studio.session
    performer = panel_of(studio, "puppet").performer(session)
    performer.record()
    studio.draw(1)
    clock.now += 0.2
    studio.draw(1)
    performer.stop()
    session.leave()
    assert not session.closing
    assert [notice.kind for notice in session.notices()] == ["warning"]
    clock.now += 6.5
    session.leave()
    assert not session.closing  # it was too long ago
    clock.now += 5.5
    session.leave()
    assert session.closing
    session.closing = False
    performer.save("mine")
    session.leave()
    assert session.closing


def test_escape_leaves_the_full_screen_first(opened: Opened, talking: Animation) -> None:
    session = opened(talking).session
    session.full_screen = True
    session.escape()
    assert (list(session.requests), session.closing) == (["fullscreen"], False)


def test_escape_closes_the_help_and_ends_a_film_before_the_window(opened: Opened, talking: Animation) -> None:
    session = opened(talking, "help").session
    session.recording = 1.0
    session.escape()
    assert ("help" in session.open, list(session.requests)) == (False, [])
    session.escape()
    assert (list(session.requests), session.closing) == (["record"], False)
    session.recording = None
    session.escape()
    assert session.closing

"""Times along the timeline, and what is drawn behind it."""

import numpy as np
import pytest

import graphics
from fba.animation import Animation, FaceTrack
from fba_player._ui.ruler import Ruler, label
from fba_player.session._timeline_trace import INTRA, Trace, trace_of_motion, trace_picture
from player_tracks import face_track


def test_places_and_times() -> None:
    ruler = Ruler(2.0, 12.0, 100.0, 600.0)
    assert (ruler.x(2.0), ruler.x(7.0), ruler.x(99.0), ruler.time(350)) == (100, 350, 600, 7.0)
    assert ruler.time(-50) == 2.0
    assert Ruler(3.0, 3.0, 0.0, 100.0).x(3.0) == 0  # a single frame
    assert Ruler(3.0, 4.0, 50.0, 50.0).time(50) == 3.0  # no room


def test_labels_are_far_enough_apart() -> None:
    assert Ruler(0.0, 10.0, 0.0, 1000.0).step(80) == 1
    assert Ruler(0.0, 3600.0, 0.0, 1000.0).step(80) == 300
    assert Ruler(0.0, 0.4, 0.0, 1000.0).step(80) == 0.05
    assert Ruler(0.0, 1e7, 0.0, 1000.0).step(80) == 828000  # 230 hours
    assert Ruler(1.5, 4.2, 0.0, 1000.0).ticks(1.0) == [2.0, 3.0, 4.0]
    assert len(Ruler(0.0, 1e6, 0.0, 100.0).ticks(0.01)) <= 1001


@pytest.mark.parametrize(
    ("seconds", "step", "text"),
    [(5, 1, "0:05"), (65.2, 0.1, "1:05.2"), (3605, 60, "1:00:05"), (0.05, 0.05, "0:00.05"), (-2, 1, "-0:02")],
)
def test_labels_are_as_short_as_they_can_be(seconds: float, step: float, text: str) -> None:
    assert label(seconds, step) == text


def test_the_trace_is_as_high_as_the_root_of_the_bits() -> None:
    trace = Trace(
        np.array([400.0, 100.0, 100.0]), np.array([True, False, False]), np.array([0.0, 1.0, 2.0]), True
    )
    picture = trace_picture(trace, 0.0, 3.0, (31, 100))
    tall = (picture[..., 3] > 0).sum(axis=0)
    assert tall[2] == 100
    assert tall[15] == 53  # half of 94, over the least of 6
    assert picture[50, 2, :3].tolist() == list(INTRA)
    assert picture[99, 15, :3].tolist() != list(INTRA)
    assert tall[9] == 0  # a gap before the next plane


def test_many_planes_on_few_pixels_show_the_largest() -> None:
    amounts = np.ones(1000)
    amounts[503] = 9.0
    trace = Trace(amounts, np.zeros(1000, bool), np.linspace(0.0, 1.0, 1000), True)
    tall = (trace_picture(trace, 0.0, 1.0, (50, 60))[..., 3] > 0).sum(axis=0)
    assert tall[24:26].max() == 60
    assert (tall[:24] > 0).all()
    assert tall[:24].max() < 30


def still_values(frames: int) -> np.ndarray:
    return np.zeros((frames, 68), dtype=int)


def test_motion_is_added_up_over_parameters() -> None:
    face = face_track([{3: 0, 5: 0}, {3: 50, 5: 0}, {3: 100, 5: 10}, {3: 100, 5: 10}])
    trace = trace_of_motion(Animation(25, np.array([0, 1, 2, 5]), face=face))  # type: ignore[arg-type]
    np.testing.assert_allclose(trace.amounts, [0.0, 0.5, 1.5, 0.0])
    np.testing.assert_allclose(trace.times, [0.0, 0.04, 0.08, 0.2])
    joy = np.zeros((3, 6), dtype=int)
    joy[1:, 0], joy[1:, 1] = 1, [30, 60]
    smile = FaceTrack(still_values(3), np.ones((3, 68), bool), expression=joy)
    trace = trace_of_motion(Animation(25, np.arange(3), face=smile))  # type: ignore[arg-type]
    np.testing.assert_allclose(trace.amounts, [0.0, 1.5, 0.5])  # the expression is chosen and half there
    still = face_track([{3: 7}, {3: 7}])
    assert trace_of_motion(Animation(25, np.arange(2), face=still)) is None  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("slid", "speed"), [(0.98, 1.0), (1.02, 1.0), (2.613, 2.61), (9.0, 4.0), (0.01, 0.1), (0.255, 0.25)]
)
def test_the_slider_of_speed_holds_on_to_its_steps(slid: float, speed: float) -> None:
    graphics.imported("imgui_bundle")
    from fba_player._ui._transport_buttons import snap_speed

    assert snap_speed(slid) == speed

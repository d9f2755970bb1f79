"""Times along the timeline, and where panels stand: columns that leave the middle free, share the height."""

import numpy as np
import pytest

import graphics
from fba.animation import Animation, FaceTrack
from fba_player._ui._docks import (
    EDGE,
    GAP,
    MIN_COLUMN,
    MIN_MIDDLE,
    MIN_MIDDLE_SHARE,
    TITLE,
    Dock,
    DockRequest,
    Docks,
    free_middle,
)
from fba_player._ui.ruler import Ruler, label
from fba_player.session._timeline_trace import INTRA, Trace, trace_of_motion, trace_picture
from player_tracks import face_track

TOP = 56.0


def request(
    name: str, side: str = "left", width: float = 400, height: float = 250, least: float = 150
) -> DockRequest:
    return DockRequest(name, side, width, height, least)


def apart(docks: dict[str, Dock]) -> bool:
    """Whether none touches another."""
    boxes = list(docks.values())
    return all(
        one.left >= other.left + other.width
        or other.left >= one.left + one.width
        or one.top >= other.top + other.height
        or other.top >= one.top + one.height
        for place, one in enumerate(boxes)
        for other in boxes[:place]
    )


def test_a_single_panel_gets_the_size_it_asks_for_at_its_side() -> None:
    docks = Docks()
    assert docks.arrange([request("a")], 1280, TOP, 530) == {"a": Dock(EDGE, TOP, 400, 250)}
    docks = Docks()
    assert docks.arrange([request("a", "right")], 1280, TOP, 530) == {
        "a": Dock(1280 - EDGE - 400, TOP, 400, 250)
    }


def test_a_panel_without_room_at_its_side_goes_to_the_other() -> None:
    found = Docks().arrange([request("a"), request("b"), request("c")], 1280, TOP, 530)
    assert (found["a"].left, found["b"].left) == (EDGE, EDGE)
    assert found["b"].top == TOP + 250 + GAP
    assert found["c"] == Dock(1280 - EDGE - 400, TOP, 400, 250)


def test_where_both_sides_are_full_they_share_the_height() -> None:
    requests = [
        request("a", height=500),
        request("b", height=500, side="right"),
        request("c", height=400, least=200),
    ]
    found = Docks().arrange(requests, 1280, TOP, 530)
    assert found["c"].left == EDGE
    assert found["a"].height + GAP + found["c"].height == pytest.approx(530)
    assert found["a"].height > 150
    assert found["c"].height > 200
    assert not any(dock.folded for dock in found.values())


def test_the_least_recently_used_panel_is_folded() -> None:
    requests = [request(name, height=400, least=200) for name in "abcdef"]
    docks = Docks()
    found = docks.arrange(requests, 1280, TOP, 530)
    left = [name for name, dock in found.items() if dock.left == EDGE]
    assert [found[name].folded for name in left] == [True, False, False]
    assert found[left[0]].height == TITLE
    docks.use(left[0])
    again = docks.arrange(requests, 1280, TOP, 530)
    assert [again[name].folded for name in left] == [False, True, False]
    assert [again[name].left for name in again] == [found[name].left for name in again]  # nobody moves over
    assert apart(found)
    assert apart(again)


def test_closing_a_panel_gives_its_room_to_the_others() -> None:
    docks = Docks()
    requests = [request(name, height=400, least=200) for name in "abcdef"]
    found = docks.arrange(requests, 1280, TOP, 530)
    folded = next(name for name, dock in found.items() if dock.folded)
    side = found[folded].left
    closed = next(n for n, dock in found.items() if dock.left == side and not dock.folded)
    again = docks.arrange([one for one in requests if one.name != closed], 1280, TOP, 530)
    assert not again[folded].folded


@pytest.mark.parametrize("wide", [900.0, 1280.0, 1920.0, 3840.0])
def test_the_middle_stays_free(wide: float) -> None:
    found = Docks().arrange([request("a", width=430), request("b", "right", width=380)], wide, TOP, 410)
    left, right = free_middle(found.values(), wide)
    assert (1 - left - right) * wide >= max(MIN_MIDDLE_SHARE * wide, MIN_MIDDLE) - 1e-6
    assert min(dock.width for dock in found.values()) >= MIN_COLUMN


def test_a_narrow_display_has_one_column() -> None:
    found = Docks().arrange([request("a"), request("b", "right")], 640, TOP, 400)
    assert found["a"].left == found["b"].left
    left, right = free_middle(found.values(), 640)
    assert left == 0.0
    assert (1 - right) * 640 >= MIN_MIDDLE


@pytest.mark.parametrize(("wide", "high"), [(200.0, 60.0), (320.0, 100.0), (640.0, 200.0), (900.0, 250.0)])
def test_whatever_the_size_they_stay_inside(wide: float, high: float) -> None:
    found = Docks().arrange([request(name) for name in "abcdefgh"], wide, TOP, high)
    assert found
    assert apart(found)
    for dock in found.values():
        assert dock.left >= EDGE - 1e-6
        assert dock.left + dock.width <= wide - EDGE + 1e-6
        assert dock.top + dock.height <= TOP + high + 1e-6


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

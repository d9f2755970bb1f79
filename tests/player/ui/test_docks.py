"""Where panels stand: columns that leave the middle free, share their height, and fold what is too much."""

import pytest

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

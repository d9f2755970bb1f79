"""Full screen on one of several monitors, with a stand-in for glfw."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from fba_player.window._display import FullScreen, overlap


class Glfw:
    """Two monitors side by side, and a window."""

    def __init__(self, x: int, monitors: tuple[str, ...] = ("left", "right")) -> None:
        self.place = (x, 50, 800, 600)
        self.monitors = monitors
        self.on: str | None = None

    def get_window_monitor(self, window: object) -> str | None:
        return self.on

    def get_window_pos(self, window: object) -> tuple[int, int]:
        return self.place[:2]

    def get_window_size(self, window: object) -> tuple[int, int]:
        return self.place[2:]

    def get_monitors(self) -> tuple[str, ...]:
        return self.monitors

    def get_primary_monitor(self) -> str | None:
        return self.monitors[0] if self.monitors else None

    def get_monitor_pos(self, monitor: str) -> tuple[int, int]:
        return (0, 0) if monitor == "left" else (1920, 0)

    def get_video_mode(self, monitor: str) -> Any:
        size = (1920, 1080) if monitor == "left" else (2560, 1440)
        return SimpleNamespace(size=size, refresh_rate=60)

    def set_window_monitor(self, window: object, monitor: str | None, *place: int) -> None:
        self.on, self.place = monitor, place[:4]  # type: ignore[assignment]

    def swap_interval(self, interval: int) -> None:
        pass


def test_it_covers_the_monitor_that_has_most_of_the_window_and_goes_back() -> None:
    for x, monitor, size in ((1000, "left", (1920, 1080)), (1700, "right", (2560, 1440))):
        glfw = Glfw(x)
        screen = FullScreen(glfw, object())
        assert not screen.active
        screen.toggle()
        assert glfw.on == monitor
        assert glfw.place[2:] == size
        assert screen.active
        screen.toggle()
        assert glfw.on is None
        assert glfw.place == (x, 50, 800, 600)


def test_off_all_monitors_it_takes_the_first_and_without_one_it_stays() -> None:
    far = Glfw(9000)
    FullScreen(far, object()).toggle()
    assert far.on == "left"
    none = Glfw(0, ())
    FullScreen(none, object()).toggle()
    assert (none.on, none.place) == (None, (0, 50, 800, 600))


def test_overlap() -> None:
    assert overlap((0, 0, 10, 10), (5, 5, 10, 10)) == 25
    assert overlap((0, 0, 10, 10), (10, 0, 5, 5)) == 0
    assert overlap((-5, -5, 20, 20), (0, 0, 3, 4)) == 12

"""The display: a check for one, the start of glfw, which opens windows, and full screen."""

from __future__ import annotations

from typing import Any

from fba.errors import DisplayError
from fba_player.gl._context import cure

HOW_WITHOUT = (
    "On a machine without a display, `fba render FILE -o OUT.mp4` makes a film instead; "
    "with one, check that the variable DISPLAY (or WAYLAND_DISPLAY) is set"
)


def check_display(instead: str = HOW_WITHOUT) -> None:
    """Raise DisplayError, which ends with what to do instead, if no window can be opened."""
    start_glfw([], instead).terminate()


def start_glfw(problems: list[str], instead: str = HOW_WITHOUT) -> Any:
    """Start glfw and return the module. problems: gets the messages that glfw reports from now on.

    instead: what to do without a window, the end of errors.

    Raises DisplayError if it is not installed or finds no display.
    """
    try:
        import glfw
    except ImportError as error:
        raise DisplayError(
            f"the window needs the Python package glfw, which cannot be used: {error}. "
            f"{cure(error, 'mpeg4-fba[player]')}{'' if instead == HOW_WITHOUT else f'. {instead}'}"
        ) from error
    glfw.set_error_callback(lambda code, text: problems.append(decode(text)))
    if not glfw.init():
        reason = problems[-1] if problems else "there is no display"
        raise DisplayError(f"no window can be opened: {reason}. {instead}")
    return glfw


def decode(value: bytes | str) -> str:
    """Return the text from glfw, which may be bytes in UTF-8."""
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else value


class FullScreen:
    """Turns full screen on and off for a glfw window."""

    def __init__(self, glfw: Any, window: Any) -> None:
        self._glfw, self._window = glfw, window
        self._before: tuple[int, int, int, int] | None = None

    @property
    def active(self) -> bool:
        """Whether the window covers a monitor."""
        return bool(self._glfw.get_window_monitor(self._window))

    def toggle(self) -> None:
        """Cover the monitor that shows most of the window, or go back to its former position and size."""
        glfw, window = self._glfw, self._window
        if self.active:
            x, y, wide, high = self._before or (60, 60, 1280, 720)
            glfw.set_window_monitor(window, None, x, y, wide, high, 0)
            return
        x, y = glfw.get_window_pos(window)
        wide, high = glfw.get_window_size(window)
        monitor = self._nearest((x, y, wide, high))
        if monitor is None:
            return
        self._before = (x, y, wide, high)
        mode = glfw.get_video_mode(monitor)
        glfw.set_window_monitor(window, monitor, 0, 0, *mode.size, mode.refresh_rate)
        glfw.swap_interval(1)

    def _nearest(self, window: tuple[int, int, int, int]) -> Any:
        glfw = self._glfw
        best, most = glfw.get_primary_monitor() or None, 0
        for monitor in glfw.get_monitors():
            mode = glfw.get_video_mode(monitor)
            shared = overlap(window, (*glfw.get_monitor_pos(monitor), *mode.size))
            if shared > most:
                best, most = monitor, shared
        return best


def overlap(first: tuple[int, int, int, int], second: tuple[int, int, int, int]) -> int:
    """Return the area of the intersection of two rectangles (x, y, width, height)."""
    wide = min(first[0] + first[2], second[0] + second[2]) - max(first[0], second[0])
    high = min(first[1] + first[3], second[1] + second[3]) - max(first[1], second[1])
    return max(wide, 0) * max(high, 0)

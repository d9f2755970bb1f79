"""The display: a check for one, the start of glfw, which opens windows, and full screen."""

from __future__ import annotations

import ctypes
import sys
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


class _VisibilityEvent(ctypes.Structure):
    """XVisibilityEvent of Xlib, filled up to the size of its largest event."""

    _fields_ = (
        ("type", ctypes.c_int),
        ("serial", ctypes.c_ulong),
        ("send_event", ctypes.c_int),
        ("display", ctypes.c_void_p),
        ("window", ctypes.c_ulong),
        ("state", ctypes.c_int),
        ("rest", ctypes.c_long * 24),
    )


class Covering:
    """Whether other windows cover all of a window, where X11 says so; glfw has no name for it.

    X11 says so unless a compositor draws the windows. Under Wayland the swap of pictures waits while a window
    is covered, and nothing is needed; macOS and Windows are not asked.
    """

    _CHANGES, _NOTIFY, _FULL = 1 << 16, 15, 2
    """VisibilityChangeMask, VisibilityNotify and VisibilityFullyObscured of X.h."""

    def __init__(self, glfw: Any, window: Any) -> None:
        self._covered = False
        self._x11: Any = None
        number = glfw.get_x11_window(window) if sys.platform == "linux" else None
        if not number:
            return
        try:
            self._x11 = ctypes.CDLL("libX11.so.6")
        except OSError:
            return
        self._x11.XOpenDisplay.restype = ctypes.c_void_p
        self._display = ctypes.c_void_p(self._x11.XOpenDisplay(None))
        if not self._display:
            self._x11 = None
            return
        self._x11.XSelectInput(self._display, ctypes.c_ulong(number), ctypes.c_long(self._CHANGES))

    @property
    def covered(self) -> bool:
        """Whether nothing of the window can be seen."""
        event = _VisibilityEvent()
        while self._x11 is not None and self._x11.XPending(self._display):
            self._x11.XNextEvent(self._display, ctypes.byref(event))
            if event.type == self._NOTIFY:
                self._covered = event.state == self._FULL
        return self._covered

    def close(self) -> None:
        """Release its connection; safe to call twice."""
        if self._x11 is not None:
            self._x11.XCloseDisplay(self._display)
        self._x11, self._covered = None, False


def overlap(first: tuple[int, int, int, int], second: tuple[int, int, int, int]) -> int:
    """Return the area of the intersection of two rectangles (x, y, width, height)."""
    wide = min(first[0] + first[2], second[0] + second[2]) - max(first[0], second[0])
    high = min(first[1] + first[3], second[1] + second[3]) - max(first[1], second[1])
    return max(wide, 0) * max(high, 0)

"""Check for a display, and start glfw, the library that opens windows."""

from __future__ import annotations

from typing import Any

from fba.errors import DisplayError
from fba_player.gl.system_libraries import cure

HOW_WITHOUT = (
    "On a machine without a display, `fba render FILE -o OUT.mp4` makes a film instead; "
    "with one, check that the variable DISPLAY (or WAYLAND_DISPLAY) is set"
)


def check_display() -> None:
    """Raise DisplayError, which says what to do, if no window can be opened."""
    start_glfw([]).terminate()


def start_glfw(problems: list[str]) -> Any:
    """Start glfw and return the module. problems: gets the messages that glfw reports from now on.

    Raises DisplayError if it is not installed or finds no display.
    """
    try:
        import glfw
    except ImportError as error:
        raise DisplayError(
            f"the window needs the Python package glfw, which cannot be used: {error}. "
            f"{cure(error, 'glfw')}. {HOW_WITHOUT}"
        ) from error
    glfw.set_error_callback(lambda code, text: problems.append(_decode(text)))
    if not glfw.init():
        reason = problems[-1] if problems else "there is no display"
        raise DisplayError(f"no window can be opened: {reason}. {HOW_WITHOUT}")
    return glfw


def _decode(value: bytes | str) -> str:
    return value.decode(errors="replace") if isinstance(value, bytes) else value

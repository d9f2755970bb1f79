"""A window with OpenGL, on which scenes are shown one after the other.

It imports little, so that the window is there before the long imports.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from fba.errors import DisplayError
from fba_player.gl._context import (
    OPENGL,
    how_to_install,
    import_moderngl,
    missing_libraries,
    missing_text,
)
from fba_player.view._font import label_font, shortened
from fba_player.window._display import HOW_WITHOUT, start_glfw

if TYPE_CHECKING:
    from fba_player.session._memory import Memory
    from fba_player.view._camera import Camera

OPENING_GREY = (118, 122, 127)
OPENING_TEXT = (236, 238, 240)
"""Colours of a window before its first picture, sRGB."""
OPENING_TEXT_HEIGHT = 22.0
"""Points."""


@dataclass(frozen=True)
class Resumed:
    """What a window goes on with when the file that it shows has changed: where it was, and what is open.

    zoom: the seconds that the timeline shows; None for all.
    """

    time: float
    playing: bool
    view: Camera | str | None
    marks: tuple[float | None, float | None]
    zoom: tuple[float, float] | None
    panels: frozenset[str]
    lanes: str


class Surface:
    """A window that stays from one scene to the next; a context manager.

    size: width and height in points. There can be one at a time, in the main thread. It appears with `open`.
    resumed: what the next scene goes on with, None where it begins anew. read: reads a file that is opened
    next, to see whether it can be shown; by default with `fba.read`. memory: see `Session.memory`.
    """

    def __init__(self, size: tuple[int, int] = (1280, 720)) -> None:
        if size[0] < 1 or size[1] < 1:
            raise ValueError(f"a window must have at least 1x1 pixels, not {size[0]}x{size[1]}")
        self.size = size
        self.resumed: Resumed | None = None
        self.read: Callable[[Path], object] | None = None
        self.memory: Memory | None = None
        self.glfw: Any = None
        self.gl: Any = None
        self.window: Any = None
        self._problems: list[str] = []

    def open(self, title: str) -> None:
        """Show the window, if it is not there yet, and that something is being opened.

        Raises DisplayError without a display or OpenGL 3.3, which says what to do.
        """
        if self.window is not None:
            self.glfw.set_window_title(self.window, title)
            return
        self.glfw = start_glfw(self._problems)
        try:
            self._open(title)
            self._show_opening(title)
            self.glfw.show_window(self.window)
            self._show_opening(title)
        except Exception:
            self.close()
            raise

    def close(self) -> None:
        """Close the window; safe to call twice."""
        if self.gl is not None:
            self.gl.release()
            self.gl = None
        if self.window is not None:
            self.glfw.destroy_window(self.window)
            self.window = None
        if self.glfw is not None:
            self.glfw.terminate()
            self.glfw = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def pixels(self) -> tuple[int, int]:
        """Width and height in pixels; zeros while it is minimised."""
        width, height = self.glfw.get_framebuffer_size(self.window)
        return int(width), int(height)

    @property
    def scale(self) -> float:
        """The pixels per point: 1 on normal displays, 2 on high-resolution ones."""
        return min(max(float(self.glfw.get_window_content_scale(self.window)[0]), 0.5), 8.0)

    def _open(self, title: str) -> None:
        glfw, moderngl = self.glfw, import_moderngl()
        for hint, value in (
            (glfw.CONTEXT_VERSION_MAJOR, 3),
            (glfw.CONTEXT_VERSION_MINOR, 3),
            (glfw.OPENGL_PROFILE, glfw.OPENGL_CORE_PROFILE),
            (glfw.OPENGL_FORWARD_COMPAT, True),
            (glfw.SCALE_TO_MONITOR, True),
            (glfw.VISIBLE, False),
        ):
            glfw.window_hint(hint, value)
        self.window = glfw.create_window(*self.size, title, None, None)
        glfw.default_window_hints()
        if not self.window:
            missing = missing_libraries()
            if missing:
                raise DisplayError(f"the window needs OpenGL, but {missing_text(missing)}")
            reason = self._problems[-1] if self._problems else "the display refused"
            raise DisplayError(
                f"no window with OpenGL 3.3 can be opened: {reason}. "
                "Install a driver (Debian, Ubuntu: apt-get install libegl1 libgl1 libgl1-mesa-dri). "
                + HOW_WITHOUT
            )
        glfw.make_context_current(self.window)
        glfw.swap_interval(1)
        try:
            self.gl = moderngl.create_context(require=330)
        except Exception as error:
            raise DisplayError(
                f"OpenGL 3.3 cannot be used in the window: {error}. {how_to_install(OPENGL)}, or update the "
                "graphics driver"
            ) from error

    def _show_opening(self, title: str) -> None:
        """Show something at once: until the first picture, shaders are compiled and meshes prepared."""
        size = self.pixels
        if size[0] > 0 and size[1] > 0:
            _draw_opening(self.gl, size, f"Opening {title} ...", self.scale)
            self.glfw.swap_buffers(self.window)


def _draw_opening(context: Any, size: tuple[int, int], text: str, scale: float) -> None:
    """Fill a window's framebuffer, without shaders, which take a while to be compiled.

    context: of moderngl. size: of the framebuffer in pixels. text: shown in the middle, cut to the width.
    scale: pixels per point.
    """
    from PIL import Image, ImageDraw

    picture = Image.new("RGBA", size, (*OPENING_GREY, 255))
    pen, font = ImageDraw.Draw(picture), label_font(OPENING_TEXT_HEIGHT * scale)
    line = shortened(pen, text, font, size[0] * 0.9)
    pen.text((size[0] / 2, size[1] / 2), line, font=font, fill=OPENING_TEXT, anchor="mm")
    texture = context.texture(size, 4, picture.transpose(Image.Transpose.FLIP_TOP_BOTTOM).tobytes())
    filled = context.framebuffer([texture])
    context.copy_framebuffer(context.screen, filled)
    filled.release()
    texture.release()

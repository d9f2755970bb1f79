"""A window with OpenGL, on which scenes are shown one after the other.

It imports little, so that the window is there before the long imports.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from threading import current_thread, main_thread
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from fba.arrays import UInt8
from fba.compiled import compilation_listener
from fba.errors import DisplayError
from fba.sampling import smoothstep
from fba_player.gl._context import (
    OPENGL,
    how_to_install,
    import_moderngl,
    missing_libraries,
    missing_text,
)
from fba_player.view._font import label_font, shortened
from fba_player.window._display import HOW_WITHOUT, start_glfw

TEXT, FAINT, ACCENT, LINE = (232, 235, 238), (204, 208, 214), (92, 173, 230), (108, 113, 121)
"""sRGB, as in the panels; fainter text is lighter than there, as the backdrop is."""
NAME, SMALL = 26.0, 14.0
"""Heights of text in points."""
BAR = (220.0, 3.0)
"""Width and height of the bar that shows how far it is, in points."""
KEYS = "Space plays and pauses      F1 shows all keys      Esc closes"
LEAST_HEIGHT = 200.0
"""Points; lower windows have the name only."""


def opening_picture(size: tuple[int, int], scale: float, name: str, step: str, done: float) -> UInt8:
    """Return the page, uint8 (height, width, 4), bottom row first.

    size: in pixels. scale: pixels per point. name: of what is opened. step: what is being prepared.
    done: share of the preparation that is done.
    """
    from PIL import Image, ImageDraw

    wide, high = size
    picture = Image.fromarray(_backdrop(size))
    pen, (x, y) = ImageDraw.Draw(picture), (wide / 2, high * 0.45)

    def write(at: float, text: str, points: float, colour: tuple[int, int, int]) -> None:
        font = label_font(points * scale)
        pen.text((x, at), shortened(pen, text, font, wide * 0.9), font=font, fill=colour, anchor="mm")

    write(y, name, NAME, TEXT)
    if high >= LEAST_HEIGHT * scale:
        across, thick = min(BAR[0] * scale, wide * 0.9), BAR[1] * scale
        left, top = x - across / 2, y + 34 * scale
        pen.rectangle((left, top, left + across, top + thick), fill=LINE)
        pen.rectangle((left, top, left + across * done, top + thick), fill=ACCENT)
        write(top + 24 * scale, step, SMALL, TEXT)
        write(high - 40 * scale, KEYS, SMALL, FAINT)
    return np.asarray(picture.convert("RGBA"))[::-1]


@lru_cache(maxsize=1)
def _backdrop(size: tuple[int, int]) -> UInt8:
    """Return the backdrop of studio.frag, top row first, so that nothing jumps when the figure appears."""
    across, up = np.linspace(-1, 1, size[0]), np.linspace(1, -1, size[1])[:, None]
    share = smoothstep((up + 1.1) / 2.1)[..., None]
    light = (1 - share) * (0.155, 0.165, 0.185) + share * (0.42, 0.44, 0.475)
    light = light * (1 - 0.15 * (across**2 + up**2))[..., None]
    toned = light * (1 + light * 0.06) / (1 + light * 0.5)
    return np.asarray((1.23460 * np.sqrt(toned) - 0.21734 * toned - 0.02316) * 255, np.uint8)


if TYPE_CHECKING:
    from fba_player.session._memory import Memory
    from fba_player.view._camera import Camera

COMPILING = "Compiling for this machine, on the first run only: {} functions"
FUNCTIONS_TOLD = 3
"""Number of compiled functions at which the window says so."""


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


class WindowClosedError(Exception):
    """The window was closed before the scene was there."""


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
        self.title = ""
        self._step: tuple[str, float] = ("", 0.0)
        self._compiled = 0
        self._listening = ExitStack()
        self._problems: list[str] = []

    def open(self, title: str) -> None:
        """Show the window, if it is not there yet, and that something is being opened.

        Raises DisplayError without a display or OpenGL 3.3, which says what to do.
        """
        self.title = title
        if self.window is not None:
            self.glfw.set_window_title(self.window, title)
            self.glfw.set_window_should_close(self.window, False)
            return
        self.glfw = start_glfw(self._problems)
        self._listening.enter_context(compilation_listener(self.tell_of_compiling))
        try:
            self._open(title)
            self.tell("Starting", 0.05)
            self.glfw.show_window(self.window)
            self._draw_opening()  # what was drawn before may be lost
        except Exception:
            self.close()
            raise

    def tell(self, step: str, done: float) -> None:
        """Show what is being prepared, until `show_scene`, and the share done; not for a file shown again.

        Raises WindowClosedError if the user has closed the window meanwhile.
        """
        if self.window is not None and self.resumed is None:
            self._step = (step, done)
            self._draw_opening()
            if self.glfw.window_should_close(self.window):
                raise WindowClosedError

    def tell_of_compiling(self) -> None:
        """Show that one more function is compiled, if the window is still being prepared."""
        self._compiled += 1
        if self._step[0] and self._compiled >= FUNCTIONS_TOLD and current_thread() is main_thread():
            self._step, before = (COMPILING.format(self._compiled), self._step[1]), self._step
            self._draw_opening()
            self._step = before

    def show_scene(self) -> None:
        """Note that the window shows a scene from now on."""
        self._step = ("", 0.0)

    def close(self) -> None:
        """Close the window; safe to call twice."""
        self._listening.close()
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

    def _draw_opening(self) -> None:
        """Draw the opening page, without shaders, which take a while to be compiled."""
        size = self.pixels
        if size[0] < 1 or size[1] < 1:
            return
        self.glfw.poll_events()  # or the desktop takes the program for hung
        page = opening_picture(size, self.scale, self.title, *self._step)
        texture = self.gl.texture(size, 4, page.tobytes())
        filled = self.gl.framebuffer([texture])
        self.gl.copy_framebuffer(self.gl.screen, filled)
        filled.release()
        texture.release()
        self.glfw.swap_buffers(self.window)

"""The player's window: glfw for window and input, moderngl for the picture."""

from __future__ import annotations

import time as wall
from types import TracebackType
from typing import Any

from fba.animation import Animation
from fba.errors import DisplayError
from player.camera import Camera
from player.context import import_moderngl
from player.controls import Controls
from player.offscreen import following
from player.overlay import Overlay
from player.renderer import Renderer
from player.scene import Scene
from player.target import Target
from player.transport import Transport

HOW_WITHOUT = (
    "On a machine without a display, `fba render FILE -o OUT.mp4` makes a film instead; "
    "with one, check that the variable DISPLAY (or WAYLAND_DISPLAY) is set"
)
IDLE = 0.05
"""Seconds between looks at the input while nothing moves."""
FASTEST = 1 / 250
"""Least seconds a picture takes, where the display does not set the pace."""


def play(
    animation: Animation | Scene,
    *,
    title: str | None = None,
    size: tuple[int, int] = (1280, 720),
    camera: Camera | str | None = None,
    loop: bool = True,
    speed: float = 1.0,
    start: float | None = None,
    paused: bool = False,
) -> None:
    """Open a window, play an animation in it, and return when it is closed.

    title: of the window; the animation's name by default. size: of the window. camera: a `Camera`, the
    name of a preset, or None for the one that suits the content. speed: 0.1 to 4. start: seconds.
    F1 shows the keys. Motion follows the wall clock: a slow machine shows fewer pictures, not slower ones.

    Raises DisplayError where there is no display or no OpenGL 3.3, saying what to do; ValueError for a
    speed, size or preset that does not exist.
    """
    scene = animation if isinstance(animation, Scene) else Scene(animation)
    with Window(scene, title=title, size=size, camera=camera, loop=loop) as window:
        window.transport.set_speed(speed)
        if start is not None:
            window.transport.seek(start)
        if not paused:
            window.transport.play()
        window.run()


class Window:
    """A window that shows a scene; see `play`. A context manager; one at a time, in the main thread."""

    def __init__(
        self,
        scene: Scene,
        *,
        title: str | None = None,
        size: tuple[int, int] = (1280, 720),
        camera: Camera | str | None = None,
        loop: bool = True,
    ) -> None:
        if size[0] < 1 or size[1] < 1:
            raise ValueError(f"a window must have at least 1x1 pixels, not {size[0]}x{size[1]}")
        chosen = scene.camera(camera, size[0] / size[1]) if isinstance(camera, str) else camera
        self.scene = scene
        self.transport = Transport(scene.timeline, loop=loop)
        self.pictures = 0
        self._title = title or scene.animation.name or "fba"
        self._shown_title = ""
        self._target: Target | None = None
        self._renderer: Renderer | None = None
        self._overlay: Overlay | None = None
        self._gl: Any = None
        self._window: Any = None
        self._problems: list[str] = []
        self._stale = True
        self._glfw = self._started_glfw()
        try:
            self._open(size)
            self.controls = Controls(scene, self.transport, self._framebuffer(), chosen)
            self._connect()
        except Exception:
            self.close()
            raise

    def run(self) -> None:
        """Show the scene until the window is closed."""
        while self.update():
            pass

    def update(self) -> bool:
        """Handle the input and draw one picture, or wait where nothing moves. False once closed."""
        glfw = self._glfw
        begun = wall.perf_counter()
        if self.transport.playing or self._stale:
            glfw.poll_events()
        else:
            glfw.wait_events_timeout(IDLE)
        if glfw.window_should_close(self._window) or self.controls.closing:
            return False
        if not (self.transport.playing or self._stale):
            return True
        size = self._framebuffer()
        if size[0] < 1 or size[1] < 1:  # minimised
            glfw.wait_events_timeout(IDLE)
            return True
        self._draw(size)
        glfw.swap_buffers(self._window)
        self.pictures += 1
        left = FASTEST - (wall.perf_counter() - begun)
        if left > 0:
            wall.sleep(left)
        return True

    def close(self) -> None:
        """Close the window and give everything back; safe to call twice."""
        for part in (self._overlay, self._renderer, self._target):
            if part is not None:
                part.close()
        self._overlay = self._renderer = self._target = None
        if self._gl is not None:
            self._gl.release()
            self._gl = None
        if self._window is not None:
            self._glfw.destroy_window(self._window)
            self._window = None
        self._glfw.terminate()

    def __enter__(self) -> Window:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _started_glfw(self) -> Any:
        try:
            import glfw
        except ImportError as error:
            raise DisplayError(
                f"the window needs the Python package glfw, which cannot be used: {error}. "
                f"Install it with: pip install glfw. {HOW_WITHOUT}"
            ) from error
        glfw.set_error_callback(lambda code, text: self._problems.append(_text(text)))
        if not glfw.init():
            raise DisplayError(
                f"no window can be opened: {self._reason('there is no display')}. {HOW_WITHOUT}"
            )
        return glfw

    def _open(self, size: tuple[int, int]) -> None:
        glfw = self._glfw
        moderngl = import_moderngl()
        for hint, value in (
            (glfw.CONTEXT_VERSION_MAJOR, 3),
            (glfw.CONTEXT_VERSION_MINOR, 3),
            (glfw.OPENGL_PROFILE, glfw.OPENGL_CORE_PROFILE),
            (glfw.OPENGL_FORWARD_COMPAT, True),
            (glfw.SCALE_TO_MONITOR, True),
        ):
            glfw.window_hint(hint, value)
        self._window = glfw.create_window(*size, self._title, None, None)
        if not self._window:
            raise DisplayError(
                f"no window with OpenGL 3.3 can be opened: {self._reason('the display refused')}. "
                "Install a driver (Debian, Ubuntu: apt-get install libegl1 libgl1 libgl1-mesa-dri). "
                + HOW_WITHOUT
            )
        glfw.make_context_current(self._window)
        glfw.swap_interval(1)
        try:
            self._gl = moderngl.create_context(require=330)
        except Exception as error:
            raise DisplayError(
                f"OpenGL 3.3 cannot be used in the window: {error}. Install the system libraries libegl1 and "
                "libgl1 (Debian, Ubuntu: apt-get install libegl1 libgl1), or update the graphics driver"
            ) from error
        self._renderer = Renderer(self._gl)
        self._overlay = Overlay(self._gl)

    def _reason(self, otherwise: str) -> str:
        return self._problems[-1] if self._problems else otherwise

    def _framebuffer(self) -> tuple[int, int]:
        width, height = self._glfw.get_framebuffer_size(self._window)
        return int(width), int(height)

    def _draw(self, size: tuple[int, int]) -> None:
        assert self._renderer is not None
        assert self._overlay is not None
        if self._target is None or self._target.size != size:
            if self._target is not None:
                self._target.close()
            self._target = Target(self._gl, size, samples=0)
        controls = self.controls
        controls.size = size
        controls.scale = max(float(self._glfw.get_window_content_scale(self._window)[0]), 0.5)
        self._stale = False
        time = self.transport.time
        camera = following(controls.camera, self.scene, time)
        self._target.begin()
        within = self._renderer.draw(self.scene.at(time), camera, size)
        self._target.finish(self._gl.screen, within)
        self._gl.screen.use()
        self._gl.viewport = (0, 0, *size)
        self._overlay.draw(controls)
        self._show_title()

    def _show_title(self) -> None:
        text = f"{self._title} - frame {self.transport.frame + 1} / {self.scene.timeline.frames}"
        if text != self._shown_title:
            self._glfw.set_window_title(self._window, text)
            self._shown_title = text

    def _connect(self) -> None:
        glfw, window = self._glfw, self._window
        glfw.set_key_callback(window, self._on_key)
        glfw.set_mouse_button_callback(window, self._on_button)
        glfw.set_cursor_pos_callback(window, self._on_move)
        glfw.set_scroll_callback(window, lambda _, x, y: self._act(lambda: self.controls.scroll(y)))
        glfw.set_framebuffer_size_callback(window, lambda *_: self._act(lambda: None))
        glfw.set_window_refresh_callback(window, lambda *_: self._act(lambda: None))

    def _act(self, action: Any) -> None:
        action()
        self._stale = True

    def _on_key(self, window: Any, key: int, code: int, action: int, modifiers: int) -> None:
        if action == self._glfw.RELEASE:
            return
        name = self._key_name(key, code)
        held = action == self._glfw.REPEAT
        if name is None or (held and name not in ("left", "right", "+", "-")):
            return
        self._act(lambda: self.controls.key(name))

    def _key_name(self, key: int, code: int) -> str | None:
        glfw = self._glfw
        named = {
            glfw.KEY_SPACE: "space", glfw.KEY_LEFT: "left", glfw.KEY_RIGHT: "right", glfw.KEY_HOME: "home",
            glfw.KEY_END: "end", glfw.KEY_ESCAPE: "escape", glfw.KEY_F1: "f1", glfw.KEY_KP_ADD: "+",
            glfw.KEY_KP_SUBTRACT: "-", glfw.KEY_EQUAL: "+", glfw.KEY_MINUS: "-",
        }  # fmt: skip
        if key in named:
            return named[key]
        text = glfw.get_key_name(key, code)  # what the user's own keyboard layout has there
        return _text(text).lower() if text else None

    def _on_button(self, window: Any, button: int, action: int, modifiers: int) -> None:
        glfw = self._glfw
        names = {
            glfw.MOUSE_BUTTON_LEFT: "left",
            glfw.MOUSE_BUTTON_RIGHT: "right",
            glfw.MOUSE_BUTTON_MIDDLE: "middle",
        }
        if action == glfw.PRESS and button in names:
            x, y = self._pixels(*glfw.get_cursor_pos(window))
            self._act(lambda: self.controls.press(names[button], x, y))
        else:
            self._act(self.controls.release)

    def _on_move(self, window: Any, x: float, y: float) -> None:
        self._act(lambda: self.controls.move(*self._pixels(x, y)))

    def _pixels(self, x: float, y: float) -> tuple[float, float]:
        """Window units to pixels of the picture."""
        wide, high = self._glfw.get_window_size(self._window)
        size = self._framebuffer()
        return x * size[0] / max(wide, 1), y * size[1] / max(high, 1)


def _text(value: bytes | str) -> str:
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)

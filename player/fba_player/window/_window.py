"""The player's window: glfw for window and input, moderngl for the picture, imgui for the panels."""

from __future__ import annotations

import os
import shlex
import time as wall
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fba.arrays import UInt8
from fba.atomic import PathLike
from fba.errors import DisplayError, FbaWarning
from fba_player.export.render import film_rate
from fba_player.gl._context import cure, import_moderngl, is_software
from fba_player.gl._framebuffer import Readback, Target
from fba_player.gl._renderer import Renderer
from fba_player.playback._transport import Transport
from fba_player.playback.live import LiveTimeline
from fba_player.session._captures import FILM_RATE, Captures, draw_screenshot
from fba_player.session._controls import Controls
from fba_player.session._pages import page_of
from fba_player.session._session import Session
from fba_player.session._source import Source
from fba_player.view._camera import Camera
from fba_player.view.protocols import Closing
from fba_player.view.switches import Quality, samples_of
from fba_player.window._display import Covering, FullScreen
from fba_player.window._glfw_input import GlfwInput
from fba_player.window._plain_overlay import Overlay
from fba_player.window.surface import Surface

if TYPE_CHECKING:
    from fba_player.view.protocols import Showable

LOST = (
    "OpenGL stopped working ({reason}): the graphics driver was reset, or has no memory left. Start the "
    "player again; a smaller window, or LIBGL_ALWAYS_SOFTWARE=1 (drawing without the graphics card), may help"
)
IDLE_SECONDS = 0.05
"""Seconds to wait for input while nothing moves."""
HIDDEN_SECONDS = 0.25
"""Seconds to wait for input while the window cannot be seen."""
USUAL_RATE = 60
"""Pictures a second of a display that does not say how many it shows."""
LEAST_SHARE = 0.9
"""Least time from one picture to the next, in periods of the display, which may set the pace itself."""
LOOK_SECONDS = 0.7
"""Seconds between two looks at whether the file has changed on disk."""
WARNING_SECONDS = 12.0
"""Seconds for which warnings about the file are shown."""
SETTLING_PICTURES = 4
"""Pictures drawn after an input: imgui needs some until the panels have settled."""


class Window(Closing):
    """A window that shows a scene; a context manager. See `fba.player.play`.

    There can be one at a time, in the main thread. panels: False shows the plain timeline instead of panels,
    as it does if imgui is missing. folder: where pictures and films are saved; by default the current one.
    surface: where it is shown, which stays open afterwards; by default a new one. follows_file: whether it
    leaves the scene when the file has changed, so that it is shown again.
    """

    def __init__(
        self,
        scene: Showable,
        *,
        title: str | None = None,
        size: tuple[int, int] = (1280, 720),
        camera: Camera | str | None = None,
        loop: bool = True,
        source: Source | None = None,
        panels: bool = True,
        folder: PathLike | None = None,
        surface: Surface | None = None,
    ) -> None:
        self._surface = surface if surface is not None else Surface(size)
        self._owned = surface is None
        timeline = scene.timeline
        self.session = Session(scene, Transport(timeline, loop=loop), source=source, camera=camera, size=size)
        self.session.memory = self._surface.memory
        self.captures = Captures(self.session, folder)
        self.pictures = 0
        self._title = title or scene.title or "fba"
        self._shown_title = ""
        self._target: Target | None = None
        self._samples = 0
        self._renderer: Renderer | None = None
        self._readback: Readback | None = None
        self._overlay: Overlay | None = None
        self._gui: Any = None
        self._gl: Any = None
        self._window: Any = None
        self._glfw: Any = None
        self._pictures_due, self._restless = SETTLING_PICTURES, False
        self._next = self._least = 0.0
        self._covering: Covering | None = None
        self._timeline = timeline
        self._arrived = timeline.arrived
        self._doubted = False
        self._looked = 0.0
        self.follows_file = False
        self._last = wall.perf_counter()
        try:
            self._surface.open(self._title)
            self._glfw, self._gl, self._window = self._surface.glfw, self._surface.gl, self._surface.window
            self._prepare()
            self._make_panels(panels)
        except Exception:
            self.close()
            raise
        self.session.source.probe()

    @property
    def transport(self) -> Transport:
        return self.session.transport

    def run(self) -> None:
        """Show the scene until the window is closed."""
        while self.update():
            pass

    def _warn_of_bap_steps(self) -> None:
        """Warn once if a live stream seems to be made with another table of BAP steps."""
        timeline = self._timeline
        if isinstance(timeline, LiveTimeline) and timeline.animation.doubt and not self._doubted:
            self._doubted = True
            self.session.say(timeline.animation.doubt, "warning", WARNING_SECONDS)

    def _look_for_changes(self, now: float) -> None:
        """Leave the scene when its file has changed on disk."""
        source = self.session.source
        if not self.follows_file or now < self._looked + LOOK_SECONDS:
            return
        self._looked = now
        if source.path is not None and source.changed():
            self.session.reload(Path(source.path))
            self._redraw()

    def update(self) -> bool:
        """Handle input and draw one picture, or wait if nothing moves. Returns False once closed."""
        glfw, session = self._glfw, self.session
        begun = wall.perf_counter()
        self._warn_of_bap_steps()
        self._look_for_changes(begun)
        arrived = self._timeline.arrived  # a live stream makes the timeline longer, also while paused
        playing = session.transport.playing
        restless = session.restless or session.source.probing or arrived != self._arrived
        if restless or (begun >= self._next if playing else self._restless):
            self._pictures_due, self._arrived = max(self._pictures_due, 1), arrived
        self._restless = restless or playing  # one more picture after everything has stopped
        hidden = self._hidden
        if hidden:
            glfw.wait_events_timeout(HIDDEN_SECONDS)
        elif self._pictures_due:
            glfw.poll_events()
        else:
            glfw.wait_events_timeout(min(self._next - begun, IDLE_SECONDS) if playing else IDLE_SECONDS)
        if glfw.window_should_close(self._window) and not session.closing:
            session.leave()
            glfw.set_window_should_close(self._window, session.closing)
            self._redraw()
        if session.closing:
            return False
        if hidden or not self._pictures_due:
            return True
        size = self._surface.pixels
        if size[0] < 1 or size[1] < 1:  # minimised
            glfw.wait_events_timeout(HIDDEN_SECONDS)
            return True
        self._pictures_due -= 1
        self._draw_checked(size)
        glfw.swap_buffers(self._window)
        self.pictures += 1
        self._next = begun + self._seconds_to_next()
        least = self._least if session.recording is None else 1 / FILM_RATE
        left = least - (wall.perf_counter() - begun)
        if left > 0:
            wall.sleep(left)
        return True

    @property
    def _hidden(self) -> bool:
        """Whether no picture is needed, because nobody can see it and nothing records it."""
        session = self.session
        if session.recording is not None or "take" in session.rolling or session.requests:
            return False
        minimised = bool(self._glfw.get_window_attrib(self._window, self._glfw.ICONIFIED))
        return minimised or (self._covering is not None and self._covering.covered)

    def _seconds_to_next(self) -> float:
        """Return the seconds from one picture to the next while nothing but the performance moves.

        Frame by frame, there is one for each frame; in a window without the focus, as many as a film would
        have; else as many as the display shows.
        """
        transport = self.transport
        if not transport.interpolate:
            return min(transport.until_next_frame, HIDDEN_SECONDS)
        if not self._glfw.get_window_attrib(self._window, self._glfw.FOCUSED):
            return float(1 / film_rate(self._timeline.rate))
        return 0.0

    def close(self) -> None:
        """Finish a film, close the window and release its resources; safe to call twice."""
        try:
            self.session.exports.close()
            self.captures.close()
        finally:
            parts = (self._covering, self._gui, self._overlay, self._renderer, self._target, self._readback)
            for part in parts:
                if part is not None:
                    part.close()
            self._covering = self._gui = self._overlay = self._renderer = self._target = self._readback = None
            self._gl = self._window = None
            if self._owned:
                self._surface.close()

    def _prepare(self) -> None:
        """Prepare what draws."""
        glfw = self._glfw
        self._covering = Covering(glfw, self._window)
        rates = [glfw.get_video_mode(monitor).refresh_rate for monitor in glfw.get_monitors()]
        self._least = LEAST_SHARE / max([*rates, USUAL_RATE])
        self._renderer = Renderer(self._gl)
        self._samples = (Quality.FAST if is_software(self._gl) else Quality.FINE).samples

    def _make_panels(self, panels: bool) -> None:
        """Make the panels, or the plain timeline in their place, and connect the input."""
        session = self.session
        session.size, session.scale = self._surface.pixels, self._surface.scale
        if panels:
            try:
                from fba_player._ui.gui import Gui

                self._gui = Gui(self._gl, session)
            except (ImportError, RuntimeError) as error:
                remedy = cure(error, "mpeg4-fba[player]")
                text = f"the window has no panels, as imgui cannot be used: {error}. {remedy}"
                warnings.warn(text, FbaWarning, stacklevel=4)
        if self._gui is None:
            self.controls = Controls(session, plain=True)
            self._overlay = Overlay(self._gl)
        else:
            self.controls = self._gui.controls
        self._full_screen = FullScreen(self._glfw, self._window)
        self.input = GlfwInput(self._glfw, self._window, session, self.controls, self._gui, self._redraw)

    def _redraw(self) -> None:
        self._pictures_due = SETTLING_PICTURES

    def _draw_checked(self, size: tuple[int, int]) -> None:
        """Draw a picture. Raises DisplayError on an unrecoverable OpenGL error."""
        try:
            self._draw(size)
            problem = self._gl.error
        except import_moderngl().Error as error:
            raise DisplayError(LOST.format(reason=" ".join(str(error).split()))) from error
        if problem in ("GL_OUT_OF_MEMORY", "GL_UNKNOWN_ERROR"):  # moderngl has no name for a lost context
            raise DisplayError(LOST.format(reason=problem))

    def _draw(self, size: tuple[int, int]) -> None:
        session = self.session
        session.size, session.scale, session.full_screen = size, self._surface.scale, self._full_screen.active
        session.viewpoint.aspect = size[0] / size[1]
        samples = samples_of(session.scene.switches, self._samples)
        if self._target is None or (self._target.size, self._target.samples) != (size, samples):
            if self._target is not None:
                self._target.close()
            self._target = Target(self._gl, size, samples)
        assert self._renderer is not None
        session.exports.poll()
        self.captures.begin_picture()
        time = self.transport.time
        self._target.begin()
        gradual = wall.perf_counter() if session.recording is None else None  # films need no clock
        camera, smoothed = session.camera(time), self._target.smoothed
        view = session.view(time, camera.seen(size[1]))
        within = self._renderer.draw(view, camera, size, gradual, smoothed=smoothed)
        if self._renderer.morphing:
            self._pictures_due = max(self._pictures_due, 1)
        self._target.finish(self._gl.screen, within)
        self.captures.add_picture(lambda: self._start_reading(size))
        self._handle_requests()
        self._gl.screen.use()
        self._gl.viewport = (0, 0, *size)
        now = wall.perf_counter()
        if self._gui is not None:
            self._gui.draw(now - self._last)
        elif self._overlay is not None and not session.bare:
            self._overlay.draw(self.controls)
        self._last = now
        self.input.set_cursor(hidden=self._full_screen.active and session.hides_mouse)
        self._show_title()

    def _start_reading(self, size: tuple[int, int]) -> Callable[[], UInt8]:
        """Begin to read the window's picture for a film."""
        if self._readback is None:
            self._readback = Readback(self._gl)
        return self._readback.start(self._gl.screen, size)

    def _handle_requests(self) -> None:
        """Do what the user requested: screenshots, films, full screen."""
        session = self.session
        while session.requests:
            request = session.requests.popleft()
            if request in ("screenshot", "transparent"):
                self._screenshot(transparent=request == "transparent")
            elif request == "record":
                self.captures.toggle_recording()
            elif request == "fullscreen":
                self._full_screen.toggle()
            elif request == "copy_command":
                self._copy_command()
            self._redraw()

    def _screenshot(self, *, transparent: bool) -> None:
        assert self._renderer is not None
        try:
            pixels = draw_screenshot(self._gl, self._renderer, self.session, transparent=transparent)
        except DisplayError as error:
            self.session.say(f"No picture could be drawn: {error}", "error", 8.0)
            return
        self.captures.screenshot(pixels, transparent=transparent)

    def _copy_command(self) -> None:
        """Put the command that draws this picture onto the clipboard, and show it."""
        session, time = self.session, self.transport.time
        name = os.path.abspath(session.source.path) if session.source.path is not None else "FILE"
        options = {"time": f"{time:.3f}", **session.viewpoint.options()}
        given = " ".join(f"--{option} {value}" for option, value in options.items())
        text = f"fba render {shlex.quote(name)} -o picture.png {given}"
        self._glfw.set_clipboard_string(self._window, text)
        session.say(f"Copied: {text}", seconds=8.0, about="command")

    def _show_title(self) -> None:
        if page_of(self.session) is not None:
            text = self._title + (" (not saved)" if self.session.unsaved else "")
        else:
            text = f"{self._title} - {self.transport.frame_text()}"
        if text != self._shown_title:
            self._glfw.set_window_title(self._window, text)
            self._shown_title = text

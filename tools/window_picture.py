"""Pictures of the window with its panels, drawn without a window, for tests and documentation.

python -m tools.window_picture talk.fba -o window.png --panels file,view --time 1.5
"""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any

import numpy as np

from fba.arrays import UInt8
from fba_player.gl._context import offscreen_context
from fba_player.gl._framebuffer import Target
from fba_player.gl._renderer import Renderer
from fba_player.session._session import Session

if TYPE_CHECKING:
    from fba_player._ui.gui import Gui

SETTLES = 4
"""Pictures until panels have found their size and position."""


class Studio:
    """Draws a session as its window would, into memory.

    Raises DisplayError without OpenGL, ImportError without imgui.
    """

    def __init__(self, session: Session) -> None:
        from fba_player._ui.gui import Gui

        self.session = session
        self._gl: Any = offscreen_context()
        self._target: Target | None = None
        self._renderer: Renderer | None = None
        self._screen: Any = None
        self._colour: Any = None
        self._gui: Gui | None = None
        try:
            with self._gl:
                self._renderer = Renderer(self._gl)
                self._gui = Gui(self._gl, session, hides=False)
        except Exception:
            self.close()
            raise

    @property
    def gui(self) -> Gui:
        """The panels and the bar."""
        assert self._gui is not None
        return self._gui

    def draw(self, pictures: int = 1, delta: float = 1 / 60) -> UInt8:
        """Draw pictures, `delta` seconds apart; returns the last as uint8 (H, W, 4), top row first.

        The others only let the panels settle: the scene is not drawn in them.
        """
        self.settle(pictures - 1, delta)
        with self._gl:
            self._fit_size()
            self._draw_scene()
            self._screen.use()
            self.gui.draw(delta)
            data = self._screen.read(components=4)
        width, height = self.session.size
        return np.frombuffer(data, np.uint8).reshape(height, width, 4)[::-1]

    def settle(self, pictures: int, delta: float = 1 / 60) -> None:
        """Let the panels follow the mouse and the session for some pictures; the scene is not drawn."""
        with self._gl:
            self._fit_size()
            for _ in range(pictures):
                self._screen.use()
                self.gui.draw(delta)

    def close(self) -> None:
        """Release its resources; safe to call twice."""
        if self._gl is None:
            return
        with self._gl:
            for part in (self._gui, self._renderer, self._target):
                if part is not None:
                    part.close()
            self._release_screen()
        self._gl.release()
        self._gl = None

    def __enter__(self) -> Studio:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _draw_scene(self) -> None:
        assert self._target is not None
        assert self._renderer is not None
        session = self.session
        time = session.transport.time
        self._target.begin()
        within = self._renderer.draw(session.view(time), session.camera(time), session.size)
        self._target.finish(self._screen, within)

    def _fit_size(self) -> None:
        """Make the framebuffers as large as the session's window, if they are not."""
        if self._target is not None and self._target.size == self.session.size:
            return
        if self._target is not None:
            self._target.close()
        self._release_screen()
        self._target = Target(self._gl, self.session.size, samples=0)
        self._colour = self._gl.renderbuffer(self.session.size, 4)
        self._screen = self._gl.framebuffer([self._colour])

    def _release_screen(self) -> None:
        if self._screen is not None:
            self._screen.release()
            self._colour.release()
            self._screen = None


def picture(session: Session, panels: tuple[str, ...] = ()) -> UInt8:
    """The window of a session with these panels open: uint8 (H, W, 4), top row first."""
    session.source.probe(wait=True)
    session.open |= set(panels)
    with Studio(session) as studio:
        return studio.draw(SETTLES).copy()


def main(arguments: list[str]) -> int:
    """Run the command that the module's docstring shows."""
    import argparse

    from PIL import Image

    import fba
    from fba_player.scene.scene import Scene
    from fba_player.session._source import Source

    parser = argparse.ArgumentParser(prog="python -m tools.window_picture", description=__doc__)
    parser.add_argument("file")
    parser.add_argument("-o", "--output", required=True)
    parser.add_argument("--panels", default="", help="names with commas between them")
    parser.add_argument("--size", default="1280x720")
    parser.add_argument("--scale", type=float, default=1.0)
    parser.add_argument("--time", type=float, default=0.0)
    parser.add_argument("--marks", help="IN,OUT in seconds")
    parser.add_argument("--fps")
    given = parser.parse_args(arguments)
    wide, high = (int(part) for part in given.size.split("x"))
    animation = fba.read(given.file, **({"source_rate": given.fps} if given.fps else {}))
    scene = Scene(animation)
    session = Session(scene, source=Source(scene, given.file), size=(wide, high), scale=given.scale)
    session.transport.seek(given.time)
    if given.marks:
        session.transport.mark_in, session.transport.mark_out = (float(m) for m in given.marks.split(","))
    panels = tuple(name for name in given.panels.split(",") if name)
    Image.fromarray(picture(session, panels)).convert("RGB").save(given.output)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

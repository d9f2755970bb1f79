"""Keys, and the mouse over the picture -> the session; knows no window, no OpenGL and no imgui.

Places are in pixels from the upper left corner of the picture.
"""

from __future__ import annotations

from fba_player.session.actions import act
from fba_player.session.keys import by_name
from fba_player.session.session import Session

BAR_HEIGHT = 52
"""Pixels at the bottom that belong to the plain timeline, at a display scale of 1."""
BAR_MARGIN = 16
ORBIT_SPEED = 0.35
"""Degrees a pixel."""
ZOOM_STEP = 0.9


class Controls:
    """What the user can do with keys and with the mouse over the picture.

    plain: there are no panels but the plain timeline at the bottom, which the mouse moves too.
    """

    def __init__(self, session: Session, *, plain: bool = False) -> None:
        self.session = session
        self.plain = plain
        self._held: str | None = None
        self._last = (0.0, 0.0)

    def key(self, name: str, *, held: bool = False) -> bool:
        """A key was pressed, or is still held; names as in the table of keys, in lower case.

        Returns whether it means something.
        """
        session = self.session
        row = by_name().get(name)
        if row is not None:
            session.touched()
            return (not held or row.held) and act(session, row.action)
        return not held and session.press_switch(name)

    def press(self, button: str, x: float, y: float) -> None:
        """A mouse button ("left", "right", "middle") goes down."""
        self._last = (x, y)
        bottom = self.session.size[1] - BAR_HEIGHT * self.session.scale
        if self.plain and button == "left" and y >= bottom:
            self._held = "timeline"
            self._seek(x)
        elif button in ("left", "right", "middle"):
            self._held = "orbit" if button == "left" else "pan"

    def move(self, x: float, y: float) -> None:
        """The mouse moves."""
        right, down = x - self._last[0], y - self._last[1]
        self._last = (x, y)
        viewpoint = self.session.viewpoint
        if self._held == "timeline":
            self._seek(x)
        elif self._held == "orbit" and (right or down):
            turn = ORBIT_SPEED / self.session.scale
            viewpoint.camera = viewpoint.camera.orbit(-right * turn, down * turn)
        elif self._held == "pan" and (right or down):
            height = max(self.session.size[1], 1)
            viewpoint.camera = viewpoint.camera.pan(-right / height, down / height)

    def release(self) -> None:
        """The mouse button goes up."""
        self._held = None

    @property
    def holding(self) -> bool:
        """Whether a button that went down over the picture is still down."""
        return self._held is not None

    def scroll(self, steps: float) -> None:
        """The wheel turns; away from the user is positive and comes nearer."""
        viewpoint = self.session.viewpoint
        viewpoint.camera = viewpoint.camera.zoom(ZOOM_STEP ** max(min(steps, 10.0), -10.0))

    def bar(self) -> tuple[float, float]:
        """Where the plain timeline begins and ends, x in pixels."""
        margin = BAR_MARGIN * self.session.scale
        return margin, max(self.session.size[0] - margin, margin + 1)

    def _seek(self, x: float) -> None:
        low, high = self.bar()
        self.session.transport.seek_share((x - low) / (high - low))

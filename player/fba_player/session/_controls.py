"""Keys, and the mouse over the picture, applied to the session.

Positions are in pixels from the upper left corner of the picture.
"""

from __future__ import annotations

import math

from fba_player.scene.compare import CompareScene
from fba_player.session._actions import act
from fba_player.session._keys import by_name
from fba_player.session._pages import page_of
from fba_player.session._session import Session

BAR_HEIGHT = 52
"""Height of the plain timeline at the bottom, in pixels at a display scale of 1."""
BAR_MARGIN = 16
ORBIT_SPEED = 0.35
"""Degrees per pixel."""
ZOOM_STEP = 0.9
WIPE_REACH = 12.0
"""Pixels, at a display scale of 1, from the line of a wipe within which the mouse takes hold of it."""
CLICK_DISTANCE = 4.0
"""Pixels, at a display scale of 1, by which the mouse may move in a click on a page."""


class Controls:
    """Handles keys, and the mouse over the picture.

    plain: whether the plain timeline at the bottom takes the place of the panels; the mouse seeks in it.
    """

    def __init__(self, session: Session, *, plain: bool = False) -> None:
        self.session = session
        self.plain = plain
        self._held: str | None = None
        self._last = (0.0, 0.0)
        self._dragged = False
        self._may_click = False

    def key(self, name: str, *, held: bool = False) -> bool:
        """Handle a key that was pressed, or is still held. name: as in the table of keys, in lower case.

        Returns whether the key has a meaning.
        """
        session = self.session
        row = by_name().get(name)
        page = page_of(session)
        if page is not None:
            if page.press_key(session, name):
                return True
            if row is None or not page.keeps(row.action):
                return False
        if row is not None:
            session.touched()
            return (not held or row.held) and act(session, row.action)
        return not held and session.press_switch(name)

    def press(self, button: str, x: float, y: float) -> None:
        """Handle a mouse button, "left", "right" or "middle", that goes down."""
        self._last, self._dragged = (x, y), False
        bottom = self.session.size[1] - BAR_HEIGHT * self.session.scale
        if self.plain and button == "left" and y >= bottom:
            self._held = "timeline"
            self._seek(x)
        elif button in ("left", "right", "middle"):
            page = page_of(self.session)
            flat = page is not None and page.grab is not None
            if (
                button == "left"
                and page is not None
                and page.grab is not None
                and page.grab(self.session, x, y)
            ):
                self._held = "item"
            else:
                self._held = "orbit" if button == "left" and not flat else "pan"
            if button == "left" and self.at_wipe(x):
                self._held = "wipe"
            self._may_click = button == "left"

    def move(self, x: float, y: float) -> None:
        right, down = x - self._last[0], y - self._last[1]
        if not self._dragged and page_of(self.session) is not None:
            self._dragged = math.hypot(right, down) > CLICK_DISTANCE * self.session.scale
            if not self._dragged:
                return
        self._last = (x, y)
        viewpoint = self.session.viewpoint
        page = page_of(self.session)
        if self._held == "timeline":
            self._seek(x)
        elif self._held == "wipe" and isinstance(self.session.scene, CompareScene):
            self.session.scene.wipe = min(max(x / max(self.session.size[0], 1), 0.0), 1.0)
        elif self._held == "item" and page is not None and page.drag is not None:
            page.drag(self.session, x, y)
        elif self._held == "orbit" and (right or down):
            turn = ORBIT_SPEED / self.session.scale
            viewpoint.camera = viewpoint.camera.orbit(-right * turn, down * turn)
        elif self._held == "pan" and (right or down):
            height = max(self.session.size[1], 1)
            viewpoint.camera = viewpoint.camera.pan(-right / height, down / height)

    def release(self) -> None:
        """Handle the mouse button going up: one that did not move is a click, on pages that have them."""
        clicked = self._held in ("orbit", "pan") and self._may_click and not self._dragged
        page = page_of(self.session)
        if self._held == "item" and page is not None and page.drop is not None:
            page.drop(self.session)
        self._held = None
        if clicked and page is not None:
            page.click(self.session, *self._last)

    @property
    def holding(self) -> bool:
        """Whether a button that went down over the picture is still down."""
        return self._held is not None

    def scroll(self, steps: float) -> None:
        """Zoom by a turn of the wheel; positive steps, away from the user, zoom in."""
        viewpoint = self.session.viewpoint
        viewpoint.camera = viewpoint.camera.zoom(ZOOM_STEP ** max(min(steps, 10.0), -10.0))

    def bar(self) -> tuple[float, float]:
        """Return left and right end of the plain timeline, in pixels."""
        margin = BAR_MARGIN * self.session.scale
        return margin, max(self.session.size[0] - margin, margin + 1)

    def at_wipe(self, x: float) -> bool:
        """Return whether a pixel is at the line between two figures that are compared."""
        scene = self.session.scene
        if not isinstance(scene, CompareScene) or scene.arrangement != "wipe":
            return False
        return abs(x - scene.wipe * self.session.size[0]) <= WIPE_REACH * self.session.scale

    def _seek(self, x: float) -> None:
        low, high = self.bar()
        self.session.transport.seek_share((x - low) / (high - low))

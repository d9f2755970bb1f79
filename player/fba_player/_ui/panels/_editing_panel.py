"""The base of panels that list items placed on a head by hand, and the widgets that they share."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar, Generic

from imgui_bundle import imgui

from fba_player._ui import theme
from fba_player._ui.panels.panel import Panel, shorten
from fba_player.session._page import Edited, Page
from fba_player.session._session import Session


class EditingPanel(Panel, Generic[Edited]):
    """The panel of a page: the list of its items and what can be done with the current one.

    page: what it belongs to. list_height: share of the panel's height that the list takes.
    """

    page: ClassVar[Page[Any]]
    list_height: ClassVar[float]

    def __init__(self) -> None:
        self._scrolled_to = ""

    def draw_editing(self, session: Session, edited: Edited) -> None:
        """Draw the content with imgui."""
        raise NotImplementedError

    def row_of(self, edited: Edited, name: str) -> tuple[str, theme.Colour]:
        """Return the text and the colour of an item's row in the list."""
        raise NotImplementedError

    def available(self, session: Session) -> bool:
        return self.page.find(session) is not None

    def draw(self, session: Session) -> None:
        edited = self.page.find(session)
        assert edited is not None
        self.draw_editing(session, edited)

    def closed(self, session: Session) -> None:
        session.open.add(self.name)  # without it the page would be of no use

    def draw_list(self, edited: Edited) -> None:
        """Draw all items; a click on one makes it the current one, which is scrolled into view."""
        tall = max(imgui.get_window_height() * self.list_height, 80.0)
        if imgui.begin_child("list", (0, tall)):
            for name in edited.names:
                is_current = name == edited.current
                text, colour = self.row_of(edited, name)
                text = shorten(text, imgui.get_content_region_avail().x)
                imgui.push_style_color(imgui.Col_.text, colour)
                if imgui.selectable(f"{text}##{name}", is_current)[0]:
                    edited.choose(name)
                imgui.pop_style_color()
                if is_current and self._scrolled_to != name:
                    imgui.set_scroll_here_y(0.4)
        imgui.end_child()
        self._scrolled_to = edited.current


def draw_name(name: str) -> None:
    """Draw the name of the current item, large."""
    imgui.push_font(None, theme.LARGE)
    imgui.text_colored(theme.ACCENT, name)
    imgui.pop_font()


def draw_buttons(
    session: Session,
    page: Page[Edited],
    edited: Edited,
    rows: Sequence[Sequence[tuple[str, str, bool]]],
) -> None:
    """Draw rows of buttons (label, action of the page, whether it is enabled) and do what is clicked."""
    for row in rows:
        for number, (label, action, enabled) in enumerate(row):
            if number:
                imgui.same_line()
            imgui.begin_disabled(not enabled)
            if imgui.button(label):
                page.act(session, edited, action)
            imgui.end_disabled()

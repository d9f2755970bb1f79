"""The windows of open panels: docked in columns, or where the user has moved them."""

from __future__ import annotations

from imgui_bundle import imgui

from fba_player._ui._docks import EDGE, GAP, Dock, DockRequest, Docks, free_middle
from fba_player._ui.panels.panel import Panel
from fba_player.session._session import Session

COLUMNS_TOP = 56.0
"""Top of the columns, below the buttons, in points."""

_FLAGS = imgui.WindowFlags_
FREE = int(_FLAGS.no_saved_settings | _FLAGS.no_collapse)
DOCKED = int(FREE | _FLAGS.no_resize | _FLAGS.no_bring_to_front_on_focus)
FOLDED = int(_FLAGS.no_scrollbar | _FLAGS.no_scroll_with_mouse)
COVERING_OPACITY = 0.985
"""Opacity of a panel that covers others."""


class PanelWindows:
    """Draws panels in columns, until the user drags one away by its title.

    A click on the title of a folded panel unfolds it; a double click on the title of a moved one docks it
    again. sides: shares of the display's width that the columns cover at the left and the right.
    """

    def __init__(self) -> None:
        self.sides = (0.0, 0.0)
        self._docks = Docks()
        self._needed: dict[str, float] = {}
        self._moved: set[str] = set()
        self._focused = ""

    def draw(self, panels: list[Panel], session: Session, display: tuple[float, float], below: float) -> None:
        """Draw open panels. display: size in points. below: points that are used at the bottom."""
        wide, high = display
        room = high - COLUMNS_TOP - below - GAP
        self.sides = (0.0, 0.0)
        if room < 60 or wide < 120:
            return
        docked = [panel for panel in panels if panel.side != "middle" and panel.name not in self._moved]
        docks = self._docks.arrange([self._request(panel) for panel in docked], wide, COLUMNS_TOP, room)
        self.sides = free_middle(docks.values(), wide)
        for panel in panels:
            if panel in docked:
                if panel.name in docks:
                    self._draw_docked(panel, session, docks[panel.name])
            else:
                self._draw_free(panel, session, display, room)

    def forget(self, names: set[str]) -> None:
        """Dock these closed panels when they open again."""
        self._moved -= names

    def _request(self, panel: Panel) -> DockRequest:
        height = self._needed.get(panel.name, panel.height) if panel.fitted else panel.height
        return DockRequest(panel.name, panel.side, panel.width, height, panel.least)

    def _draw_docked(self, panel: Panel, session: Session, dock: Dock) -> None:
        imgui.set_next_window_pos((dock.left, dock.top))
        imgui.set_next_window_size((dock.width, dock.height))
        if not self._window(panel, session, DOCKED | (FOLDED if dock.folded else 0), folded=dock.folded):
            session.open.discard(panel.name)

    def _draw_free(self, panel: Panel, session: Session, display: tuple[float, float], room: float) -> None:
        wide = min(panel.width, display[0] - 2 * EDGE)
        if panel.name not in self._moved:
            high = min(self._request(panel).height, room)
            place = ((display[0] - wide) / 2, COLUMNS_TOP + max(room - high, 0.0) / 2)
            imgui.set_next_window_pos(place, imgui.Cond_.always)
            imgui.set_next_window_size((wide, high), imgui.Cond_.always)
            imgui.set_next_window_bg_alpha(COVERING_OPACITY)
        imgui.set_next_window_size_constraints((min(200, wide), 60), (display[0], max(room, 60)))
        if not self._window(panel, session, FREE, folded=False):
            session.open.discard(panel.name)

    def _window(self, panel: Panel, session: Session, flags: int, *, folded: bool) -> bool:
        """Draw the window of a panel; return False if the user closed it."""
        imgui.push_style_var(imgui.StyleVar_.window_min_size, (32, 1))
        expanded, stays_open = imgui.begin(f"{panel.title}###{panel.name}", True, flags)
        imgui.pop_style_var()
        if expanded and not folded:
            panel.draw(session)
            if panel.fitted:
                style = imgui.get_style()
                end = imgui.get_cursor_pos_y() - style.item_spacing.y
                self._needed[panel.name] = end + style.window_padding.y
        self._handle_title(panel, folded=folded)
        imgui.end()
        return bool(stays_open)

    def _handle_title(self, panel: Panel, *, folded: bool) -> None:
        """Handle clicks and drags of the title, and note which panel is in use."""
        name = panel.name
        focused = imgui.is_window_focused(imgui.FocusedFlags_.root_and_child_windows)
        if focused and self._focused != name:  # clicked, or opened
            self._focused = name
            self._docks.use(name)
        if not self._holds_title():
            return
        if name in self._moved:
            if imgui.is_mouse_double_clicked(0):
                self._moved.discard(name)
        elif imgui.is_mouse_dragging(0):
            self._moved.add(name)
            if folded:
                imgui.set_window_size((panel.width, self._request(panel).height))

    @staticmethod
    def _holds_title() -> bool:
        """Return whether the mouse is pressed on the title of the window that is being drawn."""
        x, y = imgui.get_window_pos()
        start_x, start_y = imgui.get_mouse_pos() - imgui.get_mouse_drag_delta(0)
        on_title = y <= start_y <= y + imgui.get_frame_height()
        focused = imgui.is_window_focused(imgui.FocusedFlags_.root_window)
        return bool(focused and on_title and x <= start_x <= x + imgui.get_window_width())

"""Everything over the picture: the imgui context, the bar and the panels.

Windows of open panels are docked in columns, or stay where the user has moved them (`PanelWindows`).
"""

from __future__ import annotations

from typing import Any

from imgui_bundle import imgui, implot

from fba_player._ui import theme
from fba_player._ui._bar import Bar
from fba_player._ui._docks import EDGE, GAP, Dock, DockRequest, Docks, free_middle
from fba_player._ui._hud import (
    WELCOME_HEIGHT,
    buttons_bottom,
    draw_buttons,
    draw_name,
    draw_notices,
    draw_welcome,
    draw_work,
    live_message,
)
from fba_player._ui._imgui_renderer import ImguiRenderer
from fba_player._ui.panels.panel import Panel
from fba_player._ui.panels.registry import make_panels
from fba_player.session._controls import Controls
from fba_player.session._pages import page_of
from fba_player.session._session import Session

COLUMNS_TOP = 56.0
"""Top of the columns, below the buttons, in points."""

_FLAGS = imgui.WindowFlags_
FREE = int(_FLAGS.no_saved_settings | _FLAGS.no_collapse)
DOCKED = int(FREE | _FLAGS.no_resize | _FLAGS.no_bring_to_front_on_focus)
FOLDED = int(_FLAGS.no_scrollbar | _FLAGS.no_scroll_with_mouse)
COVERING_OPACITY = 0.985
"""Opacity of a panel that covers others."""
HIDE_SECONDS = 3.0
"""Seconds without input, and without news of a live stream, after which the bar is hidden while playing."""
FADE_SECONDS = 0.25
"""Seconds in which the bar fades."""


class Gui:
    """Draws the bar and panels of a session on a moderngl context, in a window or into memory.

    hides: whether the bar is hidden while playing. Raises RuntimeError if this build of imgui cannot be used.
    """

    def __init__(self, context: Any, session: Session, *, hides: bool = True) -> None:
        self.session = session
        self.controls = Controls(session)
        self.hides = hides
        self._context: Any = imgui.create_context()
        imgui.set_current_context(self._context)
        self._plots = implot.create_context()
        io = imgui.get_io()
        io.set_ini_filename(None)
        io.config_windows_move_from_title_bar_only = True
        io.config_input_trickle_event_queue = True
        theme.apply_theme()
        self._renderer = ImguiRenderer(context)
        self.bar = Bar(self._renderer)
        self._page = page = page_of(session)
        self._plays = page is None or page.plays
        self.panels = make_panels(page.panel if page is not None else "")
        self._panel_windows = PanelWindows()
        self._open: set[str] = set()
        self._cover()
        session.viewpoint.camera = session.viewpoint.beginning
        self._button = -1
        self._listed = False
        self._message, self._told = "", 0.0  # what a live stream said last, and when
        self.shown = 1.0
        """Opacity of the bar, 0 to 1."""

    @property
    def io(self) -> imgui.IO:
        """Input for imgui, in points: `add_mouse_pos_event` and so on."""
        imgui.set_current_context(self._context)
        return imgui.get_io()

    @property
    def cursor(self) -> str:
        """The mouse cursor that imgui asks for, by its name, such as "arrow"."""
        imgui.set_current_context(self._context)
        return imgui.MouseCursor_(imgui.get_mouse_cursor()).name or "arrow"

    def draw(self, delta: float) -> None:
        """Draw over the bound framebuffer, which has the session's size. delta: seconds since the last call.

        Input over the picture moves the camera.
        """
        session = self.session
        io = self.io
        implot.set_current_context(self._plots)
        scale = session.scale
        display = (session.size[0] / scale, session.size[1] / scale)
        io.display_size = imgui.ImVec2(*display)
        io.display_framebuffer_scale = imgui.ImVec2(scale, scale)
        io.delta_time = min(max(delta, 1e-4), 0.25)
        self._cover()
        session.viewpoint.refit()
        imgui.new_frame()
        if imgui.get_frame_count() > 2:  # before, imgui does not know the layout yet
            self._mouse(io)
        if not session.bare:
            self._draw_all(display, io)
        sides = self._panel_windows.sides if not session.bare else (0.0, 0.0)
        if session.recording is None:  # opening a panel must not move the picture of a film
            session.viewpoint.uncover(*sides, smoothly=self.hides)
        below = self._bar_height(display) * self.shown if not session.bare else 0.0
        draw_notices(session, display, sides[0] * display[0], below)
        self._popups()
        imgui.render()
        self._renderer.draw(imgui.get_draw_data())

    def close(self) -> None:
        """Release its resources; safe to call twice."""
        if self._context is None:
            return
        imgui.set_current_context(self._context)
        for panel in self.panels:
            panel.closed(self.session)
        self._renderer.close()
        implot.destroy_context(self._plots)
        imgui.destroy_context(self._context)
        self._context = None

    def _popups(self) -> None:
        """Tell the session whether a list is open, and close it if the session asks for that."""
        flags = imgui.PopupFlags_
        is_open = imgui.is_popup_open("", flags.any_popup_id | flags.any_popup_level)
        if is_open and self._listed and not self.session.popup:
            imgui.internal.close_popup_to_level(0, True)
            is_open = False
        self._listed = self.session.popup = is_open

    def _cover(self) -> None:
        """Tell the camera how much of the picture the bar covers."""
        session = self.session
        wide, high = (pixels / session.scale for pixels in session.size)
        shown = 0.0 if session.bare else 1.0 / max(high, 1.0)
        hints = WELCOME_HEIGHT if session.greets and self._page is None else 0.0
        session.viewpoint.covered = shown * (self._bar_height((wide, high)) + hints)
        session.viewpoint.covered_above = shown * buttons_bottom((wide, high)) if self._plays else 0.0

    def _draw_all(self, display: tuple[float, float], io: imgui.IO) -> None:
        session = self.session
        self._hide(io)
        below = self._bar_height(display)
        taken = draw_work(session)
        if self.shown > 0 and self._plays:
            imgui.push_style_var(imgui.StyleVar_.alpha, self.shown)
            self.bar.draw(session, display)
            available = [panel for panel in self.panels if panel.available(session)]
            left = draw_buttons(session, available, display)
            if self._page is None:  # the title of a page's window says it
                draw_name(session, display, taken, left - 20)
            imgui.pop_style_var()
        if self._page is None:
            draw_welcome(session, display, below * self.shown)
        closed = self._open - session.open
        self._panel_windows.forget(closed)
        for panel in self.panels:
            if panel.name in closed:
                panel.closed(session)
            elif panel.name in session.open and not panel.available(session):
                session.open.discard(panel.name)
                session.say(f"{panel.title}: there is nothing to show here", "warning")
        shown = [panel for panel in self.panels if panel.name in session.open and panel.available(session)]
        self._panel_windows.draw(shown, session, display, below)
        self._open = set(session.open)

    def _bar_height(self, display: tuple[float, float]) -> float:
        """Return the height of the bar in points; 0 in a window that plays nothing."""
        return self.bar.height(self.session, display) if self._plays else 0.0

    def _hide(self, io: imgui.IO) -> None:
        session = self.session
        busy = imgui.is_any_item_active() or (io.want_capture_mouse and session.idle < 10 * HIDE_SECONDS)
        if (message := live_message(session)) != self._message:
            self._message, self._told = message, session.clock()
        told = session.clock() - self._told < HIDE_SECONDS or session.transport.waiting
        quiet = session.idle > HIDE_SECONDS and not (message and told)
        away = self.hides and session.transport.playing and quiet and not busy and not session.greets
        step = io.delta_time / FADE_SECONDS
        self.shown = max(self.shown - step, 0.0) if away else min(self.shown + 2 * step, 1.0)

    def _mouse(self, io: imgui.IO) -> None:
        """Pass the mouse to the controls where no panel is under it."""
        controls, scale = self.controls, self.session.scale
        x, y = io.mouse_pos.x * scale, io.mouse_pos.y * scale
        if controls.at_wipe(x) and not io.want_capture_mouse:
            imgui.set_mouse_cursor(imgui.MouseCursor_.resize_ew)
        if controls.holding:
            controls.move(x, y)
            if not imgui.is_mouse_down(self._button):
                controls.release()
        elif not io.want_capture_mouse:
            for button, name in enumerate(("left", "right", "middle")):
                if imgui.is_mouse_clicked(button):
                    self._button = button
                    controls.press(name, x, y)
                    break
            if imgui.is_mouse_double_clicked(0) and self._page is None:
                self.session.viewpoint.reset()
            if io.mouse_wheel:
                controls.scroll(io.mouse_wheel)


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

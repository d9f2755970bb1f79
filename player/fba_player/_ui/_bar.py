"""The bar at the bottom of the picture: timeline with lanes, and buttons."""

from __future__ import annotations

from typing import Any

from imgui_bundle import imgui

from fba_player._ui import theme
from fba_player._ui._hud import WELCOME_HEIGHT
from fba_player._ui._imgui_renderer import ImguiRenderer
from fba_player._ui._lane_rows import GUTTER, LaneRows
from fba_player._ui._transport_buttons import SIDE_MARGIN, Buttons
from fba_player._ui.panels.panel import EITHER_BUTTON, STANDING, tooltip
from fba_player._ui.ruler import Ruler, label
from fba_player.playback._time_zoom import TimeZoom
from fba_player.playback._timeline import clock_text
from fba_player.session._keys import key_of
from fba_player.session._session import Session
from fba_player.session._timeline_trace import trace_picture

HEIGHT = 124.0
"""Height of the bar in points."""
LOW_HEIGHT = 60.0
"""Height in windows that have room for the timeline only."""
TRACK_TOP = 24.0
TRACK_HEIGHT = 40.0
BUTTONS = TRACK_TOP + TRACK_HEIGHT + 13.0
"""Upper edge and height of the timeline, and the upper edge of the buttons, in points."""
LEAST_WIDTH, LEAST_HEIGHT = 520.0, 440.0
"""Least size of a window that has lanes, in points."""
ZOOM_BAR = (4.0, 6.0)
"""Distance below the timeline and height of the bar that shows which part of the time is shown, in points."""
ZOOM = 0.8
"""Factor on the time shown for a step of the wheel."""
PAN = 0.1
"""Share of the time shown by which a step of the wheel moves it."""
MOUSE_BUTTONS = EITHER_BUTTON | int(imgui.ButtonFlags_.mouse_button_middle)
GRIP_DISTANCE = 7.0
"""Distance in points within which the mouse grabs a mark."""
LABEL_DISTANCE = 86.0
"""Least distance in points between labels of the ruler."""


class Bar:
    """Draws the transport of a session; the mouse seeks and moves marks in it. One for each window."""

    def __init__(self, renderer: ImguiRenderer) -> None:
        self._renderer = renderer
        self.lanes = LaneRows(renderer)
        self._held = ""
        self._time = 0.0
        self._from = 0.0
        self._trace: tuple[object, ...] = ()
        self._ticks: tuple[Ruler | None, list[float], list[tuple[float, float, str]]] = (None, [], [])
        self.area = (0.0, 0.0, 0.0, 0.0)
        """Left, top, right, bottom of the timeline in points; for tests and pictures."""
        self.zoom_bar = (0.0, 0.0)
        """Centre of the bar that shows the enlarged part, in points; for tests."""
        self._hovered = False
        self.buttons = Buttons()

    def height(self, session: Session, display: tuple[float, float]) -> float:
        """Return the height of the bar in points, in a display of this size."""
        if display[1] < 260 or display[0] < 330:
            return LOW_HEIGHT
        return HEIGHT + (self.lanes.height(session, display) if _has_lanes(display) else 0.0)

    def draw(self, session: Session, display: tuple[float, float]) -> None:
        """Draw the bar at the bottom of a display of this size in points."""
        wide, high = display
        tall = self.height(session, display)
        imgui.set_next_window_pos((0, high - tall))
        imgui.set_next_window_size((wide, tall))
        imgui.push_style_var(imgui.StyleVar_.window_padding, (0, 0))
        imgui.push_style_var(imgui.StyleVar_.window_rounding, 0.0)
        imgui.push_style_var(imgui.StyleVar_.window_border_size, 0.0)
        imgui.push_style_var(imgui.StyleVar_.window_min_size, (1, 1))
        imgui.push_style_color(imgui.Col_.window_bg, (*theme.GROUND[:3], 1.0))  # no legs shine through
        imgui.begin("##bar", None, STANDING)
        imgui.pop_style_color()
        imgui.pop_style_var(4)
        margin = min(SIDE_MARGIN, wide * 0.05)
        lanes = max(tall - HEIGHT, 0.0)
        zoom = self._zoomed(session)
        ruler = Ruler(zoom.low, zoom.high, margin + (GUTTER if lanes else 0.0), wide - margin)
        self._draw_zoom(zoom, ruler, high - tall, lanes)
        self._timeline(session, ruler, high - tall, lanes)
        if lanes:
            self.lanes.draw(session, ruler, high - tall + TRACK_TOP, high)
        self._over_all(session, ruler, high - tall, lanes)
        if tall >= HEIGHT:
            self.buttons.draw(session, wide, high - HEIGHT + BUTTONS)
        imgui.end()

    def _zoomed(self, session: Session) -> TimeZoom:
        """Return the part of the time that is shown; it follows the current time where nobody drags that."""
        zoom, time = session.zoom, session.transport.time
        zoom.bound(*_span(session))
        if time != self._time and not self._held:
            zoom.follow(time)
        self._time = time
        return zoom

    def _draw_zoom(self, zoom: TimeZoom, ruler: Ruler, y: float, lanes: float) -> None:
        """Draw which part of the time is shown, below the timeline, and the button that shows all."""
        if zoom.shows_all:
            return
        imgui.set_cursor_screen_pos((ruler.left - GUTTER if lanes else ruler.right - 30, y + 3))
        imgui.push_style_var(imgui.StyleVar_.frame_padding, (4, 0))
        if imgui.button("fit", (30, 18)):
            zoom.reset()
        imgui.pop_style_var()
        tooltip("show all of the time", key_of("zoom_fit"))
        whole = Ruler(zoom.first, zoom.last, ruler.left, ruler.right)
        top = y + TRACK_TOP + lanes + TRACK_HEIGHT + ZOOM_BAR[0]
        left, right = whole.x(zoom.low), max(whole.x(zoom.high), whole.x(zoom.low) + 8)
        self.zoom_bar = ((left + right) / 2, top + ZOOM_BAR[1] / 2)
        imgui.set_cursor_screen_pos((ruler.left, top - 2))
        imgui.invisible_button("part", (ruler.right - ruler.left, ZOOM_BAR[1] + 4))
        lit = imgui.is_item_active() or imgui.is_item_hovered()
        if imgui.is_item_active():
            moved = imgui.get_io().mouse_delta.x / max(ruler.right - ruler.left, 1.0)
            zoom.pan(moved * (zoom.last - zoom.first))
        tooltip("drag to move the enlarged part; the wheel over the timeline changes its length")
        to, bottom = imgui.get_window_draw_list(), top + ZOOM_BAR[1]
        to.add_rect_filled((ruler.left, top), (ruler.right, bottom), theme.packed(theme.LINE), rounding=3.0)
        colour = theme.packed(theme.ACCENT, 0.9 if lit else 0.6)
        to.add_rect_filled((left, top), (right, bottom), colour, rounding=3.0)

    def _timeline(self, session: Session, ruler: Ruler, y: float, lanes: float) -> None:
        """Draw the time axis and the track; handle the mouse over them and over the lanes between."""
        to = imgui.get_window_draw_list()
        top = y + TRACK_TOP + lanes
        bottom = top + TRACK_HEIGHT
        self.area = (ruler.left, top, ruler.right, bottom)
        if ruler.right - ruler.left < 8:
            return
        imgui.set_cursor_screen_pos((ruler.left - GRIP_DISTANCE, y + 4))
        size = (ruler.right - ruler.left + 2 * GRIP_DISTANCE, bottom - y - 4)
        imgui.invisible_button("timeline", size, MOUSE_BUTTONS)
        self._hovered = imgui.is_item_hovered()
        self._drag(session, ruler)
        self._wheel(session.zoom, ruler)
        to.add_rect_filled((ruler.left, top), (ruler.right, bottom), theme.packed(theme.LINE), rounding=4.0)
        self._draw_trace(session, ruler, top)
        if lanes:
            name = "motion" if session.source.info.plane_bits is None else "bits"
            place = (ruler.left - GUTTER, (top + bottom) / 2 - theme.SMALL / 2)
            to.add_text(imgui.get_font(), theme.SMALL, place, theme.packed(theme.FAINT), name)
        at = ruler.x(session.transport.time)
        to.add_rect_filled((ruler.left, top), (at, bottom), theme.packed(theme.ACCENT, 0.16), rounding=4.0)
        self._scale(to, ruler, y, bottom)

    def _over_all(self, session: Session, ruler: Ruler, y: float, lanes: float) -> None:
        """Draw what stands over the track and the lanes: marks, the current time, the text at the mouse."""
        to = imgui.get_window_draw_list()
        top, bottom = y + TRACK_TOP, y + TRACK_TOP + lanes + TRACK_HEIGHT
        if ruler.right - ruler.left < 8:
            return
        self._marks(session, to, ruler, top, bottom)
        time, colour = session.transport.time, theme.packed(theme.TEXT)
        if session.zoom.shows(time):
            at = ruler.x(time)
            to.add_rect_filled((at - 1, top - 5), (at + 1, bottom + 3), colour)
            to.add_triangle_filled((at - 6, top - 9), (at + 6, top - 9), (at, top - 1), colour)
        if self._hovered or self._held:
            self._hover_text(session, ruler, to, top, bottom)

    def _wheel(self, zoom: TimeZoom, ruler: Ruler) -> None:
        """Zoom with the wheel about the time at the mouse; move sideways, with Shift, or by a middle drag."""
        io = imgui.get_io()
        shown = zoom.high - zoom.low
        if imgui.is_item_active() and imgui.is_mouse_down(2):
            zoom.pan(-io.mouse_delta.x * shown / max(ruler.right - ruler.left, 1.0))
        if not self._hovered:
            return
        imgui.set_item_key_owner(imgui.Key.mouse_wheel_y)
        imgui.set_item_key_owner(imgui.Key.mouse_wheel_x)
        if io.mouse_wheel_h or (io.mouse_wheel and io.key_shift):
            zoom.pan(-(io.mouse_wheel_h or io.mouse_wheel) * PAN * shown)
        elif io.mouse_wheel:
            zoom.zoom(ZOOM ** max(min(io.mouse_wheel, 8.0), -8.0), ruler.time(io.mouse_pos.x))

    def _drag(self, session: Session, ruler: Ruler) -> None:
        transport = session.transport
        x = imgui.get_io().mouse_pos.x
        time = ruler.time(x)
        if imgui.is_item_activated():
            self._held = self._grabbed(session, ruler, x)
            self._from = time
        if not imgui.is_item_active() or imgui.is_mouse_down(2):
            self._held = ""
            return
        session.touched()
        if self._held == "head":
            transport.seek(min(time, ruler.high))
        elif self._held == "in":
            mark = transport.mark_out  # which stays after it
            transport.mark_in = time if mark is None else min(time, mark - 1e-3)
        elif self._held == "out":
            mark = transport.mark_in
            transport.mark_out = time if mark is None else max(time, mark + 1e-3)
        elif self._held == "range" and abs(ruler.x(self._from) - x) > 3:
            transport.clear_marks()
            transport.mark_in, transport.mark_out = min(self._from, time), max(self._from, time)

    def _grabbed(self, session: Session, ruler: Ruler, x: float) -> str:
        if imgui.is_mouse_down(1):
            return "range"
        marks = {"in": session.transport.mark_in, "out": session.transport.mark_out}
        seen = {name: time for name, time in marks.items() if time is not None and session.zoom.shows(time)}
        near = {name: abs(ruler.x(time) - x) for name, time in seen.items()}
        name = min(near, key=lambda mark: near[mark], default="head")
        head = abs(ruler.x(session.transport.time) - x)
        return name if near and near[name] <= min(GRIP_DISTANCE, head) else "head"

    def _draw_trace(self, session: Session, ruler: Ruler, top: float) -> None:
        trace = session.source.trace
        if trace is None:
            return
        scale = session.scale
        size = (max(round((ruler.right - ruler.left) * scale), 1), max(round((TRACK_HEIGHT - 4) * scale), 1))
        key = (trace, size, ruler.low, ruler.high)
        if self._trace[:-1] != key:
            picture = trace_picture(trace, ruler.low, ruler.high, size)
            self._trace = (*key, self._renderer.set_picture("trace", picture))
        image: Any = self._trace[-1]
        to = imgui.get_window_draw_list()
        to.add_image(image, (ruler.left, top + 4), (ruler.right, top + TRACK_HEIGHT))

    def _scale(self, to: imgui.ImDrawList, ruler: Ruler, y: float, bottom: float) -> None:
        if self._ticks[0] != ruler:
            self._ticks = (ruler, *_ticks(ruler))
        _, small, large = self._ticks
        font, colour = imgui.get_font(), theme.packed(theme.FAINT)
        faint, line = theme.packed(theme.FAINT, 0.35), theme.packed(theme.LINE)
        for x in small:
            to.add_line((x, bottom - 3), (x, bottom), faint)
        for x, left, text in large:
            to.add_line((x, y + TRACK_TOP), (x, bottom), line)
            to.add_text(font, 12.0, (left, y + 5), colour, text)

    def _marks(self, session: Session, to: imgui.ImDrawList, ruler: Ruler, top: float, bottom: float) -> None:
        dark = theme.packed((0.05, 0.055, 0.06, 0.62))
        marks = (session.transport.mark_in, 6.0, ruler.left), (session.transport.mark_out, -6.0, ruler.right)
        for time, inwards, edge in marks:
            if time is None:
                continue
            x = ruler.x(time)
            to.add_rect_filled((min(x, edge), top), (max(x, edge), bottom), dark)
            if not session.zoom.shows(time):
                continue
            to.path_clear()
            for at in ((x + inwards, top - 4), (x, top - 4), (x, bottom + 3), (x + inwards, bottom + 3)):
                to.path_line_to(at)
            to.path_stroke(theme.packed(theme.WARM), thickness=2.5)

    def _hover_text(
        self, session: Session, ruler: Ruler, to: imgui.ImDrawList, top: float, bottom: float
    ) -> None:
        """Draw the time, the frame, and the kind and bits of the plane under the mouse."""
        x = min(max(imgui.get_io().mouse_pos.x, ruler.left), ruler.right)
        time = ruler.time(x)
        frame = session.scene.timeline.position(time)[0]
        if not self._held:
            to.add_line((x, top), (x, bottom), theme.packed(theme.TEXT, 0.45))
        text = f"{clock_text(time)}   frame {frame}"
        info = session.source.info
        if info.plane_bits is not None and info.plane_intra is not None and frame < len(info.plane_bits):
            kind = "I" if info.plane_intra[frame] else "P"
            text += f"   {kind} plane, {int(info.plane_bits[frame])} bits"
        said = self.lanes.text(session, time)
        text += f"\n{said}" if said else ""
        size = imgui.calc_text_size(text)
        left = min(max(x - size.x / 2, ruler.left), max(ruler.right - size.x, ruler.left))
        over = imgui.get_foreground_draw_list()
        upper = top - 39 - size.y - (WELCOME_HEIGHT if session.greets else 0.0)
        box = (left - 9, upper), (left + size.x + 9, upper + size.y + 10)
        over.add_rect_filled(*box, theme.packed((0.105, 0.112, 0.124, 0.98)), rounding=6.0)
        over.add_rect(*box, theme.packed(theme.LINE), rounding=6.0)
        over.add_text((left, upper + 5), theme.packed(theme.TEXT), text)


def _has_lanes(display: tuple[float, float]) -> bool:
    return display[0] >= LEAST_WIDTH and display[1] >= LEAST_HEIGHT


def _ticks(ruler: Ruler) -> tuple[list[float], list[tuple[float, float, str]]]:
    """Return the x of small ticks, and (x, left edge of the label, label) of large ones."""
    step = ruler.step(LABEL_DISTANCE)
    large = []
    for time in ruler.ticks(step):
        x, text = ruler.x(time), label(time, step)
        wide = 6.2 * len(text)
        large.append((x, max(min(x - wide / 2, ruler.right - wide), ruler.left), text))
    return [ruler.x(time) for time in ruler.ticks(step / 5)], large


def _span(session: Session) -> tuple[float, float]:
    """Return the times of the first and the last frame."""
    timeline = session.scene.timeline
    start = float(timeline.start)
    return start, max(float(timeline.time_of(timeline.frames - 1)), start)

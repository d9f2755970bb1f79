"""The bar at the bottom of the picture: timeline and buttons."""

from __future__ import annotations

from typing import Any

from imgui_bundle import imgui

from fba_player._ui import theme
from fba_player._ui._imgui_renderer import ImguiRenderer
from fba_player._ui._transport_buttons import SIDE_MARGIN, Buttons
from fba_player._ui.panels.panel import EITHER_BUTTON, STANDING
from fba_player._ui.ruler import Ruler, label
from fba_player.playback._timeline import clock_text
from fba_player.session._session import Session
from fba_player.session._timeline_trace import stretch_at, trace_picture

HEIGHT = 124.0
"""Height of the bar in points."""
LOW_HEIGHT = 60.0
"""Height in windows that have room for the timeline only."""
TRACK_TOP = 24.0
TRACK_HEIGHT = 40.0
BUTTONS = TRACK_TOP + TRACK_HEIGHT + 13.0
"""Upper edge and height of the timeline, and the upper edge of the buttons, in points."""
STRIP_EDGES = (4.0, 9.0)
"""Upper and lower edge of the strip of expressions, in points below the timeline."""
GRIP_DISTANCE = 7.0
"""Distance in points within which the mouse grabs a mark."""
LABEL_DISTANCE = 86.0
"""Least distance in points between labels of the ruler."""


class Bar:
    """Draws the transport of a session; the mouse seeks and moves marks in it. One for each window."""

    def __init__(self, renderer: ImguiRenderer) -> None:
        self._renderer = renderer
        self._held = ""
        self._from = 0.0
        self._trace: tuple[object, ...] = ()
        self._ticks: tuple[Ruler | None, list[float], list[tuple[float, float, str]]] = (None, [], [])
        self.area = (0.0, 0.0, 0.0, 0.0)
        """Left, top, right, bottom of the timeline in points; for tests and pictures."""
        self.buttons = Buttons()

    def height(self, display: tuple[float, float]) -> float:
        """Return the height of the bar in points, in a display of this size."""
        return HEIGHT if display[1] >= 260 and display[0] >= 330 else LOW_HEIGHT

    def draw(self, session: Session, display: tuple[float, float]) -> None:
        """Draw the bar at the bottom of a display of this size in points."""
        wide, high = display
        tall = self.height(display)
        imgui.set_next_window_pos((0, high - tall))
        imgui.set_next_window_size((wide, tall))
        imgui.push_style_var(imgui.StyleVar_.window_padding, (0, 0))
        imgui.push_style_var(imgui.StyleVar_.window_rounding, 0.0)
        imgui.push_style_var(imgui.StyleVar_.window_border_size, 0.0)
        imgui.push_style_var(imgui.StyleVar_.window_min_size, (1, 1))
        imgui.begin("##bar", None, STANDING)
        imgui.pop_style_var(4)
        margin = min(SIDE_MARGIN, wide * 0.05)
        self._timeline(session, Ruler(*_span(session), margin, wide - margin), high - tall)
        if tall == HEIGHT:
            self.buttons.draw(session, wide, high - tall + BUTTONS)
        imgui.end()

    def _timeline(self, session: Session, ruler: Ruler, y: float) -> None:
        transport = session.transport
        to = imgui.get_window_draw_list()
        top, bottom = y + TRACK_TOP, y + TRACK_TOP + TRACK_HEIGHT
        self.area = (ruler.left, top, ruler.right, bottom)
        if ruler.right - ruler.left < 8:
            return
        imgui.set_cursor_screen_pos((ruler.left - GRIP_DISTANCE, y + 4))
        size = (ruler.right - ruler.left + 2 * GRIP_DISTANCE, TRACK_TOP - 4 + TRACK_HEIGHT)
        imgui.invisible_button("timeline", size, EITHER_BUTTON)
        hovered = imgui.is_item_hovered()
        self._drag(session, ruler)
        to.add_rect_filled((ruler.left, top), (ruler.right, bottom), theme.packed(theme.LINE), rounding=4.0)
        self._draw_trace(session, ruler, top)
        at = ruler.x(transport.time)
        to.add_rect_filled((ruler.left, top), (at, bottom), theme.packed(theme.ACCENT, 0.16), rounding=4.0)
        self._draw_expressions(session, to, ruler, bottom)
        self._scale(to, ruler, y, bottom)
        self._marks(session, to, ruler, top, bottom)
        colour = theme.packed(theme.TEXT)
        to.add_rect_filled((at - 1, top - 5), (at + 1, bottom + 3), colour)
        to.add_triangle_filled((at - 6, top - 9), (at + 6, top - 9), (at, top - 1), colour)
        if hovered or self._held:
            self._hover_text(session, ruler, to, top, bottom)

    def _drag(self, session: Session, ruler: Ruler) -> None:
        transport = session.transport
        x = imgui.get_io().mouse_pos.x
        time = ruler.time(x)
        if imgui.is_item_activated():
            self._held = self._grabbed(session, ruler, x)
            self._from = time
        if not imgui.is_item_active():
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
        near = {name: abs(ruler.x(time) - x) for name, time in marks.items() if time is not None}
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

    def _draw_expressions(self, session: Session, to: imgui.ImDrawList, ruler: Ruler, bottom: float) -> None:
        """Draw the expressions that the face shows, the stronger the less transparent."""
        for stretch in session.source.expressions:
            colour = theme.FEELINGS.get(stretch.label)
            if colour is None or not stretch.shows:
                continue
            left, right = ruler.x(stretch.start), min(ruler.x(stretch.end), ruler.right)
            alpha = 0.35 + 0.65 * stretch.intensity / 100
            corners = (left, bottom + STRIP_EDGES[0]), (max(right, left + 1), bottom + STRIP_EDGES[1])
            to.add_rect_filled(*corners, theme.packed(colour, alpha), rounding=2.0)

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
        expression = stretch_at(session.source.expressions, time)
        if expression is not None:
            text += f"   {expression}"
        size = imgui.calc_text_size(text)
        left = min(max(x - size.x / 2, ruler.left), max(ruler.right - size.x, ruler.left))
        over = imgui.get_foreground_draw_list()
        box = (left - 9, top - 54), (left + size.x + 9, top - 54 + size.y + 10)
        over.add_rect_filled(*box, theme.packed((0.105, 0.112, 0.124, 0.98)), rounding=6.0)
        over.add_rect(*box, theme.packed(theme.LINE), rounding=6.0)
        over.add_text((left, top - 49), theme.packed(theme.TEXT), text)


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

"""Curves one below the other over a common time axis; the mouse seeks, zooms and moves them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from imgui_bundle import imgui

from fba_player._ui import theme
from fba_player._ui.panels._curve_data import Course, Envelope, envelope
from fba_player._ui.panels.panel import EITHER_BUTTON, shorten
from fba_player._ui.ruler import Ruler, label
from fba_player.playback._time_zoom import TimeZoom
from fba_player.playback._timeline import clock_text
from fba_player.session._session import Session

COLOURS: tuple[theme.Colour, ...] = (
    (0.36, 0.68, 0.90, 1.0), (0.96, 0.72, 0.33, 1.0), (0.45, 0.80, 0.52, 1.0), (0.90, 0.50, 0.62, 1.0),
    (0.68, 0.58, 0.94, 1.0), (0.35, 0.80, 0.78, 1.0), (0.93, 0.58, 0.36, 1.0), (0.72, 0.78, 0.40, 1.0),
)  # fmt: skip
LABEL_HEIGHT = 19.0
"""Height in points of the name and values above a curve."""
CURVE_HEIGHT = 36.0
"""Height in points of a curve."""
LANE_GAP = 7.0
"""Points between two curves."""
AXIS = 22.0
"""Height in points of the time labels below the curves."""
LABEL_DISTANCE = 74.0
"""Least distance in points between time labels."""
FILLED_IN_WIDTH = 1.0
"""Width in points of a curve where its values were not sent."""
SENT_WIDTH = 1.6
"""Width in points of a curve where its values were sent."""
ZOOM = 0.8
"""Factor on the time shown for a step of the wheel."""


@dataclass(frozen=True)
class Lane:
    """A curve: the course of a parameter and its title. write: formats a value as (number, unit)."""

    course: Course
    title: str
    write: Callable[[float], tuple[str, str]]
    colour: theme.Colour

    @property
    def key(self) -> tuple[str, int]:
        """(kind, number) of the parameter."""
        return self.course.kind, self.course.number


@dataclass(eq=False)
class _Lines:
    """Points of a lane relative to its upper left corner, and the height of its zero line."""

    made_for: tuple[object, ...]
    points: list[imgui.ImVec2]
    runs: list[list[imgui.ImVec2]]
    all_sent: bool
    dense: bool
    zero: float | None
    low: float
    high: float


class Lanes:
    """Draws lanes; their points are reused until the course, the time range or the size changes."""

    def __init__(self) -> None:
        self._lines: dict[tuple[str, int], _Lines] = {}
        self._ticks: tuple[tuple[float, ...], float, list[tuple[float, str]]] = ((), 1.0, [])
        self.area = (0.0, 0.0, 0.0, 0.0)
        """Left, top, right, bottom of the first curve in points; for tests."""

    def draw(
        self, session: Session, lanes: list[Lane], time_zoom: TimeZoom, now: dict[tuple[str, int], float]
    ) -> None:
        """Draw the lanes into the rest of the window. now: current values by the keys of the lanes."""
        room = imgui.get_content_region_avail()
        if session.transport.playing and not imgui.is_mouse_down(1):
            time_zoom.follow(session.transport.time)
        imgui.push_style_var(imgui.StyleVar_.item_spacing, (0, 0))
        imgui.push_style_var(imgui.StyleVar_.window_padding, (0, 0))
        imgui.begin_child("lanes", (0, max(room.y - AXIS, 20.0)))
        wide = imgui.get_content_region_avail().x
        left, top = imgui.get_cursor_screen_pos()
        ruler = Ruler(time_zoom.low, time_zoom.high, left, left + wide)
        visible = imgui.get_window_pos().y, imgui.get_window_pos().y + imgui.get_window_height()
        y = top
        for number, lane in enumerate(lanes):
            if y + LABEL_HEIGHT + CURVE_HEIGHT >= visible[0] and y <= visible[1]:
                self._lane(session, lane, ruler, time_zoom, y, now.get(lane.key))
            if number == 0:
                self.area = (left, y + LABEL_HEIGHT, left + wide, y + LABEL_HEIGHT + CURVE_HEIGHT)
            y += LABEL_HEIGHT + CURVE_HEIGHT + LANE_GAP
        imgui.set_cursor_screen_pos((left, top))
        imgui.dummy((1, max(y - top - LANE_GAP, 1)))
        imgui.end_child()
        imgui.pop_style_var(2)
        bottom = imgui.get_cursor_screen_pos().y
        self._axis(ruler, bottom)
        imgui.dummy((1, AXIS - 4))
        for key in set(self._lines) - {lane.key for lane in lanes}:
            del self._lines[key]

    def _lane(
        self, session: Session, lane: Lane, ruler: Ruler, time_zoom: TimeZoom, y: float, now: float | None
    ) -> None:
        to = imgui.get_window_draw_list()
        left, right, top = ruler.left, ruler.right, y + LABEL_HEIGHT
        wide = right - left
        imgui.set_cursor_screen_pos((left, top))
        name = f"lane{lane.course.kind}{lane.course.number}"
        imgui.invisible_button(name, (max(wide, 1), CURVE_HEIGHT), EITHER_BUTTON)
        hovered = imgui.is_item_hovered()
        _mouse(session, ruler, time_zoom, hovered=hovered, active=imgui.is_item_active())
        to.add_rect_filled((left, top), (right, top + CURVE_HEIGHT), theme.packed(theme.HOLLOW), rounding=3.0)
        lines = self._points(lane, ruler, time_zoom)
        corner = imgui.ImVec2(left, top)
        if lines.zero is not None:
            zero = top + lines.zero
            to.add_line((left, zero), (right, zero), theme.packed(theme.TEXT, 0.13))
        to.push_clip_rect((left, top - 1), (right, top + CURVE_HEIGHT + 1), True)
        colour = _darken(lane.colour) if lines.dense else lane.colour
        if not lines.all_sent:
            _line(to, lines.points, corner, theme.packed(colour, 0.5), FILLED_IN_WIDTH)
        for run in [lines.points] if lines.all_sent else lines.runs:
            _line(to, run, corner, theme.packed(colour), SENT_WIDTH)
        to.pop_clip_rect()
        at = ruler.x(session.transport.time)
        if time_zoom.low <= session.transport.time <= time_zoom.high:
            to.add_line((at, top), (at, top + CURVE_HEIGHT), theme.packed(theme.TEXT, 0.8))
        self._draw_label(to, lane, lines, ruler, y, now)
        if hovered:
            _hover(to, lane, ruler, top)

    def _points(self, lane: Lane, ruler: Ruler, time_zoom: TimeZoom) -> _Lines:
        wide = ruler.right - ruler.left
        key = (lane.course, time_zoom.low, time_zoom.high, wide)
        before = self._lines.get(lane.key)
        if before is not None and before.made_for == key:
            return before
        course = lane.course
        shown = (time_zoom.low, time_zoom.high, max(int(wide), 1))
        points = envelope(course.times, course.values, course.sent, *shown)
        values = course.values if len(course.values) else np.zeros(1)
        lines = self._lines[lane.key] = _make_lines(
            points, key, float(values.min()), float(values.max()), wide
        )
        return lines

    def _draw_label(
        self, to: imgui.ImDrawList, lane: Lane, lines: _Lines, ruler: Ruler, y: float, now: float | None
    ) -> None:
        font = imgui.get_font()
        (low, _), (high, unit) = lane.write(lines.low), lane.write(lines.high)
        number = "" if now is None else lane.write(now)[0]
        span = f"{low} to {high} {unit}" if low != high else f"always {low} {unit}"
        wide = imgui.calc_text_size(number).x
        small = imgui.calc_text_size(span).x * theme.SMALL / imgui.get_font_size()
        fits = ruler.right - ruler.left - small - 74
        to.add_circle_filled((ruler.left + 4, y + 9.5), 3.5, theme.packed(lane.colour))
        title = shorten(lane.title, max(fits - 14, 20))
        to.add_text((ruler.left + 13, y), theme.packed(theme.TEXT), title)
        to.add_text(font, theme.SMALL, (ruler.right - 66 - small, y + 2), theme.packed(theme.FAINT), span)
        to.add_text((ruler.right - wide - 2, y), theme.packed(lane.colour), number)

    def _axis(self, ruler: Ruler, y: float) -> None:
        key = (ruler.low, ruler.high, ruler.left, ruler.right)
        if self._ticks[0] != key:
            step = ruler.step(LABEL_DISTANCE)
            self._ticks = (key, step, [(ruler.x(t), label(t, step)) for t in ruler.ticks(step)])
        to, font, colour = imgui.get_window_draw_list(), imgui.get_font(), theme.packed(theme.FAINT)
        for x, text in self._ticks[2]:
            to.add_line((x, y), (x, y + 4), colour)
            at = min(max(x - 3.1 * len(text), ruler.left), ruler.right - 6.2 * len(text))
            to.add_text(font, 12.0, (at, y + 5), colour, text)


def _mouse(session: Session, ruler: Ruler, time_zoom: TimeZoom, *, hovered: bool, active: bool) -> None:
    io = imgui.get_io()
    if active and imgui.is_mouse_down(0):
        session.touched()
        session.transport.seek(ruler.time(io.mouse_pos.x))
    elif active and imgui.is_mouse_down(1) and io.mouse_delta.x:
        time_zoom.pan(
            -io.mouse_delta.x * (time_zoom.high - time_zoom.low) / max(ruler.right - ruler.left, 1.0)
        )
    if hovered:
        imgui.set_item_key_owner(imgui.Key.mouse_wheel_y)
        if io.mouse_wheel:
            time_zoom.zoom(ZOOM ** max(min(io.mouse_wheel, 8.0), -8.0), ruler.time(io.mouse_pos.x))
        if imgui.is_mouse_double_clicked(1):
            time_zoom.reset()


def _hover(to: imgui.ImDrawList, lane: Lane, ruler: Ruler, top: float) -> None:
    """Show the time under the mouse, and the value there."""
    x = min(max(imgui.get_io().mouse_pos.x, ruler.left), ruler.right)
    to.add_line((x, top), (x, top + CURVE_HEIGHT), theme.packed(theme.TEXT, 0.35))
    if imgui.is_mouse_down(0) or not len(lane.course.times):
        return
    time = ruler.time(x)
    value, unit = lane.write(float(np.interp(time, lane.course.times, lane.course.values)))
    imgui.set_tooltip(f"{clock_text(time)}   {value} {unit}")


def _make_lines(curve: Envelope, key: tuple[object, ...], low: float, high: float, wide: float) -> _Lines:
    """Convert values to points; their range fills the height of the lane."""
    room = high - low or 1.0
    inner = CURVE_HEIGHT - 6

    def y(values: np.ndarray) -> np.ndarray:
        share = np.full(len(values), 0.5) if high == low else (values - low) / room
        return 3 + inner * (1 - share)

    xs, ys = (curve.x * wide).tolist(), y(curve.values).tolist()
    points = list(map(imgui.ImVec2, xs, ys))
    if len(points) == 1:
        points = [imgui.ImVec2(0.0, ys[0]), imgui.ImVec2(wide, ys[0])]
    all_sent = bool(curve.sent.all())
    runs = [] if all_sent else [_widen(points[a:b]) for a, b in curve.runs()]
    zero = float(y(np.zeros(1))[0]) if low < 0 < high else None
    spread = wide * float(np.ptp(curve.x)) if len(points) > 8 else np.inf
    dense = len(points) > 1.5 * spread and float(np.abs(np.diff(curve.values)).mean()) > 0.2 * room
    return _Lines(key, points, runs, all_sent, dense, zero, low, high)


def _darken(colour: theme.Colour) -> theme.Colour:
    """Return a darker colour, for a curve so dense that it fills its lane."""
    red, green, blue, alpha = colour
    return red * 0.6, green * 0.6, blue * 0.6, alpha


def _widen(points: list[imgui.ImVec2]) -> list[imgui.ImVec2]:
    """Return a run of points; a single point becomes a visible dash."""
    if len(points) > 1:
        return points
    x, y = points[0].x, points[0].y
    return [imgui.ImVec2(x - 1.5, y), imgui.ImVec2(x + 1.5, y)]


def _line(
    to: imgui.ImDrawList, points: list[imgui.ImVec2], corner: imgui.ImVec2, colour: int, thickness: float
) -> None:
    if len(points) < 2:
        return
    first = to.vtx_buffer.size()
    to.add_polyline(cast(Any, points), colour, thickness, 0)
    # The points are reused in each picture: the position of the lane is added to their vertices.
    shade = imgui.internal.shade_verts_transform_pos
    shade(to, first, to.vtx_buffer.size(), imgui.ImVec2(0, 0), 1.0, 0.0, corner)

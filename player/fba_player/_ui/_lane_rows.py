"""The lanes of the timeline: what is said, felt and heard, and which groups move."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from imgui_bundle import imgui

from fba.arrays import UInt8
from fba_player._ui import theme
from fba_player._ui._imgui_renderer import ImguiRenderer
from fba_player._ui.ruler import Ruler
from fba_player.playback._lanes import Lane, lane_picture
from fba_player.session._group_activity import Activity, activity_picture
from fba_player.session._session import Session
from fba_player.sound._peaks import Outline, peaks_picture

LANE = 19.0
"""Height of a lane of names in points."""
SOUND = 26.0
"""Height of the lane of the sound."""
GROUP_ROW = 12.0
"""Height of the row of a group."""
GAP = 2.0
"""Points below a lane."""
GUTTER = 74.0
"""Points at the left for the names of lanes."""
MOST_SHARE = 0.3
"""Largest share of the window's height that lanes take; those that do not fit are left out, from below."""
TITLES = {"visemes": "visemes", "expressions": "expressions", "felt": "felt (est.)"}
"""Names of lanes, as they stand at the left."""
NAME_ROOM = 8.0
"""Points around a name in a lane."""


@dataclass(frozen=True, eq=False)
class _Row:
    """A lane. subject: what it shows; draw: makes its picture from time low to high, of a size in pixels."""

    name: str
    height: float
    subject: Any
    draw: Callable[[float, float, tuple[int, int]], UInt8]


class LaneRows:
    """Draws the lanes of a session one below the other, as pictures, which are made again after changes."""

    def __init__(self, renderer: ImguiRenderer) -> None:
        self._renderer = renderer
        self._pictures: dict[str, tuple[object, ...]] = {}
        self.areas: dict[str, tuple[float, float, float, float]] = {}
        """Left, top, right, bottom of lanes in points, by name; for tests."""

    def height(self, session: Session, display: tuple[float, float]) -> float:
        """Return the height of all lanes in points, with the gaps below them."""
        return sum(row.height + GAP for row in _rows(session, display[1]))

    def draw(self, session: Session, ruler: Ruler, top: float, high: float) -> None:
        """Draw the lanes from the height `top` on. high: of the display."""
        self.areas = {}
        to = imgui.get_window_draw_list()
        for row in _rows(session, high):
            area = self.areas[row.name] = (ruler.left, top, ruler.right, top + row.height)
            to.add_rect_filled(area[:2], area[2:], theme.packed(theme.LINE, 0.55), rounding=2.0)
            self._draw_picture(session, row, ruler, area)
            _draw_title(to, row, area)
            if isinstance(row.subject, Lane):
                _draw_names(to, row.subject, ruler, area)
            top += row.height + GAP

    def text(self, session: Session, time: float) -> str:
        """Return what the lanes say about a time, for the text at the mouse; "" without lanes."""
        parts = []
        for lane in session.source.lanes:
            text = lane.text(time)
            if text:
                parts.append(f"{lane.name} (estimated): {text}" if lane.estimated else f"{lane.name}: {text}")
        activity = session.source.activity
        if activity is not None and session.lanes == "all":
            moving = activity.moving(time, 1 / float(session.scene.timeline.rate))
            parts += [f"moving: {', '.join(moving)}"] if moving else []
        return "   ".join(parts)

    def _draw_picture(
        self, session: Session, row: _Row, ruler: Ruler, area: tuple[float, float, float, float]
    ) -> None:
        scale = session.scale
        size = (max(round((area[2] - area[0]) * scale), 1), max(round(row.height * scale), 1))
        key = (row.subject, size, ruler.low, ruler.high, session.sound_offset)
        before = self._pictures.get(row.name)
        if before is None or before[:-1] != key:
            picture = row.draw(ruler.low, ruler.high, size)
            self._pictures[row.name] = (*key, self._renderer.set_picture(f"lane {row.name}", picture))
        image: Any = self._pictures[row.name][-1]
        imgui.get_window_draw_list().add_image(image, area[:2], area[2:])


def _rows(session: Session, high: float) -> list[_Row]:
    """Return the lanes that the session shows and that have room in a display of this height."""
    if session.lanes == "none":
        return []
    rows = [_lane_row(lane) for lane in session.source.lanes]
    if session.peaks is not None and len(session.peaks.outline.low):
        rows.append(_sound_row(session, session.peaks.outline))
    activity = session.source.activity
    if activity is not None and session.lanes == "all":
        rows.append(_group_row(activity))
    shown, room = [], high * MOST_SHARE
    for row in rows:
        if row.height + GAP <= room:
            shown.append(row)
            room -= row.height + GAP
    return shown


def _lane_row(lane: Lane) -> _Row:
    colours = [theme.name_colour(label) for label in lane.labels]
    return _Row(lane.name, LANE, lane, lambda *shown: lane_picture(lane, colours, *shown))


def _sound_row(session: Session, outline: Outline) -> _Row:
    begins = float(session.scene.timeline.start) + session.sound_offset

    def draw(low: float, high: float, size: tuple[int, int]) -> UInt8:
        return peaks_picture(outline, theme.ACCENT, low - begins, high - begins, size)

    return _Row("sound", SOUND, outline, draw)


def _group_row(activity: Activity) -> _Row:
    height = GROUP_ROW * len(activity.names)
    return _Row("groups", height, activity, lambda *shown: activity_picture(activity, theme.WARM, *shown))


def _draw_title(to: imgui.ImDrawList, row: _Row, area: tuple[float, float, float, float]) -> None:
    """Draw the name of a lane, or those of the groups, at the left of it."""
    left, top, _, bottom = area
    titles = row.subject.names if isinstance(row.subject, Activity) else (TITLES.get(row.name, row.name),)
    step = (bottom - top) / len(titles)
    font, size = imgui.get_font(), min(theme.SMALL, step)
    for number, title in enumerate(titles):
        at = (left - GUTTER, top + number * step + (step - size) / 2 - 0.5)
        to.add_text(font, size, at, theme.packed(theme.FAINT), title)
        if number:
            line = top + number * step
            to.add_line((left, line), (area[2], line), theme.packed(theme.LINE))


def _draw_names(
    to: imgui.ImDrawList, lane: Lane, ruler: Ruler, area: tuple[float, float, float, float]
) -> None:
    """Draw the names in the middle of what they stand for, where a viseme is strongest, if there is room."""
    seconds = (ruler.high - ruler.low) / max(ruler.right - ruler.left, 1.0)
    taken = ruler.left
    for start, end, name in lane.named(ruler.low, ruler.high, NAME_ROOM * seconds):
        wide = imgui.calc_text_size(name).x * theme.SMALL / theme.FONT_SIZE
        left = max((ruler.x(start) + ruler.x(end) - wide) / 2, taken + 3)
        if left + wide + 2 > ruler.x(end):
            continue
        at = (left, (area[1] + area[3]) / 2 - theme.SMALL / 2 - 1)
        to.add_text(imgui.get_font(), theme.SMALL, (at[0] + 1, at[1] + 1), theme.packed((0, 0, 0, 0.7)), name)
        to.add_text(imgui.get_font(), theme.SMALL, at, theme.packed(theme.TEXT), name)
        taken = left + wide + 2

"""F5: the panel of curves: chosen FAPs and BAPs, visemes and expressions, and what follows from them."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache, partial
from typing import Any

import numpy as np
from imgui_bundle import imgui

from fba.parameters import BAP_STANDARD_COUNT, FIRST_LOW_LEVEL_FAP, Bap, Fap, baps, faps
from fba_player._ui import theme
from fba_player._ui.panels._curve_data import Course, Courses, amount, parameter
from fba_player._ui.panels._curve_plot import COLOURS, Lane, Lanes
from fba_player._ui.panels._derived import KINDS as DERIVED
from fba_player._ui.panels._derived import derived_name, derived_numbers, derived_unit
from fba_player._ui.panels.panel import Panel, choose_name, tooltip
from fba_player.playback._time_zoom import TimeZoom
from fba_player.scene.compare import CompareScene
from fba_player.scene.scene import Scene
from fba_player.session._session import Session

BEGINS_WITH = 3
"""Number of curves at first: those that move most."""
MOVERS = 8
"""Number of curves of the button "Most moving"."""
MAX_CURVES = 24
"""Largest number of parameters chosen at once."""


class CurvesPanel(Panel):
    """Curves one below the other, each with its least, largest and current value."""

    name, title, label = "curves", "Curves", "Curves"
    side = "left"
    width, height, least = 430.0, 282.0, 176.0

    def __init__(self) -> None:
        self._courses: Courses | None = None
        self._courses_of: Any = None
        self._movers_chosen = False
        self.which = 0
        """Number of the animation whose curves are shown, if several are compared."""
        self._lanes: list[Lane] = []
        self.time_zoom = TimeZoom()
        self.lanes = Lanes()
        self.chooser = Chooser()

    def available(self, session: Session) -> bool:
        return _timeline(session) is not None

    def draw(self, session: Session) -> None:
        names = session.scene.names if isinstance(session.scene, CompareScene) else ()
        if len(names) > 1:
            self.which = choose_name("##which", names, min(self.which, len(names) - 1))
        all_courses = self._update_courses(session)
        timeline = session.scene.timeline
        self.time_zoom = session.zoom
        self.time_zoom.bound(session.transport.start, float(timeline.time_of(timeline.frames - 1)))
        self._tools(session, all_courses)
        chosen = session.selection.all
        if not chosen:
            imgui.dummy((0, 6))
            imgui.text_colored(theme.FAINT, "Choose parameters, or show those that move most.")
            return
        courses = [all_courses.course(kind, number) for kind, number in chosen]
        if [lane.course for lane in self._lanes] != courses:
            self._lanes = [_lane(course, number) for number, course in enumerate(courses)]
        self.lanes.draw(session, self._lanes, self.time_zoom, _now(session, courses, self.which))

    def closed(self, session: Session) -> None:
        session.rolling.discard(self.name)

    def _update_courses(self, session: Session) -> Courses:
        timeline = _timeline(session, self.which)
        if self._courses is None or self._courses_of is not timeline:
            scene: Any = session.scene
            several = isinstance(scene, CompareScene)
            later = scene.timeline.later[self.which] if several else 0
            model = scene.scenes[self.which].model if several else scene.model
            self._courses = Courses(timeline, model, float(later))
            self._courses_of, self._movers_chosen = timeline, False
        if self._courses.advance():
            session.rolling.add(self.name)
        else:
            session.rolling.discard(self.name)
        if not self._movers_chosen and self._courses.resolved_share >= 1.0:
            self._movers_chosen = True
            if not session.selection.all:
                session.selection.choose(self._courses.movers(BEGINS_WITH))
        return self._courses

    def _tools(self, session: Session, courses: Courses) -> None:
        self.chooser.draw(session, face=courses.has_face, body=courses.has_body)
        imgui.same_line()
        if imgui.button("Most moving"):
            session.selection.choose(courses.movers(MOVERS))
        tooltip(f"the {MOVERS} that move most")
        imgui.same_line()
        if imgui.button("None"):
            session.selection.choose([])
        if courses.resolved_share < 1.0:
            imgui.same_line()
            imgui.text_colored(theme.FAINT, f"{courses.resolved_share:.0%}")
        elif not self.time_zoom.shows_all:
            imgui.same_line()
            if imgui.button("Show all"):
                self.time_zoom.reset()
            tooltip("show the full range; the wheel zooms, a right drag moves")


def _timeline(session: Session, which: int = 0) -> Any:
    """Return the timeline of the scene, or of one of several animations that are compared."""
    scene = session.scene
    if isinstance(scene, CompareScene):
        return scene.scenes[which].timeline
    return scene.timeline if isinstance(scene, Scene) else None


def _lane(course: Course, number: int) -> Lane:
    kind = course.kind
    if kind in DERIVED:
        title = derived_name(kind, course.number)
    else:
        title = f"{course.number} {parameter(kind, course.number).name}"
    write = partial(amount, kind, course.number)
    return Lane(course, title, write, COLOURS[number % len(COLOURS)])


def _now(session: Session, courses: list[Course], which: int) -> dict[tuple[str, int], float]:
    """Return the current values of curves; of FAPs and BAPs after the hooks."""
    kinds = {course.kind for course in courses}
    time = session.transport.time
    values = {
        (course.kind, course.number): float(np.interp(time, course.times, course.values))
        for course in courses
        if course.kind in DERIVED and len(course.times)
    }
    if session.before_frame:
        faps, baps = session.values
    else:
        shown_timeline: Any = session.scene.timeline
        timeline = _timeline(session, which)
        if timeline is not shown_timeline:
            time = shown_timeline.own_time(which, time)
        faps = timeline.faps(time) if "fap" in kinds else session.values[0]
        baps = timeline.baps(time) if "bap" in kinds else session.values[1]
    rows = [(course.kind, course.number) for course in courses if course.kind not in DERIVED]
    return values | {(kind, n): float((faps if kind == "fap" else baps)[n - 1]) for kind, n in rows}


@cache
def all_parameters() -> tuple[tuple[str, int, str, str], ...]:
    """Return (kind, number, text shown, text searched) of all parameters, FAPs first."""
    rows: list[tuple[str, int, str, str]] = []
    listed: list[tuple[str, Sequence[Fap | Bap]]] = [
        ("fap", faps()[FIRST_LOW_LEVEL_FAP - 1 :]), ("bap", baps()[:BAP_STANDARD_COUNT]),
    ]  # fmt: skip
    for kind, parameters in listed:
        for row in parameters:
            searched = f"{kind} {row.number} {row.name} {row.name.replace('_', ' ')} {row.group_name}"
            rows.append((kind, row.number, f"{row.number} {row.name}", searched.lower()))
    return tuple(rows)


@cache
def search_parameters(query: str, *, face: bool, body: bool) -> tuple[tuple[str, int, str], ...]:
    """Return (kind, number, text) of curves that match all words: a number, or parts of name or group."""
    words = query.lower().split()
    present = {"fap": face, "bap": body}
    rows = [row for row in all_parameters() if present[row[0]]]
    for kind, number in derived_numbers(face=face, body=body):
        name = derived_name(kind, number)
        rows.append((kind, number, name, f"{name.replace('_', ' ')} {name} {kind} curve".lower()))
    return tuple(
        (kind, number, text)
        for kind, number, text, searched in rows
        if all(_matches(word, number if kind in present else 0, searched) for word in words)
    )


def _matches(word: str, number: int, searched: str) -> bool:
    """Return whether a word matches: a number or a single letter as a full word, others also as a part."""
    if word.isdecimal():
        return word == str(number)
    return word in searched.split() if len(word) == 1 else word in searched


class Chooser:
    """A button that opens the list; its ticks are the selection of the session."""

    def __init__(self) -> None:
        self.query = ""
        self.first_row = (0.0, 0.0)
        """The middle of the first row, in points; for tests."""

    def draw(self, session: Session, *, face: bool, body: bool) -> None:
        """Draw the button, and the list if it is open. face, body: whether to list FAPs, BAPs."""
        if imgui.button("Choose..."):
            imgui.open_popup("choose")
        low, high = imgui.get_item_rect_min(), imgui.get_item_rect_max()
        imgui.set_next_window_pos((low.x, high.y + 4), imgui.Cond_.appearing)
        imgui.set_next_window_size((360, 330))
        if not imgui.begin_popup("choose"):
            return
        if imgui.is_window_appearing():
            imgui.set_keyboard_focus_here()
        imgui.set_next_item_width(-1)
        _, self.query = imgui.input_text_with_hint("##query", "number, name or group", self.query)
        rows = search_parameters(self.query.strip(), face=face, body=body)
        imgui.push_style_var(imgui.StyleVar_.frame_padding, (4, 2))
        imgui.push_style_var(imgui.StyleVar_.item_spacing, (8, 3))
        imgui.begin_child("list", (0, 0))
        selection = session.selection
        clipper = imgui.ListClipper()
        clipper.begin(len(rows))
        while clipper.step():
            for kind, number, text in rows[clipper.display_start : clipper.display_end]:
                on = (kind, number) in selection.all
                full = len(selection.all) >= MAX_CURVES
                changed, _ = imgui.checkbox(f"{text}##{kind}{number}", on)
                if (kind, number, text) == rows[0]:
                    low, high = imgui.get_item_rect_min(), imgui.get_item_rect_max()
                    self.first_row = (low.x + 10, (low.y + high.y) / 2)
                _group(kind, number)
                if changed and (on or not full):
                    selection.toggle(kind, number)
        if not rows:
            imgui.text_colored(theme.FAINT, "no match")
        imgui.end_child()
        imgui.pop_style_var(2)
        imgui.end_popup()


def _group(kind: str, number: int) -> None:
    """Draw the kind and group of a curve at the right end of its row."""
    if kind in DERIVED:
        text = derived_unit(kind, number)
    else:
        text = f"{kind.upper()} {parameter(kind, number).group_name.partition(',')[0]}"
    font, size = imgui.get_font(), theme.SMALL
    right = imgui.get_window_pos().x + imgui.get_content_region_avail().x
    wide = imgui.calc_text_size(text).x * size / imgui.get_font_size()
    y = imgui.get_item_rect_min().y + 3
    imgui.get_window_draw_list().add_text(font, size, (right - wide - 4, y), theme.packed(theme.FAINT), text)

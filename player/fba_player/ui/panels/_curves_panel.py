"""F5: the panel of curves of chosen FAPs and BAPs."""

from __future__ import annotations

from functools import partial
from typing import Any

from imgui_bundle import imgui

from fba_player.scene.compare import CompareScene
from fba_player.scene.scene import Scene
from fba_player.session.session import Session
from fba_player.ui import theme
from fba_player.ui.panels._curve_data import Courses, TimeZoom, amount, parameter
from fba_player.ui.panels._curve_plot import COLOURS, Lane, Lanes
from fba_player.ui.panels._parameter_chooser import Chooser
from fba_player.ui.panels.panel import Panel, choose_name, tooltip

BEGINS_WITH = 3
"""Number of curves at first: those that move most."""
MOVERS = 8
"""Number of curves of the button "Most moving"."""


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
        """Whether the scene has FAPs or BAPs."""
        return _timeline(session) is not None

    def draw(self, session: Session) -> None:
        """Draw the content."""
        names = session.scene.names if isinstance(session.scene, CompareScene) else ()
        if len(names) > 1:
            self.which = choose_name("##which", names, min(self.which, len(names) - 1))
        known = self._update_courses(session)
        transport = session.transport
        self.time_zoom.bound(
            transport.start, float(session.scene.timeline.time_of(session.scene.timeline.frames - 1))
        )
        self._tools(session, known)
        chosen = [("fap", n) for n in session.selection.faps] + [("bap", n) for n in session.selection.baps]
        if not chosen:
            imgui.dummy((0, 6))
            imgui.text_colored(theme.FAINT, "Choose FAPs or BAPs, or show those that move most.")
            return
        courses = [known.course(kind, number) for kind, number in chosen]
        if [lane.course for lane in self._lanes] != courses:
            self._lanes = [_lane(course, number) for number, course in enumerate(courses)]
        self.lanes.draw(session, self._lanes, self.time_zoom, _now(session, chosen, self.which))

    def closed(self, session: Session) -> None:
        """Stop asking for pictures; computed courses stay."""
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
        if not self._movers_chosen and self._courses.known >= 1.0:
            self._movers_chosen = True
            if not (session.selection.faps or session.selection.baps):
                _choose(session, self._courses.movers(BEGINS_WITH))
        return self._courses

    def _tools(self, session: Session, known: Courses) -> None:
        self.chooser.draw(session, face=known.has_face, body=known.has_body)
        imgui.same_line()
        if imgui.button("Most moving"):
            _choose(session, known.movers(MOVERS))
        tooltip(f"the {MOVERS} that move most")
        imgui.same_line()
        if imgui.button("None"):
            _choose(session, [])
        if known.known < 1.0:
            imgui.same_line()
            imgui.text_colored(theme.FAINT, f"{known.known:.0%}")
        elif not self.time_zoom.shows_all:
            imgui.same_line()
            if imgui.button("Show all"):
                self.time_zoom.reset()
            tooltip("show the full range; the wheel zooms, a right drag moves")


def _timeline(session: Session, which: int = 0) -> Any:
    """The timeline of the scene, or of one of several animations that are compared."""
    scene = session.scene
    if isinstance(scene, CompareScene):
        return scene.scenes[which].timeline
    return scene.timeline if isinstance(scene, Scene) else None


def _choose(session: Session, chosen: list[tuple[str, int]]) -> None:
    session.selection.faps = [number for kind, number in chosen if kind == "fap"]
    session.selection.baps = [number for kind, number in chosen if kind == "bap"]


def _lane(course: Any, number: int) -> Lane:
    row = parameter(course.kind, course.number)
    write = partial(amount, course.kind, course.number)
    return Lane(course, f"{row.number} {row.name}", write, COLOURS[number % len(COLOURS)])


def _now(session: Session, chosen: list[tuple[str, int]], which: int) -> dict[tuple[str, int], float]:
    """Current values of parameters, after the hooks."""
    kinds = {kind for kind, _ in chosen}
    if session.before_frame:
        faps, baps = session.values
    else:
        shown_timeline: Any = session.scene.timeline
        timeline, time = _timeline(session, which), session.transport.time
        if timeline is not shown_timeline:
            time = shown_timeline.own_time(which, time)
        faps = timeline.faps(time) if "fap" in kinds else session.values[0]
        baps = timeline.baps(time) if "bap" in kinds else session.values[1]
    return {(kind, n): float((faps if kind == "fap" else baps)[n - 1]) for kind, n in chosen}

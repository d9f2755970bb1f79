"""The list of captured markers, the virtual one of the current, and what can be done with it."""

from __future__ import annotations

from imgui_bundle import imgui

from fba.capture.virtual_markers.mapping import ASSIGNMENTS, OVERLAPS
from fba_player.scene.marker_editing import MarkerEditing
from fba_player.session.marking import KEYS, act_on, editing_of, note_unsaved
from fba_player.session.session import Session
from fba_player.ui import theme
from fba_player.ui.panels.panel import Panel, facts, heading, shorten, tooltip

LIST_HEIGHT = 0.30
"""Share of the panel's height that the list takes."""
SLOWEST, FASTEST = 0.02, 2.0
"""Smallest and largest radius that can be set, in multiples of what a new virtual marker gets."""
ASSIGNMENT_TEXTS = {"shared": "several markers", "exclusive": "the nearest alone"}
OVERLAP_TEXTS = {"match": "meet their markers", "add": "are added"}


class MarkersPanel(Panel):
    """All markers of the capture; a click on one makes it the current one."""

    name, title, label = "markers", "Virtual markers", "Markers"
    width, height = 340.0, 2000.0

    def __init__(self) -> None:
        self._shown = ""

    def available(self, session: Session) -> bool:
        return editing_of(session) is not None

    def draw(self, session: Session) -> None:
        editing = editing_of(session)
        assert editing is not None
        _current(session, editing)
        _reach(editing)
        _buttons(session, editing)
        self._list(editing)
        _settings(editing)
        note_unsaved(session, editing)
        _state(editing)
        if imgui.collapsing_header("Keys"):
            facts("keys", list(KEYS))

    def closed(self, session: Session) -> None:
        session.open.add(self.name)  # without it the page would be of no use

    def _list(self, editing: MarkerEditing) -> None:
        markers, names = editing.mapping.markers, editing.names
        placed = sum(name in markers for name in editing.motion.names)
        heading(
            f"{placed} of {len(editing.motion.names)} on the head, {len(editing.mapping.fixed)} fixed",
            exact=True,
        )
        tall = max(imgui.get_window_height() * LIST_HEIGHT, 80.0)
        if imgui.begin_child("list", (0, tall)):
            for name in names:
                marker = markers.get(name)
                is_current = name == editing.current
                fixed = "  fixed" if marker is not None and marker.fixed else ""
                where = (
                    "" if marker is None else "  beside" if marker.vertex is None else f"  {marker.vertex}"
                )
                colour = theme.FAINT if marker is None else theme.TEXT
                text = shorten(f"{name}{where}{fixed}", imgui.get_content_region_avail().x)
                imgui.push_style_color(imgui.Col_.text, colour)
                if imgui.selectable(f"{text}##{name}", is_current)[0]:
                    editing.choose(name)
                imgui.pop_style_color()
                if is_current and self._shown != name:
                    imgui.set_scroll_here_y(0.4)
        imgui.end_child()
        self._shown = editing.current


def _current(session: Session, editing: MarkerEditing) -> None:
    marker = editing.marker
    imgui.push_font(None, theme.LARGE)
    imgui.text_colored(theme.ACCENT, editing.current)
    imgui.pop_font()
    imgui.push_text_wrap_pos(0.0)
    if marker is None:
        imgui.text_colored(theme.WARM, "not on the head yet: click where it is")
    elif marker.vertex is None:
        imgui.text_unformatted("beside the face: it tells how the head moves")
    else:
        count = 0 if editing.influence is None else int((editing.influence.shares > 0).sum())
        imgui.text_unformatted(f"vertex {marker.vertex}, moves {count} vertices")
    if not editing.seen[session.transport.frame, editing.motion.names.index(editing.source)]:
        imgui.text_colored(theme.FAINT, "not seen in this frame")
    imgui.pop_text_wrap_pos()


def _reach(editing: MarkerEditing) -> None:
    """Sliders of radius and depth, in the head's unit; both go together until the depth is changed alone."""
    marker = editing.marker
    is_placed = marker is not None and marker.vertex is not None
    imgui.begin_disabled(not is_placed)
    usual = editing.first_radius
    low, high = SLOWEST * usual, FASTEST * usual
    radius = marker.radius if marker is not None and is_placed else usual
    depth = marker.depth if marker is not None and is_placed else usual
    digits = "%.4f" if usual < 0.5 else "%.2f"
    changed, value = imgui.slider_float("radius", radius, low, high, digits)
    if changed and value > 0 and is_placed:
        editing.resize(float(value), float(value) if depth == radius else depth)
    tooltip("How far around its vertex the marker moves the head, in the unit of the head")
    changed, value = imgui.slider_float("depth", depth, low, high, digits)
    if changed and value > 0 and is_placed:
        editing.resize(radius, float(value))
    tooltip("How far before and behind its vertex")
    imgui.end_disabled()
    if marker is not None and marker.follows:
        imgui.text_colored(theme.FAINT, f"goes with {marker.follows}")
        return
    changed, fixed = imgui.checkbox("fixed", marker is not None and marker.fixed)
    if changed:
        editing.fix(fixed)
    tooltip("The face does not move it: it tells how the head moves", "X")


def _buttons(session: Session, editing: MarkerEditing) -> None:
    buttons = (
        ("Previous", "previous", True),
        ("Next", "next", True),
        ("Next free", "missing", any(name not in editing.mapping.markers for name in editing.motion.names)),
        ("Remove", "remove", editing.marker is not None),
        ("Undo", "undo", True),
        ("Save", "save", editing.path is not None),
    )
    for number, (label, action, useful) in enumerate(buttons):
        if number not in (0, 3):
            imgui.same_line()
        imgui.begin_disabled(not useful)
        if imgui.button(label):
            act_on(session, editing, action)
        imgui.end_disabled()


def _settings(editing: MarkerEditing) -> None:
    heading("A vertex belongs to")
    for number, name in enumerate(ASSIGNMENTS):
        if number:
            imgui.same_line()
        if imgui.radio_button(ASSIGNMENT_TEXTS[name], editing.mapping.assignment == name):
            editing.assign(name)
    heading("Displacements that overlap")
    for number, name in enumerate(OVERLAPS):
        if number:
            imgui.same_line()
        if imgui.radio_button(OVERLAP_TEXTS[name], editing.mapping.overlap == name):
            editing.add_up(name)
    heading("Shown")
    changed, on = imgui.checkbox("reach of the marker", editing.shows_weights)
    if changed:
        editing.shows_weights = on
    imgui.same_line()
    changed, on = imgui.checkbox("cloud beside", editing.beside)
    if changed:
        editing.beside = on


def _state(editing: MarkerEditing) -> None:
    """What keeps the head from moving, or what is odd."""
    made = editing.performance
    imgui.push_text_wrap_pos(0.0)
    if made is None:
        imgui.text_colored(theme.WARM, f"The head does not move yet: {editing.problem}")
    for doubt in editing.doubts:
        imgui.text_colored(theme.WARM, doubt)
    imgui.pop_text_wrap_pos()

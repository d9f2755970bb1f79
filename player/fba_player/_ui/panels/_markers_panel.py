"""The list of captured markers, the virtual one of the current, and what can be done with it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TypeVar

from imgui_bundle import imgui

from fba.capture.virtual_markers.mapping import ASSIGNMENTS, OVERLAPS
from fba_player._ui import theme
from fba_player._ui.panels._editing_panel import EditingPanel, draw_buttons, draw_name
from fba_player._ui.panels.panel import facts, heading, tooltip
from fba_player.scene.marker_editing import MarkerEditing
from fba_player.session._marking import KEYS, MARKING
from fba_player.session._session import Session

MIN_REACH = 0.02
MAX_REACH = 2.0
"""Limits of the radius and the depth that can be set, in multiples of a new virtual marker's radius."""
ASSIGNMENT_TEXTS = {"shared": "several markers", "exclusive": "the nearest alone"}
OVERLAP_TEXTS = {"match": "meet their markers", "add": "are added"}

Word = TypeVar("Word", bound=str)


class MarkersPanel(EditingPanel[MarkerEditing]):
    """All markers of the capture; a click on one makes it the current one."""

    name, title, label = "markers", "Virtual markers", "Markers"
    width, height = 340.0, 2000.0
    page, list_height = MARKING, 0.30

    def draw_editing(self, session: Session, editing: MarkerEditing) -> None:
        _current(session, editing)
        _reach(editing)
        _buttons(session, editing)
        captured, fixed = editing.motion.names, len(editing.mapping.fixed)
        placed = sum(name in editing.placed for name in captured)
        heading(f"{placed} of {len(captured)} on the head, {fixed} fixed", exact=True)
        self.draw_list(editing)
        _settings(editing)
        MARKING.note_unsaved(session, editing)
        _state(editing)
        if imgui.collapsing_header("Keys"):
            facts("keys", list(KEYS))

    def row_of(self, editing: MarkerEditing, name: str) -> tuple[str, theme.Colour]:
        marker = editing.mapping.markers.get(name)
        if marker is None:
            return name, theme.FAINT
        where = "beside" if marker.vertex is None else str(marker.vertex)
        return f"{name}  {where}{'  fixed' if marker.fixed else ''}", theme.TEXT


def _current(session: Session, editing: MarkerEditing) -> None:
    marker = editing.marker
    draw_name(editing.current)
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
    """Draw sliders of radius and depth, in the head's unit; both move together until the depth is moved
    alone."""
    marker = editing.marker
    is_placed = marker is not None and marker.vertex is not None
    imgui.begin_disabled(not is_placed)
    usual = editing.first_radius
    low, high = MIN_REACH * usual, MAX_REACH * usual
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
    rows = (
        (("Previous", "previous", True), ("Next", "next", True),
         ("Next free", "missing", bool(editing.missing))),
        (("Remove", "remove", editing.marker is not None), ("Undo", "undo", True),
         ("Save", "save", editing.path is not None)),
    )  # fmt: skip
    draw_buttons(session, MARKING, editing, rows)


def _settings(editing: MarkerEditing) -> None:
    heading("A vertex belongs to")
    assignment = _choose(ASSIGNMENTS, ASSIGNMENT_TEXTS, editing.mapping.assignment)
    if assignment is not None:
        editing.assign(assignment)
    heading("Displacements that overlap")
    overlap = _choose(OVERLAPS, OVERLAP_TEXTS, editing.mapping.overlap)
    if overlap is not None:
        editing.add_up(overlap)
    heading("Shown")
    changed, on = imgui.checkbox("reach of the marker", editing.shows_weights)
    if changed:
        editing.shows_weights = on
    imgui.same_line()
    changed, on = imgui.checkbox("cloud beside", editing.beside)
    if changed:
        editing.beside = on


def _choose(names: Sequence[Word], texts: Mapping[str, str], current: str) -> Word | None:
    """Draw radio buttons beside each other; return the name that was clicked, else None."""
    clicked = None
    for number, name in enumerate(names):
        if number:
            imgui.same_line()
        if imgui.radio_button(texts[name], current == name):
            clicked = name
    return clicked


def _state(editing: MarkerEditing) -> None:
    """Draw what keeps the head from moving, or what is odd."""
    made = editing.performance
    imgui.push_text_wrap_pos(0.0)
    if made is None:
        imgui.text_colored(theme.WARM, f"The head does not move yet: {editing.problem}")
    for doubt in editing.doubts:
        imgui.text_colored(theme.WARM, doubt)
    imgui.pop_text_wrap_pos()

"""The panels of pages, which list the items that are placed on a head: feature points, virtual markers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar, Generic

from imgui_bundle import imgui

from fba.capture.virtual_markers.mapping import ASSIGNMENTS, OVERLAPS
from fba.parameters import feature_points, point_rows
from fba_player._ui import theme
from fba_player._ui.panels.panel import (
    Panel,
    choose_by_button,
    facts,
    heading,
    shorten,
    sized,
    tooltip,
    wrapped,
)
from fba_player.scene._photo_scene import PhotoEditing
from fba_player.scene._point_placement import MATES, PointPlacement, describe_point
from fba_player.scene.marker_editing import MarkerEditing
from fba_player.session._pages import (
    MARKER_KEYS,
    MARKING,
    PHOTO_KEYS,
    PHOTOS,
    PLACING,
    POINT_KEYS,
    Edited,
    Page,
)
from fba_player.session._session import Session

MIN_REACH = 0.02
MAX_REACH = 2.0
"""Limits of the radius and the depth that can be set, in multiples of a new virtual marker's radius."""
ASSIGNMENT_TEXTS = dict(zip(ASSIGNMENTS, ("several markers", "the nearest alone"), strict=True))
OVERLAP_TEXTS = dict(zip(OVERLAPS, ("meet their markers", "are added"), strict=True))


class EditingPanel(Panel, Generic[Edited]):
    """The panel of a page: the list of its items and what can be done with the current one.

    page: what it belongs to. list_height: share of the panel's height that the list takes.
    """

    page: ClassVar[Page[Any]]
    list_height: ClassVar[float]

    def __init__(self) -> None:
        self._scrolled_to = ""

    def draw_editing(self, session: Session, edited: Edited) -> None:
        """Draw the content with imgui."""
        raise NotImplementedError

    def row_of(self, edited: Edited, name: str) -> tuple[str, theme.Colour]:
        """Return the text and the colour of an item's row in the list."""
        raise NotImplementedError

    def available(self, session: Session) -> bool:
        return self.page.find(session) is not None

    def draw(self, session: Session) -> None:
        edited = self.page.find(session)
        assert edited is not None
        self.draw_editing(session, edited)

    def closed(self, session: Session) -> None:
        session.open.add(self.name)  # without it the page would be of no use

    def draw_list(self, edited: Edited) -> None:
        """Draw all items; a click on one makes it the current one, which is scrolled into view."""
        tall = max(imgui.get_window_height() * self.list_height, 80.0)
        if imgui.begin_child("list", (0, tall)):
            for name in edited.names:
                is_current = name == edited.current
                text, colour = self.row_of(edited, name)
                text = shorten(text, imgui.get_content_region_avail().x)
                imgui.push_style_color(imgui.Col_.text, colour)
                if imgui.selectable(f"{text}##{name}", is_current)[0]:
                    edited.choose(name)
                imgui.pop_style_color()
                if is_current and self._scrolled_to != name:
                    imgui.set_scroll_here_y(0.4)
        imgui.end_child()
        self._scrolled_to = edited.current


def draw_buttons(
    session: Session, page: Page[Edited], edited: Edited, rows: Sequence[Sequence[tuple[str, str, bool]]]
) -> None:
    """Draw rows of buttons (label, action of the page, whether it is enabled) and do what is clicked."""
    for row in rows:
        for number, (label, action, enabled) in enumerate(row):
            if number:
                imgui.same_line()
            imgui.begin_disabled(not enabled)
            if imgui.button(label):
                page.act(session, edited, action)
            imgui.end_disabled()


class PointsPanel(EditingPanel[PointPlacement]):
    """All points in the order in which they are asked for; a click on one makes it the current one."""

    name, title, label = "points", "Feature points", "Points"
    width, height = 380.0, 2000.0
    page, list_height = PLACING, 0.36

    def draw_editing(self, session: Session, placement: PointPlacement) -> None:
        _draw_point(session, placement)
        missing, units = len(placement.missing), len(placement.missing_units)
        needed = f", {units} of them needed" if units else ""
        heading(f"{len(placement.names) - missing} placed, {missing} missing{needed}", exact=True)
        self.draw_list(placement)
        _draw_parts(placement)
        if imgui.collapsing_header("Keys", imgui.TreeNodeFlags_.default_open):
            facts("keys", list(POINT_KEYS))

    def row_of(self, placement: PointPlacement, name: str) -> tuple[str, theme.Colour]:
        is_placed = name in placement.places
        unplaced_colour = theme.WARM if name in placement.missing_units else theme.FAINT
        text = f"{'+' if is_placed else '-'} {name}  {describe_point(name)}"
        return text, theme.TEXT if is_placed else unplaced_colour


def _draw_point(session: Session, placement: PointPlacement) -> None:
    name = placement.current
    sized(name, theme.LARGE, theme.ACCENT)
    wrapped(describe_point(name))
    wrapped(_place_text(placement, name), theme.FAINT)
    rows = (
        (("Previous", "previous", True), ("Next", "next", True),
         ("Next missing", "missing", bool(placement.missing))),
        (("Mirror", "mirror", name in MATES), ("Mirror all", "mirror all", True)),
        (("Undo", "undo", True), ("Remove", "remove", name in placement.places),
         ("Save", "save", bool(placement.places))),
    )  # fmt: skip
    draw_buttons(session, PLACING, placement, rows)


def _place_text(placement: PointPlacement, name: str) -> str:
    place = placement.places.get(name)
    if place is None:
        guess = f"; {name}? is about there" if placement.guess() is not None else ""
        return f"no place yet: click on the head{guess}"
    if isinstance(place, int):
        return f"on vertex {place}; click elsewhere to move it"
    return "at a position; click on the head to move it"


def _draw_parts(placement: PointPlacement) -> None:
    """Draw a tick box for each of several parts: hair may hide the ears."""
    parts = placement.surface.parts
    if len(parts) < 2 or not imgui.collapsing_header(f"Shown parts ({len(parts)})"):
        return
    for number, part in enumerate(parts):
        changed, shown = imgui.checkbox(f"{part.name}##{number}", number not in placement.hidden)
        if changed and shown:
            placement.hidden.discard(number)
        elif changed:
            placement.hidden.add(number)


class PhotosPanel(EditingPanel[PhotoEditing]):
    """All points of the photographs; a click on one makes it the current one."""

    name, title, label = "photos", "Points on photographs", "Points"
    width, height = 340.0, 2000.0
    page, list_height = PHOTOS, 0.45

    def draw_editing(self, session: Session, editing: PhotoEditing) -> None:
        view, name = editing.current.split()
        sized(name, theme.LARGE, theme.ACCENT)
        wrapped(feature_points()[point_rows()[name]].description)
        wrapped(
            "in the profile, the side that is seen" if view == "side" else "in the frontal picture",
            theme.FAINT,
        )
        rows = (
            (("Previous", "previous", True), ("Next", "next", True),
             ("Next missing", "missing", bool(editing.missing))),
            (("Undo", "undo", True), ("Remove", "remove", editing.current in editing.placed),
             ("Save", "save", bool(editing.placed))),
        )  # fmt: skip
        draw_buttons(session, PHOTOS, editing, rows)
        heading(f"{len(editing.placed)} placed, {len(editing.missing)} missing", exact=True)
        self.draw_list(editing)
        if imgui.collapsing_header("Keys", imgui.TreeNodeFlags_.default_open):
            facts("keys", list(PHOTO_KEYS))

    def row_of(self, editing: PhotoEditing, name: str) -> tuple[str, theme.Colour]:
        view, point = name.split()
        is_placed = name in editing.placed
        text = (
            f"{'+' if is_placed else '-'} {view} {point}  {feature_points()[point_rows()[point]].description}"
        )
        return text, theme.TEXT if is_placed else theme.FAINT


class MarkersPanel(EditingPanel[MarkerEditing]):
    """All markers of the capture; a click on one makes it the current one."""

    name, title, label = "markers", "Virtual markers", "Markers"
    width, height = 340.0, 2000.0
    page, list_height = MARKING, 0.30

    def draw_editing(self, session: Session, editing: MarkerEditing) -> None:
        _draw_marker(session, editing)
        captured, fixed = editing.motion.names, len(editing.mapping.fixed)
        placed = sum(name in editing.placed for name in captured)
        heading(f"{placed} of {len(captured)} on the head, {fixed} fixed", exact=True)
        self.draw_list(editing)
        _draw_settings(editing)
        MARKING.note_unsaved(session, editing)
        _draw_doubts(editing)
        if imgui.collapsing_header("Keys"):
            facts("keys", list(MARKER_KEYS))

    def row_of(self, editing: MarkerEditing, name: str) -> tuple[str, theme.Colour]:
        marker = editing.mapping.markers.get(name)
        if marker is None:
            return name, theme.FAINT
        where = "beside" if marker.vertex is None else str(marker.vertex)
        return f"{name}  {where}{'  fixed' if marker.fixed else ''}", theme.TEXT


def _draw_marker(session: Session, editing: MarkerEditing) -> None:
    marker = editing.marker
    sized(editing.current, theme.LARGE, theme.ACCENT)
    if marker is None:
        wrapped("not on the head yet: click where it is", theme.WARM)
    elif marker.vertex is None:
        wrapped("beside the face: it tells how the head moves")
    else:
        count = 0 if editing.influence is None else int((editing.influence.shares > 0).sum())
        wrapped(f"vertex {marker.vertex}, moves {count} vertices")
    if not editing.seen[session.transport.frame, editing.motion.names.index(editing.source)]:
        wrapped("not seen in this frame", theme.FAINT)
    rows = (
        (("Previous", "previous", True), ("Next", "next", True),
         ("Next free", "missing", bool(editing.missing))),
        (("Remove", "remove", marker is not None), ("Undo", "undo", True),
         ("Save", "save", editing.path is not None)),
    )  # fmt: skip
    _draw_reach(editing)
    draw_buttons(session, MARKING, editing, rows)


def _draw_reach(editing: MarkerEditing) -> None:
    """Draw sliders of radius and depth, which move together until the depth is moved alone."""
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


def _draw_settings(editing: MarkerEditing) -> None:
    heading("A vertex belongs to")
    assignment = choose_by_button(ASSIGNMENT_TEXTS, editing.mapping.assignment)
    if assignment is not None:
        editing.assign(assignment)
    heading("Displacements that overlap")
    overlap = choose_by_button(OVERLAP_TEXTS, editing.mapping.overlap)
    if overlap is not None:
        editing.add_up(overlap)
    heading("Shown")
    editing.shows_weights = imgui.checkbox("reach of the marker", editing.shows_weights)[1]
    imgui.same_line()
    editing.beside = imgui.checkbox("cloud beside", editing.beside)[1]


def _draw_doubts(editing: MarkerEditing) -> None:
    """Draw what keeps the head from moving, or what is odd."""
    if editing.performance is None:
        wrapped(f"The head does not move yet: {editing.problem}", theme.WARM)
    for doubt in editing.doubts:
        wrapped(doubt, theme.WARM)

"""The list of feature points to be placed by hand, the current one, and what can be done with it."""

from __future__ import annotations

from imgui_bundle import imgui

from fba_player._ui import theme
from fba_player._ui.panels._editing_panel import EditingPanel, draw_buttons, draw_name
from fba_player._ui.panels.panel import facts, heading
from fba_player.scene._point_placement import MATES, PointPlacement, describe_point
from fba_player.session._placing import KEYS, PLACING
from fba_player.session._session import Session


class PointsPanel(EditingPanel[PointPlacement]):
    """All points in the order in which they are asked for; a click on one makes it the current one."""

    name, title, label = "points", "Feature points", "Points"
    width, height = 380.0, 2000.0
    page, list_height = PLACING, 0.36

    def draw_editing(self, session: Session, placement: PointPlacement) -> None:
        _current(session, placement)
        missing, units = len(placement.missing), len(placement.missing_units)
        needed = f", {units} of them needed" if units else ""
        heading(f"{len(placement.names) - missing} placed, {missing} missing{needed}", exact=True)
        self.draw_list(placement)
        _parts(placement)
        if imgui.collapsing_header("Keys", imgui.TreeNodeFlags_.default_open):
            facts("keys", list(KEYS))

    def row_of(self, placement: PointPlacement, name: str) -> tuple[str, theme.Colour]:
        is_placed = name in placement.places
        unplaced_colour = theme.WARM if name in placement.missing_units else theme.FAINT
        text = f"{'+' if is_placed else '-'} {name}  {describe_point(name)}"
        return text, theme.TEXT if is_placed else unplaced_colour


def _current(session: Session, placement: PointPlacement) -> None:
    name = placement.current
    draw_name(name)
    imgui.push_text_wrap_pos(0.0)
    imgui.text_unformatted(describe_point(name))
    imgui.text_colored(theme.FAINT, _state(placement, name))
    imgui.pop_text_wrap_pos()
    rows = (
        (("Previous", "previous", True), ("Next", "next", True),
         ("Next missing", "missing", bool(placement.missing))),
        (("Mirror", "mirror", name in MATES), ("Mirror all", "mirror all", True)),
        (("Undo", "undo", True), ("Remove", "remove", name in placement.places),
         ("Save", "save", bool(placement.places))),
    )  # fmt: skip
    draw_buttons(session, PLACING, placement, rows)


def _state(placement: PointPlacement, name: str) -> str:
    place = placement.places.get(name)
    if place is None:
        guess = f"; {name}? is about there" if placement.guess() is not None else ""
        return f"no place yet: click on the head{guess}"
    if isinstance(place, int):
        return f"on vertex {place}; click elsewhere to move it"
    return "at a position; click on the head to move it"


def _parts(placement: PointPlacement) -> None:
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

"""The list of feature points to be placed by hand, the current one, and what can be done with it."""

from __future__ import annotations

from imgui_bundle import imgui

from fba_player.scene.point_placement import MATES, PointPlacement, describe_point
from fba_player.session.placing import KEYS, act_on, placement_of
from fba_player.session.session import Session
from fba_player.ui import theme
from fba_player.ui.panels.panel import Panel, facts, heading, shorten

LIST_HEIGHT = 0.36
"""Share of the panel's height that the list takes."""


class PointsPanel(Panel):
    """All points in the order in which they are asked for; a click on one makes it the current one."""

    name, title, label = "points", "Feature points", "Points"
    width, height = 380.0, 2000.0

    def __init__(self) -> None:
        self._shown = ""

    def available(self, session: Session) -> bool:
        return placement_of(session) is not None

    def draw(self, session: Session) -> None:
        placement = placement_of(session)
        assert placement is not None
        _current(session, placement)
        self._list(placement)
        _parts(placement)
        if imgui.collapsing_header("Keys", imgui.TreeNodeFlags_.default_open):
            facts("keys", list(KEYS))

    def closed(self, session: Session) -> None:
        session.open.add(self.name)  # without it the page would be of no use

    def _list(self, placement: PointPlacement) -> None:
        missing, units = len(placement.missing), len(placement.missing_units)
        needed = f", {units} of them needed" if units else ""
        heading(f"{len(placement.order) - missing} placed, {missing} missing{needed}", exact=True)
        tall = max(imgui.get_window_height() * LIST_HEIGHT, 80.0)
        if imgui.begin_child("list", (0, tall)):
            for name in placement.order:
                is_current = name == placement.current
                colour = theme.TEXT if name in placement.places else theme.WARM
                if name not in placement.places and name not in placement.missing_units:
                    colour = theme.FAINT
                sign = "+" if name in placement.places else "-"
                text = shorten(f"{sign} {name}  {describe_point(name)}", imgui.get_content_region_avail().x)
                imgui.push_style_color(imgui.Col_.text, colour)
                if imgui.selectable(f"{text}##{name}", is_current)[0]:
                    placement.choose(name)
                imgui.pop_style_color()
                if is_current and self._shown != name:
                    imgui.set_scroll_here_y(0.4)
        imgui.end_child()
        self._shown = placement.current


def _current(session: Session, placement: PointPlacement) -> None:
    name = placement.current
    imgui.push_font(None, theme.LARGE)
    imgui.text_colored(theme.ACCENT, name)
    imgui.pop_font()
    imgui.push_text_wrap_pos(0.0)
    imgui.text_unformatted(describe_point(name))
    imgui.text_colored(theme.FAINT, _state(placement, name))
    imgui.pop_text_wrap_pos()
    buttons = (
        ("Previous", "previous", True),
        ("Next", "next", True),
        ("Next missing", "missing", bool(placement.missing)),
        ("Mirror", "mirror", name in MATES),
        ("Mirror all", "mirror all", True),
        ("Undo", "undo", True),
        ("Remove", "remove", name in placement.places),
        ("Save", "save", bool(placement.places)),
    )
    for number, (label, action, useful) in enumerate(buttons):
        if number not in (0, 3, 5):
            imgui.same_line()
        imgui.begin_disabled(not useful)
        if imgui.button(label):
            act_on(session, placement, action)
        imgui.end_disabled()


def _state(placement: PointPlacement, name: str) -> str:
    place = placement.places.get(name)
    if place is None:
        guess = f"; {name}? is about there" if placement.guess() is not None else ""
        return f"no place yet: click on the head{guess}"
    if isinstance(place, int):
        return f"on vertex {place}; click elsewhere to move it"
    return "at a position; click on the head to move it"


def _parts(placement: PointPlacement) -> None:
    """A tick for each part, where there are several: hair may hide the ears."""
    parts = placement.surface.parts
    if len(parts) < 2 or not imgui.collapsing_header(f"Shown parts ({len(parts)})"):
        return
    for number, part in enumerate(parts):
        changed, shown = imgui.checkbox(f"{part.name}##{number}", number not in placement.hidden)
        if changed and shown:
            placement.hidden.discard(number)
        elif changed:
            placement.hidden.add(number)

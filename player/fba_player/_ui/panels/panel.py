"""The base class of panels, and the widgets that they share."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import ClassVar, TypeVar

from imgui_bundle import imgui

from fba_player._ui import theme
from fba_player.session._keys import key_of
from fba_player.session._session import Session

Word = TypeVar("Word", bound=str)

_FLAGS = imgui.WindowFlags_
STANDING = int(
    _FLAGS.no_decoration | _FLAGS.no_move | _FLAGS.no_saved_settings | _FLAGS.no_bring_to_front_on_focus
    | _FLAGS.no_nav | _FLAGS.no_focus_on_appearing
)  # fmt: skip
"""Flags of a fixed window without a title: the bar, the buttons."""
EITHER_BUTTON = int(imgui.ButtonFlags_.mouse_button_left | imgui.ButtonFlags_.mouse_button_right)


class Panel:
    """A window over the picture; subclasses set the names and draw the content.

    name: in the table of keys ("panel NAME" is its action) and in `Session.open`. title: as shown. label: on
    its button above the picture. side: the column where it opens, "right" or "left"; "middle" for one that
    covers the picture. width, height: size in points that it asks for. fitted: whether its content decides
    its height. least: least useful height where several share a column. The window has one object of each
    panel.
    """

    name: ClassVar[str]
    title: ClassVar[str]
    label: ClassVar[str]
    side: ClassVar[str] = "right"
    width: ClassVar[float] = 300.0
    height: ClassVar[float] = 300.0
    fitted: ClassVar[bool] = False
    least: ClassVar[float] = 150.0

    def draw(self, session: Session) -> None:
        """Draw the content with imgui; called for each picture while the panel is open."""
        raise NotImplementedError

    def available(self, session: Session) -> bool:
        """Return whether the panel is of use for this scene; else it has no button."""
        return True

    def closed(self, session: Session) -> None:
        """Called once when the panel is closed, and when the window is closed."""

    @property
    def key(self) -> str:
        """Its key as text; "" if it has none."""
        return key_of(f"panel {self.name}")


def facts(name: str, rows: list[tuple[str, str]]) -> None:
    """Draw a table of (label, value) rows. name: its imgui identifier."""
    if imgui.begin_table(name, 2, imgui.TableFlags_.sizing_fixed_fit | imgui.TableFlags_.pad_outer_x):
        imgui.table_setup_column("what", imgui.TableColumnFlags_.width_fixed)
        imgui.table_setup_column("value", imgui.TableColumnFlags_.width_stretch)
        for what, value in rows:
            imgui.table_next_row()
            imgui.table_next_column()
            imgui.text_colored(theme.FAINT, what)
            imgui.table_next_column()
            wrapped(value)
        imgui.end_table()


def wrapped(text: str, colour: theme.Colour = theme.TEXT) -> None:
    """Draw a text in a colour, wrapped at the right edge."""
    imgui.push_text_wrap_pos(0.0)
    imgui.text_colored(colour, text)
    imgui.pop_text_wrap_pos()


def heading(text: str, *, exact: bool = False) -> None:
    """Draw a heading, in capitals unless `exact`, which is for text with names in it."""
    imgui.dummy((0, 2))
    sized(text if exact else text.upper(), theme.SMALL, theme.ACCENT)


def sized(text: str, size: float, colour: theme.Colour) -> None:
    """Draw a text in letters of this size, in points."""
    imgui.push_font(None, size)
    imgui.text_colored(colour, text)
    imgui.pop_font()


def shorten(text: str, wide: float) -> str:
    """Return the text, cut with "..." to a width in points."""
    if imgui.calc_text_size(text).x <= wide:
        return text
    while text and imgui.calc_text_size(text + "...").x > wide:
        text = text[:-1]
    return text.rstrip(" ;,") + "..."


def choose_name(label: str, names: Sequence[str], now: int, width: float = -1) -> int:
    """Draw a list of names, of which number `now` is chosen; return the new choice. width: points."""
    imgui.set_next_item_width(width)
    if imgui.begin_combo(label, names[now]):
        for number, name in enumerate(names):
            if imgui.selectable(f"{name}##{number}", number == now)[0]:
                now = number
        imgui.end_combo()
    return now


def choose_by_button(texts: Mapping[Word, str], now: str) -> Word | None:
    """Draw radio buttons beside each other, with the texts of names; return a name that is clicked."""
    clicked = None
    for number, (name, text) in enumerate(texts.items()):
        if number:
            imgui.same_line()
        if imgui.radio_button(text, now == name):
            clicked = name
    return clicked


def tooltip(text: str, key: str = "") -> None:
    """Show a text while the mouse rests on the last item, with the key that does the same."""
    if imgui.is_item_hovered(imgui.HoveredFlags_.for_tooltip) and imgui.begin_tooltip():
        imgui.text_unformatted(text)
        if key:
            imgui.same_line()
            imgui.text_colored(theme.FAINT, key)
        imgui.end_tooltip()


def icon_button(
    name: str,
    draw_icon: Callable[[imgui.ImDrawList, float, float, float, int], None],
    size: float = 30.0,
    *,
    lit: bool = False,
    colour: theme.Colour | None = None,
    filled: bool = False,
) -> bool:
    """Draw a square button with an icon; return whether it is pressed. lit: whether its state is on."""
    x, y = imgui.get_cursor_screen_pos()
    pressed = imgui.invisible_button(name, (size, size))
    to, held, hovered = imgui.get_window_draw_list(), imgui.is_item_active(), imgui.is_item_hovered()
    if filled:
        ground = theme.packed(theme.ACCENT, 1.0 if hovered else 0.9)
        to.add_circle_filled((x + size / 2, y + size / 2), size / 2 - (1 if held else 0), ground)
    elif hovered or held:
        ground = theme.packed(theme.HOVERED if hovered and not held else theme.RAISED)
        to.add_rect_filled((x, y), (x + size, y + size), ground, rounding=6.0)
    shade = (0.06, 0.07, 0.08, 1.0) if filled else colour or (theme.ACCENT if lit else theme.TEXT)
    draw_icon(to, x + size / 2, y + size / 2, size * (0.25 if filled else 0.27), theme.packed(shade))
    return bool(pressed)

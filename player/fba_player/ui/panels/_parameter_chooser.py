"""A list of FAPs and BAPs with search, to choose curves from."""

from __future__ import annotations

from functools import cache

from imgui_bundle import imgui

from fba.parameters import BAP_STANDARD_COUNT, FIRST_LOW_LEVEL_FAP, baps, faps
from fba_player.session.session import Session
from fba_player.ui import theme

MOST = 24
"""Most parameters chosen at once."""


@cache
def all_parameters() -> tuple[tuple[str, int, str, str], ...]:
    """(kind, number, text shown, text searched) of all parameters, FAPs first."""
    rows = []
    for fap in faps()[FIRST_LOW_LEVEL_FAP - 1 :]:
        searched = f"fap {fap.number} {fap.name} {fap.name.replace('_', ' ')} {fap.group_name}".lower()
        rows.append(("fap", fap.number, f"{fap.number} {fap.name}", searched))
    for bap in baps()[:BAP_STANDARD_COUNT]:
        searched = f"bap {bap.number} {bap.name} {bap.name.replace('_', ' ')} {bap.group_name}".lower()
        rows.append(("bap", bap.number, f"{bap.number} {bap.name}", searched))
    return tuple(rows)


@cache
def search_parameters(query: str, *, face: bool, body: bool) -> tuple[tuple[str, int, str], ...]:
    """(kind, number, text) of the parameters that match all words: a number, or parts of name or group."""
    words = query.lower().split()
    rows = []
    for kind, number, text, searched in all_parameters():
        if not (face if kind == "fap" else body):
            continue
        if all(_matches(word, number, searched) for word in words):
            rows.append((kind, number, text))
    return tuple(rows)


def _matches(word: str, number: int, searched: str) -> bool:
    """Whether a word matches; numbers and single letters only as a full word, others also as a part."""
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
                on = number in (selection.faps if kind == "fap" else selection.baps)
                full = len(selection.faps) + len(selection.baps) >= MOST
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
    """Draw the kind and group of a parameter at the right end of its row."""
    name = (faps() if kind == "fap" else baps())[number - 1].group_name.partition(",")[0]
    text = f"{kind.upper()} {name}"
    font, size = imgui.get_font(), theme.SMALL
    right = imgui.get_window_pos().x + imgui.get_content_region_avail().x
    wide = imgui.calc_text_size(text).x * size / imgui.get_font_size()
    y = imgui.get_item_rect_min().y + 3
    imgui.get_window_draw_list().add_text(font, size, (right - wide - 4, y), theme.packed(theme.FAINT), text)

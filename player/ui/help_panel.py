"""F1: what keys and mouse do."""

from __future__ import annotations

from imgui_bundle import imgui

from player.ui import theme
from player.ui.keys import keys, mouse
from player.ui.panel import Panel, heading
from player.ui.session import Session


class HelpPanel(Panel):
    """All keys, from the table of keys, those of switches, and the mouse; in two columns where they fit."""

    name, title, label = "help", "Keys and mouse", "Help"
    side = "left"
    width, height = 800.0, 560.0

    def draw(self, session: Session) -> None:
        """Draw it."""
        wide = imgui.get_content_region_avail().x
        if wide > 640 and imgui.begin_table("columns", 2):
            imgui.table_next_row()
            imgui.table_next_column()
            _groups({"Play", "Keep"})
            imgui.table_next_column()
            _groups({"View", "Window"})
            _rest(session)
            imgui.end_table()
        else:
            _groups({row.group for row in keys()})
            _rest(session)


def _groups(chosen: set[str]) -> None:
    group = ""
    for row in keys():
        if row.group not in chosen:
            continue
        if row.group != group:
            if group:
                imgui.end_table()
            group = row.group
            heading(group)
            _table(group)
        _line(row.shown, row.does)
    imgui.end_table()


def _rest(session: Session) -> None:
    switches = session.switch_keys()
    if switches:
        heading("Switches")
        _table("switches")
        for key, text in switches:
            _line(key, text)
        imgui.end_table()
    heading("Mouse")
    _table("mouse")
    for what, does in mouse():
        _line(what, does)
    imgui.end_table()


def _table(name: str) -> None:
    imgui.begin_table(name, 2, imgui.TableFlags_.sizing_fixed_fit)
    imgui.table_setup_column("key", imgui.TableColumnFlags_.width_fixed, 138.0)
    imgui.table_setup_column("does", imgui.TableColumnFlags_.width_stretch)


def _line(key: str, does: str) -> None:
    imgui.table_next_row()
    imgui.table_next_column()
    imgui.push_text_wrap_pos(0.0)
    imgui.text_unformatted(key)
    imgui.pop_text_wrap_pos()
    imgui.table_next_column()
    imgui.push_style_color(imgui.Col_.text, theme.FAINT)
    imgui.push_text_wrap_pos(0.0)
    imgui.text_unformatted(does)
    imgui.pop_text_wrap_pos()
    imgui.pop_style_color()

"""F1: the help about keys and mouse."""

from __future__ import annotations

from imgui_bundle import imgui

from fba_player._ui import theme
from fba_player._ui.panels.panel import Panel, heading, wrapped
from fba_player.session._keys import keys, mouse
from fba_player.session._session import Session

MIN_COLUMN_WIDTH = 296.0
"""Least width of a column in points."""
KEY_WIDTH = 124.0
"""Largest width of the keys in a column, in points."""
COLUMNS = {
    2: (("Play", "Save", "Window"), ("View", "Switches", "Mouse")),
    3: (("Play",), ("View", "Switches", "Save"), ("Window", "Mouse")),
    4: (("Play",), ("View", "Switches"), ("Window", "Save"), ("Mouse",)),
}
"""Groups in each column, by the number of columns."""


class HelpPanel(Panel):
    """The keys of actions and switches, and the mouse; in as many columns as fit."""

    name, title, label = "help", "Keys and mouse", "Help"
    side = "middle"
    width, height, fitted = 1240.0, 520.0, True

    def draw(self, session: Session) -> None:
        groups = _groups(session)
        columns = min(int(imgui.get_content_region_avail().x // MIN_COLUMN_WIDTH), 4)
        imgui.push_style_var(imgui.StyleVar_.cell_padding, (6, 1.5))
        if columns > 1 and imgui.begin_table("columns", columns):
            imgui.table_next_row()
            for names in COLUMNS[columns]:
                imgui.table_next_column()
                for name in names:
                    _group(name, groups.get(name, []))
            imgui.end_table()
        elif columns <= 1:
            for name, rows in groups.items():
                _group(name, rows)
        imgui.pop_style_var()


def _groups(session: Session) -> dict[str, list[tuple[str, str]]]:
    """Return (keys, what they do) by name of the group."""
    groups: dict[str, list[tuple[str, str]]] = {}
    for row in keys():
        groups.setdefault(row.group, []).append((row.shown, row.does))
    groups["Switches"] = session.switch_keys()
    groups["Mouse"] = list(mouse())
    return groups


def _group(name: str, rows: list[tuple[str, str]]) -> None:
    if not rows:
        return
    heading(name)
    imgui.begin_table(name, 2, imgui.TableFlags_.sizing_fixed_fit)
    wide = min(max(imgui.calc_text_size(key).x for key, _ in rows), KEY_WIDTH)
    imgui.table_setup_column("key", imgui.TableColumnFlags_.width_fixed, wide)
    imgui.table_setup_column("does", imgui.TableColumnFlags_.width_stretch)
    for key, does in rows:
        imgui.table_next_row()
        imgui.table_next_column()
        wrapped(key)
        imgui.table_next_column()
        wrapped(does, theme.FAINT)
    imgui.end_table()

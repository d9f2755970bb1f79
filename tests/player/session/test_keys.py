"""The table of keys, the panels that it opens, and the documentation of both."""

import re
from pathlib import Path

import graphics
from fba_player.session._keys import by_name, key_of, keys, mouse
from fba_player.view.switches import SWITCHES

ROOT = Path(__file__).parents[3]


def documented() -> list[tuple[str, str]]:
    text = (ROOT / "docs" / "play.md").read_text(encoding="utf-8")
    part = re.split(r"^## ", text, flags=re.MULTILINE)
    section = next(one for one in part if one.startswith("Keys and mouse"))
    rows = re.findall(r"^\| (.+?) \| (.+?) \|$", section, flags=re.MULTILINE)
    return [(keys.replace("`", ""), does) for keys, does in rows]


def test_the_documentation_has_every_key_in_order() -> None:
    wanted = [(row.shown, row.does) for row in keys()]
    wanted += [(one.key, one.label) for one in SWITCHES.values() if one.key]
    assert documented() == wanted + list(mouse())


def test_no_key_does_two_things() -> None:
    names = [name.lower() for row in keys() for name in row.keys]
    assert len(names) == len(set(names)) == len(by_name())


def test_keys_are_shown_as_people_write_them() -> None:
    assert key_of("toggle") == "Space"
    assert key_of("transparent") == "Shift+F12"
    assert key_of("faster") == "+"
    assert key_of("panel file") == "F2"
    assert key_of("no such thing") == ""
    assert [row.shown for row in keys() if row.action == "fullscreen"] == ["F, F11"]


def test_every_panel_has_a_key_and_every_key_its_panel() -> None:
    graphics.imported("imgui_bundle")
    from fba_player._ui.panels.registry import make_panels

    panels = [panel.name for panel in make_panels()]
    opened = [row.action.removeprefix("panel ") for row in keys() if row.action.startswith("panel ")]
    assert sorted(panels) == sorted(opened)
    assert len(set(panels)) == len(panels)

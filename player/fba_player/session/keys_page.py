"""The tables of keys for docs/play.md: `python -m fba_player.session.keys_page` prints them."""

from __future__ import annotations

import re
import sys

from fba_player.session.keys import keys, mouse
from fba_player.view.switches import SWITCHES


def tables() -> str:
    """Markdown: a table for each group of keys, for switches and for the mouse."""
    lines: list[str] = []
    group = ""
    for row in keys():
        if row.group != group:
            group = row.group
            lines += _head(group.lower())
        lines.append(f"| {', '.join(_marked(key) for key in row.shown.split(', '))} | {row.does} |")
    lines += _head("switch") + [f"| {one.key} | {one.label} |" for one in SWITCHES.values() if one.key]
    lines += _head("mouse") + [f"| {what} | {does} |" for what, does in mouse()]
    return "\n".join(lines[1:]) + "\n"


def _head(title: str) -> list[str]:
    return ["", f"| {title} | |", "|---|---|"]


def _marked(key: str) -> str:
    """Signs as code, so that they are not taken for marks of the page."""
    return key if re.fullmatch(r"\w+([+]\w+)*", key) else f"`{key}`"


if __name__ == "__main__":
    sys.stdout.write(tables())

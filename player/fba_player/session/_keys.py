"""The table of keys, for the window, the help and docs/play.md.

`python -m fba_player.session._keys` prints the tables of docs/play.md.
"""

from __future__ import annotations

import re
import sys
from dataclasses import dataclass
from functools import cache

from fba.text_files import packaged_rows
from fba_player.view.switches import SWITCHES


@dataclass(frozen=True, slots=True)
class Key:
    """A row of the table.

    keys: one or more, such as "F12" or "Ctrl+S". action: see `fba_player.session._actions`. held: whether it
    repeats while the key is held. group, does: for the help. shown: the keys as text, "Esc, Q".
    """

    keys: tuple[str, ...]
    action: str
    held: bool
    group: str
    does: str
    shown: str


@cache
def keys() -> tuple[Key, ...]:
    """Return all rows, in the order of the help."""
    return tuple(
        Key(
            keys=tuple(row["keys"].split()),
            action=row["action"],
            held=bool(row["held"]),
            group=row["group"],
            does=row["does"],
            shown=", ".join(_key_text(key) for key in row["keys"].split()),
        )
        for row in packaged_rows(__package__, "keys.csv")
    )


@cache
def mouse() -> tuple[tuple[str, str], ...]:
    """Return (mouse gesture, what it does), for the help."""
    return tuple((row["mouse"], row["does"]) for row in packaged_rows(__package__, "mouse.csv"))


@cache
def by_name() -> dict[str, Key]:
    """Return the rows by the name of a key in lower case: "space", "shift+f12", "ctrl+s"."""
    return {name.lower(): row for row in keys() for name in row.keys}


@cache
def key_of(action: str) -> str:
    """Return the first key of an action, as shown to users; "" if it has none."""
    return next((_key_text(row.keys[0]) for row in keys() if row.action == action), "")


def _key_text(key: str) -> str:
    return key if len(key) == 1 else "+".join(part[:1].upper() + part[1:] for part in key.split("+"))


def tables() -> str:
    """Return a table in Markdown for each group of keys, for switches and for the mouse."""
    lines: list[str] = []
    group = ""
    for row in keys():
        if row.group != group:
            group = row.group
            lines += _table_head(group.lower())
        lines.append(f"| {', '.join(_to_markdown(key) for key in row.shown.split(', '))} | {row.does} |")
    switches = [switch for switch in SWITCHES.values() if switch.key]
    lines += _table_head("switch") + [f"| {switch.key} | {switch.label} |" for switch in switches]
    lines += _table_head("mouse") + [f"| {what} | {does} |" for what, does in mouse()]
    return "\n".join(lines[1:]) + "\n"


def _table_head(title: str) -> list[str]:
    return ["", f"| {title} | |", "|---|---|"]


def _to_markdown(key: str) -> str:
    """Return a key as Markdown: punctuation as code, so that it is not read as Markdown."""
    return key if re.fullmatch(r"\w+([+]\w+)*", key) else f"`{key}`"


if __name__ == "__main__":
    sys.stdout.write(tables())

"""TOML files that map names to names: joints of a capture to those of the standard, markers to places."""

from __future__ import annotations

import json
import os
import re
import textwrap
import tomllib
from collections.abc import Callable, Mapping, Sequence
from difflib import get_close_matches
from typing import Any

from fba.atomic import atomic
from fba.errors import SAVE_AS_UTF8, FormatError, OptionError
from fba.limits import Limits
from fba.source import Path, read_whole

MAX_BYTES = 1 << 20
"""Size of the longest file of a map."""
MAX_LISTED = 12
"""Most names in a message."""


def read_names(path: Path, table: str, example: str, limits: Limits) -> dict[str, Any]:
    """Return a table of a TOML file: name -> value.

    example: a line of such a table, for messages. Raises FormatError for a file without the table, and as
    `read_toml`.
    """
    names = read_toml(path, f"{example} below [{table}]", limits).get(table)
    if not isinstance(names, dict) or not names:
        raise FormatError(f"has no table [{table}]; expected lines such as {example} below it", path=path)
    return names


def read_toml(path: Path, expected: str, limits: Limits) -> dict[str, Any]:
    """Return the content of a TOML file of a map.

    expected: lines of such a file, for messages. Raises FormatError, with the line, for other files, and
    LimitError.
    """
    data = read_whole(path)
    if len(data) > MAX_BYTES:
        raise FormatError(f"has {len(data)} bytes, more than the {MAX_BYTES} that a map may have", path=path)
    limits.check_bytes(40 * len(data), f"{os.fspath(path)}: the map", source=len(data))
    try:
        return tomllib.loads(data.decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        raise FormatError(f"is not UTF-8 text (byte {error.start}); {SAVE_AS_UTF8}", path=path) from None
    except (ValueError, RecursionError) as error:  # a plain ValueError: a number of thousands of digits
        line = re.search(r"at line (\d+)", str(error))
        raise FormatError(
            f"is not TOML: {str(error)[:200]}; expected lines such as {expected}",
            path=path, line=int(line[1]) if line else None,
        ) from None  # fmt: skip


def change_names(
    base: Mapping[str, str],
    pairs: Mapping[str, str],
    check_name: Callable[[str], None],
    check_value: Callable[[str], None],
    shared: str,
) -> dict[str, str]:
    """Return a map of names with changes.

    pairs: name -> value, or "" to leave the name out. Another name that had the same value loses it, unless
    it is the shared value. The checks raise OptionError for names and values that do not exist.
    """
    result = dict(base)
    for name, value in pairs.items():
        check_name(name)
        if value:
            check_value(value)
        result = {
            each: taken
            for each, taken in result.items()
            if each != name and (taken != value or value == shared)
        }
        if value:
            result[name] = value
    return result


def change_known_names(
    base: Mapping[str, str],
    pairs: Mapping[str, str],
    known: Sequence[str],
    what: str,
    check_value: Callable[[str], None],
    shared: str = "",
) -> dict[str, str]:
    """Return a map as `change_names` does, in the order of `known`, the names of the source.

    what: begins the message about an absent name, "the capture has no marker".
    """

    def check_name(name: str) -> None:
        if name not in known:
            raise OptionError(f"{what} {name!r}{_like(name, known)}; it has {list_names(known)}")

    result = change_names(base, pairs, check_name, check_value, shared)
    order = {name: number for number, name in reversed(list(enumerate(known)))}
    return dict(sorted(result.items(), key=lambda pair: order.get(pair[0], len(order))))


def simplify(name: str) -> str:
    """Return letters and digits of a name in lower case, without a prefix: "Anna:Left_Leg" -> "leftleg"."""
    return re.sub(r"[^a-z0-9]", "", name.rpartition(":")[2].lower())


def key_of(name: str) -> str:
    """Return the letters and digits of a name, in lower case."""
    return re.sub(r"[^a-z0-9]", "", name.lower())


def both_sides(text: str) -> list[tuple[str, str]]:
    """Return ("l", "LeftArm") and ("r", "RightArm") for "(Left|Right)Arm"; ("", text) without sides."""
    sides = re.search(r"\((\w+)\|(\w+)\)", text)
    if sides is None:
        return [("", text)]
    return [(side, text.replace(sides[0], word)) for side, word in zip("lr", sides.groups(), strict=True)]


def list_names(names: Sequence[str]) -> str:
    """Return names as text, at most `MAX_LISTED` of them."""
    return ", ".join(names[:MAX_LISTED]) + (
        f", and {len(names) - MAX_LISTED} more" if len(names) > MAX_LISTED else ""
    )


def _like(name: str, known: Sequence[str]) -> str:
    """Return " (did you mean 'LCL'?)", or ""; upper and lower case count as equal."""
    by_lower = {each.lower(): each for each in known}
    near = get_close_matches(name.lower(), by_lower, n=1)
    return f" (did you mean {by_lower[near[0]]!r}?)" if near else ""


def write_names(
    path: Path,
    table: str,
    names: Mapping[str, str],
    heading: Sequence[str],
    left: Mapping[str, Sequence[str]],
) -> None:
    """Write a table as TOML.

    heading: lines of comment before it. left: texts of comments behind it -> names that they list.
    """
    lines = [*(f"# {line}" for line in heading), "", f"[{table}]"]
    for name, value in names.items():
        lines.append(f"{json.dumps(name, ensure_ascii=False)} = {json.dumps(value)}")
    for what, others in left.items():
        if others:
            # a name with a line break in it must not end the comment
            quoted = ", ".join(json.dumps(name)[1:-1] for name in others)
            lines += textwrap.wrap(f"{what}: {quoted}", 100, initial_indent="# ", subsequent_indent="#   ")
    with atomic(path) as file:
        file.write(("\n".join(lines) + "\n").encode())

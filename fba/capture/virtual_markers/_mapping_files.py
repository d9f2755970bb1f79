"""Mappings of virtual markers as TOML files; docs/virtual-markers.md describes them."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from fba.atomic import atomic
from fba.capture.virtual_markers.mapping import MadeFor, MarkerMapping, VirtualMarker
from fba.errors import FormatError, OptionError
from fba.limits import DEFAULT_LIMITS, Limits
from fba.name_maps import read_toml
from fba.source import Path

TABLE = "virtual_markers"
EXAMPLE = '"Chin" = { vertex = 1234, radius = 0.02 }'
HEADING = """\
# Virtual markers: which vertex of a head each marker of a capture is paired with, and how far around it
# moves the mesh. Vertices are counted from 0; radius (in x and y) and depth (along z) are in the unit of
# the head. Fixed markers are not moved by the face; they tell how the head moves. Change what you like and
# give it to `fba markers --map`.
"""
KEYS = {
    "vertex": int,
    "radius": (int, float),
    "depth": (int, float),
    "fixed": bool,
    "follows": str,
    "share": (int, float),
    "lid": bool,
}
MARKER_WORDS = {int: "a whole number", (int, float): "a number", bool: "true or false", str: "a text"}
COUNTS, TEXTS = ("vertices", "triangles"), ("name", "connectivity", "shape")


def read_mapping(path: Path, *, limits: Limits = DEFAULT_LIMITS) -> MarkerMapping:
    """Return the mapping in a TOML file.

    Raises FormatError for other files and those whose parts contradict each other; LimitError.
    """
    content = read_toml(path, f"{EXAMPLE} below [{TABLE}]", limits)
    markers = content.get(TABLE)
    if not isinstance(markers, dict) or not markers:
        raise FormatError(f"has no table [{TABLE}]; expected lines such as {EXAMPLE} below it", path=path)
    unknown = [key for key in content if key not in (TABLE, "head", "settings")]
    if unknown:
        raise FormatError(f"there is no table {unknown[0]!r} in a mapping of virtual markers", path=path)
    try:
        return MarkerMapping(
            {name: _read_marker(name, entry) for name, entry in markers.items()},
            **_read_settings(content.get("settings", {})),
            made_for=_read_head(content["head"]) if "head" in content else None,
        )
    except OptionError as error:
        raise FormatError(str(error), path=path) from None


def write_mapping(path: Path, mapping: MarkerMapping) -> None:
    """Write a mapping as TOML, completely or not at all."""
    lines = [HEADING]
    if mapping.made_for is not None:
        made = mapping.made_for
        lines += ["[head]", f"name = {_text(made.name)}"]
        lines += [f"{key} = {getattr(made, key)}" for key in COUNTS]
        lines += [f"connectivity = {_text(made.connectivity)}", f"shape = {_text(made.shape)}", ""]
    lines += [
        "[settings]",
        f"assignment = {_text(mapping.assignment)}",
        f"overlap = {_text(mapping.overlap)}",
    ]
    if mapping.gaze != "none":
        lines.append(f"gaze = {_text(mapping.gaze)}")
    if mapping.squint:
        lines.append(f"squint = {mapping.squint!r}")
    if mapping.scale:
        lines.append(f"scale = [{', '.join(_text(name) for name in mapping.scale)}]")
    lines += ["", f"[{TABLE}]"]
    lines += [f"{_text(name)} = {_entry(marker)}" for name, marker in mapping.markers.items()]
    with atomic(path) as file:
        file.write(("\n".join(lines) + "\n").encode("utf-8", "surrogatepass"))


def _read_marker(name: str, entry: Any) -> VirtualMarker:
    if not isinstance(entry, dict):
        raise OptionError(f"{name!r} is {entry!r}; expected a table such as {EXAMPLE.partition('= ')[2]}")
    for key, value in entry.items():
        if key not in KEYS:
            raise OptionError(f"{name!r}: there is no {key!r}; known are {', '.join(KEYS)}")
        kind: Any = KEYS[key]
        if not isinstance(value, kind) or (kind is not bool and isinstance(value, bool)):
            raise OptionError(f"{name!r}: {key} must be {MARKER_WORDS[kind]}, not {value!r}")
    fixed = bool(entry.get("fixed", False))
    if "vertex" not in entry and not fixed:
        raise OptionError(f"{name!r} has no vertex; only fixed markers may be beside the face")
    if "vertex" in entry and "radius" not in entry:
        raise OptionError(f"{name!r} has no radius")
    try:
        radius = float(entry.get("radius", 0.0))
        depth = float(entry.get("depth", radius))
        follows, share = entry.get("follows", ""), float(entry.get("share", 1.0))
        lid = bool(entry.get("lid", False))
        return VirtualMarker(entry.get("vertex"), radius, depth, fixed, follows, share, lid)
    except (OptionError, OverflowError) as error:
        raise OptionError(f"{name!r}: {error}") from None


def _read_settings(table: Any) -> dict[str, Any]:
    settings = _checked_table(table, "settings", ("assignment", "overlap", "scale", "gaze", "squint"))
    result: dict[str, Any] = {}
    for key in ("assignment", "overlap", "gaze"):
        if key in settings:
            if not isinstance(settings[key], str):
                raise OptionError(f"settings: {key} must be a word, not {settings[key]!r}")
            result[key] = settings[key]
    squint = settings.get("squint", 0.0)
    if isinstance(squint, bool) or not isinstance(squint, int | float):
        raise OptionError(f"settings: squint must be a number from 0 to 1, not {squint!r}")
    scale = settings.get("scale", [])
    if not isinstance(scale, list) or not all(isinstance(name, str) for name in scale):
        raise OptionError(f"settings: scale must be a list of two markers, not {scale!r}")
    return {**result, "squint": float(squint), "scale": tuple(scale)}


def _read_head(table: Any) -> MadeFor:
    head = _checked_table(table, "head", (*TEXTS, *COUNTS))
    for key in (*TEXTS, *COUNTS):
        value = head.get(key)
        kind = str if key in TEXTS else int
        if not isinstance(value, kind) or isinstance(value, bool):
            raise OptionError(f"head: {key} must be {'a text' if kind is str else 'a number'}, not {value!r}")
    return MadeFor(**head)


def _checked_table(table: Any, name: str, known: tuple[str, ...]) -> Mapping[str, Any]:
    if not isinstance(table, dict):
        raise OptionError(f"{name} must be a table, not {table!r}")
    for key in table:
        if key not in known:
            raise OptionError(f"{name}: there is no {key!r}; known are {', '.join(known)}")
    return table


def _entry(marker: VirtualMarker) -> str:
    parts = []
    if marker.vertex is not None:
        parts += [f"vertex = {marker.vertex}", f"radius = {marker.radius!r}", f"depth = {marker.depth!r}"]
    if marker.fixed:
        parts.append("fixed = true")
    if marker.lid:
        parts.append("lid = true")
    if marker.follows:
        parts.append(f"follows = {_text(marker.follows)}")
    if marker.share != 1.0:
        parts.append(f"share = {marker.share!r}")
    return f"{{ {', '.join(parts)} }}"


def _text(text: str) -> str:
    """Return a text as TOML writes it; DEL must not stand for itself there, other than in JSON."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")

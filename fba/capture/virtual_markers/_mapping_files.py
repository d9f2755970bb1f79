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
Kinds = Mapping[str, tuple[Any, str]]
"""Keys of a table, the types of their values, and words for these."""
MARKER_KINDS: Kinds = {
    "vertex": (int, "a whole number"),
    "radius": ((int, float), "a number"),
    "depth": ((int, float), "a number"),
    "fixed": (bool, "true or false"),
    "follows": (str, "a text"),
    "share": ((int, float), "a number"),
    "lid": (bool, "true or false"),
}
HEAD_KINDS: Kinds = {
    "name": (str, "a text"),
    "connectivity": (str, "a text"),
    "shape": (str, "a text"),
    "vertices": (int, "a number"),
    "triangles": (int, "a number"),
}
SETTING_KINDS: Kinds = {
    "assignment": (str, "a word"),
    "overlap": (str, "a word"),
    "gaze": (str, "a word"),
    "squint": ((int, float), "a number from 0 to 1"),
    "scale": (list, "a list of two markers"),
}


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
    except (OptionError, OverflowError) as error:
        raise FormatError(str(error), path=path) from None


def write_mapping(path: Path, mapping: MarkerMapping) -> None:
    """Write a mapping as TOML, completely or not at all."""
    lines = [HEADING]
    if mapping.made_for is not None:
        lines.append("[head]")
        for key, value in vars(mapping.made_for).items():
            lines.append(f"{key} = {_text(value) if isinstance(value, str) else value}")
        lines.append("")
    lines.append("[settings]")
    lines += [f"assignment = {_text(mapping.assignment)}", f"overlap = {_text(mapping.overlap)}"]
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
    _check(entry, repr(name), MARKER_KINDS)
    if "vertex" not in entry and not entry.get("fixed"):
        raise OptionError(f"{name!r} has no vertex; only fixed markers may be beside the face")
    if "vertex" in entry and "radius" not in entry:
        raise OptionError(f"{name!r} has no radius")
    try:
        sizes = {key: float(entry[key]) for key in ("radius", "depth", "share") if key in entry}
        if "radius" in sizes:
            sizes.setdefault("depth", sizes["radius"])
        return VirtualMarker(**{"vertex": None, **entry, **sizes})
    except (OptionError, OverflowError) as error:
        raise OptionError(f"{name!r}: {error}") from None


def _read_settings(table: Any) -> dict[str, Any]:
    settings = _check(table, "settings", SETTING_KINDS)
    scale = settings.get("scale", [])
    if not all(isinstance(name, str) for name in scale):
        raise OptionError(f"settings: scale must be a list of two markers, not {scale!r}")
    return {**settings, "squint": float(settings.get("squint", 0.0)), "scale": tuple(scale)}


def _read_head(table: Any) -> MadeFor:
    if isinstance(table, dict):
        table = {**dict.fromkeys(HEAD_KINDS), **table}
    return MadeFor(**_check(table, "head", HEAD_KINDS))


def _check(table: Any, where: str, kinds: Kinds) -> dict[str, Any]:
    """Return a table; OptionError for unknown keys, and for values of other types."""
    if not isinstance(table, dict):
        raise OptionError(f"{where} must be a table, not {table!r}")
    for key, value in table.items():
        if key not in kinds:
            raise OptionError(f"{where}: there is no {key!r}; known are {', '.join(kinds)}")
        kind, words = kinds[key]
        if not isinstance(value, kind) or (isinstance(value, bool) and kind is not bool):
            raise OptionError(f"{where}: {key} must be {words}, not {value!r}")
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
    """Return a text as TOML writes it: as JSON, but with DEL escaped."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")

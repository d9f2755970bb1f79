"""Maps from markers to places on the face: to find, to change, and to keep in TOML files."""

from __future__ import annotations

import re
import warnings
from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

from fba.capture.markers._motion import MarkerMotion
from fba.capture.markers._targets import RIGID, SKULL, TARGETS
from fba.errors import FbaWarning, FormatError, ModelError, OptionError, did_you_mean
from fba.limits import DEFAULT_LIMITS, Limits
from fba.name_maps import change_known_names, read_names, simplify, write_names
from fba.parameters import point_rows
from fba.source import Path
from fba.text_files import packaged_rows

TABLE = "markers"
MIN_NAMES = 8
"""Smallest number of names by which a set of markers fits."""
MIN_SHARE = 0.6
"""Smallest share of a set's names that must be present."""


@cache
def marker_sets() -> dict[str, dict[str, str]]:
    """Return the built-in sets: name of the set -> simplified marker name -> target, "" for none."""
    result: dict[str, dict[str, str]] = {}
    for row in packaged_rows(__package__, "marker_sets.csv"):
        result.setdefault(row["set"], {})[simplify(row["marker"])] = row["target"]
    return result


def match_names(names: Sequence[str]) -> tuple[str, dict[str, str]]:
    """Return the set whose names fit, and marker -> target; ("", {}) if no set fits.

    Markers may also be named after feature points ("2.1", "FDP_2.1", "fp8_3"), "head" or a tragion.
    """
    direct = {name: target for name in names if (target := _named_point(name))}
    if len(direct) >= MIN_NAMES:
        return "feature points", direct
    simple = {name: simplify(name) for name in names}
    best: tuple[str, dict[str, str]] = ("", {})
    for family, members in marker_sets().items():
        found = {name: members[short] for name, short in simple.items() if short in members}
        used = {name: target for name, target in found.items() if target}
        if len(found) >= MIN_SHARE * len(members) and len(used) >= MIN_NAMES and len(used) > len(best[1]):
            best = family, used
    return best


def _named_point(name: str) -> str:
    """Return the target that a marker is named after, or ""."""
    word = name.rpartition(":")[2].strip().lower()
    if word in TARGETS:
        return word
    match = re.fullmatch(r"(?:fdp|fp|point|p)?[ _\-]?(\d{1,2})[._\-](\d{1,2})", word)
    point = f"{int(match[1])}.{int(match[2])}" if match else ""
    return point if point in TARGETS else ""


def find_map(motion: MarkerMotion) -> tuple[dict[str, str], str]:
    """Return marker -> target of a capture, and the source of the map: a set's name, or "shape".

    If the names fit no set, the shape of the cloud decides. ModelError if it is not that of a face.
    """
    family, found = match_names(motion.names)
    if found:
        return found, family
    from fba.capture.markers._proposal import propose_map

    return propose_map(motion), "shape"


def change_map(
    motion: MarkerMotion, base: Mapping[str, str] | None, pairs: Mapping[str, str]
) -> dict[str, str]:
    """Return a map in which some markers are changed by hand.

    base: the map before; None for that of `find_map`. pairs: marker -> target, or "" to leave it out. Another
    marker that had the same feature point loses it. OptionError for an unknown marker or target.
    """
    return change_known_names(
        find_map(motion)[0] if base is None else base,
        pairs, motion.names, "the capture has no marker", check_target, shared=SKULL,
    )  # fmt: skip


def read_map(path: Path, *, limits: Limits = DEFAULT_LIMITS) -> dict[str, str]:
    """Return the map in a TOML file: the table "markers", marker -> target.

    Raises FormatError, with the line, for other files and for targets that do not exist.
    """
    table = read_names(path, TABLE, '"Chin" = "2.1"', limits)
    for marker, target in table.items():
        try:
            check_target(target if isinstance(target, str) else repr(target))
        except OptionError as error:
            raise FormatError(f"{marker!r}: {error}", path=path) from None
    try:
        check_map(table)
    except OptionError as error:
        raise FormatError(str(error), path=path) from None
    return dict(table)


def write_map(path: Path, markers: Mapping[str, str], motion: MarkerMotion | None = None) -> None:
    """Write a map as TOML; a comment names the markers without a place, if the motion is given."""
    unused = [] if motion is None else [name for name in motion.names if name not in markers]
    heading = (
        "Markers of a capture, and where they are on the face: feature points of ISO/IEC 14496-2,",
        "l_tragion and r_tragion in front of the ears, or head for one on the skull.",
        "Change it and give it to `fba encode --map`.",
    )
    write_names(path, TABLE, markers, heading, {"Markers that are not used": unused})


def check_map(markers: Mapping[str, str]) -> None:
    """Raise OptionError where two markers are at the same point."""
    taken: dict[str, str] = {}
    for marker, target in markers.items():
        check_target(target)
        if target != SKULL and target in taken:
            raise OptionError(f"{taken[target]!r} and {marker!r} are both at {target}")
        taken[target] = marker


def check_target(target: str) -> None:
    """Raise OptionError for a place where markers cannot be."""
    if target in TARGETS:
        return
    if target in point_rows():
        raise OptionError(
            f"no marker can be at feature point {target}, which is inside the head or the mouth, or on hair"
        )
    special = [name for name in RIGID if name not in point_rows()]
    raise OptionError(
        f"there is no place {target!r}{did_you_mean(target, TARGETS)}; a marker is at a feature point of the "
        f"face, such as 2.1 or 8.3, or at {', '.join(special)}"
    )


def summarise(motion: MarkerMotion) -> dict[str, Any]:
    """Return the description of a capture, and in "map" and "placed" what of it is on a face.

    map: source of the places on the face, a set's name or "shape"; "" if there is no face. placed: number of
    markers with a place.
    """
    placed: dict[str, str] = {}
    found_by = ""
    try:
        with warnings.catch_warnings(action="ignore", category=FbaWarning):
            if len(motion):
                placed, found_by = find_map(motion)
    except ModelError:
        pass
    return {**motion.describe(), "map": found_by, "placed": len(placed)}

"""Places on a face of a tracker's points: a table, changes by hand, and TOML files.

A point, "152", or the middle of several, "37+38", is at a place.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import cache

import numpy as np

from fba.arrays import Float64
from fba.capture.markers._targets import RIGID, SKULL
from fba.capture.markers.marker_maps import check_map, check_target
from fba.errors import OptionError
from fba.name_maps import change_names, write_names
from fba.source import Path
from fba.text_files import packaged_rows

PARTS = {68: (68,), 70: (68, 70), 468: (468,), 478: (468, 478)}
"""Rows of the table that count for each number of points."""
MAX_POINTS = 8
"""Largest number of points whose middle is a place."""
TABLE = "markers"


@cache
def point_places(count: int) -> dict[str, str]:
    """Return points -> place on the face, for a tracker with this number of points."""
    return {row["points"]: row["place"] for row in _rows(count)}


@cache
def _rows(count: int) -> list[dict[str, str]]:
    rows = packaged_rows(__package__, "point_places.csv")
    return [row for row in rows if int(row["tracker"]) in PARTS[count]]


def find_still(places: Mapping[str, str], count: int) -> frozenset[str]:
    """Return the points of a map that the head alone moves, by their places."""
    still = {*RIGID, *(row["place"] for row in _rows(count) if row["still"])}
    return frozenset(points for points, place in places.items() if place in still)


def check_places(places: Mapping[str, str], count: int) -> None:
    """Raise OptionError for points that a tracker lacks, and for places where markers cannot be."""
    check_map(dict(places))
    for points in places:
        numbers_of(points, count)


def numbers_of(points: str, count: int) -> tuple[int, ...]:
    """Return the numbers in "37+38"; OptionError for other texts, and for points that the tracker lacks."""
    if not re.fullmatch(r"\d{1,4}(\+\d{1,4})*", points, re.ASCII):
        raise OptionError(f"{points!r} is no point; expected a number, or several as in 37+38")
    numbers = tuple(map(int, points.split("+")))
    if max(numbers) >= count or len(numbers) > MAX_POINTS:
        raise OptionError(f"there is no point {points}; the tracker has points 0 to {count - 1}")
    return numbers


def change_places(count: int, base: Mapping[str, str] | None, pairs: Mapping[str, str]) -> dict[str, str]:
    """Return a map in which some points are changed by hand.

    base: the map before; None for that of the table. pairs: points -> place, or "" to leave them out. Other
    points that had the same place lose it. OptionError for unknown points or places.
    """
    result = change_names(
        point_places(count) if base is None else base,
        pairs, lambda points: check_places({points: SKULL}, count), check_target, shared=SKULL,
    )  # fmt: skip
    check_places(result, count)
    return result


def write_places(path: Path, places: Mapping[str, str], count: int) -> None:
    """Write a map as TOML, which `fba.capture.markers.marker_maps.read_map` reads."""
    heading = (
        f"Points of a tracker with {count} of them, and where they are on the face: feature points of",
        "ISO/IEC 14496-2, l_tragion and r_tragion in front of the ears, or head for one on the skull.",
        "37+38 is the middle of two points. Change it and give it to `fba encode --map`.",
    )
    write_names(path, TABLE, places, heading, {})


def take_points(positions: Float64, names: tuple[str, ...]) -> Float64:
    """Return positions (T, M, D) of points, or of the middles of several, from those (T, N, D) of all."""
    count = positions.shape[1]
    return np.stack([positions[:, list(numbers_of(name, count))].mean(axis=1) for name in names], axis=1)


def fill_points(positions: Float64) -> Float64:
    """Return points (T, M, D) without gaps, interpolated linearly relative to the face's middle.

    positions: NaN where a point is missing. Each point is seen at least once, and each frame has a point.
    """
    missing = np.isnan(positions[..., 0])
    if not missing.any():
        return positions
    middle = np.nanmedian(positions, axis=1, keepdims=True)
    away = positions - middle
    frames = np.arange(len(positions))
    for point in np.flatnonzero(missing.any(axis=0)).tolist():
        there = np.flatnonzero(~missing[:, point])
        for axis in range(away.shape[2]):
            away[:, point, axis] = np.interp(frames, there, away[there, point, axis])
    return away + middle

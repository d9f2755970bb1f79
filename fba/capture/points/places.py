"""Where on a face the points of a tracker are: a table, corrected by hand, in TOML files.

A place is told by one point, "152", or by the middle of several, "37+38".
"""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping
from functools import cache
from importlib.resources import files

import numpy as np

from fba.arrays import Float64
from fba.capture.markers._targets import HEAD, RIGID
from fba.capture.markers.marker_maps import check_map, check_target
from fba.errors import OptionError
from fba.name_maps import change_names, write_names
from fba.source import Path

PARTS = {68: (68,), 70: (68, 70), 468: (468,), 478: (468, 478)}
"""Rows of the table that count for each number of points."""
MAX_POINTS = 8
"""Largest number of points whose middle is a place."""
TABLE = "markers"


@cache
def point_places(count: int) -> dict[str, str]:
    """Return points -> place on the face, for a tracker with this number of points."""
    return {row["points"]: row["place"] for row in _rows() if int(row["tracker"]) in PARTS[count]}


@cache
def still_points(count: int) -> frozenset[str]:
    """Return the points that the head alone moves."""
    return frozenset(row["points"] for row in _rows() if int(row["tracker"]) in PARTS[count] and row["still"])


def find_still(places: Mapping[str, str], count: int) -> frozenset[str]:
    """Return which points of a map the head alone moves: those of the table, and those at still places."""
    known = {place for points, place in point_places(count).items() if points in still_points(count)}
    still = (known | set(RIGID)) - {HEAD}
    return frozenset(points for points, place in places.items() if place in still or place == HEAD)


@cache
def _rows() -> tuple[dict[str, str], ...]:
    text = (files(__package__) / "point_places.csv").read_text(encoding="utf-8")
    return tuple(csv.DictReader(text.splitlines()))


def check_places(places: Mapping[str, str], count: int) -> None:
    """Raise OptionError for points that a tracker has not, and for places that markers cannot have."""
    check_map(dict(places))
    for points in places:
        check_points(points, count)


def check_points(points: str, count: int) -> None:
    """Raise OptionError for points that a tracker with this number of points lacks."""
    numbers_of(points, count)


def numbers_of(points: str, count: int) -> tuple[int, ...]:
    """Return the numbers in "37+38"; OptionError for something else, or a point beyond the last."""
    if not re.fullmatch(r"\d{1,4}(\+\d{1,4})*", points, re.ASCII):
        raise OptionError(f"{points!r} is no point; expected a number, or several as in 37+38")
    numbers = tuple(map(int, points.split("+")))
    if max(numbers) >= count or len(numbers) > MAX_POINTS:
        raise OptionError(f"there is no point {points}; the tracker has points 0 to {count - 1}")
    return numbers


def change_places(count: int, base: Mapping[str, str] | None, pairs: Mapping[str, str]) -> dict[str, str]:
    """Return a map with some points given by hand.

    base: the map that is changed, None for the table's. pairs: points -> place, or "" to leave them out.
    Other points that had the same place lose it. OptionError for unknown points or places.
    """
    result = change_names(
        point_places(count) if base is None else base,
        pairs, lambda points: check_points(points, count), check_target, shared=HEAD,
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
    """Return what is at each of these points, or in their middle: positions (T, N, D) to (T, M, D)."""
    count = positions.shape[1]
    return np.stack([positions[:, list(numbers_of(name, count))].mean(axis=1) for name in names], axis=1)


def fill_points(positions: Float64) -> Float64:
    """Return points (T, M, D) without gaps: missing ones go straight on, as the face's middle moves.

    positions: NaN where a point is missing; each is there in one frame at least, as is a point in each frame.
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
    return np.asarray(away + middle)

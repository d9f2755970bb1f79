"""Positions of the feature points of a mesh, from CSV, JSON and FDP files; written as CSV."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from fba.arrays import Float64
from fba.atomic import atomic
from fba.errors import ModelError
from fba.face.feature_points import names
from fba.face.importers.points.fdp import read_fdp, xface_points
from fba.parameters import point_rows
from fba.text_files import parse_integer, parse_number, read_bytes, read_lines

MAX_JSON = 1 << 24
"""Largest JSON file of 84 points, in bytes."""


@dataclass(frozen=True, eq=False)
class GivenPoints:
    """Feature points given by the user.

    points: float64 (84, 3), in the unit of the mesh, NaN where unknown. vertices: the vertex of the mesh
    file for each point, from 0, by its name; where both are given the vertex decides.
    """

    points: Float64
    vertices: Mapping[str, int] = field(default_factory=dict)

    def __bool__(self) -> bool:
        return bool(self.vertices) or bool(np.isfinite(self.points).any())


def given_points(points: object) -> GivenPoints:
    """Return the feature points from the argument `points` of an importer.

    points: the path of a file, an array (84, 3) with NaN where unknown, or a mapping from names to a
    position (x, y, z) or a vertex number. Raises ModelError for anything else.
    """
    if isinstance(points, GivenPoints):
        return points
    if isinstance(points, str | os.PathLike):
        return read_points(points)
    if isinstance(points, Mapping):
        return _from_mapping(points, "feature points")
    try:
        array = np.array(points, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ModelError(f"feature points cannot be read from {type(points).__name__}: {error}") from error
    if array.shape != (len(names()), 3) or np.isinf(array).any():
        raise ModelError(
            f"feature points must have shape ({len(names())}, 3), NaN where unknown, not {array.shape}"
        )
    return GivenPoints(array)


def points_beside(path: Path, endings: Sequence[str]) -> GivenPoints | None:
    """Return the points of the first file beside a mesh with its name and one of the endings, or None."""
    for ending in endings:
        candidate = path.with_name(path.stem + ending)
        if candidate.is_file():
            return read_points(candidate)
    return None


def read_points(path: str | os.PathLike[str]) -> GivenPoints:
    """Return the feature points from a file.

    CSV: lines `name,x,y,z` or `name,vertex`, vertices counted from 0 as in the mesh file; commas,
    semicolons, tabs or blanks between; a line of titles, empty lines and `#` comments are skipped. JSON:
    an object from names to [x, y, z] or a vertex number, or the same under "points". FDP: text or
    Xface. Raises ModelError naming file and line.
    """
    name = os.fspath(path)
    suffix = os.path.splitext(name)[1].lower()
    if suffix == ".json":
        try:
            content = json.loads(read_bytes(name, MAX_JSON))
        except (ValueError, RecursionError) as error:
            raise ModelError(f"{name}: is not JSON: {error}") from error
        if isinstance(content, dict) and isinstance(content.get("points"), dict):
            content = content["points"]
        if not isinstance(content, dict):
            raise ModelError(f"{name}: an object from names of feature points to positions is expected")
        return _from_mapping(content, name)
    if suffix in (".fdp", ".xml"):
        return _from_fdp(name)
    return _from_csv(name)


def write_points(path: str | os.PathLike[str], given: GivenPoints, comment: str = "") -> None:
    """Write feature points as CSV, atomically: `name,vertex` where a vertex is known, else `name,x,y,z`.

    comment: a line at the top. Raises ModelError without any point, FormatError where the file cannot be
    written.
    """
    _check_given(given, os.fspath(path))
    lines = [f"# {' '.join(comment.split())}"] if comment else []
    for name, position in zip(names(), given.points, strict=True):
        if name in given.vertices:
            lines.append(f"{name},{given.vertices[name]}")
        elif np.isfinite(position).all():
            lines.append(",".join([name, *(f"{float(number):.9g}" for number in position)]))
    with atomic(path) as file:
        file.write(("\n".join(lines) + "\n").encode())


def _from_csv(path: str) -> GivenPoints:
    points = np.full((len(names()), 3), np.nan)
    vertices: dict[str, int] = {}
    first = True
    for line, text in read_lines(path):
        where = f"{path}:{line}"
        bare = text.split("#", 1)[0].strip()
        if not bare:
            continue
        tokens = [token.strip().strip('"') for token in re.split(r"[,;\t]|\s+", bare)]
        tokens = [token for token in tokens if token] if "," not in bare and ";" not in bare else tokens
        tokens = tokens or [""]  # nothing but quotation marks
        was_first, first = first, False
        name = tokens[0]
        if name not in point_rows():
            if was_first and not name[:1].isdigit():
                continue  # titles
            raise ModelError(f"{where}: there is no feature point {name[:40]!r}; they are named 2.1 to 11.6")
        if name in vertices or np.isfinite(points[point_rows()[name]]).any():
            raise ModelError(f"{where}: feature point {name} is listed twice")
        if len(tokens) == 2:
            vertices[name] = parse_integer(tokens[1], where, "a vertex")
        elif len(tokens) == 4:
            points[point_rows()[name]] = [parse_number(token, where, "a coordinate") for token in tokens[1:]]
        else:
            raise ModelError(f"{where}: 'name,x,y,z' or 'name,vertex' is expected, not {bare[:60]!r}")
    return _check_given(GivenPoints(points, vertices), path)


def _from_mapping(content: Mapping[Any, Any], where: str) -> GivenPoints:
    points = np.full((len(names()), 3), np.nan)
    vertices: dict[str, int] = {}
    for name, value in content.items():
        if name not in point_rows():
            raise ModelError(
                f"{where}: there is no feature point {str(name)[:40]!r}; they are named 2.1 to 11.6"
            )
        if isinstance(value, int | np.integer) and not isinstance(value, bool):
            vertices[name] = int(value)
            continue
        try:
            position = np.array(value, dtype=np.float64)
        except (OverflowError, TypeError, ValueError):
            position = np.array([np.nan])
        if position.shape != (3,) or not np.isfinite(position).all():
            raise ModelError(
                f"{where}: feature point {name} must be [x, y, z] or a vertex, not {_short(value)}"
            )
        points[point_rows()[name]] = position
    return _check_given(GivenPoints(points, vertices), where)


def _short(value: object) -> str:
    """Return a value as the text of an error shows it."""
    try:
        text = str(value)
    except ValueError:  # Python writes no number of more than 4300 digits
        return "a huge number"
    return text[:60]


def _from_fdp(path: str) -> GivenPoints:
    fdp = read_fdp(path)
    if fdp.format == "xface":
        return GivenPoints(xface_points(fdp))
    return GivenPoints(fdp.points, {name: vertex for name, (_, vertex) in fdp.vertices.items()})


def _check_given(given: GivenPoints, where: str) -> GivenPoints:
    """Return the points, if there are any; ModelError otherwise, and for a negative vertex."""
    if not given:
        raise ModelError(f"{where}: contains no feature points")
    for name, vertex in given.vertices.items():
        if vertex < 0:
            raise ModelError(f"{where}: feature point {name} is vertex {vertex}; vertices count from 0")
    return given

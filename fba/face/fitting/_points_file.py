"""Files of points on photographs: JSON with positions by feature point, or what landmark programs write."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from typing import Any

import numpy as np

from fba.arrays import Float64
from fba.atomic import atomic
from fba.capture.points.places import point_places, take_points
from fba.errors import FbaError, ModelError
from fba.face.feature_points import FREE_POINTS
from fba.face.feature_points import names as feature_point_names
from fba.formats import read_face
from fba.parameters import point_rows
from fba.text_files import read_bytes

Points = Mapping[str, tuple[float, float]]
"""Positions in a picture by feature point: pixels to the right and down from its top left corner."""

VIEWS = ("front", "side")
FRONT_POINTS = (
    "3.5", "3.6", "3.7", "3.11", "3.8", "3.12", "3.1", "3.3", "3.2", "3.4", "4.1", "4.3", "4.5", "4.2", "4.4",
    "4.6", "9.3", "9.1", "9.2", "9.15", "8.3", "8.4", "8.1", "8.9", "8.10", "8.2", "8.5", "8.6", "8.7", "8.8",
    "2.2", "2.1", "2.10", "2.13", "2.14", "10.9", "10.10", "10.5", "10.6", "11.1",
)  # fmt: skip
"""The points that a frontal photograph shows, those first that a face cannot do without."""
SIDE_POINTS = (
    "9.3", "9.15", "8.1", "8.2", "2.2", "2.10", "2.1", "9.12", "3.5", "3.7", "8.3", "11.1", "2.13", "10.9",
    "10.5", "11.4", "11.6", "4.1", "4.3", "4.5", "9.1", "3.1", "3.3", "8.5", "8.7",
)  # fmt: skip
"""The points that a profile shows, by the names of the subject's left side whichever side is seen."""
HIDDEN = ("6.1", "6.2", "6.3", "6.4", "7.1", "9.8", "9.9", "9.10", "9.11", *FREE_POINTS)
"""Points that no photograph of a neutral face shows."""
MAX_JSON = 1 << 20
OUTSIDE = 1.0
"""Points may lie outside the picture by this share of its size: of a chin that is cut off, say."""


def read_photo_points(
    path: str | os.PathLike[str], size: tuple[int, int] | None = None
) -> dict[str, dict[str, tuple[float, float]]]:
    """Return the points of a file by view, "front" and "side", and by name: pixels from the top left.

    JSON: {"front": {"points": {"3.5": [812, 640], ...}}, "side": {...}}; a profile uses the names of the
    subject's left side whichever side is seen. Or the table or JSON of a landmark program with 68, 70, 468
    or 478 points on the frontal picture, whose first face is taken; size: (width, height) of that picture,
    for programs that write shares of it.

    Raises ModelError or FormatError naming the file, and the point that is wrong.
    """
    content = _json(path)
    if isinstance(content, dict) and any(view in content for view in VIEWS):
        return {view: _view_points(content[view], f"{path}: {view}") for view in VIEWS if view in content}
    if isinstance(content, dict) and set(content) & set(feature_point_names()):
        return {"front": _view_points({"points": content}, os.fspath(path))}
    return {"front": _landmarks(path, size)}


def write_photo_points(
    path: str | os.PathLike[str], points: Mapping[str, Points], pictures: Mapping[str, str] | None = None
) -> None:
    """Write points by view as JSON, atomically. pictures: names of the photographs by view."""
    content: dict[str, Any] = {}
    for view, places in points.items():
        named = {"picture": pictures[view]} if pictures and view in pictures else {}
        rows = {name: [round(x, 2), round(y, 2)] for name, (x, y) in places.items()}
        content[view] = {**named, "points": rows}
    text = json.dumps(content, indent=1)
    with atomic(path) as file:
        file.write((text + "\n").encode())


def check_inside(points: Points, size: tuple[int, int], where: str) -> None:
    """Raise ModelError for a point far outside a picture of this size."""
    width, height = size
    for name, (x, y) in points.items():
        if not (-OUTSIDE * width <= x <= (1 + OUTSIDE) * width) or not (
            -OUTSIDE * height <= y <= (1 + OUTSIDE) * height
        ):
            raise ModelError(
                f"{where}: point {name} is at ({x:g}, {y:g}), far outside the picture of {width} x {height} "
                "pixels; is this the file of another picture?"
            )


def _json(path: str | os.PathLike[str]) -> Any:
    """Return the content of a small JSON file; None for other files."""
    data = read_bytes(path, 1 << 28)
    if len(data) > MAX_JSON or data.lstrip()[:1] != b"{":
        return None
    try:
        return json.loads(data)
    except (ValueError, RecursionError):
        return None  # a document on each line, perhaps: for the readers of landmarks


def _view_points(content: Any, where: str) -> dict[str, tuple[float, float]]:
    if isinstance(content, dict) and isinstance(content.get("points"), dict):
        content = content["points"]
    elif not isinstance(content, dict):
        raise ModelError(f"{where}: an object from names of feature points to [x, y] is expected")
    result = {}
    for name, place in content.items():
        if name not in point_rows():
            raise ModelError(
                f"{where}: there is no feature point {str(name)[:40]!r}; they are named 2.1 to 11.6"
            )
        if name in HIDDEN:
            raise ModelError(f"{where}: no photograph shows point {name}; leave it out")
        numbers = isinstance(place, list) and all(
            isinstance(one, int | float) and not isinstance(one, bool) and abs(one) < 1e7 for one in place
        )
        if not numbers or len(place) != 2:
            raise ModelError(f"{where}: point {name} must be [x, y] in pixels, not {str(place)[:40]}")
        result[name] = (float(place[0]), float(place[1]))
    if not result:
        raise ModelError(f"{where}: contains no points")
    return result


def _landmarks(path: str | os.PathLike[str], size: tuple[int, int] | None) -> dict[str, tuple[float, float]]:
    """Return the feature points among a landmark program's points in the first frame with a face."""
    motion = read_face(os.fspath(path), format="points", source_rate=30, pixels=True)
    frames = np.flatnonzero(motion.seen)
    if not len(frames):
        raise ModelError(f"{path}: no face was seen; there are no points to take")
    if motion.metric:
        raise ModelError(f"{path}: its points are in space, and those in the photograph's pixels are needed")
    plane: Float64 = motion.positions[frames[0], :, :2]
    if motion.share:
        if size is None:
            raise FbaError(f"{path}: its points are shares of the picture, whose size is not known")
        plane = plane * size
    places = {points: place for points, place in point_places(motion.count).items() if place in point_rows()}
    taken = take_points(plane[None], tuple(places))[0]
    result = {
        place: (float(x), float(y))
        for place, (x, y) in zip(places.values(), taken, strict=True)
        if np.isfinite(x) and place not in HIDDEN
    }
    if len(result) < 8:
        raise ModelError(f"{path}: only {len(result)} of its points are feature points of a face")
    return result

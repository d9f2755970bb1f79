"""The 64 points of a tracker, the 16 of a face's outline, and the 86 vertices of the control mask.

`points.csv` says where each point is: sums of MPEG-4's feature points. `computed_vertices.csv` is Table 4.1
of the source: the vertices that are computed from points, by their coordinates across the face; its last
column is the feature point whose depth such a vertex has. `triangles.csv` joins vertices to triangles.

The numbers of points are those of the source as far as its text gives them: 5 and 7 above the irises, 9 the
outer end of the right brow, 11 to 26 the eyes, 39 and 48 the middles of the lips, 42 and 45 the corners of
the mouth, 54 the base of the nose, 55 to 60 its bridge, tip and nostrils, 61 to 64 the irises. All else is
ours.

In arrays, row n is point n + 1. Axes: x to the face's left, y up, z forward, millimetres.
"""

from __future__ import annotations

import csv
import re
from functools import cache
from importlib.resources import files

import numpy as np

from fba.arrays import Float64, Int64, Intp
from fba.face import feature_point_names as names
from fba.face import neutral_points
from fba.face.feature_points import row_of

TRACKED = 64
"""Number of points of a tracker."""
OUTLINE = 16
"""Number of points of the outline."""
VERTICES = 86
"""Number of vertices of a mask."""
IRIS = 4
"""The last points of a tracker are those of the irises, which the mask has not."""
SAME = TRACKED - IRIS
"""Vertices that are points of the tracker: the first ones of the mask."""
PARTS = ("mouth", "left_eye", "right_eye", "left_brow", "right_brow")
"""Parts of a face that are recognised apart, so that a user may join what an actor never joined."""
ANCHORS = {"mouth": 48, "left_eye": 15, "right_eye": 17, "left_brow": 15, "right_brow": 17}
"""The point of each part that counts as still: the middle of the upper lip, inner corners of eyes."""
REGISTERED = (21, 19, 57, 60, 59, 48)
"""Points by which a face is laid on the standard mask: corners of eyes, nose, middle of the upper lip."""
_TERM = re.compile(r"([+-]?)([\d.]+)(?:\*([\d.]+))?")
MILLIMETRES = 1000.0


def _terms(text: str) -> list[tuple[str, float]]:
    """Return names and shares in a sum like "4.1*0.375+4.3*0.75-4.5*0.125"."""
    return [
        (name, float(share or 1) * (-1 if sign == "-" else 1)) for sign, name, share in _TERM.findall(text)
    ]


def _read(name: str) -> list[dict[str, str]]:
    text = (files(__package__) / name).read_text(encoding="utf-8")
    return list(csv.DictReader(text.splitlines()))


@cache
def point_weights() -> Float64:
    """Return the shares (80, 84) of feature points in the points of tracker and outline."""
    weights = np.zeros((TRACKED + OUTLINE, len(names())))
    for row in _read("points.csv"):
        for name, share in _terms(row["at"]):
            weights[int(row["number"]) - 1, row_of()[name]] += share
    return _frozen(weights)


@cache
def point_parts() -> tuple[str, ...]:
    """Return the part of each of the 80 points: one of `PARTS`, "nose", "left_iris", "right_iris",
    "outline"."""
    return tuple(row["part"] for row in _read("points.csv"))


@cache
def point_names() -> tuple[str, ...]:
    """Return what each of the 80 points is, in words."""
    return tuple(row["what"] for row in _read("points.csv"))


@cache
def part_points(part: str) -> Intp:
    """Return the rows of the tracked points of a part."""
    return np.array([n for n, one in enumerate(point_parts()[:SAME]) if one == part], dtype=np.intp)


@cache
def part_vertices(part: str) -> Intp:
    """Return the rows of the vertices of the mask that a part moves."""
    computed = [SAME + n for n, row in enumerate(_read("computed_vertices.csv")) if row["part"] == part]
    return np.array([*part_points(part), *computed], dtype=np.intp)


@cache
def vertex_weights() -> Float64:
    """Return the shares (2, 86, 80) of points in the x and the y of vertices."""
    weights = np.zeros((2, VERTICES, TRACKED + OUTLINE))
    weights[:, range(SAME), range(SAME)] = 1.0
    for n, row in enumerate(_read("computed_vertices.csv")):
        for axis, column in enumerate("xy"):
            for name, share in _terms(row[column]):
                weights[axis, SAME + n, int(name) - 1] += share
    return _frozen(weights)


@cache
def depth_weights() -> Float64:
    """Return the shares (86, 84) of feature points in the depth of vertices."""
    weights = np.zeros((VERTICES, len(names())))
    weights[:SAME] = point_weights()[:SAME]
    for n, row in enumerate(_read("computed_vertices.csv")):
        if row["depth"]:
            weights[SAME + n, row_of()[row["depth"]]] = 1.0
        else:
            weights[SAME + n] = vertex_weights()[0, SAME + n] @ point_weights()
    return _frozen(weights)


@cache
def standard_points() -> Float64:
    """Return the 80 points of the standard face: float64 (80, 3), millimetres."""
    return _frozen(points_of_face(neutral_points()))


@cache
def standard_mask() -> Float64:
    """Return the standard mask: float64 (86, 3), millimetres."""
    return _frozen(mask_of_face(neutral_points()))


def points_of_face(features: Float64) -> Float64:
    """Return tracked points and outline (..., 80, 3), millimetres, of feature points (..., 84, 3), metres."""
    return np.asarray(MILLIMETRES * (point_weights() @ features))


def mask_of_face(features: Float64) -> Float64:
    """Return the mask (..., 86, 3), millimetres, of a face whose feature points (..., 84, 3) are known,
    metres."""
    across = compute_vertices(points_of_face(features)[..., :2])
    deep = MILLIMETRES * (depth_weights() @ features[..., 2:])
    return np.concatenate([across, deep], axis=-1)


def flat_mask(points: Float64) -> Float64:
    """Return masks (..., 86, 3) of tracked points (..., 64, 2): depth and outline are those of the standard
    mask."""
    outline = np.broadcast_to(
        standard_points()[TRACKED:, :2], (*points.shape[:-2], len(standard_points()) - TRACKED, 2)
    )
    across = compute_vertices(np.concatenate([points, outline], axis=-2))
    deep = np.broadcast_to(standard_mask()[:, 2:], (*points.shape[:-2], VERTICES, 1))
    return np.concatenate([across, deep], axis=-1)


def compute_vertices(points: Float64) -> Float64:
    """Return x and y of the mask (..., 86, 2) from those of 80 points, Table 4.1 of the source."""
    across, up = vertex_weights()
    return np.stack([points[..., 0] @ across.T, points[..., 1] @ up.T], axis=-1)


@cache
def triangles() -> Int64:
    """Return the triangles of the mask: int64 (130, 3), vertices counted from 0, counter-clockwise."""
    rows = [[int(row[name]) - 1 for name in "abc"] for row in _read("triangles.csv")]
    array = np.array(rows, dtype=np.int64)
    array.flags.writeable = False
    return array


def _frozen(array: Float64) -> Float64:
    array.flags.writeable = False
    return array

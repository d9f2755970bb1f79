"""The 64 points of a tracker, the 16 of a face's outline, and the 86 vertices of the control mask.

`points.csv` gives the position of each point as a sum of MPEG-4's feature points. `computed_vertices.csv` is
Table 4.1 of the source: the vertices that are computed from points, by their coordinates across the face; its
last column names the feature point that gives the depth. `triangles.csv` joins vertices to triangles.

Points are numbered as in the source where its text gives numbers: 5 and 7 above the irises, 9 the outer end
of the right brow, 11 to 26 the eyes, 39 and 48 the middles of the lips, 42 and 45 the corners of the mouth,
54 the base of the nose, 55 to 60 its bridge, tip and nostrils, 61 to 64 the irises. Other numbers are ours.

In arrays, row n is point n + 1. Axes: x to the face's left, y up, z forward, millimetres.
"""

from __future__ import annotations

import re
from functools import cache

import numpy as np

from fba.arrays import Float64, Int64, Intp
from fba.face import feature_point_names as names
from fba.face import neutral_points
from fba.parameters import point_rows
from fba.text_files import packaged_rows

TRACKED = 64
"""Number of points of a tracker."""
OUTLINE = 16
"""Number of points of the outline."""
VERTICES = 86
"""Number of vertices of a mask."""
IRIS = 4
"""Number of points of the irises: the last of a tracker's points, which the mask lacks."""
SAME = TRACKED - IRIS
"""Number of vertices that are points of the tracker: the first of the mask."""
PARTS = ("mouth", "left_eye", "right_eye", "left_brow", "right_brow")
"""Parts of a face, recognised separately: a user may combine what the actor never did together."""
ANCHORS = {"mouth": 48, "left_eye": 15, "right_eye": 17, "left_brow": 15, "right_brow": 17}
"""The point relative to which each part moves: the middle of the upper lip, the inner corners of the eyes."""
REGISTERED = (21, 19, 57, 60, 59, 48)
"""Points that are fitted to the standard mask: corners of the eyes, nose, middle of the upper lip."""
_TERM = re.compile(r"([+-]?)([\d.]+)(?:\*([\d.]+))?")
MILLIMETRES = 1000.0


def _terms(text: str) -> list[tuple[str, float]]:
    """Return names and shares in a sum like "4.1*0.375+4.3*0.75-4.5*0.125"."""
    return [
        (name, float(share or 1) * (-1 if sign == "-" else 1)) for sign, name, share in _TERM.findall(text)
    ]


@cache
def point_weights() -> Float64:
    """Return the weights (80, 84) of feature points in the points of tracker and outline."""
    weights = np.zeros((TRACKED + OUTLINE, len(names())))
    for row in packaged_rows(__package__, "points.csv"):
        for name, share in _terms(row["at"]):
            weights[int(row["number"]) - 1, point_rows()[name]] += share
    return _frozen(weights)


@cache
def point_parts() -> tuple[str, ...]:
    """Return the part of each of the 80 points: one of `PARTS`, "nose", "left_iris", "right_iris",
    "outline"."""
    return tuple(row["part"] for row in packaged_rows(__package__, "points.csv"))


@cache
def point_names() -> tuple[str, ...]:
    """Return the description of each of the 80 points."""
    return tuple(row["what"] for row in packaged_rows(__package__, "points.csv"))


@cache
def part_points(part: str) -> Intp:
    """Return the rows of the tracked points of a part."""
    return np.array([n for n, other in enumerate(point_parts()[:SAME]) if other == part], dtype=np.intp)


@cache
def part_vertices(part: str) -> Intp:
    """Return the rows of the mask's vertices that belong to a part."""
    computed = [
        SAME + n
        for n, row in enumerate(packaged_rows(__package__, "computed_vertices.csv"))
        if row["part"] == part
    ]
    return np.array([*part_points(part), *computed], dtype=np.intp)


@cache
def vertex_weights() -> Float64:
    """Return the weights (2, 86, 80) of points in the x and the y of vertices."""
    weights = np.zeros((2, VERTICES, TRACKED + OUTLINE))
    weights[:, range(SAME), range(SAME)] = 1.0
    for n, row in enumerate(packaged_rows(__package__, "computed_vertices.csv")):
        for axis, column in enumerate("xy"):
            for name, share in _terms(row[column]):
                weights[axis, SAME + n, int(name) - 1] += share
    return _frozen(weights)


@cache
def depth_weights() -> Float64:
    """Return the weights (86, 84) of feature points in the depth of vertices."""
    weights = np.zeros((VERTICES, len(names())))
    weights[:SAME] = point_weights()[:SAME]
    for n, row in enumerate(packaged_rows(__package__, "computed_vertices.csv")):
        if row["depth"]:
            weights[SAME + n, point_rows()[row["depth"]]] = 1.0
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
    """Return the mask (..., 86, 3), millimetres, of feature points (..., 84, 3), metres."""
    across = compute_vertices(points_of_face(features)[..., :2])
    deep = MILLIMETRES * (depth_weights() @ features[..., 2:])
    return np.concatenate([across, deep], axis=-1)


def flat_mask(points: Float64) -> Float64:
    """Return masks (..., 86, 3) of tracked points (..., 64, 2), with the standard depth and outline."""
    outline = np.broadcast_to(
        standard_points()[TRACKED:, :2], (*points.shape[:-2], len(standard_points()) - TRACKED, 2)
    )
    across = compute_vertices(np.concatenate([points, outline], axis=-2))
    deep = np.broadcast_to(standard_mask()[:, 2:], (*points.shape[:-2], VERTICES, 1))
    return np.concatenate([across, deep], axis=-1)


def compute_vertices(points: Float64) -> Float64:
    """Return x and y of the mask (..., 86, 2) for 80 points: Table 4.1 of the source."""
    across, up = vertex_weights()
    return np.stack([points[..., 0] @ across.T, points[..., 1] @ up.T], axis=-1)


@cache
def triangles() -> Int64:
    """Return the triangles of the mask: int64 (130, 3), 0-based vertices, counter-clockwise."""
    rows = [[int(row[name]) - 1 for name in "abc"] for row in packaged_rows(__package__, "triangles.csv")]
    array = np.array(rows, dtype=np.int64)
    array.flags.writeable = False
    return array


def mask_distance(points: Float64, others: Float64) -> Float64:
    """Return the mean distance of points from the nearest of the others (equation 3.16): float64 (...).

    points: (..., N, D). others: (..., M, D). Not symmetric; the source uses this direction only. It is
    Dubuisson and Jain's modification of Hausdorff's distance.
    """
    here, there = ((array**2).sum(axis=-1) for array in (points, others))
    square = here[..., :, None] + there[..., None, :] - 2 * points @ np.swapaxes(others, -1, -2)
    return np.asarray(np.sqrt(np.maximum(square.min(axis=-1), 0.0)).mean(axis=-1))


def _frozen(array: Float64) -> Float64:
    array.flags.writeable = False
    return array

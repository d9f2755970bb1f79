"""Wrinkles of the skin: how strong FAPs make them, and where they lie on a face.

All faces share one map (`fba_player._mesh.wrinkle_map`) of half a face, seen from the front. A face's feature
points say where each vertex of its skin lies in the map. Faces whose model asks for wrinkles show them.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from fba.arrays import Float32, Float64, Intp
from fba.face import FaceModel, Part
from fba.parameters import point_rows
from fba.sampling import smoothstep
from fba.text_files import packaged_rows
from fba_player._mesh.wrinkle_map import WRINKLES

BEGINNING_SHARE = 0.5
"""A wrinkle begins at this share of the motion at which it is full: half a frown shows none."""

MAP_POINTS = {
    "3.7": (0.690, -0.020), "3.11": (0.286, -0.048), "3.9": (0.515, -0.165), "3.13": (0.514, 0.159),
    "4.1": (0.238, 0.277), "4.3": (0.572, 0.394), "4.5": (0.938, 0.222),
    "9.1": (0.283, -0.614), "9.3": (0.000, -0.584), "9.15": (0.000, -0.768), "9.12": (0.000, -0.265),
    "8.1": (0.000, -0.997), "8.2": (0.000, -1.299), "8.3": (0.442, -1.121),
    "5.3": (0.690, -0.501), "2.10": (0.000, -1.612), "11.1": (0.000, 1.158),
}  # fmt: skip
"""Where feature points lie in the map: left of the middle and above the pupils, in eye separations (ES)."""
MIRRORED = {
    "3.7": "3.12", "3.11": "3.8", "3.9": "3.10", "3.13": "3.14", "4.1": "4.2", "4.3": "4.4", "4.5": "4.6",
    "9.1": "9.2", "8.3": "8.4", "5.3": "5.4",
}  # fmt: skip
"""The points of the right side."""
NEEDED = ("3.7", "3.11", "4.1", "4.3", "9.3", "8.3", "8.1")
"""Points without which a face shows no wrinkles."""
MAX_DEPTH = 0.75
"""How far behind the pupils the map reaches, in eye separations: not onto ears and neck."""
OUTSIDE_OF_MAP = 9.0
"""Coordinate, far outside of the map, of vertices without wrinkles."""
STIFFNESS = 1e-4
"""How far the map may miss feature points to bend less (regularisation of the spline)."""


@cache
def wrinkle_table() -> tuple[Intp, Intp, Float64]:
    """Return the rows of wrinkles.csv: their wrinkles (R,), columns of their FAPs, left and right (2, R), and
    the values that bring the wrinkles out fully (R,)."""
    rows = packaged_rows(__package__, "wrinkles.csv")
    kinds = np.array([WRINKLES.index(row["wrinkle"]) for row in rows])
    columns = np.array([[int(row[side]) - 1 for row in rows] for side in ("left", "right")])
    return kinds, columns, np.array([float(row["full"]) for row in rows])


def wrinkle_strengths(faps: Float32) -> Float32:
    """Return the strength of each of `WRINKLES` on the left and the right side: float32 (2, 4), 0..1.

    faps: (68,). A FAP counts only in the direction of its row; effects of several FAPs add up.
    """
    kinds, columns, full = wrinkle_table()
    shares = np.maximum(faps[columns] / full, 0.0)
    strengths = np.zeros((2, len(WRINKLES)))
    for side in range(2):
        np.add.at(strengths[side], kinds, shares[side])
    return smoothstep((strengths - BEGINNING_SHARE) / (1 - BEGINNING_SHARE)).astype(np.float32)


def place_wrinkles(model: FaceModel, part: Part) -> Float32 | None:
    """Return float32 (V, 2): where the vertices of a part lie in the map, x positive on the face's left.

    Vertices without wrinkles lie outside of it. None for parts other than skin, and for faces that show no
    wrinkles or lack the points needed.
    """
    if not model.wrinkles or part.kind != "skin":
        return None
    points = _points_in_map(model)
    if points is None:
        return None
    spline = _ThinPlate(*points)
    flat = _in_front(model, part.vertices.astype(np.float64))
    places = spline(flat[:, :2])
    behind = flat[:, 2] < -MAX_DEPTH
    places[behind, 0] += np.copysign(OUTSIDE_OF_MAP, places[behind, 0])
    return places.astype(np.float32)


def _in_front(model: FaceModel, positions: Float64) -> Float64:
    """Return the positions (N, 3) relative to the middle of the pupils, in eye separations."""
    middle = model.points[[point_rows()["3.5"], point_rows()["3.6"]]].mean(axis=0)
    return np.asarray((positions - middle) / (model.fapu.ES * 1024))


def _points_in_map(model: FaceModel) -> tuple[Float64, Float64] | None:
    """Return the points (N, 2) of a face that have places in the map, and these places (N, 2)."""
    positions, places = [], []
    for name, (x, y) in MAP_POINTS.items():
        for side, point in ((1, name), (-1, MIRRORED.get(name))):
            if point is None:
                continue
            position = model.points[point_rows()[point]]
            if np.isfinite(position).all():
                positions.append(position)
                places.append((side * x, y))
            elif name in NEEDED:
                return None
    flat = _in_front(model, np.array(positions))[:, :2]
    return (flat, np.array(places)) if np.isfinite(flat).all() else None  # not without the pupils


class _ThinPlate:
    """A thin-plate spline of the plane. SciPy has one, whose import would delay every start of the player."""

    def __init__(self, points: Float64, values: Float64) -> None:
        self._points = points
        count = len(points)
        flat = np.column_stack([np.ones(count), points])
        matrix = np.zeros((count + 3, count + 3))
        matrix[:count, :count] = _bending(points, points) + STIFFNESS * np.eye(count)
        matrix[:count, count:] = flat
        matrix[count:, :count] = flat.T
        self._weights = np.linalg.lstsq(matrix, np.vstack([values, np.zeros((3, 2))]), rcond=None)[0]

    def __call__(self, places: Float64) -> Float64:
        """Return the spline (N, 2) at places (N, 2)."""
        basis = np.column_stack([_bending(places, self._points), np.ones(len(places)), places])
        return np.asarray(basis @ self._weights)


def _bending(places: Float64, points: Float64) -> Float64:
    """Return (N, M): r^2 log r of the distances between places (N, 2) and points (M, 2)."""
    squared = ((places[:, None] - points[None]) ** 2).sum(axis=2)
    return np.asarray(0.5 * squared * np.log(np.maximum(squared, 1e-30)))

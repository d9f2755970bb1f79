"""A small head for tests: a mask through the feature points of `adult.csv`, eyeballs, teeth, a tongue."""

import csv
from functools import cache
from pathlib import Path

import numpy as np
from scipy.interpolate import RBFInterpolator
from scipy.spatial import Delaunay

from fba.face.authoring import author
from fba.face.feature_points import MIRRORED
from fba.face.model import FaceModel, Part
from fba.parameters import point_rows

EYE_RADIUS = 0.012
ON_SKIN = [
    name
    for name in point_rows()
    if name.split(".")[0] in {"2", "3", "4", "5", "8", "9", "11"}
    and name not in {"3.5", "3.6", "9.8", "9.9", "9.10", "9.11", "11.4", "11.5", "11.6"}
]
UPPER_LIP, LOWER_LIP = ("2.2", "2.6", "2.7"), ("2.3", "2.8", "2.9")


@cache
def adult_points() -> np.ndarray:
    """(84, 3) metres, symmetric: an adult by published norms, as the standard wants a neutral face."""
    points = np.full((len(point_rows()), 3), np.nan)
    for row in csv.DictReader(Path(__file__).with_name("adult.csv").read_text().splitlines()):
        place = np.array([float(row[axis]) for axis in "xyz"]) / 1000
        points[point_rows()[row["point"]]] = place
        if row["point"] in MIRRORED:
            points[point_rows()[MIRRORED[row["point"]]]] = place * (-1, 1, 1)
    return points


def small_head(points: np.ndarray | None = None, cell: float = 0.006) -> FaceModel:
    """No tables; about 1000 vertices with the default cell size in metres."""
    points = adult_points().copy() if points is None else points
    row = point_rows()
    skin, bound = _mask(points, cell)
    parts = [skin]
    for side, name in (("left", "3.5"), ("right", "3.6")):
        vertices, triangles = ball(points[row[name]] - (0, 0, EYE_RADIUS), EYE_RADIUS)
        bound[row[name]] = sum(len(p.vertices) for p in parts) + int(vertices[:, 2].argmax())
        parts.append(Part(f"{side} eye", "eye", vertices, triangles))
    for jaw, (low, high) in (("upper", ("9.10", "9.8")), ("lower", ("9.9", "9.11"))):
        heights = (points[row[low], 1], points[row[high], 1])
        corners = np.array([(x, y, z) for x in (-0.02, 0.02) for y in heights for z in (-0.02, 0)])
        corners[:, 2] += points[row["9.10"]][2]
        parts.append(Part(f"{jaw} teeth", "teeth", corners, _BOX))
    tongue, sides = ball(points[row["6.2"]], 1.0, rings=6)
    tongue = points[row["6.2"]] + (tongue - points[row["6.2"]]) * (0.015, 0.003, 0.025)
    parts.append(Part("tongue", "tongue", tongue, sides))
    at = sum(len(p.vertices) for p in parts[:-1])
    for name in ("6.1", "6.3", "6.4"):
        nearest = int(np.linalg.norm(tongue - points[row[name]], axis=1).argmin())
        tongue[nearest] = points[row[name]]
        bound[row[name]] = at + nearest
    parts[-1] = Part("tongue", "tongue", tongue, sides)
    return FaceModel(parts=tuple(parts), points=points, bound=bound, name="small head")


@cache
def authored_head(cell: float = 0.006) -> FaceModel:
    """A small head with tables that `author` made."""
    head = small_head(cell=cell)
    return author(head.parts, head.points, bound=head.bound)


def ball(centre: np.ndarray, radius: float, rings: int = 12) -> tuple[np.ndarray, np.ndarray]:
    """A sphere with its poles on the z axis: the first vertex is the foremost."""
    polar = np.linspace(0, np.pi, rings + 1)
    turn = np.arange(2 * rings) * np.pi / rings
    a, b = np.meshgrid(polar[1:-1], turn, indexing="ij")
    around = np.stack([np.sin(a) * np.cos(b), np.sin(a) * np.sin(b), np.cos(a)], axis=-1).reshape(-1, 3)
    unit = np.vstack([[0, 0, 1], around, [0, 0, -1]])
    n = 2 * rings
    faces = [(0, 1 + i, 1 + (i + 1) % n) for i in range(n)]
    for k in range(rings - 2):
        for i in range(n):
            p, q = 1 + k * n + i, 1 + k * n + (i + 1) % n
            faces += [(p, p + n, q), (q, p + n, q + n)]
    last = len(unit) - 1
    faces += [(last, last - n + (i + 1) % n, last - n + i) for i in range(n)]
    return np.asarray(centre) + radius * unit, np.array(faces)


_BOX = np.array(
    [
        *([0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1]),
        *([2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]),
    ]
)


def _mask(points: np.ndarray, cell: float) -> tuple[Part, np.ndarray]:
    """Two sheets, above and below the line of the lips, with holes for the eyes, through every point."""
    row = point_rows()
    known = points[[row[name] for name in ON_SKIN]]
    planar, first = np.unique(known[:, :2].round(6), axis=0, return_index=True)
    depth = RBFInterpolator(planar, known[first, 2], kernel="thin_plate_spline")
    mouth = points[row["2.2"], 1]
    low, high = known[:, :2].min(axis=0) - cell, known[:, :2].max(axis=0) + cell
    xs, ys = np.arange(low[0], high[0], cell), np.arange(low[1], high[1], cell)
    grid = np.stack(np.meshgrid(xs, ys), axis=-1).reshape(-1, 2)
    line = np.column_stack([xs, np.full(len(xs), mouth)])
    bound = np.full(len(row), -1, dtype=np.int32)
    vertices, triangles, start = [], [], 0
    for sheet, names in ((1, LOWER_LIP), (-1, UPPER_LIP)):
        mine = [n for n in ON_SKIN if n not in names and (points[row[n], 1] - mouth) * sheet >= -1e-9]
        if sheet < 0:
            mine = [n for n in mine if n not in {"2.4", "2.5", "5.1", "5.2", "8.3", "8.4"}]
        own = points[[row[n] for n in mine], :2]
        rest = np.vstack([grid[(grid[:, 1] - mouth) * sheet > cell / 2], line])
        rest = rest[np.linalg.norm(rest[:, None] - own[None], axis=2).min(axis=1) > cell / 3]
        flat = np.vstack([own, rest])
        faces = Delaunay(flat).simplices
        span = flat[faces]
        turned = np.linalg.det(span[:, 1:] - span[:, :1]) < 0
        faces[turned] = faces[turned][:, ::-1]
        middle = flat[faces].mean(axis=1)
        hole = np.zeros(len(faces), dtype=bool)
        for lids in (("3.7", "3.1", "3.11", "3.3"), ("3.12", "3.2", "3.8", "3.4")):
            outer, top, inner, bottom = (points[row[n], :2] for n in lids)
            centre = np.array([(outer[0] + inner[0]) / 2, (top[1] + bottom[1]) / 2])
            size = np.array([abs(outer[0] - inner[0]) / 2, (top[1] - bottom[1]) / 2])
            hole |= (((middle - centre) / size) ** 2).sum(axis=1) < 0.9
        z = depth(flat)
        z[: len(mine)] = points[[row[n] for n in mine], 2]
        vertices.append(np.column_stack([flat, z]))
        triangles.append(faces[~hole] + start)
        for i, name in enumerate(mine):
            bound[row[name]] = start + i
        start += len(flat)
    return Part("skin", "skin", np.vstack(vertices), np.vstack(triangles)), bound

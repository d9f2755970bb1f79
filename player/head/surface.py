"""The skin of the built-in head: a smooth surface through landmarks and feature points, that moves with them.

The head is star-shaped about a point inside it, so its skin is one distance for every direction: a
thin-plate spline through all landmarks. It is cut into triangles in a flat chart of those directions, with
holes for eyes and mouth. How far each vertex follows each feature point is a biharmonic interpolation
over the mesh between those points and what stays still, so motion dies away smoothly and goes round the
holes: an upper lip never grips the lower one.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import numpy as np
import numpy.typing as npt

from fba.face.feature_points import names, row_of
from fba.face.points import FeaturePointFace
from player.head.hairline import hairline_places
from player.head.loops import LIP_STEPS, Curve, brow, lid, lip
from player.head.spreading import spread

Float64 = npt.NDArray[np.float64]
Int32 = npt.NDArray[np.int32]

CENTRE = np.array([0.0, -0.030, -0.090])
SKIN_GROUPS = ("2.1", "2.10", "2.11", "2.12", "2.13", "2.14")
OFF_SKIN = ("8.", "9.8", "9.9", "9.10", "9.11", "11.5")
FINE, MEDIUM, COARSE = 0.025, 0.036, 0.09
"""Distance of neighbours in the chart, radians: face, sides, back of the head."""
RIM = 2.95
"""Angle from straight ahead at which the chart ends; a single vertex closes the head there."""


@dataclass(frozen=True, eq=False)
class Surface:
    """vertices (V, 3), triangles (F, 3), weights (V, 84): vertex = neutral + weights @ displacements.

    chart (V, 2): where the vertex lies in the chart. parts: vertex rows by name ("lid margin left
    upper", "lip inner upper", "lip inner lower", "brow left", ...). lip: (V,) share of lip colour.
    """

    vertices: Float64
    triangles: Int32
    weights: Float64
    chart: Float64
    parts: dict[str, npt.NDArray[np.intp]]
    lip: Float64


def to_chart(places: Float64) -> Float64:
    """Places -> (N, 2) azimuthal equidistant chart about straight ahead, radians."""
    d = places - CENTRE
    d = d / np.linalg.norm(d, axis=1, keepdims=True)
    angle = np.arctan2(np.hypot(d[:, 0], d[:, 1]), d[:, 2])
    length = np.maximum(np.hypot(d[:, 0], d[:, 1]), 1e-12)
    chart: Float64 = d[:, :2] / length[:, None] * angle[:, None]
    return chart


def from_chart(chart: Float64) -> Float64:
    """Unit directions of chart places."""
    angle = np.hypot(chart[:, 0], chart[:, 1])
    flat = chart * (np.sin(angle) / np.maximum(angle, 1e-12))[:, None]
    return np.concatenate([flat, np.cos(angle)[:, None]], axis=1)


def mirrored(places: Float64) -> Float64:
    """Places and their mirror images, those on the midline once."""
    aside = places[np.abs(places[:, 0]) > 1e-9]
    return np.concatenate([places, aside * np.where(np.arange(places.shape[1]) == 0, -1.0, 1.0)])


class Skin:
    """Distance of the skin from the head's centre, in every direction."""

    def __init__(self, face: FeaturePointFace) -> None:
        from scipy.interpolate import RBFInterpolator

        with (files(__package__) / "landmarks.csv").open(encoding="utf-8") as file:
            extra = [[float(row[axis]) / 1000 for axis in "xyz"] for row in csv.DictReader(file)]
        on_skin = face.points[[row_of()[name] for name in skin_points()]]
        places = np.concatenate([mirrored(np.array(extra)), on_skin])
        offset = places - CENTRE
        radius = np.linalg.norm(offset, axis=1)
        self._spline = RBFInterpolator(
            offset / radius[:, None], radius, kernel="thin_plate_spline", smoothing=2e-5, degree=1
        )
        self._balls = face.eyeball_centres
        self._lid_radius = face.eyeball_radius + 0.0015

    def places(self, chart: Float64) -> Float64:
        """(N, 3) places on the skin; where eyeballs lie beneath, the skin bulges over them."""
        direction = from_chart(chart)
        radius = self._spline(direction)
        for centre in self._balls:
            offset = centre - CENTRE
            along = direction @ offset
            inside = self._lid_radius**2 - (offset @ offset - along**2)
            over = np.where(inside > 0, along + np.sqrt(np.maximum(inside, 0)), 0.0)
            radius = _smooth_max(radius, over, 0.003)
        place: Float64 = CENTRE + direction * radius[:, None]
        return place


def _smooth_max(a: Float64, b: Float64, width: float) -> Float64:
    blend = np.clip(0.5 + (b - a) / (2 * width), 0, 1)
    result: Float64 = a + (b - a) * blend + width * blend * (1 - blend)
    return result


@cache
def skin_points() -> tuple[str, ...]:
    """Feature points that lie on the skin, lips excluded where they face inward."""
    skin = [n for n in names() if n.split(".")[0] in ("4", "5", "8", "9", "11") or n in SKIN_GROUPS]
    return tuple(n for n in skin if n not in OFF_SKIN)


def build(face: FeaturePointFace) -> Surface:
    """The skin of a face that has the proportions of the neutral one."""
    skin = Skin(face)
    mesh = _Parts()
    holes: dict[str, list[Float64]] = {"left": [], "right": [], "mouth": []}
    for side in ("left", "right"):
        for upper in (True, False):
            edge = slice(None) if upper else slice(1, -1)
            curves = [lid(face, upper=upper, fold=fold) for fold in (False, True)]
            if side == "right":
                curves = [curve.mirrored() for curve in curves]
            margin, fold = curves[0], Curve(skin.places(to_chart(curves[1].places)), curves[1].weights)
            name = f"{side} {'upper' if upper else 'lower'}"
            mesh.add(f"lid margin {name}", margin.places[edge], margin.weights[edge])
            holes[side].append(to_chart(margin.places) if upper else to_chart(margin.places)[::-1])
            for t in (0.3, 0.65):
                between = margin.places * (1 - t) + fold.places * t
                mesh.add(f"lid {name} {t}", _outside(between, face, 0.0012 * t + 0.0006)[1:-1])
            mesh.add(f"lid fold {name}", fold.places[edge], fold.weights[edge])
        arch = brow(face) if side == "left" else brow(face).mirrored()
        mesh.add(f"brow {side}", skin.places(to_chart(arch.places)), arch.weights)
    _add_lips(mesh, face, holes["mouth"])
    keep = [n for n in skin_points() if not n.startswith(("4.", "8."))]
    rows = [row_of()[n] for n in keep]
    for offset in (-0.0022, 0.0010, 0.0042):
        mesh.add(f"hairline {offset}", mirrored(hairline_places(lambda p: skin.places(to_chart(p)), offset)))
    mesh.add("points", face.points[rows], np.eye(len(names()))[rows])
    outline = [np.concatenate(loop) for loop in holes.values()]
    covered = [*_lid_areas(mesh), _lip_area(mesh)]
    grid = _grid(mesh.chart(), covered)
    mesh.add("skin", skin.places(grid), chart=grid)
    return _finish(mesh, skin, outline)


class _Parts:
    def __init__(self) -> None:
        self.places: list[Float64] = []
        self.charts: list[Float64] = []
        self.weights: list[Float64 | None] = []
        self.names: dict[str, npt.NDArray[np.intp]] = {}
        self.count = 0

    def add(
        self, name: str, places: Float64, weights: Float64 | None = None, chart: Float64 | None = None
    ) -> None:
        self.places.append(places)
        self.charts.append(to_chart(places) if chart is None else chart)
        self.weights.append(weights)
        self.names[name] = np.arange(self.count, self.count + len(places))
        self.count += len(places)

    def chart(self) -> Float64:
        return np.concatenate(self.charts)

    def part_chart(self, name: str) -> Float64:
        return self.charts[list(self.names).index(name)]


def _outside(places: Float64, face: FeaturePointFace, gap: float) -> Float64:
    """Places pushed out to at least `gap` off the nearer eyeball."""
    result = places.copy()
    for centre in face.eyeball_centres:
        offset = result - centre
        distance = np.linalg.norm(offset, axis=1, keepdims=True)
        least = face.eyeball_radius + gap
        result = np.where(distance < least, centre + offset * (least / distance), result)
    return result


def _add_lips(mesh: _Parts, face: FeaturePointFace, hole: list[Float64]) -> None:
    for upper in (True, False):
        edge = slice(None) if upper else slice(1, -1)
        inner, outer = (lip(face, upper=upper, inner=inner) for inner in (True, False))
        name = "upper" if upper else "lower"
        u = np.linspace(-1, 1, LIP_STEPS * 2 + 1)
        # The lips touch, but the chart needs a slit between them, as if a little open.
        slit = np.zeros_like(inner.places)
        slit[:, 1] = (0.0016 if upper else -0.0016) * (1 - u**4)
        apart = to_chart(inner.places + slit)
        hole.append(apart if upper else apart[::-1])
        mesh.add(f"lip inner {name}", inner.places[edge], inner.weights[edge], apart[edge])
        outer_chart = to_chart(outer.places)
        for t in (0.2, 0.45, 0.72):
            places = inner.places * (1 - t) + outer.places * t
            fullness = np.sin(np.pi * t**0.75) * (1 - u**2) ** 0.7
            places[:, 2] += 0.0027 * fullness
            weights = inner.weights * (1 - t) + outer.weights * t
            chart = apart * (1 - t) + outer_chart * t
            mesh.add(f"lip {name} {t}", places[1:-1], weights[1:-1], chart[1:-1])
        mesh.add(f"lip outer {name}", outer.places[edge], outer.weights[edge], outer_chart[edge])


def _lid_areas(mesh: _Parts) -> list[Float64]:
    areas = []
    for side in ("left", "right"):
        upper, lower = (mesh.part_chart(f"lid fold {side} {which}") for which in ("upper", "lower"))
        areas.append(np.concatenate([upper, lower[::-1]]))
    return areas


def _lip_area(mesh: _Parts) -> Float64:
    upper, lower = (mesh.part_chart(f"lip outer {which}") for which in ("upper", "lower"))
    return np.concatenate([upper, lower[::-1]])


def _grid(taken: Float64, covered: list[Float64]) -> Float64:
    """Places in the chart to fill the rest: dense on the face, sparse behind; symmetric."""
    from scipy.spatial import cKDTree

    layers = []
    for spacing, low, high in ((FINE, 0.0, 0.78), (MEDIUM, 0.78, 1.75), (COARSE, 1.75, RIM - 0.05)):
        rows = np.arange(-RIM, RIM, spacing * 0.866)
        columns = np.arange(0, RIM, spacing)
        x, y = np.meshgrid(columns, rows)
        x = x + (np.arange(len(rows)) % 2 * spacing / 2)[:, None]
        half = np.stack([x.ravel(), y.ravel()], axis=1)
        angle = np.hypot(half[:, 0] * 1.05, half[:, 1])
        half = half[(angle >= low) & (angle < high)]
        layers.append(half[_free(half, taken, 0.62 * spacing, cKDTree)])
        taken = np.concatenate([taken, mirrored(layers[-1])])
    half = np.concatenate(layers)
    for area in covered:
        half = half[~_inside(half, area)]
    around = np.linspace(0, 2 * np.pi, 48, endpoint=False)
    rim = RIM * np.stack([np.sin(around), np.cos(around)], axis=1)
    return np.concatenate([mirrored(half), rim])


def _free(places: Float64, taken: Float64, distance: float, tree: type) -> npt.NDArray[np.bool_]:
    nearest = tree(taken).query(places)[0]
    return np.asarray(nearest > distance)


def _inside(places: Float64, polygon: Float64) -> npt.NDArray[np.bool_]:
    inside = np.zeros(len(places), dtype=bool)
    for a, b in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
        if a[1] == b[1]:
            continue
        crossing = (a[1] > places[:, 1]) != (b[1] > places[:, 1])
        inside ^= crossing & (places[:, 0] < (b[0] - a[0]) * (places[:, 1] - a[1]) / (b[1] - a[1]) + a[0])
    return inside


def _finish(mesh: _Parts, skin: Skin, holes: list[Float64]) -> Surface:
    from scipy.spatial import Delaunay

    chart, vertices = mesh.chart(), np.concatenate(mesh.places)
    triangles = Delaunay(chart).simplices
    centroids = chart[triangles].mean(axis=1)
    in_hole = np.zeros(len(triangles), dtype=bool)
    for hole in holes:
        in_hole |= _inside(centroids, hole)
    edge = np.zeros(len(vertices), dtype=bool)
    for name, rows in mesh.names.items():
        edge[rows] = "margin" in name or "inner" in name
    triangles = triangles[~(in_hole & edge[triangles].all(axis=1))]
    a, b, c = (chart[triangles[:, i]] for i in range(3))
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    triangles = np.where((area < 0)[:, None], triangles[:, ::-1], triangles)[np.abs(area) > 1e-9]
    rim = mesh.names["skin"][-48:]
    pole = skin.places(np.array([[0.0, -np.pi]]))
    fan = np.stack([rim, np.roll(rim, -1), np.full(48, len(vertices))], axis=1)
    triangles = np.concatenate([triangles, fan])
    vertices = np.concatenate([vertices, pole])
    chart = np.concatenate([chart, [[0.0, -np.pi]]])
    given, known = _given_weights(vertices, mesh)
    weights = spread(vertices, triangles, given, known)
    lip_share = np.zeros(len(vertices))
    for name, rows in mesh.names.items():
        if name.startswith("lip"):
            lip_share[rows] = 0.55 if "outer" in name else 1.0
    return Surface(vertices, triangles.astype(np.int32), weights, chart, dict(mesh.names), lip_share)


def _given_weights(vertices: Float64, mesh: _Parts) -> tuple[Float64, npt.NDArray[np.bool_]]:
    """Weights of the curves and points, none for what lies behind and below, and which these are."""
    known = np.zeros(len(vertices), dtype=bool)
    weights = np.zeros((len(vertices), len(names())))
    for rows, given in zip(mesh.names.values(), mesh.weights, strict=True):
        if given is not None:
            known[rows] = True
            weights[rows] = given
    still = (vertices[:, 2] < -0.085) | (vertices[:, 1] > 0.062)
    still |= (vertices[:, 1] < -0.104) & (vertices[:, 2] < -0.045)
    return weights, known | still

"""How well the surface is fitted to true points of other heads.

python -m tools.photos.measure_surface SHARED [MAP.png]

SHARED: the folder of shared data. MAP.png: shows each head from the front and from three quarters; red where
the true surface lies outside the fitted one, blue inside, full at 6 mm; points that were given are green.
"""

from __future__ import annotations

import sys
import warnings
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from PIL import Image
from scipy.spatial import cKDTree

from fba.arrays import Bool, Float64, Intp
from fba.errors import FbaWarning
from fba.face import FaceModel
from fba.face.fitting import FRONT_POINTS, SIDE_POINTS, Photo, Photograph
from fba.face.fitting._head import fit_head
from fba.face.fitting._views import View
from fba.face.importers import import_model
from fba.geometry import fit_similarity
from fba.parameters import point_rows
from fba.rotations import turn
from tools.photos.other_heads import other_heads

WITHOUT_EYES = "mediapipe_canonical"
"""A further head, of which only the points are used."""
SIZE = (600, 700)
FINE, COARSE = 0.0012, 0.003
"""Metres between samples of the fitted and of the true surface."""
HIDDEN = 0.008
"""Metres behind the foremost surface from which skin is not seen from the front."""
FOREHEAD, HALF_WIDTH, BEHIND = 0.95, 1.15, 1.0
"""The face ends so far above, beside and behind the pupils, in distances between these."""
JAW, EYE = 0.006, 0.002
"""Metres below the line from chin to jaw that count, and around the openings of the eyes that do not."""
FULL = 0.006
MAP, PIXELS = (300, 260), 1500
"""Height and width of a map, and its pixels for a metre."""
Samples = tuple[Float64, Float64, Float64]
"""Of a surface: places (N, 3), normals (N, 3), areas (N,)."""


@dataclass(frozen=True, eq=False)
class SurfaceError:
    """Errors (N,), metres, at samples of the true face; above 0 where that lies outside the fitted one."""

    samples: Samples
    errors: Float64

    @property
    def mean(self) -> float:
        """Mean over the area, mm."""
        return 1000 * float(np.average(np.abs(self.errors), weights=self.samples[2]))

    @property
    def most(self) -> float:
        """That 95 % of the area stay below, mm."""
        off = np.abs(self.errors)
        order = np.argsort(off)
        share = np.cumsum(self.samples[2][order]) / self.samples[2].sum()
        return 1000 * float(off[order][np.searchsorted(share, 0.95)])

    @property
    def good(self) -> float:
        """Share of the area within 3 mm."""
        return float(np.average(np.abs(self.errors) < 0.003, weights=self.samples[2]))


def photographed(head: FaceModel, number: int, *, side: bool) -> FaceModel:
    """Return the head made of true points of a head, seen from up to 10 degrees off the front and side."""
    random = np.random.default_rng(number)
    row = point_rows()
    eyes = float(np.linalg.norm(head.points[row["3.5"]] - head.points[row["3.6"]]))
    photos = []
    for yaw, names in ((0.0, FRONT_POINTS), (90.0, SIDE_POINTS))[: 2 if side else 1]:
        beside, above = np.radians(np.array([-yaw, 0]) + random.uniform(-10, 10, 2))
        around = turn(np.array([1.0, 0, 0]), above) @ turn(np.array([0, 1.0, 0]), beside)
        view = View(around, 1800.0, np.array([300.0, 300.0]), 1.5)
        known = [name for name in names if np.isfinite(head.points[row[name]]).all()]
        places = view.project(head.points[[row[name] for name in known]] - head.points[row["9.15"]])
        points = {name: (float(x), float(y)) for name, (x, y) in zip(known, places, strict=True)}
        pixels = np.full((SIZE[1], SIZE[0], 3), 150, dtype=np.uint8)
        photos.append(Photo(Photograph(pixels, SIZE, f"{yaw:g}"), points))
    with warnings.catch_warnings(action="ignore", category=FbaWarning):
        base = replace(FaceModel.default(), tables=(), levels=())  # only the shape is measured
        return fit_head(base, photos[0], photos[1] if side else None, eyes=eyes)[0]


def surface_error(fitted: FaceModel, true: FaceModel) -> SurfaceError:
    """Return how far the true face is from a fitted one that is laid on it by the points of both."""
    rows = given(true)
    laid = fit_similarity(fitted.points[rows], true.points[rows])
    vertices = laid.apply(fitted.part("skin").vertices.astype(np.float64))
    places, normals, _ = _samples(vertices, fitted.part("skin").triangles, FINE)
    face = _face(true)
    apart, near = cKDTree(places).query(face[0])
    off = face[0] - places[near]
    across = np.abs((off * normals[near]).sum(axis=1))
    apart = np.where(apart < FINE, np.minimum(apart, across), apart)  # between samples
    return SurfaceError(face, np.copysign(apart, (off * face[1]).sum(axis=1)))


def given(head: FaceModel) -> Intp:
    """Return the rows of the points of a head that photographs show."""
    rows = np.array(sorted({point_rows()[name] for name in FRONT_POINTS + SIDE_POINTS}))
    return rows[np.isfinite(head.points[rows]).all(axis=1)]


def _samples(vertices: Float64, triangles: np.ndarray, step: float) -> Samples:
    """Return places on triangles, hardly further apart than a step, metres."""
    corners = vertices[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(normals, axis=1) / 2
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    parts = np.clip(np.ceil(longest / step).astype(int), 1, 40)
    places, owners, shares = [], [], []
    for count in np.unique(parts):
        own = np.flatnonzero(parts == count)
        grid = np.array([(i + 1 / 3, j + 1 / 3) for i in range(count) for j in range(count - i)]) / count
        weights = np.column_stack([grid, 1 - grid.sum(axis=1)])
        places.append(np.einsum("kc,fcd->fkd", weights, corners[own]).reshape(-1, 3))
        owners.append(np.repeat(own, len(grid)))
        shares.append(np.repeat(areas[own] / len(grid), len(grid)))
    units = normals / np.maximum(2 * areas, 1e-15)[:, None]
    return np.concatenate(places), units[np.concatenate(owners)], np.concatenate(shares)


def _face(head: FaceModel) -> Samples:
    """Return samples of a face that are seen from the front: no eyes, ears, neck or skull."""
    part, row, points = head.part("skin"), point_rows(), head.points
    places, normals, areas = _samples(part.vertices.astype(np.float64), part.triangles, COARSE)
    x, y, z = places.T
    middle = (points[row["3.5"]] + points[row["3.6"]]) / 2
    eyes = float(np.linalg.norm(points[row["3.5"]] - points[row["3.6"]]))
    chin = points[row["2.1"]]
    keep: Bool = (normals[:, 2] > 0) & foremost(places) & (y > chin[1]) & (y < middle[1] + FOREHEAD * eyes)
    keep &= (z > middle[2] - BEHIND * eyes) & (np.abs(x - middle[0]) < HALF_WIDTH * eyes)
    for outer, inner, upper, lower in (("3.7", "3.11", "3.1", "3.3"), ("3.8", "3.12", "3.2", "3.4")):
        corners = points[[row[outer], row[inner]]]
        centre, wide = corners.mean(axis=0), np.linalg.norm(corners[0] - corners[1]) / 2 + EYE
        high = abs(points[row[upper], 1] - points[row[lower], 1]) / 2 + EYE
        keep &= ((x - centre[0]) / wide) ** 2 + ((y - centre[1]) / high) ** 2 > 1
    for name in ("2.13", "2.14"):
        jaw = points[row[name]]
        along = (x - chin[0]) / (jaw[0] - chin[0])
        keep &= (along < 0) | (y > chin[1] + np.clip(along, 0, 1) * (jaw[1] - chin[1]) - JAW)
    return places[keep], normals[keep], areas[keep]


def foremost(places: Float64) -> Bool:
    """Return (N,), whether places are seen from the front."""
    cells = np.unique(np.floor(places[:, :2] / COARSE), axis=0, return_inverse=True)[1].ravel()
    front = np.full(cells.max() + 1, -np.inf)
    np.maximum.at(front, cells, places[:, 2])
    return np.asarray(places[:, 2] > front[cells] - HIDDEN)


def error_map(error: SurfaceError, points: Float64, yaw: float) -> np.ndarray:
    """Return a picture uint8 (H, W, 3) of a face from a side (degrees) in the colours of its errors."""
    places, normals, _ = error.samples
    around = turn(np.array([0.0, 1.0, 0.0]), np.radians(-yaw))
    share = np.clip(error.errors / FULL, -1, 1)
    colours = np.stack([1 + np.minimum(share, 0), 1 - np.abs(share), 1 - np.maximum(share, 0)], axis=1)
    facing = (normals @ around.T)[:, 2]
    colours *= np.clip(0.35 + 0.65 * facing, 0, 1)[:, None] * 255
    picture = np.full((*MAP, 3), 40, dtype=np.uint8)

    def draw(marked: Float64, paint: Float64, reach: int) -> None:
        seen = (marked - places.mean(axis=0)) @ around.T
        for k in np.argsort(seen[:, 2]):
            x, y = (seen[k, :2] * (PIXELS, -PIXELS) + (MAP[1] / 2, MAP[0] / 2)).astype(int)
            if 0 <= x < MAP[1] and 0 <= y < MAP[0]:
                picture[max(y - reach, 0) : y + reach + 1, max(x - reach, 0) : x + reach + 1] = paint[k]

    draw(places[facing > 0], colours[facing > 0], 2)
    draw(points, np.tile([0, 140, 0], (len(points), 1)), 1)
    return picture


def main(shared: str, output: str | None = None) -> None:
    heads = other_heads(Path(shared))
    heads[WITHOUT_EYES] = import_model(Path(shared) / f"data/foreign/heads/{WITHOUT_EYES}.obj")
    maps = []
    print(f"{'':20}   front alone: mean, 95 % (mm), within 3 mm    with profile")
    for number, (name, head) in enumerate(heads.items()):
        errors = [surface_error(photographed(head, number, side=side), head) for side in (False, True)]
        texts = [f"{one.mean:6.2f} {one.most:6.2f} {100 * one.good:6.0f} %" for one in errors]
        print(f"{name:20} {'      '.join(texts)}", flush=True)
        points = head.points[given(head)]
        maps.append(np.vstack([error_map(errors[1], points, yaw) for yaw in (0.0, 45.0)]))
    if output:
        Image.fromarray(np.hstack(maps)).save(output)


if __name__ == "__main__":
    main(*sys.argv[1:])

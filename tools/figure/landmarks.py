"""The standard's feature points on the built-in head, by the rules of points.csv."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import numpy.typing as npt
import sculpt
from subdivide import Refined

from fba.face.feature_points import MIRRORED, names, row_of
from fba.mesh.meshes import vertex_normals

Float64 = npt.NDArray[np.float64]
HERE = Path(__file__).parent


def bound_points(
    surface: Refined,
    where: sculpt.Marks,
    found: dict[str, int],
    starts: dict[str, int],
) -> tuple[Float64, npt.NDArray[np.int32]]:
    """(feature points (84, 3), the vertices (84,) they are bound to), by the rules of points.csv.

    found: vertices of points on parts other than the skin; starts: first vertex of each part.
    """
    points, bound = np.full((len(names()), 3), np.nan), np.full(len(names()), -1, dtype=np.int32)
    finder = Finder(surface, where)
    with (HERE / "points.csv").open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            name, part = row["point"], row["part"]
            place = np.array([float(row[axis]) for axis in "xyz"])
            pair = [(name, place, 1.0)]
            if name in MIRRORED:
                pair.append((MIRRORED[name], place, -1.0))
            for point, target, side in pair:
                at = row_of()[point]
                if row["rule"] == "free":
                    points[at] = target / 1000
                elif part == "skin":
                    bound[at] = finder.find(row["rule"], target, side)
                else:
                    own = part.replace("left", "right") if side < 0 else part
                    bound[at] = starts[own] + found[point]
    return points, bound


class Finder:
    """Finds vertices of the skin by the rules of points.csv."""

    def __init__(self, surface: Refined, where: sculpt.Marks) -> None:
        self.vertices = surface.vertices
        self.eye, self.mouth = (
            sculpt.interpolate_rings(surface, where.eye),
            sculpt.interpolate_rings(surface, where.mouth),
        )
        self.lip = surface.blend @ where.lip.astype(np.float64)
        self.normals = vertex_normals(surface.vertices, surface.triangles)
        self.outside = np.zeros(len(self.vertices), dtype=bool)
        self.outside[surface.triangles[surface.uvs[surface.corners].mean(axis=1)[:, 0] < 1.0]] = True

    def find(self, rule: str, target: Float64, side: float) -> int:
        """The vertex of a rule of points.csv, on the left (side 1) or right (-1)."""
        places = self.vertices * (side, 1.0, 1.0)
        return int(getattr(self, f"_{rule}")(places, target))

    def _best(self, score: Float64, chosen: npt.NDArray[np.bool_]) -> int:
        return int(np.where(chosen, score, np.inf).argmin())

    def _near(self, places: Float64, target: Float64) -> int:
        face = self.outside & ((self.mouth == sculpt.FAR) | (self.mouth > 2))
        on_midline = np.abs(places[:, 0]) < 1e-6 if target[0] == 0 else np.abs(places[:, 0]) > 1e-6
        return self._best(np.linalg.norm(places - target / 1000, axis=1), face & on_midline)

    def _lip(self, places: Float64, target: Float64) -> int:
        ring = np.abs(self.mouth - sculpt.CONTACT_RING) < 1e-6
        widest = places[ring, 0].max()
        lips = ring & (self.lip * target[1] > 0) if target[1] else ring
        return self._best(np.abs(places[:, 0] - target[0] * widest), lips)

    def _lid(self, places: Float64, target: Float64) -> int:
        ring = (np.abs(self.eye - sculpt.MARGIN_RING) < 1e-6) & (places[:, 0] > 0)
        if target[0]:
            return self._best(-places[:, 0] * target[0], ring)
        height = places[:, 1] * target[1]
        centre = sculpt.EYE_CENTRE - sculpt.ORIGIN
        return self._best(np.abs(places[:, 0] - centre[0]), ring & (height > 0.002))

    def _top(self, places: Float64, target: Float64) -> int:
        return self._best(-places[:, 1], np.abs(places[:, 0]) < 1e-6)

    def _back(self, places: Float64, target: Float64) -> int:
        return self._best(places[:, 2], (np.abs(places[:, 0]) < 1e-6) & (places[:, 1] > -0.03))

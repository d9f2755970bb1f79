"""The standard's feature points on the built-in head, by the rules of points.csv."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fba.arrays import Bool, Float64, Int32
from fba.face import feature_point_names as names
from fba.face.feature_points import MIRRORED
from fba.parameters import point_rows
from tools.figure import sculpt
from tools.figure.subdivide import Refined

HERE = Path(__file__).parent / "data"


def bound_points(
    surface: Refined, grown: Float64, marks: sculpt.Marks, inner: dict[str, int], starts: dict[str, int]
) -> tuple[Float64, Int32]:
    """Return feature points (84, 3), and the vertices (84,) they are bound to, by the rules of points.csv.

    grown: the surface's vertices with hair, whose top and back are the head's. marks: of the surface. inner:
    vertices of points on parts other than the skin. starts: first vertex of each part.
    """
    points, bound = np.full((len(names()), 3), np.nan), np.full(len(names()), -1, dtype=np.int32)
    outside = np.zeros(len(surface.vertices), dtype=bool)
    outside[surface.triangles[surface.uvs[surface.corners].mean(axis=1)[:, 0] < 1.0]] = True
    skin = Skin(surface.vertices, grown, marks, outside)
    with (HERE / "points.csv").open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            name, part = row["point"], row["part"]
            place = np.array([float(row[axis]) for axis in "xyz"])
            pair = [(name, place, 1.0)]
            if name in MIRRORED:
                pair.append((MIRRORED[name], place, -1.0))
            for point, target, side in pair:
                number = point_rows()[point]
                if row["rule"] == "free":
                    points[number] = target / 1000
                elif part == "skin":
                    bound[number] = skin.find(row["rule"], target, side)
                else:
                    own = part.replace("left", "right") if side < 0 else part
                    bound[number] = starts[own] + inner[point]
    return points, bound


@dataclass(frozen=True, eq=False)
class Skin:
    """The skin that points are bound to. grown: its vertices with hair. marks: of its vertices. outside: (V,)
    mask of its outer side."""

    vertices: Float64
    grown: Float64
    marks: sculpt.Marks
    outside: Bool

    def find(self, rule: str, target: Float64, side: float) -> int:
        """Return the vertex of a rule of points.csv, on the left (side 1) or right (-1)."""
        score, candidates = RULES[rule](self, self.vertices * (side, 1.0, 1.0), target)
        return int(np.where(candidates, score, np.inf).argmin())


def _near(skin: Skin, positions: Float64, target: Float64) -> tuple[Float64, Bool]:
    mouth = skin.marks.mouth
    face = skin.outside & ((mouth == sculpt.FAR) | (mouth > 2))
    on_midline = np.abs(positions[:, 0]) < 1e-6
    return np.linalg.norm(positions - target / 1000, axis=1), face & (on_midline == (target[0] == 0))


def _on_lip(skin: Skin, positions: Float64, target: Float64) -> tuple[Float64, Bool]:
    ring = np.abs(skin.marks.mouth - sculpt.CONTACT_RING) < 1e-6
    widest = positions[ring, 0].max()
    lips = ring & (skin.marks.lip * target[1] > 0) if target[1] else ring
    return np.abs(positions[:, 0] - target[0] * widest), lips


def _on_lid(skin: Skin, positions: Float64, target: Float64) -> tuple[Float64, Bool]:
    ring = (np.abs(skin.marks.eye - sculpt.MARGIN_RING) < 1e-6) & (positions[:, 0] > 0)
    if target[0]:
        return -positions[:, 0] * target[0], ring
    centre = sculpt.EYE_CENTRE - sculpt.ORIGIN
    return np.abs(positions[:, 0] - centre[0]), ring & (positions[:, 1] * target[1] > 0.002)


def _at_top(skin: Skin, positions: Float64, target: Float64) -> tuple[Float64, Bool]:
    return -skin.grown[:, 1], np.abs(positions[:, 0]) < 1e-6


def _at_back(skin: Skin, positions: Float64, target: Float64) -> tuple[Float64, Bool]:
    return skin.grown[:, 2], (np.abs(positions[:, 0]) < 1e-6) & (positions[:, 1] > -0.03)


RULES = {"near": _near, "lip": _on_lip, "lid": _on_lid, "top": _at_top, "back": _at_back}
"""(score of each vertex, lowest for the point; which vertices may be it) by the rule's name."""

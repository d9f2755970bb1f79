"""Eyeballs of a face model: the sphere that a part of kind "eye" is, and where it looks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fba.face.model import FaceModel, Part, point_row
from player.shapes import Eye

Float32 = npt.NDArray[np.float32]
Float64 = npt.NDArray[np.float64]

ROUND = 0.03
"""A part whose vertices are further than this from a sphere, as a share of its radius, is drawn as it is."""
FEWEST = 12
SAMPLED = 96
"""Vertices from which an eyeball's rotation is found."""
DILATE = (29, 30)
LIDS = (("3.1", "3.3", "3.7", "3.11"), ("3.2", "3.4", "3.12", "3.8"))
"""Middles of upper and lower lid, outer and inner corner, of the left and of the right eye."""


@dataclass(frozen=True, eq=False)
class Eyeball:
    """One eyeball in the neutral face. side: 0 left, 1 right. centre (3,), radius; metres.

    rows: vertices of the part that are sampled, away from the pupil. lids: vertices of the whole model at
    `LIDS`, -1 where there are none. iris, pupil: diameters; step: by how much one unit of FAP 29 or 30
    changes the pupil.
    """

    side: int
    centre: Float64
    radius: float
    rows: npt.NDArray[np.intp]
    neutral: Float64
    lids: tuple[int, ...]
    iris: float
    pupil: float
    step: float

    def posed(self, part: Float32, face: Float32, faps: Float32, matrix: Float64) -> Eye:
        """The eye for moved vertices of its part (V, 3) and of the face, in the world by matrix (4, 4)."""
        moved = part[self.rows].astype(np.float64)
        middle, start = moved.mean(axis=0), self.neutral.mean(axis=0)
        turn = _rotation(self.neutral - start, moved - middle)
        centre = middle + turn @ (self.centre - start)
        frame = np.eye(4)
        frame[:3, :3] = turn * self.radius
        frame[:3, 3] = centre
        pupil = self.pupil + self.step * float(faps[DILATE[self.side] - 1])
        iris = self.iris / 2 / self.radius
        return Eye(
            matrix @ frame,
            iris,
            float(np.clip(pupil / 2 / self.radius, 0.03, iris * 0.92)),
            self._lid_places(face, centre),
            matrix[:3, :3] / np.linalg.norm(matrix[:3, 0]),
        )

    def _lid_places(self, face: Float32, centre: Float64) -> Float64:
        """(4, 3) lids' middles and corners from the centre, in radii; wide open where there are none."""
        open_ = np.array([[0.0, 0.5, 0.86], [0.0, -0.5, 0.86], [1.0, 0.0, 0.3], [-1.0, 0.0, 0.3]])
        for place, vertex in enumerate(self.lids):
            if vertex >= 0:
                open_[place] = (face[vertex] - centre) / self.radius
        return open_


def find_eyeball(part: Part, model: FaceModel) -> Eyeball | None:
    """The sphere that a part is, or None where it is none."""
    vertices = part.vertices.astype(np.float64)
    if len(vertices) < FEWEST:
        return None
    on = np.ones(len(vertices), dtype=bool)
    for _ in range(4):  # what stands out, as a cornea does, is left out
        centre, radius = _sphere(vertices[on])
        away = np.abs(np.linalg.norm(vertices - centre, axis=1) - radius)
        on = away <= max(float(np.quantile(away, 0.7)), 1e-9)
    if not np.isfinite(radius) or radius <= 0 or float(np.median(away)) > ROUND * radius:
        return None
    if float(np.ptp(vertices, axis=0).max()) > 2.4 * radius:
        return None
    side = 0 if centre[0] > 0 else 1
    behind = np.flatnonzero((vertices[:, 2] - centre[2]) < 0.75 * radius)
    if len(behind) < FEWEST:
        behind = np.arange(len(vertices))
    rows = behind[np.unique(np.linspace(0, len(behind) - 1, SAMPLED).astype(int))]
    unit = model.fapu.IRISD
    lids = tuple(int(model.bound[point_row(name)]) for name in LIDS[side])
    return Eyeball(side, centre, radius, rows, vertices[rows], lids, unit * 1024, unit * 1024 / 3, unit)


def _sphere(points: Float64) -> tuple[Float64, float]:
    """Centre and radius of the sphere nearest to points (N, 3)."""
    middle = points.mean(axis=0)
    p = points - middle
    a = np.column_stack([2 * p, np.ones(len(p))])
    found = np.linalg.lstsq(a, (p * p).sum(axis=1), rcond=None)[0]
    return found[:3] + middle, float(np.sqrt(max(found[3] + found[:3] @ found[:3], 0.0)))


def _rotation(before: Float64, after: Float64) -> Float64:
    """(3, 3) the rotation that best takes places (N, 3) about their middle to others."""
    u, _, vt = np.linalg.svd(after.T @ before)
    flip = np.diag([1.0, 1.0, np.linalg.det(u @ vt)])
    rotation: Float64 = u @ flip @ vt
    return rotation

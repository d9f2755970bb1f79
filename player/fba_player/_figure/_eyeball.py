"""Eyeballs of a face model: the sphere that fits a part of kind "eye", and its rotation."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fba.arrays import Float32, Float64, Intp
from fba.face import FaceModel, Part
from fba.face.eyeball import fit_sphere, flat_width
from fba.face.model import point_row
from fba.geometry import fit_similarity
from fba_player.view._view import Eye

MAX_ROUNDNESS_ERROR = 0.03
"""A part whose median distance from its sphere exceeds this share of the radius is drawn as a mesh."""
MIN_BALL_VERTICES = 12
"""A part with fewer vertices is not an eyeball; with fewer behind the pupil, all give its rotation."""
SAMPLED_VERTICES = 96
"""Vertices from which an eyeball's rotation is computed."""
PUPIL_FAPS = (29, 30)
"""FAPs that dilate the left and the right pupil."""
LID_POINTS = (("3.1", "3.3", "3.7", "3.11"), ("3.2", "3.4", "3.12", "3.8"))
"""Feature points of the left and right eye: middles of upper and lower lid, outer and inner corner."""
OPEN_LIDS = np.array([[0.0, 0.5, 0.86], [0.0, -0.5, 0.86], [1.0, 0.0, 0.3], [-1.0, 0.0, 0.3]])
"""These points of an open eye, relative to its centre, in radii."""


@dataclass(frozen=True, eq=False)
class Eyeball:
    """One eyeball in the neutral face. side: 0 left, 1 right. centre: (3,), and radius, metres.

    rows: sampled vertices of the part, away from the pupil. neutral: their positions. lids: the model's
    vertices at `LID_POINTS`, -1 for missing ones. iris, pupil: diameters (m). step: change of the pupil's
    diameter for one unit of FAP 29 or 30.
    """

    side: int
    centre: Float64
    radius: float
    rows: Intp
    neutral: Float64
    lids: tuple[int, ...]
    iris: float
    pupil: float
    step: float

    def pose(self, part: Float32, face: Float32, faps: Float32, matrix: Float64) -> Eye:
        """Return the eye for moved vertices (V, 3) of its part and of the face, put into the world."""
        moved = part.take(self.rows, axis=0).astype(np.float64)
        fitted = fit_similarity(self.neutral, moved)
        turn, centre = fitted.rotation, fitted.target + fitted.rotation @ (self.centre - fitted.centre)
        frame = np.eye(4)
        frame[:3, :3] = turn * self.radius
        frame[:3, 3] = centre
        pupil = self.pupil + self.step * float(faps[PUPIL_FAPS[self.side] - 1])
        iris = self.iris / 2 / self.radius
        return Eye(
            matrix @ frame,
            iris,
            min(max(pupil / 2 / self.radius, 0.03), iris * 0.92),
            self._lid_positions(face, centre),
            matrix[:3, :3] / math.sqrt(matrix[:3, 0] @ matrix[:3, 0]),
        )

    def _lid_positions(self, face: Float32, centre: Float64) -> Float64:
        """Return the lid points (4, 3) from the centre, in radii; for missing ones, those of an open eye."""
        lids = np.array(self.lids)
        return np.where(lids[:, None] >= 0, (face.take(lids, axis=0) - centre) / self.radius, OPEN_LIDS)


def find_eyeball(part: Part, model: FaceModel) -> Eyeball | None:
    """Return the sphere that fits a part, or None if it is not round."""
    vertices = part.vertices.astype(np.float64)
    if len(vertices) < MIN_BALL_VERTICES or flat_width(part) is not None:
        return None
    on_sphere = np.ones(len(vertices), dtype=bool)
    for _ in range(4):  # without what stands out, such as a cornea
        centre, radius, _ = fit_sphere(vertices[on_sphere])
        away = np.abs(np.linalg.norm(vertices - centre, axis=1) - radius)
        on_sphere = away <= max(float(np.quantile(away, 0.7)), 1e-9)
    if not np.isfinite(radius) or radius <= 0 or float(np.median(away)) > MAX_ROUNDNESS_ERROR * radius:
        return None
    if float(np.ptp(vertices, axis=0).max()) > 2.4 * radius:
        return None
    side = 0 if centre[0] > 0 else 1
    behind = np.flatnonzero((vertices[:, 2] - centre[2]) < 0.75 * radius)
    if len(behind) < MIN_BALL_VERTICES:
        behind = np.arange(len(vertices))
    rows = behind[np.unique(np.linspace(0, len(behind) - 1, SAMPLED_VERTICES).astype(int))]
    unit = model.fapu.IRISD
    lids = tuple(int(model.bound[point_row(name)]) for name in LID_POINTS[side])
    return Eyeball(side, centre, radius, rows, vertices[rows], lids, unit * 1024, unit * 1024 / 3, unit)

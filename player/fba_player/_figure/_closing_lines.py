"""Where a face closes: along its lips and lids, where little light of the sky is left."""

from __future__ import annotations

import numpy as np

from fba.arrays import Bool, Float64
from fba.face import FaceModel, Part
from fba.parameters import point_rows

LINES = (
    ("2.4", "2.6", "2.2", "2.7", "2.5", "2.9", "2.3", "2.8"),
    ("3.11", "3.1", "3.7", "3.3"),
    ("3.8", "3.2", "3.12", "3.4"),
)
"""Feature points around mouth and eyes, in order."""
WIDTH = 0.035
"""Distance from these lines within which vertices lie along them, in ES0."""
STEPS = 12
"""Points between two feature points at which the distance is measured."""


def closing_vertices(model: FaceModel, part: Part) -> Bool | None:
    """Return bool (V,): vertices of a skin along its lips and lids; None where it has none."""
    lines = [line for names in LINES if (line := _line(model, names)) is not None]
    if part.kind not in ("skin", "mouth") or not lines:
        return None
    from scipy.spatial import cKDTree

    away, _ = cKDTree(np.concatenate(lines)).query(part.vertices)
    return np.asarray(away < WIDTH * model.fapu.ES * 1024)


def _line(model: FaceModel, names: tuple[str, ...]) -> Float64 | None:
    """Return points (N, 3) along the closed curve through feature points; None if one is missing."""
    from scipy.interpolate import CubicSpline

    places = np.array([model.points[point_rows()[name]] for name in names])
    if not np.isfinite(places).all():
        return None
    closed = np.concatenate([places, places[:1]])
    curve = CubicSpline(np.arange(len(closed)), closed, bc_type="periodic")
    return np.asarray(curve(np.linspace(0, len(places), STEPS * len(places), endpoint=False)))

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
    away = [np.linalg.norm(part.vertices - place, axis=1) for place in np.concatenate(lines)]
    return np.asarray(np.min(away, axis=0) < WIDTH * model.fapu.ES * 1024)


def _line(model: FaceModel, names: tuple[str, ...]) -> Float64 | None:
    """Return points (N, 3) along the closed curve through feature points; None if one is missing.

    A cubic spline with equal steps between the points.
    """
    places = np.array([model.points[point_rows()[name]] for name in names])
    if not np.isfinite(places).all():
        return None
    count = len(places)
    following = np.roll(places, -1, axis=0)
    around = np.roll(np.eye(count), 1, axis=1)
    bends = np.linalg.solve(
        4 * np.eye(count) + around + around.T, 6 * (following - 2 * places + np.roll(places, 1, axis=0))
    )
    t = np.linspace(0, 1, STEPS, endpoint=False)[:, None]
    one, other = ((b**3 - b) / 6 for b in (1 - t, t))
    curve = [
        (1 - t) * places[k] + t * following[k] + one * bends[k] + other * bends[(k + 1) % count]
        for k in range(count)
    ]
    return np.concatenate(curve)

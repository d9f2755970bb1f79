"""How far the points of a part of the face have moved from those of the neutral face."""

from __future__ import annotations

import numpy as np

from fba.arrays import Float64
from fba.persona.points.layout import ANCHORS, part_points


def move_to_anchor(points: Float64, part: str) -> Float64:
    """Return the points of a part, (..., 64, D) to (..., K, D), relative to the part's anchor."""
    anchor = ANCHORS[part] - 1
    return np.asarray(points[..., part_points(part), :2] - points[..., anchor : anchor + 1, :2])


def displacements(points: Float64, neutral: Float64, part: str) -> Float64:
    """Return how far the points of a part are from the neutral face: float64 (T, 2K), all x, then all y.

    points: (T, 64, 2) on the standard mask; neutral: (64, 2), or one a frame. Equation 4.3 of the source.
    """
    moved = move_to_anchor(points, part) - move_to_anchor(neutral, part)
    return np.asarray(np.concatenate([moved[..., 0], moved[..., 1]], axis=-1))

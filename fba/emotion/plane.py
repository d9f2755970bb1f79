"""The plane of activation and evaluation, and the expressions near a point on it."""

from __future__ import annotations

import math
from functools import cache

import numpy as np

from fba.arrays import Float64, Intp
from fba.emotion._expression import NEUTRAL_POINT
from fba.emotion._expressions import expressions
from fba.emotion._rules import Rules
from fba.emotion.blending import Blend, combine
from fba.errors import OptionError

SCALE_MIN = 1.0
"""Lowest value of both of Whissel's scales."""
SCALE_MAX = 7.0


def known_points() -> dict[str, tuple[float, float]]:
    """Return (activation, evaluation) of the expressions that have them, by name."""
    return {each.name: each.point for each in expressions() if each.point is not None}


def expression_at(activation: float, evaluation: float, rules: Rules | None = None) -> Blend:
    """Return the expression at a point of the plane: up to three named expressions, mixed by the rules.

    The named expressions and `NEUTRAL_POINT` span triangles (Delaunay). Intensities are barycentric
    coordinates: 100 at the point of a named expression, low near neutral, continuous along any path. Outside
    all triangles, the nearest point on their outline counts.

    activation, evaluation: 1 to 7 each; OptionError for others.
    """
    for name, value in (("activation", activation), ("evaluation", evaluation)):
        if not math.isfinite(value) or not SCALE_MIN <= value <= SCALE_MAX:
            raise OptionError(f"the {name} must be from {SCALE_MIN:g} to {SCALE_MAX:g}, not {value:g}")
    names, points, triangles, outline = _triangulation()
    point = np.array([activation, evaluation])
    shares = _in_triangle(point, points, triangles)
    if shares is None:
        shares = _on_outline(point, points, outline)
    weights = {
        names[corner]: 100 * min(share, 1.0) for corner, share in shares if share > 1e-9 and names[corner]
    }
    return combine(weights, rules)


@cache
def _triangulation() -> tuple[tuple[str, ...], Float64, Intp, Intp]:
    """Return names ("" for neutral), points (N, 2), triangles (T, 3) and edges of the outline (E, 2)."""
    from scipy.spatial import Delaunay

    named = known_points()
    points = np.array([NEUTRAL_POINT, *named.values()], dtype=np.float64)
    mesh = Delaunay(points)
    return ("", *named), points, mesh.simplices.astype(np.intp), mesh.convex_hull.astype(np.intp)


def _in_triangle(point: Float64, points: Float64, triangles: Intp) -> list[tuple[int, float]] | None:
    """Return corners and barycentric coordinates of the triangle around a point; None outside them."""
    corners = points[triangles]
    edges = np.stack([corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]], axis=2)
    second_third = np.linalg.solve(edges, (point - corners[:, 0])[..., None])[..., 0]
    shares = np.column_stack([1 - second_third.sum(axis=1), second_third])
    best = int(shares.min(axis=1).argmax())
    if shares[best].min() < -1e-9:
        return None
    return list(zip(triangles[best].tolist(), shares[best].tolist(), strict=True))


def _on_outline(point: Float64, points: Float64, outline: Intp) -> list[tuple[int, float]]:
    """Return the ends of the nearest edge of the outline, and their shares in its nearest point."""
    start, end = points[outline[:, 0]], points[outline[:, 1]]
    along = end - start
    share = np.clip(((point - start) * along).sum(axis=1) / (along**2).sum(axis=1), 0, 1)
    best = int(np.hypot(*(start + share[:, None] * along - point).T).argmin())
    first, second = outline[best].tolist()
    return [(first, float(1 - share[best])), (second, float(share[best]))]

"""Does a deformation fold the skin? Triangles that turned over, and which feature points are to blame."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fba.arrays import Float64, Floating, Integer, Intp
from fba.face.feature_points import names

if TYPE_CHECKING:
    from fba.face.calibration._field import Field


LEAST = 0.04
"""Share of its usual volume to which space may be pressed together."""


def folded(field: Field, mesh: Floating, size: float) -> Intp:
    """Vertices at which the deformation turns space inside out, or nearly so; size: usual, of lengths."""
    volume = np.linalg.det(field.jacobians(mesh)) / size**3
    return np.flatnonzero(~(volume > LEAST))


def turned_over(before: Floating, after: Float64, triangles: Integer) -> tuple[Intp, float]:
    """Triangles that look the other way than their surroundings do after a deformation, and their area.

    The area is a share of the whole, before.

    Whether a triangle is turned is seen against the mean of its neighbours' normals, before and after: a
    turn of the whole surface is none of the triangle.
    """
    from fba.mesh.meshes import vertex_normals

    agreeing, areas = [], []
    for vertices in (np.asarray(before, dtype=np.float64), after):
        corners = vertices[triangles]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        around = vertex_normals(vertices, triangles)[triangles].mean(axis=1)
        agreeing.append((normal * around).sum(axis=1))
        areas.append(np.linalg.norm(normal, axis=1))
    wrong = np.flatnonzero((agreeing[0] > 0) & (agreeing[1] < 0))
    return wrong, float(areas[0][wrong].sum() / max(areas[0].sum(), 1e-30))


def blamed(places: Float64, sources: Float64, rows: Intp, count: int = 4) -> tuple[str, ...]:
    """Names of the feature points (rows, at sources) that are nearest to most of the places."""
    from scipy.spatial import cKDTree

    if not len(places) or not len(sources):
        return ()
    _, near = cKDTree(sources).query(places, k=min(3, len(sources)))
    votes = np.bincount(np.ravel(near), minlength=len(sources))
    order = np.argsort(-votes, kind="stable")[:count]
    return tuple(names()[int(rows[place])] for place in order if votes[place])

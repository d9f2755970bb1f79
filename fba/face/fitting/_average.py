"""The average face: where its skin differs from that of the built-in head, which is the face of one person.

`tools/photos/measure_average.py` makes the table: places, mm, and how much fuller the average face is there.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fba.arrays import Float64, Floating
from fba.face import FaceModel
from fba.face.calibration import rebuild_part
from fba.mesh import vertex_normals
from fba.parameters import point_rows
from fba.sampling import smoothstep
from fba.text_files import packaged_rows

FADE = 0.025
"""Metres over which a form fades between the places where it is known."""
LIDS = (0.018, 0.026)
"""Metres from the pupils up to which nothing moves, as lids must meet, and from which all does."""
CHEEKS = ("5.1", "5.2", "5.3", "5.4")
"""Points that no photograph shows."""


def with_average_forms(base: FaceModel) -> FaceModel:
    """Return the built-in head with the skin of an average face between its own feature points."""
    rows = packaged_rows(__package__, "average_forms.csv")
    places = np.array([[float(one[axis]) for axis in "xyz"] for one in rows]) / 1000
    out = np.array([float(one["out"]) for one in rows]) / 1000
    part = base.part("skin")
    normals = vertex_normals(part.vertices, part.triangles)
    moved = part.vertices + normals * (forms(base.points, places, part.vertices) @ out)[:, None]
    parts = tuple(rebuild_part(one, moved) if one is part else one for one in base.parts)
    own = base.bound - base.starts["skin"]
    bound = (own >= 0) & (own < len(moved))
    points = base.points.copy()
    points[bound] = parts[base.parts.index(part)].vertices[own[bound]]
    return replace(base, parts=parts, points=points)


def forms(points: Float64, places: Float64, at: Floating) -> Float64:
    """Return (N, K): how far points at (N, 3) move if one of K places, and its mirror image, moves by 1.

    points: (84, 3), feature points, which stay but for those of the cheeks. places: (K, 3), with x of 0 and
    above.
    """
    from scipy.interpolate import RBFInterpolator

    row = point_rows()
    known = [here for name, here in row.items() if name not in CHEEKS and np.isfinite(points[here, 0])]
    fixed = np.unique(np.round(points[known], 5), axis=0)
    beside = places[:, 0] > 0
    centres = np.concatenate([fixed, places, places[beside] * (-1, 1, 1)])
    own = np.eye(len(places))
    values = np.concatenate([np.zeros((len(fixed), len(places))), own, own[beside]])
    field = RBFInterpolator(centres, values, kernel="gaussian", epsilon=1 / FADE, smoothing=1e-6, degree=-1)
    pupils = points[[row["3.5"], row["3.6"]]]
    apart = np.linalg.norm(at[:, None] - pupils, axis=2).min(axis=1)
    return np.asarray(field(at) * smoothstep((apart - LIDS[0]) / (LIDS[1] - LIDS[0]))[:, None])

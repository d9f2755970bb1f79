"""Points of a picture without depth, given that of a face: a head that turns shows how deep each one is."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fba.arrays import Float64
from fba.capture.points.poses import Poses, fit_poses
from fba.errors import ModelError

ALSO = ("9.3", "9.15")
"""Points that hardly move, and stand out from the others: they tell the head's turns best."""
FEWEST = 5
"""Still points that tell a pose."""
ROUNDS = 6
"""Times that shape and poses are found, each from the other."""
SAMPLES = 200
"""Frames, about, that tell the shape."""
STEEPEST = 0.35
"""Least cosine between the face and the camera's direction: faces turned further show too little."""


def lift(
    points: Float64, names: tuple[str, ...], places: Mapping[str, str], template: Float64, still: list[int]
) -> Float64:
    """Return points (T, M, 2) with depth: float64 (T, M, 3), metres, as large as an adult's face.

    x to the right, y up, z towards the camera. template: (M, 3), where points are on a known face, NaN where
    unknown: these come out as NaN. still: numbers of points that the head alone moves; these come out where
    the head's pose puts them. Raises ModelError where too few points tell a pose.
    """
    fixed = [n for n in still if not np.isnan(template[n, 0])]
    fixed += [n for n, name in enumerate(names) if places[name] in ALSO and n not in fixed]
    if len(fixed) < FEWEST:
        raise ModelError(
            f"{len(fixed)} points without depth are at places that the face does not move; {FEWEST} are "
            "needed to tell how the head turns"
        )
    known = np.flatnonzero(~np.isnan(template[:, 0]))
    shape = template.copy()
    some = points[:: max(1, len(points) // SAMPLES)]
    for _ in range(ROUNDS):
        poses = fit_poses(shape[fixed], some[:, fixed])
        shape[known] = refine_shape(shape[known], template[known], some[:, known], poses)
    poses = fit_poses(shape[fixed], points[:, fixed])
    local = _in_head(points, shape, poses)
    local[:, still] = shape[still]
    return np.asarray(np.einsum("tdc,tnc->tnd", poses.rotation, local))


def refine_shape(shape: Float64, template: Float64, picture: Float64, poses: Poses) -> Float64:
    """Return points (M, 3) of the face that fit what is seen better."""
    spread = 0.004
    rows = poses.rotation[:, :2]
    seen = (picture - poses.shift[:, None]) / poses.scale[:, None, None]
    off = seen - np.einsum("tdc,nc->tnd", rows, shape)
    size = np.linalg.norm(off, axis=2)
    weights = 1 / (1 + (size / (2 * spread)) ** 2) ** 2 / spread**2 / 10
    normal = np.einsum("tn,tda,tdb->nab", weights, rows, rows)
    right = np.einsum("tn,tda,tnd->na", weights, rows, off)
    prior = np.diag(1 / np.array([0.008, 0.008, 0.006]) ** 2)
    right += (template - shape) @ prior
    return np.asarray(shape + np.linalg.solve(normal + prior, right[..., None])[..., 0])


def _in_head(points: Float64, shape: Float64, poses: Poses) -> Float64:
    """Return points (T, M, 3) in the head's axes, each as deep as in its shape (M, 3)."""
    seen = (points - poses.shift[:, None]) / poses.scale[:, None, None]
    rows = poses.rotation[:, :2]
    plane = seen - rows[:, None, :, 2] * shape[None, :, 2, None]
    across = np.linalg.inv(rows[:, :, :2])
    result = np.empty((*points.shape[:2], 3))
    result[..., :2] = np.einsum("tdc,tnc->tnd", across, plane)
    result[..., 2] = shape[:, 2]
    return result

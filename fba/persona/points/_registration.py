"""Registration of the points of pictures on the standard mask: same size, upright, facing ahead."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba import geometry
from fba.arrays import Bool, Float64
from fba.errors import ModelError
from fba.persona.points._tracked import TrackedFace
from fba.persona.points.layout import REGISTERED, TRACKED, standard_points
from fba.rotations import axis_matrices

MAX_TURN = float(np.radians(30.0))
"""Largest angle between head and camera, about x or y, radians."""
MAX_MISFIT = 0.25
"""Misfit of the six points above which they are not those of a face."""


@dataclass(frozen=True, eq=False)
class Registered:
    """Points of a film on the standard mask.

    points: float64 (T, 64, 2), millimetres, the face's left and up; NaN where a frame is left out. kept:
    bool (T,). turned: bool (T,), frames left out because the head is turned too far. alien: bool (T,), frames
    left out because the points are not arranged as in a face.
    """

    points: Float64
    kept: Bool
    turned: Bool
    alien: Bool


def fit_face_points(points: Float64, targets: Float64, *, mirror: bool = True) -> geometry.FittedSimilarity:
    """Return the similarity that brings points (..., N, Q) closest to targets (..., N, P), P >= Q.

    mirror: whether the rotation may be a reflection. Raises ModelError where all points coincide.

    The source (equations 3.12 to 3.14) misprints factor and misfit; with X'Y = U S V', the rotation of rows
    is U V', the scale tr(S) / tr(X'X), and the misfit 1 - tr(S)^2 / (tr(X'X) tr(Y'Y)).
    """
    fit = geometry.fit_similarity(points, targets, reflected=None if mirror else False)
    if not np.isfinite(fit.misfit).all():
        raise ModelError("points that all coincide cannot be laid on a face")
    return fit


def register(face: TrackedFace) -> Registered:
    """Return the points of a film on the standard mask (equation 4.9 of the source).

    The mask is turned about y as the head is. The six points of `REGISTERED` are fitted to it; then all
    points are turned back, with the depth of the turned mask. Frames are left out where the head is turned by
    more than `MAX_TURN` about x or y, or where the points are not those of a face.
    """
    tracked = face.tracked
    turned = tracked & (np.abs(np.nan_to_num(face.angles[:, :2])) > MAX_TURN).any(axis=1)
    kept = tracked & ~turned
    points = np.full(face.points.shape, np.nan)
    alien = np.zeros(len(face), dtype=bool)
    if kept.any():
        points[kept], misfit = register_points(face.points[kept], face.angles[kept, 1])
        alien[kept] = misfit > MAX_MISFIT
        points[alien] = np.nan
    return Registered(points, kept & ~alien, turned, alien)


def register_points(points: Float64, yaw: Float64) -> tuple[Float64, Float64]:
    """Return points (T, 64, 2) of pictures on the standard mask, and the misfit (T,) of the six.

    yaw: (T,), turn of the head to its left, radians.
    """
    turn = axis_matrices(1, yaw)
    standard = standard_points()[:TRACKED] @ np.swapaxes(turn, 1, 2)  # (T, 64, 3)
    rows = [number - 1 for number in REGISTERED]
    upright = points * (1.0, -1.0)  # from a picture's axes, y down, to the mask's, y up
    similarity = fit_face_points(upright[:, rows], standard[:, rows, :2], mirror=False)
    laid = similarity.apply(upright)
    deep = standard[:, :, 2]
    # the first row of the inverse turn: x of the face seen from the front
    cosine, sine = np.cos(yaw)[:, None], np.sin(yaw)[:, None]
    ahead = np.stack([cosine * laid[..., 0] - sine * deep, laid[..., 1]], axis=2)
    return ahead, similarity.misfit

"""Faces in pictures laid on the standard mask: of one size, upright, and as if they looked ahead."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.arrays import Bool, Float64
from fba.persona.points.layout import REGISTERED, TRACKED, standard_points
from fba.persona.points.procrustes import fit_face_points
from fba.persona.points.tracked import TrackedFace
from fba.rotations import axis_matrices

MOST_TURNED = float(np.radians(30.0))
"""Radians by which a head may be turned from the camera, about x or y."""
TO_UP = np.array([1.0, -1.0])
"""From a picture's axes, y down, to the mask's, y up."""
MISFIT = 0.25
"""Misfit of the six points above which they are no face."""


@dataclass(frozen=True, eq=False)
class Registered:
    """Points of a film on the standard mask.

    points: float64 (T, 64, 2), millimetres, the face's left and up; NaN where a frame is left out. kept:
    bool (T,). turned: bool (T,), frames that are left out because the head is turned too far. alien: bool
    (T,), those whose points do not lie as on a face.
    """

    points: Float64
    kept: Bool
    turned: Bool
    alien: Bool


def register(face: TrackedFace, *, most_turned: float = MOST_TURNED) -> Registered:
    """Return the points of a film on the standard mask (equation 4.9 of the source).

    The mask is turned as the head is about y, points are brought to it by the six of `REGISTERED`, and
    turned back with the depth of the turned mask's points. Frames in which the head is turned by more than
    `most_turned`, radians, about x or y are left out, and so are those whose points are not a face's.
    """
    tracked = face.tracked
    turned = tracked & (np.abs(np.nan_to_num(face.angles[:, :2])) > most_turned).any(axis=1)
    kept = tracked & ~turned
    points = np.full(face.points.shape, np.nan)
    alien = np.zeros(len(face), dtype=bool)
    if kept.any():
        points[kept], misfit = register_points(face.points[kept], face.angles[kept, 1])
        alien[kept] = misfit > MISFIT
        points[alien] = np.nan
    return Registered(points, kept & ~alien, turned, alien)


def register_points(points: Float64, yaw: Float64) -> tuple[Float64, Float64]:
    """Return points (T, 64, 2) of a picture on the standard mask, and the misfit (T,) of the six of them.

    yaw: (T,), radians, by which the head is turned to its left.
    """
    turn = axis_matrices(1, yaw)
    standard = standard_points()[:TRACKED] @ np.swapaxes(turn, 1, 2)  # (T, 64, 3)
    rows = [number - 1 for number in REGISTERED]
    upright = points * TO_UP
    similarity = fit_face_points(upright[:, rows], standard[:, rows, :2], mirror=False)
    laid = similarity.apply(upright)
    deep = standard[:, :, 2]
    # the first row of the inverse turn: x of the face ahead, from x and z of the turned one
    cosine, sine = np.cos(yaw)[:, None], np.sin(yaw)[:, None]
    ahead = np.stack([cosine * laid[..., 0] - sine * deep, laid[..., 1]], axis=2)
    return ahead, similarity.misfit

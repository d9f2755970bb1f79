"""Procrustes analysis: points of a face moved, turned, mirrored and scaled onto others."""

from __future__ import annotations

import numpy as np

from fba import geometry
from fba.arrays import Float64
from fba.errors import ModelError


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

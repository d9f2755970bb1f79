"""`lay_onto`: how a cloud of markers is laid onto points of a head: turned, scaled, perhaps mirrored."""

from __future__ import annotations

import numpy as np

from fba.arrays import Float64
from fba.errors import ModelError
from fba.geometry import FittedSimilarity, fit_similarity, principal_axes

MIN_POINTS = 3
"""Smallest number of points that define an alignment."""
MIN_SPREAD = 0.02
"""Smallest sideways spread of points, as a share of their length."""
MAX_MIRROR_RATIO = 0.5
"""Largest ratio of the error of the mirror image to that of the points if these are mirrored."""
MIN_MIRROR_ERROR = 0.05
"""Smallest error of mirrored points, as a share of their size: flat sets of markers do not show it."""


def lay_onto(points: Float64, places: Float64) -> FittedSimilarity:
    """Return the similarity that lays points (K, 3) onto places (K, 3), by least squares.

    The determinant of its rotation is -1 if the points are mirrored. ModelError for fewer than three points,
    or points on one line.
    """
    if len(points) < MIN_POINTS:
        raise ModelError(
            f"{len(points)} markers with a vertex cannot be laid onto a head: "
            f"{MIN_POINTS} at least are needed"
        )
    for what, cloud in (("markers", points), ("vertices of the virtual markers", places)):
        _, spread = principal_axes(cloud)
        if not spread[1] > MIN_SPREAD * spread[0]:
            raise ModelError(f"the {what} are all on one line, or in one place")
    plain, mirrored = (fit_similarity(points, places, reflected=reflected) for reflected in (False, True))
    size = float(np.sqrt(((places - places.mean(axis=0)) ** 2).sum(axis=1).mean()))
    is_mirrored = mirrored.error < MAX_MIRROR_RATIO * plain.error and plain.error > MIN_MIRROR_ERROR * size
    return mirrored if is_mirrored else plain

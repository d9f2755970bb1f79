"""How a cloud of markers is laid onto points of a head: turned, scaled, perhaps mirrored."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.arrays import Float64
from fba.errors import ModelError
from fba.geometry import principal_axes

MIN_POINTS = 3
"""Smallest number of points that define an alignment."""
MIN_SPREAD = 0.02
"""Smallest sideways spread of points, as a share of their length."""
MIRRORED = 0.5
"""Points are mirrored if their mirror image leaves less than this share of the error."""
MIN_MIRROR_ERROR = 0.05
"""... and if the error is larger than this share of their size: flat sets of markers do not show it."""


@dataclass(frozen=True, eq=False)
class Alignment:
    """`scale * rotation @ (mirror * point) + shift` lays a point onto its place.

    rotation: float64 (3, 3). scale: positive. mirror: float64 (3,), x -1 if the points are mirrored. shift:
    float64 (3,). error: root mean square distance that is left, in the unit of the places.
    """

    rotation: Float64
    scale: float
    mirror: Float64
    shift: Float64
    error: float

    @property
    def mirrored(self) -> bool:
        """Whether x is turned round."""
        return bool(self.mirror[0] < 0)

    def place(self, points: Float64) -> Float64:
        """Return points (..., 3) laid onto the head."""
        result: Float64 = self.scale * (points * self.mirror) @ self.rotation.T + self.shift
        return result


def align(points: Float64, places: Float64) -> Alignment:
    """Return the similarity that lays points (K, 3) onto places (K, 3), by least squares.

    ModelError for fewer than three points, or points on one line.
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
    plain = _fit(points, places, np.ones(3))
    turned = _fit(points, places, np.array([-1.0, 1.0, 1.0]))
    size = float(np.sqrt(((places - places.mean(axis=0)) ** 2).sum(axis=1).mean()))
    return (
        turned if turned.error < MIRRORED * plain.error and plain.error > MIN_MIRROR_ERROR * size else plain
    )


def _fit(points: Float64, places: Float64, mirror: Float64) -> Alignment:
    from scipy.spatial.transform import Rotation

    own = points * mirror
    middle, there = own.mean(axis=0), places.mean(axis=0)
    a, b = own - middle, places - there
    rotation = Rotation.align_vectors(b, a)[0].as_matrix()
    scale = float((b * (a @ rotation.T)).sum() / (a**2).sum())
    off = scale * a @ rotation.T - b
    error = float(np.sqrt((off**2).sum(axis=1).mean()))
    return Alignment(rotation, scale, mirror, there - scale * rotation @ middle, error)

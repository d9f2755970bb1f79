"""Fits of points to points, for all rooms that align faces or bodies.

May use: arrays alone.
"""

from fba.geometry._fits import (
    FittedSimilarity,
    Similarity,
    fit_similarity,
    nearest_orthonormal,
    nearest_rotation,
    principal_axes,
)

__all__ = [
    "FittedSimilarity",
    "Similarity",
    "fit_similarity",
    "nearest_orthonormal",
    "nearest_rotation",
    "principal_axes",
]

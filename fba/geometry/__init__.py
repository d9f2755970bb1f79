"""Fits of points to points, used by every room that lays one face or body onto another.

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

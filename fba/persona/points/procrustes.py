"""Procrustes analysis: one set of points moved, turned, mirrored and scaled onto another."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.arrays import Float64
from fba.errors import ModelError


@dataclass(frozen=True, eq=False)
class Similarity:
    """x -> scale * x . rotation + shift, for points as rows.

    rotation: float64 (p, p), orthogonal. scale: a factor. shift: (p,). misfit: 0 where the fit is perfect,
    at most 1. Several at once have a leading axis.
    """

    rotation: Float64
    scale: Float64
    shift: Float64
    misfit: Float64

    def apply(self, points: Float64) -> Float64:
        """Return points (..., N, q) moved: (..., N, p). Missing dimensions are 0."""
        full = _pad(points, self.rotation.shape[-1])
        return np.asarray(self.scale[..., None, None] * (full @ self.rotation) + self.shift[..., None, :])


def fit_similarity(points: Float64, targets: Float64, *, mirror: bool = True) -> Similarity:
    """Return the similarity that brings points (..., N, q) closest to targets (..., N, p), p >= q.

    mirror: whether the rotation may be a reflection. Raises ModelError where all points coincide.

    The source (equations 3.12 to 3.14) misprints factor and misfit; with X'Y = U S V', the rotation is U V',
    the scale tr(S) / tr(X'X), and the misfit 1 - tr(S)^2 / (tr(X'X) tr(Y'Y)).
    """
    full = _pad(points, targets.shape[-1])
    from_middle, to_middle = full.mean(axis=-2), targets.mean(axis=-2)
    here, there = full - from_middle[..., None, :], targets - to_middle[..., None, :]
    left, sizes, right = np.linalg.svd(np.swapaxes(here, -1, -2) @ there)
    if not mirror:
        sign = np.sign(np.linalg.det(left @ right))
        left = left.copy()
        left[..., -1] *= sign[..., None]
        sizes = sizes.copy()
        sizes[..., -1] *= sign
    own, other = (here**2).sum(axis=(-2, -1)), (there**2).sum(axis=(-2, -1))
    if not ((own > 0).all() and (other > 0).all()):
        raise ModelError("points that all coincide cannot be laid on a face")
    rotation, trace = left @ right, sizes.sum(axis=-1)
    scale = np.asarray(trace / own)
    shift = to_middle - scale[..., None] * (from_middle[..., None, :] @ rotation)[..., 0, :]
    return Similarity(rotation, scale, shift, np.asarray(1 - trace**2 / (own * other)))


def _pad(points: Float64, width: int) -> Float64:
    """Return points (..., N, q) with columns of zeros up to this width."""
    missing = width - points.shape[-1]
    if missing <= 0:
        return points
    return np.concatenate([points, np.zeros((*points.shape[:-1], missing))], axis=-1)

"""Rotations and similarities that fit points or matrices best, by least squares: for faces and bodies.

Arun, Huang and Blostein, "Least-squares fitting of two 3-D point sets", 1987; Umeyama, "Least-squares
estimation of transformation parameters between two point patterns", 1991.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.arrays import Float64, Floating


@dataclass(frozen=True, eq=False)
class Similarity:
    """x -> scale * rotation @ (x - centre) + target, in 2 or 3 dimensions. Several have leading axes.

    rotation: float64 (..., P, P), orthogonal. scale: (...). centre, target: (..., P).
    """

    rotation: Float64
    scale: Float64
    centre: Float64
    target: Float64

    def apply(self, points: Floating) -> Float64:
        """Return points (..., N, Q) moved, (..., N, P). Missing dimensions are taken to be 0."""
        full = _pad(points, self.rotation.shape[-1])
        turned = (full - self.centre[..., None, :]) @ np.swapaxes(self.rotation, -1, -2)
        return np.asarray(self.scale[..., None, None] * turned + self.target[..., None, :])


@dataclass(frozen=True, eq=False)
class FittedSimilarity(Similarity):
    """A similarity between two sets of points; `centre` and `target` are their weighted means.

    error: (...), root mean square of the remaining distances, in the unit of the targets. misfit: (...), the
    remaining share of the targets' variance, 0 to 1; NaN where all points or all targets coincide.
    """

    error: Float64
    misfit: Float64


def fit_similarity(
    points: Floating,
    targets: Float64,
    weights: Float64 | None = None,
    *,
    reflected: bool | None = False,
    rotation: Float64 | None = None,
) -> FittedSimilarity:
    """Return the similarity that brings points (..., N, Q) closest to targets (..., N, P), P >= Q.

    Dimensions that the points lack are taken to be 0.
    weights: (N,), not negative; None for equal weights.
    reflected: whether to fit a reflection instead of a rotation; None for the closer of the two.
    rotation: (P, P), a rotation to use; only scale and position are fitted then.
    The scale is NaN or infinite where all points coincide.
    """
    full = _pad(points, targets.shape[-1])
    share = np.full(full.shape[-2], 1.0) if weights is None else weights
    share = share / share.sum()
    centre, target = _mean(full, share), _mean(targets, share)
    here, there = full - centre[..., None, :], targets - target[..., None, :]
    if rotation is None:
        both = np.swapaxes(there * share[:, None], -1, -2) @ here
        handed = -1.0 if reflected else 1.0
        rotation = nearest_orthonormal(both) if reflected is None else nearest_rotation(both, handed=handed)
    turned = here @ np.swapaxes(rotation, -1, -2)
    with np.errstate(divide="ignore", invalid="ignore"):
        scale = np.asarray((turned * there).sum(axis=-1) @ share / ((here**2).sum(axis=-1) @ share))
        off = ((scale[..., None, None] * turned - there) ** 2).sum(axis=-1) @ share
        misfit = np.asarray(off / ((there**2).sum(axis=-1) @ share))
    return FittedSimilarity(rotation, scale, centre, target, np.sqrt(off), misfit)


def nearest_rotation(matrices: Float64, *, handed: float = 1.0) -> Float64:
    """Return the rotations (..., N, N) nearest to square matrices of that shape; they maximise tr(R' M).

    M may be a sum of rotations, whose mean this is, or the covariance of targets and points. handed: the
    determinant of the result, 1 or -1.
    """
    left, _, right = np.linalg.svd(matrices)
    left[..., -1] *= handed * np.sign(np.linalg.det(left @ right))[..., None]
    result: Float64 = left @ right
    return result


def nearest_orthonormal(matrices: Float64) -> Float64:
    """Return the matrices (..., M, N) with orthonormal rows or columns nearest to matrices.

    This is their polar factor. Unlike `nearest_rotation`, it keeps reflections.
    """
    left, _, right = np.linalg.svd(matrices, full_matrices=False)
    result: Float64 = left @ right
    return result


def principal_axes(points: Float64) -> tuple[Float64, Float64]:
    """Return the principal axes of points (N, 3) as rows (3, 3), and the singular values (3,) along them.

    The largest comes first. The values are the square roots of the sums of squared distances from the mean.
    """
    centred = points - points.mean(axis=0)
    _, values, axes = np.linalg.svd(centred, full_matrices=len(points) < points.shape[1])
    full = np.zeros(points.shape[1])
    full[: len(values)] = values
    return axes, full


def _mean(points: Floating, share: Float64) -> Float64:
    """Return the weighted mean of points (..., N, P); exact if all of them coincide."""
    first = points[..., :1, :]
    return np.asarray(first[..., 0, :] + share @ (points - first))


def _pad(points: Floating, width: int) -> Floating:
    """Return points (..., N, Q) with columns of zeros up to this width."""
    missing = width - points.shape[-1]
    if missing <= 0:
        return points
    return np.concatenate([points, np.zeros((*points.shape[:-1], missing))], axis=-1)

"""Rotations and similarities that fit points or matrices best, by least squares.

Arun, Huang and Blostein, "Least-squares fitting of two 3-D point sets", 1987; Umeyama, "Least-squares
estimation of transformation parameters between two point patterns", 1991.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.arrays import Float64


@dataclass(frozen=True, eq=False)
class Similarity:
    """x -> scale * rotation @ (x - centre) + target. Several at once have leading axes.

    rotation: float64 (..., 3, 3), orthogonal. scale: (...). centre, target: (..., 3), the weighted means of
    both sets of points. error: (...), root mean square distance that is left, in the unit of the targets.
    """

    rotation: Float64
    scale: Float64
    centre: Float64
    target: Float64
    error: Float64

    def apply(self, points: Float64) -> Float64:
        """Return points (..., N, 3) moved."""
        turned = (points - self.centre[..., None, :]) @ np.swapaxes(self.rotation, -1, -2)
        return np.asarray(self.scale[..., None, None] * turned + self.target[..., None, :])


def fit_similarity(
    points: Float64, targets: Float64, weights: Float64 | None = None, *, reflected: bool = False
) -> Similarity:
    """Return the similarity that brings points (..., N, 3) closest to targets (..., N, 3).

    weights: (N,), not negative; None for equal ones. reflected: whether to fit a reflection instead of a
    rotation.
    The scale is NaN or infinite where all points coincide.
    """
    share = np.full(points.shape[-2], 1.0) if weights is None else weights
    share = share / share.sum()
    centre, target = share @ points, share @ targets
    here, there = points - centre[..., None, :], targets - target[..., None, :]
    rotation = nearest_rotation(
        np.swapaxes(there * share[:, None], -1, -2) @ here, handed=-1.0 if reflected else 1.0
    )
    turned = here @ np.swapaxes(rotation, -1, -2)
    with np.errstate(divide="ignore", invalid="ignore"):
        scale = np.asarray((turned * there).sum(axis=-1) @ share / ((here**2).sum(axis=-1) @ share))
    off = scale[..., None, None] * turned - there
    return Similarity(rotation, scale, centre, target, np.sqrt((off**2).sum(axis=-1) @ share))


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

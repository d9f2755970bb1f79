"""Faces of one size throughout: points in units of a picture are larger where the head comes nearer."""

from __future__ import annotations

import numpy as np

from fba.arrays import Bool, Float64
from fba.capture.markers.stabilisation import fit_poses, refine_reference

ROUNDS = 2
"""Fits of the size, each with the turns of the one before."""
SMOOTH = 1
"""Frames before and behind whose median is the size: heads come nearer slowly, and trackers tremble."""


def even_sizes(points: Float64, template: Float64, still: list[int]) -> Float64:
    """Return points of one size, metres, as large as an adult's face.

    points: float64 (T, M, 3), in one unit within each frame. template: (M, 3), where they are on an adult's
    face, NaN where unknown. still: numbers of those that the face does not move.
    """
    fixed = points[:, still]
    middle = np.nanmean(fixed, axis=1, keepdims=True)
    size = np.sqrt(np.nanmean((fixed - middle) ** 2, axis=(1, 2)))
    seen: Bool = np.isfinite(size) & (size > 0)
    usual = _adult_size(points[seen] / size[seen, None, None], template)
    sizes = np.where(seen, size, np.nan) * usual
    for _ in range(ROUNDS):
        even = fixed / sizes[:, None, None]
        first = int((~np.isnan(even[..., 0])).sum(axis=1).argmax())
        reference = refine_reference(even[first].copy(), even)
        rotation, _, off = fit_poses(reference, even)
        weights = 1 / (1 + (off / (2 * np.nanmedian(off))) ** 2) ** 2
        weights = np.nan_to_num(weights * (~np.isnan(even[..., 0])))
        sizes *= _ratio(reference, even, rotation, weights)
    return points / _steady(sizes)[:, None, None]


def _adult_size(points: Float64, template: Float64) -> float:
    """Return by what points (T, M, 3) must be divided to be as large as a template's (M, 3)."""
    known = ~np.isnan(template[:, 0])
    usual = np.nanmedian(points[:, known], axis=0)
    lines = np.linalg.norm(usual[:, None] - usual[None], axis=2)
    should = np.linalg.norm(template[known][:, None] - template[known][None], axis=2)
    return float(np.nansum(lines) / should.sum())


def _ratio(reference: Float64, even: Float64, rotation: Float64, weights: Float64) -> Float64:
    """Return how much larger each frame is than the reference: float64 (T,), NaN where nothing is seen."""
    known = np.nan_to_num(even)
    total = np.maximum(weights.sum(axis=1), 1e-12)[:, None]
    own = (weights @ reference) / total
    there = np.einsum("tk,tkc->tc", weights, known) / total
    turned = np.einsum("tdc,tkc->tkd", rotation, reference[None] - own[:, None])
    top = np.einsum("tk,tkc,tkc->t", weights, known - there[:, None], turned)
    bottom = np.einsum("tk,tkc,tkc->t", weights, turned, turned)
    return np.asarray(top / np.where(bottom > 0, bottom, np.nan))


def _steady(sizes: Float64) -> Float64:
    """Return sizes (T,) without the trembling of single frames."""
    padded = np.pad(sizes, SMOOTH, mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * SMOOTH + 1)
    steady = np.nanmedian(windows, axis=1)
    return np.asarray(np.where(np.isnan(sizes), np.nan, steady))

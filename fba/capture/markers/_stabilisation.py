"""Rigid motion of a head, from the markers that the face does not move."""

from __future__ import annotations

import numpy as np

from fba import rotations
from fba.arrays import Bool, Float64
from fba.errors import ModelError
from fba.geometry import nearest_rotation, principal_axes

PASSES = 4
"""Number of fits, each with less weight for markers that the previous one left far off."""
MIN_SCALE = 2e-4
"""Largest error, in metres, for which no marker loses weight: the noise of good cameras."""
SAMPLE_FRAMES = 300
"""Approximate number of frames from which the average is made."""
MIN_SPREAD = 0.005
"""Smallest spread of markers in two directions, in metres, at which a rotation is defined."""


def fit_poses(reference: Float64, positions: Float64) -> tuple[Float64, Float64, Float64]:
    """Return rotation (T, 3, 3) and shift (T, 3) of a rigid body in each frame, and the errors left (T, K).

    reference: float64 (K, 3), positions of the markers on the body. positions: float64 (T, K, 3), metres, NaN
    for missing markers: rotation . reference + shift comes as near to them as it can. Markers far off lose
    their weight (Geman-McClure). All results are NaN where fewer than three markers, or markers on a line,
    are seen.
    """
    seen: Bool = ~np.isnan(positions[..., 0]) & ~np.isnan(reference[:, 0])
    known = np.where(seen[..., None], positions, 0.0)
    body = np.nan_to_num(reference)
    weights = seen.astype(np.float64)
    left = np.zeros(seen.shape)
    usable = _can_turn(body, seen)
    rotation = np.tile(np.eye(3), (len(positions), 1, 1))
    shift = np.zeros((len(positions), 3))
    for _ in range(PASSES):
        total = np.maximum(weights.sum(axis=1), 1e-12)
        own = (weights @ body) / total[:, None]
        there = np.einsum("tk,tkc->tc", weights, known) / total[:, None]
        spread = np.einsum("tk,tkc,kd->tcd", weights, known, body)
        spread -= total[:, None, None] * there[:, :, None] * own[:, None, :]
        rotation = nearest_rotation(spread)
        shift = there - np.einsum("tcd,td->tc", rotation, own)
        off = known - np.einsum("tcd,kd->tkc", rotation, body) - shift[:, None]
        left = np.where(seen, np.sqrt((off**2).sum(axis=2)), np.nan)
        scale = np.maximum(_median(left, seen), MIN_SCALE)
        weights = np.where(seen, 1 / (1 + (np.nan_to_num(left) / (2 * scale[:, None])) ** 2) ** 2, 0.0)
    rotation[~usable], shift[~usable], left[~usable] = np.nan, np.nan, np.nan
    return rotation, shift, left


def refine_reference(reference: Float64, positions: Float64) -> Float64:
    """Return the average positions of markers on the body: float64 (K, 3).

    reference: a first guess, such as the markers of a frame; missing markers are filled in.
    """
    positions = positions[:: max(1, len(positions) // SAMPLE_FRAMES)]
    for _ in range(2):
        rotation, shift, _ = fit_poses(reference, positions)
        back = np.einsum("tdc,tkd->tkc", rotation, positions - shift[:, None])
        known = ~np.isnan(back).any(axis=2)
        for marker in np.flatnonzero(known.any(axis=0)):
            reference[marker] = np.median(back[known[:, marker], marker], axis=0)
    return reference


def follow_head(fixed: Float64, times: Float64) -> tuple[Float64, Float64]:
    """Return the head's rotation (T, 3, 3) and shift (T, 3) from markers (T, K, 3) that only it moves."""
    seen = ~np.isnan(fixed[..., 0])
    first = int(seen.sum(axis=1).argmax())
    reference = refine_reference(fixed[first].copy(), fixed)
    rotation, shift, _ = fit_poses(reference, fixed)
    if np.isnan(shift[:, 0]).all():
        raise ModelError(
            "the head's motion cannot be found: in no frame three markers that the face does not move are "
            "seen that are not on one line"
        )
    return fill_poses(rotation, shift, times)


def fill_poses(rotation: Float64, shift: Float64, times: Float64) -> tuple[Float64, Float64]:
    """Return poses with NaN interpolated in time; at both ends they stay."""
    known = np.flatnonzero(~np.isnan(shift[:, 0]))
    if len(known) == len(shift):
        return rotation, shift
    turned = rotations.quaternions(rotation[known])
    place = np.interp(times, times[known], np.arange(len(known)))
    before = np.minimum(place.astype(np.intp), len(known) - 1)
    after = np.minimum(before + 1, len(known) - 1)
    filled = rotations.matrices(rotations.interpolate(turned[:, None], before, after, place - before)[:, 0])
    moved = np.stack([np.interp(times, times[known], shift[known, axis]) for axis in range(3)], axis=1)
    return filled, moved


def relate_poses(rotation: Float64, shift: Float64, rest: slice) -> tuple[Float64, Float64]:
    """Return poses relative to the mean over the frames of the neutral face."""
    base = nearest_rotation(rotation[rest].sum(axis=0))
    centre = shift[rest].mean(axis=0)
    turned = rotation @ base.T
    moved = shift - np.einsum("tcd,d->tc", turned, centre)
    return turned, moved


def remove_poses(rotation: Float64, shift: Float64, positions: Float64) -> Float64:
    """Return positions (T, M, 3) as the body sees them: without its motion."""
    result: Float64 = np.einsum("tdc,tkd->tkc", rotation, positions - shift[:, None])
    return result


def _can_turn(body: Float64, seen: Bool) -> Bool:
    """Whether the markers seen in each frame determine a rotation: bool (T,)."""
    result = np.zeros(len(seen), dtype=bool)
    whole = seen.all(axis=1)
    patterns, which = np.unique(seen[~whole], axis=0, return_inverse=True)
    usable = np.array([_has_spread(body[pattern]) for pattern in patterns], dtype=bool)
    result[~whole] = usable[which.ravel()]
    result[whole] = _has_spread(body)
    return result


def _has_spread(points: Float64) -> bool:
    """Whether there are at least three points that are not on a line."""
    return len(points) >= 3 and bool(principal_axes(points)[1][1] > MIN_SPREAD)


def _median(values: Float64, seen: Bool) -> Float64:
    """Return the median of each row over what is seen, 0 where nothing is: float64 (T,)."""
    count = seen.sum(axis=1)
    ordered = np.sort(np.where(seen, values, np.inf), axis=1)
    middle = ordered[np.arange(len(values)), np.maximum(count - 1, 0) // 2]
    return np.where(count > 0, middle, 0.0)

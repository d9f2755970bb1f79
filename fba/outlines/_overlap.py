"""How far the outlines of silhouettes are from each other, pixel by pixel.

A silhouette becomes the distances of its pixels from its outline, negative outside, which are cut off at a
few pixels: unlike those of filled pixels, differences of these grow with how far an outline moves, and unlike
those of whole distances, they stay near the outline.
"""

from __future__ import annotations

import numpy as np

from fba.arrays import Bool, Float32, Float64

BAND = 3.0
"""Pixels from the outline, of a silhouette 96 pixels long, at which its distances are cut off."""


def signed_distances(mask: Bool) -> Float32:
    """Return the distances (H, W) of pixels from the outline, -3..3 pixels, with the figure in the middle.

    mask: (H, W), of a figure that does not touch its border. Half a pixel aside is half the difference.
    """
    from scipy import ndimage

    away = ndimage.distance_transform_edt(mask) - ndimage.distance_transform_edt(~mask)
    result: Float32 = np.clip(away - np.sign(away) / 2, -BAND, BAND).astype(np.float32)
    for axis in (0, 1):
        used = np.flatnonzero(mask.any(axis=1 - axis))
        aside, half = divmod(mask.shape[axis] - 1 - int(used[0] + used[-1]), 2)
        result = np.roll(result, aside, axis)
        if half:
            result = np.asarray((result + np.roll(result, 1, axis)) / 2, dtype=np.float32)
    return result


def outline_distances(first: Bool, others: Bool) -> Float64:
    """Return how far the outlines of silhouettes (K, H, W) are from that of one (H, W): (K,).

    The root mean square, over the pixels near the first outline, of the differences of `signed_distances`,
    relative to the width of the masks.
    """
    one = signed_distances(first)
    near = max(int((np.abs(one) < BAND).sum()), 1)
    squares = [float(((signed_distances(other) - one) ** 2).sum()) for other in others]
    return np.asarray(np.sqrt(np.array(squares) / near) / first.shape[1])

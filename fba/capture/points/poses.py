"""`fit_poses`: place, rotation and size of a face of known shape in pictures (scaled orthography)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.arrays import Float64
from fba.errors import ModelError
from fba.geometry import nearest_orthonormal
from fba.rotations import turn

PASSES = 8
"""Number of steps of the fit, each with less weight for points that the previous step left far off."""
MIN_SCALE = 2e-4
"""Largest error, in metres, for which no point loses weight."""
RIDGE_WEIGHT = 1e-3
"""Weight of the rotation before a step, which limits turns that the points hardly show."""


@dataclass(frozen=True, eq=False)
class Poses:
    """How a head is seen in each frame.

    scale: (T,), units of the picture for a metre. rotation: (T, 3, 3), from the head's axes (left, up, front)
    to the camera's (right, up, towards it). shift: (T, 2), in the picture, of the middle of the shape.
    """

    scale: Float64
    rotation: Float64
    shift: Float64

    def project(self, shape: Float64) -> Float64:
        """Return where points (N, 3) or (T, N, 3) of the head are in the picture: (T, N, 2)."""
        shape = np.broadcast_to(shape, (len(self.scale), *shape.shape[-2:]))
        turned = np.einsum("tdc,tnc->tnd", self.rotation[:, :2], shape)
        return np.asarray(self.scale[:, None, None] * turned + self.shift[:, None])


def fit_poses(shape: Float64, picture: Float64, trust: Float64 | None = None) -> Poses:
    """Return the pose of a head in each frame.

    shape: float64 (K, 3), its points, metres. picture: float64 (T, K, 2), these points in the picture, x to
    the right, y up. trust: (K,), weights of the points; None for equal weights. Raises ModelError for a frame
    whose points do not show a pose.
    """
    trust = np.ones(len(shape)) if trust is None else trust
    middle = trust @ shape / trust.sum()
    body = shape - middle
    centre = np.einsum("k,tkc->tc", trust, picture) / trust.sum()
    seen = (picture - centre[:, None]) * trust[:, None]
    first, second = np.swapaxes(np.linalg.pinv(trust[:, None] * body) @ seen, 1, 2).swapaxes(0, 1)
    both = np.stack([first, second], axis=1)
    rows = nearest_orthonormal(both)
    rotation = np.concatenate([rows, np.cross(rows[:, 0], rows[:, 1])[:, None]], axis=1)
    scale = np.einsum("tij,tij->t", rows, both) / 2
    if not (scale > 0).all():
        raise ModelError("the points of a frame lie all in one place, or on a line, as no face does")
    weights = np.broadcast_to(trust, picture.shape[:2])
    shift = centre
    for _ in range(PASSES):
        poses, off = _step(body, picture, Poses(scale, rotation, shift), weights)
        scale, rotation, shift = poses.scale, poses.rotation, poses.shift
        usual = np.maximum(np.median(off[:, trust > trust.max() / 2], axis=1), MIN_SCALE)
        weights = trust / (1 + (off * np.sqrt(trust) / (2 * usual[:, None])) ** 2) ** 2
    return Poses(scale, rotation, shift - scale[:, None] * (rotation[:, :2] @ middle))


def _step(body: Float64, picture: Float64, poses: Poses, weights: Float64) -> tuple[Poses, Float64]:
    """Return poses after a Gauss-Newton step, and how far each point is off then, metres (T, K)."""
    scale, rotation, shift = poses.scale, poses.rotation, poses.shift
    turned = np.einsum("tdc,kc->tkd", rotation, body)
    count = len(picture)
    slopes = np.zeros((count, len(body), 2, 6))
    x, y, z = np.moveaxis(turned, 2, 0)
    slopes[:, :, 0, 1], slopes[:, :, 0, 2] = z, -y  # a small turn w moves a point by w x point
    slopes[:, :, 1, 0], slopes[:, :, 1, 2] = -z, x
    slopes[:, :, :, 3] = turned[:, :, :2]
    slopes[:, :, 0, 4] = slopes[:, :, 1, 5] = 1.0
    off = (picture - shift[:, None]) / scale[:, None, None] - turned[:, :, :2]
    weighted = slopes * weights[:, :, None, None]
    normal = np.einsum("tkda,tkdb->tab", weighted, slopes)
    right = np.einsum("tkda,tkd->ta", weighted, off)
    total = np.einsum("taa->t", normal[:, :3, :3])
    normal[:, range(3), range(3)] += RIDGE_WEIGHT * total[:, None] + 1e-18
    change = np.linalg.solve(normal, right[..., None])[..., 0]
    angle = np.linalg.norm(change[:, :3], axis=1)
    rotation = turn(change[:, :3] / np.maximum(angle, 1e-12)[:, None], angle) @ rotation
    shift = shift + scale[:, None] * change[:, 4:]
    scale = scale * np.exp(np.clip(change[:, 3], -0.5, 0.5))
    turned = np.einsum("tdc,kc->tkd", rotation, body)
    off = (picture - shift[:, None]) / scale[:, None, None] - turned[:, :, :2]
    return Poses(scale, rotation, shift), np.asarray(np.linalg.norm(off, axis=2))

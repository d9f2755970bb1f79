"""Points of a picture in the axes of a face; `fit_poses`: place, rotation and size of a known face."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fba.arrays import Float64
from fba.errors import FbaWarning, ModelError, Remedy, warn
from fba.geometry import fit_similarity, nearest_orthonormal
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


ASPECTS = {"16:9": 16 / 9, "4:3": 4 / 3, "1:1": 1.0, "3:4": 3 / 4, "9:16": 9 / 16}
"""Usual aspects of pictures, width / height."""
SAMPLE_FRAMES = 60
"""Approximate number of frames from which the aspect is found."""
MAX_SURE_RATIO = 0.8
"""Largest ratio of the errors with the best aspect and the second best that raises no doubt."""
AXIS_SIGNS = np.array([1.0, -1.0, -1.0])
"""Factors from the axes of a picture (right, down, away) to those of a face that looks into the camera."""


def upright_points(
    points: Float64,
    names: tuple[str, ...],
    places: Mapping[str, str],
    template: Float64,
    share: bool,
    aspect: float | None,
) -> Float64:
    """Return points to the right, up and towards the camera, in one unit: float64 (T, M, 2 or 3).

    points: to the right, down and away, as a `PointMotion` has them. template: (M, 3), the points on a known
    face, NaN where unknown. share: whether they are shares of the picture. aspect: its width / height; None
    to find it. Warns of reversed axes, and of the aspect if it is found.
    """
    where = {places[name]: n for n, name in enumerate(names)}
    points = points * AXIS_SIGNS[: points.shape[2]]
    points = _turn_round(points, where)
    if share:
        ratio = _find_aspect(points, template) if aspect is None else aspect
        points = points * np.array([ratio, 1.0, ratio])[: points.shape[2]]
    return points


def _turn_round(points: Float64, where: Mapping[str, int]) -> Float64:
    """Return points (T, M, D) whose axes are not reversed. where: place -> number. Warns of reversed axes."""
    needed = ("3.7", "3.12", "8.3", "8.4")
    if not all(place in where for place in needed):
        return points
    left, right, *corners = (np.nanmedian(points[:, where[place]], axis=0) for place in needed)
    mouth = np.mean(corners, axis=0)
    across, down = left - right, mouth - (left + right) / 2
    if across[0] * down[1] - across[1] * down[0] > 0:  # seen from behind
        if down[1] < 0:
            axis, how = 0, "mirrored: x is turned round"
        else:
            axis, how = 1, "upside down: y counts upwards, and is turned round"
        warn(f"the points are {how}", stacklevel=6)
        points = points * np.where(np.arange(points.shape[2]) == axis, -1.0, 1.0)
    if points.shape[2] == 3 and "9.3" in where:
        eyes = points[:, [where["3.7"], where["3.12"]], 2].mean(axis=1)
        if np.nanmedian(points[:, where["9.3"], 2] - eyes) < 0:
            warn(
                "the nose is behind the eyes: depth counts towards the camera, and is turned round",
                stacklevel=6,
            )
            points = points * np.array([1.0, 1.0, -1.0])
    return points


def face_misfit(points: Float64, shape: Float64) -> float:
    """Return the median distance, in metres, of points (T, K, D) from a shape (K, 3)."""
    if points.shape[2] == 2:
        poses = fit_poses(shape, points)
        off = (poses.project(shape) - points) / poses.scale[:, None, None]
        return float(np.median(np.linalg.norm(off, axis=2)))
    return float(np.median(np.linalg.norm(fit_similarity(points, shape).apply(points) - shape, axis=2)))


def _find_aspect(points: Float64, template: Float64) -> float:
    """Return the aspect of the picture that makes points (T, M, D), shares of it, most like a face."""
    known = ~np.isnan(template[:, 0])
    whole = ~np.isnan(points[:, known]).any(axis=(1, 2))
    some = points[whole][:: max(1, int(whole.sum()) // SAMPLE_FRAMES)][:, known]
    if not len(some):
        raise ModelError("no frame has all points of the face; give the aspect of the picture")
    errors = {}
    for name, ratio in ASPECTS.items():
        errors[name] = face_misfit(some * np.array([ratio, 1.0, ratio])[: some.shape[2]], template[known])
    best, next_best = sorted(errors, key=lambda name: errors[name])[:2]
    sure = (
        "" if errors[best] < MAX_SURE_RATIO * errors[next_best] else f", but {next_best} does nearly as well"
    )
    text = f"the points are shares of a picture of unknown size: {best} makes them most like a face"
    warnings.warn(
        FbaWarning(text + sure).with_remedies(
            Remedy("aspect", "give its aspect with {}", f"{ASPECTS[best]:.4g}")
        ),
        stacklevel=6,
    )
    return ASPECTS[best]

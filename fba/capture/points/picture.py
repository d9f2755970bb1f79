"""Points of a picture in the axes of a face: its aspect, and axes that are reversed."""

from __future__ import annotations

import warnings
from collections.abc import Mapping

import numpy as np

from fba.arrays import Float64
from fba.capture.points.poses import fit_poses
from fba.errors import FbaWarning, ModelError, Remedy, warn
from fba.geometry import fit_similarity

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

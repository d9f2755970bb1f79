"""Places of markers by the shape of their cloud alone, for names that say nothing.

The cloud is laid onto the built-in head from many directions, by its nearest points; after the best fit,
markers near a feature point get it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fba.arrays import Float64
from fba.capture.markers._motion import MarkerMotion
from fba.capture.markers._registration import GIVE_MAP, SIZE_RANGE, UNIT_FACTORS
from fba.capture.markers._targets import PUPILS, SKULL, target_points
from fba.errors import ModelError
from fba.face import FaceModel
from fba.geometry import fit_similarity
from fba.rotations import axis_matrices

RARE_POINTS = (*(f"2.{n}" for n in range(2, 10)), *(f"3.{n}" for n in range(7, 15)), "8.9", "8.10", "9.4",
               "9.5", "9.6", "9.7", "9.13", "9.14", "11.4", "11.6")  # fmt: skip
"""Points that hardly anybody marks, such as those inside the lips, beside points that many mark."""


@dataclass(frozen=True)
class Tuning:
    """Constants of the proposal of places for markers."""

    min_markers: int = 12  # number of markers whose shape identifies a face
    directions: int = 12  # number of directions about the vertical from which the cloud is laid onto the head
    first_iterations: int = 6  # number of iterations of the fit from each direction
    full_fits: int = 6  # number of best fits that are completed
    iterations: int = 25  # number of further iterations of these
    max_point_distance: float = 0.015  # distance of a marker from its feature point, in metres
    min_placed: float = 0.4  # share of the markers that must be near feature points
    max_error: float = 0.006  # root mean square distance, in metres, of the cloud of a face
    min_depth: float = -0.09  # z, in metres, of the head's surface that carries markers


TUNING = Tuning()


def propose_map(motion: MarkerMotion) -> dict[str, str]:
    """Return marker -> target. ModelError if the cloud is not that of a face, or has too few markers."""
    from scipy.optimize import linear_sum_assignment

    seen = motion.seen
    usual = seen.mean(axis=0) > 0.5
    frame = int(seen[:, usual].sum(axis=1).argmax()) if usual.any() else 0
    rows = np.flatnonzero(seen[frame])
    if len(rows) < TUNING.min_markers:
        raise ModelError(
            f"no built-in set has the names of these markers, and {len(rows)} are too few to find a face by "
            "its shape"
        ).with_remedies(GIVE_MAP)
    model = FaceModel.default()
    cloud = motion.positions[frame, rows]
    laid, error = _lay_onto(cloud, model, motion.up)
    if error > TUNING.max_error:
        raise ModelError(
            "no built-in set has the names of these markers, and their shape is not that of a face "
            f"(best fit {1000 * error:.0f} mm off)"
        ).with_remedies(GIVE_MAP)
    places = _skin_points(model)
    names = [name for name in places if name not in RARE_POINTS]
    apart = np.linalg.norm(laid[:, None] - np.array([places[name] for name in names])[None], axis=2)
    markers, targets = linear_sum_assignment(np.minimum(apart, TUNING.max_point_distance))
    result = {
        motion.names[rows[m]]: names[t]
        for m, t in zip(markers, targets, strict=True)
        if apart[m, t] < TUNING.max_point_distance
    }
    if len(result) < max(TUNING.min_markers, TUNING.min_placed * len(rows)):
        raise ModelError(
            "no built-in set has the names of these markers, and their shape is not that of a face: only "
            f"{len(result)} of {len(rows)} would be where a face has feature points"
        ).with_remedies(GIVE_MAP)
    top = places["11.1"][1]
    for m, row in enumerate(rows):
        if motion.names[row] not in result and laid[m, 1] > top:
            result[motion.names[row]] = SKULL
    return {name: result[name] for name in motion.names if name in result}


def _skin_points(model: FaceModel) -> dict[str, Float64]:
    """Return target -> position (3,) of those targets that are on the skin."""
    return {name: point for name, point in target_points(model.points).items() if name not in PUPILS}


def _lay_onto(cloud: Float64, model: FaceModel, up: str) -> tuple[Float64, float]:
    """Return the cloud on the head, float64 (M, 3), and the root mean square distance, metres."""
    from scipy.spatial import cKDTree

    skin = np.concatenate([part.vertices for part in model.of_kind("skin")]).astype(np.float64)
    skin = skin[(skin[:, 2] > TUNING.min_depth) & (skin[:, 1] > model.points[:, 1].min() - 0.02)]
    tree = cKDTree(skin)
    key = np.array(list(_skin_points(model).values()))
    size = float(np.sqrt(((cloud - cloud.mean(axis=0)) ** 2).sum(axis=1).mean()))
    usual = float(np.sqrt(((key - key.mean(axis=0)) ** 2).sum(axis=1).mean()))
    if (
        not SIZE_RANGE[0] * usual < max(UNIT_FACTORS) * size
        or not min(UNIT_FACTORS) * size < SIZE_RANGE[1] * usual
    ):
        raise ModelError(
            "no built-in set has the names of these markers, and their shape is not that of a face: they "
            f"spread over {size:.2g} m in no unit of length that a face has"
        ).with_remedies(GIVE_MAP)
    factor = min((1.0, *UNIT_FACTORS), key=lambda each: abs(np.log(each * size / usual)))
    middle = key.mean(axis=0)
    turned = [cloud * factor @ start.T for start in _rotations(up)]
    starts = [
        _fit(each - each.mean(axis=0) + middle, tree, skin, key, TUNING.first_iterations) for each in turned
    ]
    best = sorted(starts, key=lambda fit: fit[1])[: TUNING.full_fits]
    return min((_fit(laid, tree, skin, key, TUNING.iterations) for laid, _ in best), key=lambda fit: fit[1])


def _rotations(up: str) -> list[Float64]:
    """Return rotations (3, 3) from which the cloud is laid onto the head. up: axis; "" if unknown."""
    result = []
    for name in (up,) if up else ("+y", "+z", "+x", "-y", "-z", "-x"):
        axis = np.eye(3)["xyz".index(name[1])] * (1.0 if name[0] == "+" else -1.0)
        left = np.roll(np.abs(axis), 1)
        upright = np.stack([left, axis, np.cross(left, axis)])
        result += [
            axis_matrices(1, 2 * np.pi * turn / TUNING.directions) @ upright
            for turn in range(TUNING.directions)
        ]
    return result


def _fit(laid: Float64, tree: Any, skin: Float64, key: Float64, rounds: int) -> tuple[Float64, float]:
    """Return the cloud turned, scaled and moved onto the surface, and its error, metres.

    tree: a k-d tree of the vertices of the skin.
    """
    from scipy.spatial import cKDTree

    size = 1.0
    for _ in range(rounds):
        distance, nearest = tree.query(laid)
        weight = 1 / (1 + (distance / (2 * max(float(np.median(distance)), 1e-4))) ** 2)
        fit = fit_similarity(laid, skin[nearest], weight)
        scale = np.clip(fit.scale, SIZE_RANGE[0] / size, SIZE_RANGE[1] / size)
        size *= float(scale)
        laid = replace(fit, scale=scale).apply(laid)
    distance, _ = tree.query(laid)
    back, _ = cKDTree(laid).query(key)
    # features of the face must have markers near them: a smooth surface alone fits in many places
    return laid, float(np.sqrt((np.minimum(distance, 0.03) ** 2).mean()) + 0.05 * np.median(back))

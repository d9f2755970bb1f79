"""The depth of points in a picture: a head that turns shows the depth of each point.

The shape of a face is known roughly, and so is its motion: its feature points are those of another face,
moved by smooth errors, and its FAPs move them. Shape, poses and motion are each computed from the others. A
point that FAPs hardly move sideways, such as the middle of the lips, shows its depth when the head turns. A
smile moves the corners of the mouth as well, so that their depth follows from their neighbours.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fba.arrays import Float64
from fba.capture.markers._solving import measure_responses
from fba.capture.markers._targets import PUPILS, RIGID
from fba.capture.points.picture import Poses, fit_poses
from fba.errors import ModelError
from fba.face import FaceModel
from fba.parameters import faps, point_rows

SAMPLE_FRAMES = 60
"""Approximate number of frames from which the shape is computed."""
USUAL_FAPS = {"MNS": 150.0, "MW": 100.0, "ENS": 120.0, "ES": 60.0, "IRISD": 400.0}
"""Usual size of FAPs of each unit, root mean square, in thousandths of the unit."""
FACE_DIFFERENCE = np.array([0.005, 0.005, 0.004])
"""Distance of points between faces of the same size, in metres: sideways, up and in depth."""


@dataclass(frozen=True)
class Tuning:
    """Constants of the lifting of flat points into space."""

    min_still_points: int = 5  # number of still points that define a pose
    iterations: int = 10  # number of iterations in which shape and poses are computed, each from the other
    # usual shifts of pupils by the gaze, in metres: sideways, and up and down
    gaze_shift: tuple[float, float] = (0.004, 0.003)
    noise: float = 4e-4  # error of trackers, in metres
    correlation_length: float = 0.015  # distance, in metres, over which such differences are correlated
    # distance, in metres, by which single points differ from those around them
    point_difference: float = 0.0015
    independent_rate: float = 2.0  # number of frames per second that carry new information about the shape


TUNING = Tuning()


@dataclass(frozen=True, eq=False)
class Knowledge:
    """Prior knowledge of a face.

    template: float64 (M, 3), its points on another face. shape: float64 (3M, 3M), inverse covariance of the
    differences from there. motion: float64 (3M, 3M), covariance of the displacements by FAPs.
    """

    template: Float64
    shape: Float64
    motion: Float64


def lift(
    points: Float64, places: Mapping[str, str], template: Float64, times: Float64, model: FaceModel
) -> Float64:
    """Return points (T, M, 2) with depth: float64 (T, M, 3), metres, as large as an adult's face.

    x to the right, y up, z towards the camera. places: of each point. template: (M, 3), the points on the
    model's face. times: (T,), seconds. Raises ModelError where too few points show the pose.
    """
    known = _know(list(places.values()), template, model)
    spread = np.sqrt(np.diag(known.motion).reshape(-1, 3).sum(axis=1))
    if (spread < TUNING.noise).sum() < TUNING.min_still_points:
        raise ModelError(
            f"{int((spread < TUNING.noise).sum())} points without depth are at places that the face does not "
            f"move; {TUNING.min_still_points} are needed to tell how the head turns"
        )
    trust = TUNING.noise**2 / (TUNING.noise**2 + spread**2)
    some = slice(None, None, max(1, len(points) // SAMPLE_FRAMES))
    few = points[some]
    share = min(1.0, TUNING.independent_rate * float(times[-1] - times[0] + 0.5) / len(few))
    shape = template.copy()
    for _ in range(TUNING.iterations):
        poses = fit_poses(shape, few, trust)
        shape = _refine(shape, few, poses, known, share)
    poses = fit_poses(shape, points, trust)
    local = _in_head(points, shape, poses, known)
    return np.asarray(np.einsum("tdc,tnc->tnd", poses.rotation, local))


def _know(places: list[str], template: Float64, model: FaceModel) -> Knowledge:
    """Return the knowledge of a face whose points are at these places."""
    rows = [point_rows().get(place) for place in places]
    each = measure_responses(model).each
    moves = np.zeros((len(each), len(places), 3))
    for fap in faps()[2:]:
        if fap.unit in USUAL_FAPS:
            size = USUAL_FAPS[fap.unit] * model.fapu[fap.unit]
            for n, row in enumerate(rows):
                if row is not None and places[n] not in RIGID:
                    moves[fap.number - 1, n] = each[fap.number - 1, row] * size
    pupils = [n for n, place in enumerate(places) if place in PUPILS]
    looks = np.zeros((2, len(places), 3))
    looks[0, pupils, 0], looks[1, pupils, 1] = TUNING.gaze_shift
    flat = np.concatenate([moves, looks]).reshape(-1, 3 * len(places))
    apart = np.linalg.norm(template[:, None] - template[None], axis=2)
    alike = np.exp(-((apart / TUNING.correlation_length) ** 2) / 2)
    shape = np.kron(alike, np.diag(FACE_DIFFERENCE**2)) + TUNING.point_difference**2 * np.eye(3 * len(places))
    return Knowledge(template, np.asarray(np.linalg.inv(shape)), np.asarray(flat.T @ flat))


def _seen(points: Float64, poses: Poses) -> Float64:
    """Return points (T, M, 2) in metres across the head's middle."""
    return (points - poses.shift[:, None]) / poses.scale[:, None, None]


def _inverse(poses: Poses, known: Knowledge) -> tuple[Float64, Float64]:
    """Return the covariance of motion in space and in pictures, (T, 3M, 2M), and the inverse of that in
    pictures, (T, 2M, 2M)."""
    count = len(known.template)
    rows = poses.rotation[:, :2]
    shows = known.motion.reshape(-1, 3) @ rows.swapaxes(1, 2)
    shows = shows.reshape(len(rows), 3 * count, 2 * count)
    spread = _project(shows, rows) + TUNING.noise**2 * np.eye(2 * count)
    return np.asarray(shows), np.asarray(np.linalg.inv(spread))


def _project(vectors: Float64, rows: Float64) -> Float64:
    """Return (T, 3M, K), directions in space, as they are seen: (T, 2M, K). rows: (T, 2, 3)."""
    frames, _, width = vectors.shape
    seen = rows[:, None] @ vectors.reshape(frames, -1, 3, width)
    return seen.reshape(frames, -1, width)


def _refine(shape: Float64, points: Float64, poses: Poses, known: Knowledge, share: float) -> Float64:
    """Return the likeliest shape (M, 3) for poses in some frames. share: of frames with new information."""
    count = len(shape)
    rows = poses.rotation[:, :2]
    off = (_seen(points, poses) - np.einsum("tac,nc->tna", rows, shape)).reshape(len(rows), -1)
    _, inverse = _inverse(poses, known)
    across = inverse.reshape(len(rows), -1, 2) @ rows  # (T, 2M x M, 3)
    across = across.reshape(len(rows), count, 2, -1)
    normal = np.einsum("tac,tnak->nck", rows, across, optimize=True).reshape(3 * count, -1)
    pull = (inverse @ off[..., None]).reshape(-1, count, 2)
    right = np.einsum("tac,tna->nc", rows, pull).ravel()
    right = share * right + known.shape @ (known.template - shape).ravel()
    change = np.linalg.solve(share * normal + known.shape, right)
    return shape + change.reshape(count, 3)


def _in_head(points: Float64, shape: Float64, poses: Poses, known: Knowledge) -> Float64:
    """Return points (T, M, 3) in the head's axes, with the depth of the shape (M, 3) and its motion."""
    rows = poses.rotation[:, :2]
    seen = _seen(points, poses)
    off = (seen - np.einsum("tac,nc->tna", rows, shape)).reshape(len(rows), -1)
    deep = np.empty(points.shape[:2])
    for first in range(0, len(points), SAMPLE_FRAMES):
        part = slice(first, first + SAMPLE_FRAMES)
        some = Poses(poses.scale[part], poses.rotation[part], poses.shift[part])
        shows, inverse = _inverse(some, known)
        moved = shows @ (inverse @ off[part, :, None])
        deep[part] = shape[:, 2] + moved.reshape(-1, len(shape), 3)[..., 2]
    plane = seen - rows[:, None, :, 2] * deep[..., None]
    across = np.linalg.inv(rows[:, :, :2])
    return np.concatenate([np.einsum("tdc,tnc->tnd", across, plane), deep[..., None]], axis=2)

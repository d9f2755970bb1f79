"""Points of a picture without depth, given that of a face: a head that turns shows how deep each one is.

A face is known in shape, roughly, and in what it can do: its feature points are those of another face, moved
by smooth errors, and its FAPs move them. Of the shape, the poses and the motion, each is found from the
others. A point that FAPs hardly move sideways, as the middle of the lips, tells its depth by each turn of the
head; the corners of the mouth, which a smile moves, too, tell theirs by its neighbours.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fba.arrays import Float64
from fba.capture.markers._responses import measure_responses
from fba.capture.markers._targets import PUPILS, RIGID
from fba.capture.points.poses import Poses, fit_poses
from fba.errors import ModelError
from fba.face import FaceModel
from fba.face.feature_points import row_of
from fba.parameters import faps

MIN_STILL_POINTS = 5
"""Smallest number of still points that define a pose."""
ITERATIONS = 10
"""Number of iterations in which shape and poses are computed, each from the other."""
SAMPLE_FRAMES = 60
"""Approximate number of frames from which the shape is computed."""
USUAL_FAPS = {"MNS": 150.0, "MW": 100.0, "ENS": 120.0, "ES": 60.0, "IRISD": 400.0}
"""Usual size of FAPs of each unit, root mean square, in thousandths of the unit."""
GAZE_SHIFT = (0.004, 0.003)
"""Metres by which eyes move their pupils sideways, and up and down."""
NOISE = 4e-4
"""Error of trackers, in metres."""
FACE_DIFFERENCE = np.array([0.005, 0.005, 0.004])
"""Distance of points between faces of one size, in metres: sideways, up and in depth."""
CORRELATION_LENGTH = 0.015
"""Distance, in metres, over which such differences are alike."""
POINT_DIFFERENCE = 0.0015
"""Distance, in metres, by which single points differ from those around them."""
INDEPENDENT_RATE = 2.0
"""Number of frames per second that carry new information about the shape."""


@dataclass(frozen=True, eq=False)
class Knowledge:
    """What is known of a face before it is seen.

    template: float64 (M, 3), its points on another face. shape: float64 (3M, 3M), inverse covariance of how
    far they are from there; motion: float64 (3M, 3M), covariance of how far FAPs move them.
    """

    template: Float64
    shape: Float64
    motion: Float64


def lift(
    points: Float64,
    places: Mapping[str, str],
    template: Float64,
    times: Float64,
    model: FaceModel,
) -> Float64:
    """Return points (T, M, 2) with depth: float64 (T, M, 3), metres, as large as an adult's face.

    x to the right, y up, z towards the camera. places: of each point. template: (M, 3), where points are on
    the model's face. times: (T,), seconds. Raises ModelError where too few points tell a pose.
    """
    known = _know(list(places.values()), template, model)
    spread = np.sqrt(np.diag(known.motion).reshape(-1, 3).sum(axis=1))
    if (spread < NOISE).sum() < MIN_STILL_POINTS:
        raise ModelError(
            f"{int((spread < NOISE).sum())} points without depth are at places that the face does not move; "
            f"{MIN_STILL_POINTS} are needed to tell how the head turns"
        )
    trust = NOISE**2 / (NOISE**2 + spread**2)
    some = slice(None, None, max(1, len(points) // SAMPLE_FRAMES))
    few = points[some]
    share = min(1.0, INDEPENDENT_RATE * float(times[-1] - times[0] + 0.5) / len(few))
    shape = template.copy()
    for _ in range(ITERATIONS):
        poses = fit_poses(shape, few, trust)
        shape = _refine(shape, few, poses, known, share)
    poses = fit_poses(shape, points, trust)
    local = _in_head(points, shape, poses, known)
    return np.asarray(np.einsum("tdc,tnc->tnd", poses.rotation, local))


def _know(places: list[str], template: Float64, model: FaceModel) -> Knowledge:
    """Return what is known of a face whose points are at these places."""
    rows = [row_of().get(place) for place in places]
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
    looks[0, pupils, 0], looks[1, pupils, 1] = GAZE_SHIFT
    flat = np.concatenate([moves, looks]).reshape(-1, 3 * len(places))
    apart = np.linalg.norm(template[:, None] - template[None], axis=2)
    alike = np.exp(-((apart / CORRELATION_LENGTH) ** 2) / 2)
    shape = np.kron(alike, np.diag(FACE_DIFFERENCE**2)) + POINT_DIFFERENCE**2 * np.eye(3 * len(places))
    return Knowledge(template, np.asarray(np.linalg.inv(shape)), np.asarray(flat.T @ flat))


def _seen(points: Float64, poses: Poses) -> Float64:
    """Return points (T, M, 2) in metres across the head's middle."""
    return np.asarray((points - poses.shift[:, None]) / poses.scale[:, None, None])


def _inverse(poses: Poses, known: Knowledge) -> tuple[Float64, Float64]:
    """Return how motion shows in pictures, (T, 3M, 2M), and the inverse covariance of these, (T, 2M, 2M)."""
    count = len(known.template)
    rows = poses.rotation[:, :2]
    shows = known.motion.reshape(-1, 3) @ rows.swapaxes(1, 2)
    shows = shows.reshape(len(rows), 3 * count, 2 * count)
    spread = _project(shows, rows) + NOISE**2 * np.eye(2 * count)
    return np.asarray(shows), np.asarray(np.linalg.inv(spread))


def _project(vectors: Float64, rows: Float64) -> Float64:
    """Return (T, 3M, K), directions in space, as they are seen: (T, 2M, K). rows: (T, 2, 3)."""
    frames, _, width = vectors.shape
    seen = rows[:, None] @ vectors.reshape(frames, -1, 3, width)
    return np.asarray(seen.reshape(frames, -1, width))


def _refine(shape: Float64, points: Float64, poses: Poses, known: Knowledge, share: float) -> Float64:
    """Return the shape (M, 3) that is likeliest, given poses in some frames. share: of them that are new."""
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
    return np.asarray(shape + change.reshape(count, 3))


def _in_head(points: Float64, shape: Float64, poses: Poses, known: Knowledge) -> Float64:
    """Return points (T, M, 3) in the head's axes, as deep as the shape, (M, 3), and its motion say."""
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

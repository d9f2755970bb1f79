"""Errors of what a stream shows, compared with its source, and how visible they are."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np

from fba.animation import Animation
from fba.arrays import Float64
from fba.body import BapSolver
from fba.body.displacement import REACH, displacements
from fba.face import Deformer, FaceModel, resolve
from fba.face.deform.displacements import DisplacementMeter
from fba.parameters import BAP_COUNT, FAP_COUNT, bap_steps, baps, fap_groups, fap_steps, faps
from fba.tracks import hold

PROBE_STEPS = 100
"""Table steps by which a parameter is moved to see what it moves."""
HEAD_TURNS = slice(47, 50)
"""Columns of the FAPs that turn the head."""


@dataclass(frozen=True)
class Tuning:
    """Constants of visibility."""

    head_turn: float = 1e-5 * 180 / np.pi / 0.1 * 0.5  # mm for a unit: 0.1 degrees count as 0.5 mm
    important_groups: tuple[int, ...] = (2, 3, 8)
    """Groups of FAPs that viewers watch most: mouth, eyes with lids, outer lips."""
    importance: float = 1.5  # factor of these groups
    body_importance: float = 0.1  # bodies are seen from ten times as far as faces
    min_visibility: float = 0.01  # mm for a table step of parameters that move nothing on the built-in models


TUNING = Tuning()


class ParameterErrors(NamedTuple):
    """Errors of a parameter over all frames, in its unit.

    label: the standard's name. largest: the largest error. percentile: the error that 99 % of frames are
    within.
    """

    label: str
    largest: float
    percentile: float


class DistanceErrors(NamedTuple):
    """Errors of the points of a face or a body over all frames, in metres.

    largest: the largest distance. percentile: the distance that 99 % are within. head: the largest error of
    the head's angles, in degrees. feet: the largest error of soles while they stand, in metres.
    """

    largest: float
    percentile: float
    head: float = 0.0
    feet: float = 0.0


@dataclass(frozen=True)
class ShownErrors:
    """Differences between what a stream and its source show.

    parameters: those with errors, ordered by the largest error in table steps, the largest first. face:
    vertices of the built-in head, in the frame of the head. body: points 3 cm off the built-in body's joints.
    None for a part that is not shown.
    """

    parameters: list[ParameterErrors]
    face: DistanceErrors | None
    body: DistanceErrors | None


def measure_errors(wanted: Animation, shown: Animation) -> ShownErrors:
    """Return the differences at every frame of `wanted`.

    Between the frames of `shown`, values are interpolated linearly, as players do. FAPs are resolved as for a
    face without an interpolation table.
    """
    there, here = _values(wanted), _at(_values(shown), wanted, shown)
    face = body = None
    if wanted.face is not None:
        face = _face_distances(there[:, :FAP_COUNT], here[:, :FAP_COUNT])
    if wanted.body is not None:
        pair = there[:, FAP_COUNT:], here[:, FAP_COUNT:]
        moved = displacements(*pair, float(wanted.rate))
        percentile = float(np.percentile(moved.joints, 99))
        body = DistanceErrors(float(moved.joints.max()), percentile, feet=float(moved.feet.max(initial=0.0)))
    return ShownErrors(_parameter_errors(np.abs(there - here)), face, body)


def mean_distance(wanted: Animation, shown: Animation) -> float:
    """Return the mean error over frames, in weighted millimetres.

    The error of a frame is the root of the weighted sum (`error_weights`) of all squared errors.
    """
    weights = error_weights()
    coded = np.isfinite(weights)
    apart = _values(wanted) - _at(_values(shown), wanted, shown)
    return float(np.sqrt(apart[:, coded] ** 2 @ weights[coded]).mean())


def _parameter_errors(errors: Float64) -> list[ParameterErrors]:
    """Return the errors of the parameters that have any. errors: (T, 364)."""
    labels = [*(fap.label for fap in faps()), *(bap.label for bap in baps())]
    steps = np.concatenate([fap_steps(), bap_steps("iso")])
    largest = errors.max(axis=0)
    order = np.argsort(-largest / steps, kind="stable")
    return [
        ParameterErrors(labels[column], float(largest[column]), float(np.percentile(errors[:, column], 99)))
        for column in order.tolist()
        if largest[column]
    ]


def _face_distances(there: Float64, here: Float64) -> DistanceErrors:
    """Return the errors of vertices of the built-in head, for FAPs (T, 68)."""
    meter = DisplacementMeter(FaceModel.default())
    moved = meter.measure(there, here)
    return DistanceErrors(float(moved.largest.max()), moved.percentile(99), head=meter.angles(there, here)[0])


def _values(animation: Animation) -> Float64:
    """Return the shown values: float64 (T, 364), FAPs, then BAPs; 0 for an absent track."""
    result = np.zeros((len(animation), len(error_weights())))
    if animation.face is not None:
        result[:, :FAP_COUNT] = resolve(animation.face)
    if animation.body is not None:
        track = animation.body
        result[:, FAP_COUNT:] = hold(track.values, track.mask, np.zeros_like(track.values[0]))
    return result


def _at(values: Float64, wanted: Animation, shown: Animation) -> Float64:
    """Return the values (S, columns) of the frames of `shown` at those of `wanted`: (T, columns)."""
    index, keys = wanted.index - wanted.index[0], shown.index - shown.index[0]
    after = np.clip(np.searchsorted(keys, index), 0, len(keys) - 1)
    before = np.maximum(after - (keys[after] > index), 0)
    length = np.maximum(keys[after] - keys[before], 1)
    share = np.clip((index - keys[before]) / length, 0.0, 1.0)[:, None]
    result: Float64 = values[before] * (1.0 - share) + values[after] * share
    return result


@cache
def error_weights() -> Float64:
    """Return the weight of the squared error of each parameter: float64 (364,), the FAPs, then the BAPs.

    The weight times the squared error, in units, is a squared distance in millimetres: of the vertex of the
    built-in head that moves most, in the frame of the head, times the FAP's importance; or of the most moved
    of the points 3 cm off a body's joints, times the importance of bodies. Infinite for visemes and
    expressions.
    """
    weights: Float64 = np.concatenate([fap_millimetres(), bap_millimetres() * TUNING.body_importance]) ** 2
    weights[:2] = np.inf
    return weights


def fap_millimetres() -> Float64:
    """Return how far a unit of each FAP moves the built-in head, with importance: float64 (68,)."""
    deformer = Deformer(FaceModel.default())
    steps = np.asarray(fap_steps(), dtype=np.float64)
    moves = np.zeros((FAP_COUNT, 2, FAP_COUNT))
    columns = np.arange(FAP_COUNT)
    moves[columns, :, columns] = (PROBE_STEPS * steps)[:, None] * [1, -1]
    neutral = deformer.local(np.zeros(FAP_COUNT))
    largest = np.array([np.linalg.norm(deformer.local(both) - neutral, axis=2).max() for both in moves])
    result = 1000.0 * largest / (PROBE_STEPS * steps)
    result = np.maximum(result, TUNING.min_visibility / steps)
    result[HEAD_TURNS] = TUNING.head_turn
    for group in TUNING.important_groups:
        result[np.array(fap_groups()[group - 1]) - 1] *= TUNING.importance
    return result


def bap_millimetres() -> Float64:
    """Return how far a unit of each BAP moves points 3 cm off the body's joints: float64 (296,)."""
    steps = np.asarray(bap_steps("iso"), dtype=np.float64)
    moves = np.diag(PROBE_STEPS * steps)
    solver = BapSolver()
    offsets = np.concatenate([REACH * np.eye(3), np.ones((3, 1))], axis=1)
    posed = np.asarray(solver.pose(moves.astype(np.int32))) @ offsets.T
    rest = np.asarray(solver.pose(np.zeros(BAP_COUNT, np.int32))) @ offsets.T
    distances = np.linalg.norm((posed - rest)[:, :, :3], axis=2).max(axis=(1, 2))
    result: Float64 = np.maximum(1000.0 * distances / (PROBE_STEPS * steps), TUNING.min_visibility / steps)
    return result

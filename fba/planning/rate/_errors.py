"""How far the parameters that a stream shows are off from those that were to be shown."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fba.animation import Animation
from fba.arrays import Float64
from fba.body.displacement import displacements
from fba.face import resolve
from fba.parameters import bap_steps, baps, fap_steps, faps
from fba.planning.rate._visibility import error_weights
from fba.tracks import hold

FACE_PARAMETERS = len(fap_steps())


class ParameterErrors(NamedTuple):
    """How far one parameter is off over all frames, in its unit.

    label: the standard's name. largest, percentile: the largest error, and what 99 % of frames are within.
    """

    label: str
    largest: float
    percentile: float


class DistanceErrors(NamedTuple):
    """How far points of a face or a body are off over all frames, in metres.

    largest, percentile: the largest distance, and what 99 % of them are within. head: degrees that the head's
    angles are off at most. feet: metres that soles are off while they stand.
    """

    largest: float
    percentile: float
    head: float = 0.0
    feet: float = 0.0


@dataclass(frozen=True)
class ShownErrors:
    """What a stream shows otherwise than its source.

    parameters: those that are off, first those that are off by most table steps. face: vertices of the
    built-in head, in the head's own frame. body: points 3 cm off the built-in body's joints. None for what is
    not shown.
    """

    parameters: list[ParameterErrors]
    face: DistanceErrors | None
    body: DistanceErrors | None


def measure_errors(wanted: Animation, shown: Animation) -> ShownErrors:
    """Return what is shown otherwise, at every frame of `wanted`.

    Between the frames of `shown`, values go on in straight lines, as players show them. FAPs as a face
    without an interpolation table of its own shows them.
    """
    there, here = _values(wanted), _at(_values(shown), wanted, shown)
    face = body = None
    if wanted.face is not None:
        face = _face_distances(there[:, :FACE_PARAMETERS], here[:, :FACE_PARAMETERS])
    if wanted.body is not None:
        pair = there[:, FACE_PARAMETERS:], here[:, FACE_PARAMETERS:]
        moved = displacements(*pair, float(wanted.rate))
        percentile = float(np.percentile(moved.joints, 99))
        body = DistanceErrors(float(moved.joints.max()), percentile, feet=float(moved.feet.max(initial=0.0)))
    return ShownErrors(_parameter_errors(np.abs(there - here)), face, body)


def mean_distance(wanted: Animation, shown: Animation) -> float:
    """Return how far all parameters together are off, in weighed millimetres, on average over frames.

    The root of the sum of their squared errors, each with its weight (`error_weights`).
    """
    weights = error_weights()
    coded = np.isfinite(weights)
    apart = _values(wanted) - _at(_values(shown), wanted, shown)
    return float(np.sqrt(apart[:, coded] ** 2 @ weights[coded]).mean())


def _parameter_errors(errors: Float64) -> list[ParameterErrors]:
    """Return the errors of parameters that are off. errors: (T, 364)."""
    labels = [*(one.label for one in faps()), *(one.label for one in baps())]
    steps = np.concatenate([fap_steps(), bap_steps("iso")])
    largest = errors.max(axis=0)
    order = np.argsort(-largest / steps, kind="stable")
    return [
        ParameterErrors(labels[column], float(largest[column]), float(np.percentile(errors[:, column], 99)))
        for column in order.tolist()
        if largest[column]
    ]


def _face_distances(there: Float64, here: Float64) -> DistanceErrors:
    """Return how far vertices of the built-in head are off, for FAPs (T, 68)."""
    from fba.face import FaceModel
    from fba.face.deform.displacements import DisplacementMeter

    meter = DisplacementMeter(FaceModel.default())
    moved = meter.measure(there, here)
    return DistanceErrors(float(moved.largest.max()), moved.percentile(99), head=meter.angles(there, here)[0])


def _values(animation: Animation) -> Float64:
    """Return what an animation shows: float64 (T, 364), FAPs, then BAPs; 0 for a track that it lacks."""
    result = np.zeros((len(animation), len(error_weights())))
    if animation.face is not None:
        result[:, :FACE_PARAMETERS] = resolve(animation.face)
    if animation.body is not None:
        track = animation.body
        result[:, FACE_PARAMETERS:] = hold(track.values, track.mask, np.zeros_like(track.values[0]))
    return result


def _at(values: Float64, wanted: Animation, shown: Animation) -> Float64:
    """Return the values (S, columns) of the frames of `shown` at those of `wanted`: (T, columns)."""
    times, known = wanted.index - wanted.index[0], shown.index - shown.index[0]
    after = np.clip(np.searchsorted(known, times), 0, len(known) - 1)
    before = np.maximum(after - (known[after] > times), 0)
    length = np.maximum(known[after] - known[before], 1)
    share = np.clip((times - known[before]) / length, 0.0, 1.0)[:, None]
    result: Float64 = values[before] * (1.0 - share) + values[after] * share
    return result

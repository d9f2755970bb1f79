"""How far the parameters that a stream shows are off from those that were to be shown."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fba.animation import Animation
from fba.arrays import Array, Float64, Int64
from fba.face.resolve import resolve
from fba.parameters import bap_steps, baps, fap_steps, faps
from fba.planning.rate.visibility import error_weights
from fba.tracks import hold

FACE_PARAMETERS = len(fap_steps())


class ParameterErrors(NamedTuple):
    """How far one parameter is off over all frames, in its unit.

    label: the standard's name. largest, percentile: the largest error, and what 99 % of frames are within.
    """

    label: str
    largest: float
    percentile: float


def measure_errors(wanted: Animation, shown: Animation) -> list[ParameterErrors]:
    """Return how far each parameter that differs is off; first those that are off by most table steps.

    At every frame of `wanted`; between the frames of `shown`, values go on in straight lines, as players show
    them. FAPs as a face without an interpolation table of its own shows them.
    """
    errors = _errors(wanted, shown)
    labels = [*(one.label for one in faps()), *(one.label for one in baps())]
    steps = np.concatenate([fap_steps(), bap_steps("iso")])
    largest = errors.max(axis=0)
    order = np.argsort(-largest / steps, kind="stable")
    return [
        ParameterErrors(labels[column], float(largest[column]), float(np.percentile(errors[:, column], 99)))
        for column in order.tolist()
        if largest[column]
    ]


def mean_distance(wanted: Animation, shown: Animation) -> float:
    """Return how far all parameters together are off, in weighed millimetres, on average over frames.

    The root of the sum of their squared errors, each with its weight (`error_weights`).
    """
    weights = error_weights()
    coded = np.isfinite(weights)
    return float(np.sqrt(_errors(wanted, shown)[:, coded] ** 2 @ weights[coded]).mean())


def _errors(wanted: Animation, shown: Animation) -> Float64:
    """Return how far every parameter is off at every frame: float64 (T, 364)."""
    result = np.zeros((len(wanted), len(error_weights())))
    index = wanted.index - wanted.index[0], shown.index - shown.index[0]
    if wanted.face is not None and shown.face is not None:
        there, here = resolve(wanted.face), resolve(shown.face)
        result[:, :FACE_PARAMETERS] = np.abs(there - _at(here, *index))
    if wanted.body is not None and shown.body is not None:
        there, here = (
            hold(track.values, track.mask, np.zeros_like(track.values[0]))
            for track in (wanted.body, shown.body)
        )
        result[:, FACE_PARAMETERS:] = np.abs(there - _at(here, *index))
    return result


def _at(values: Array, wanted: Int64, shown: Int64) -> Float64:
    """Return the values (S, columns) of frames shown at the frames wanted: (T, columns)."""
    after = np.clip(np.searchsorted(shown, wanted), 0, len(shown) - 1)
    before = np.maximum(after - (shown[after] > wanted), 0)
    length = np.maximum(shown[after] - shown[before], 1)
    share = np.clip((wanted - shown[before]) / length, 0.0, 1.0)[:, None]
    result: Float64 = values[before] * (1.0 - share) + values[after] * share
    return result

"""How far the FAPs of a face move its feature points, in the units of that face."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from fba.arrays import Float64
from fba.face import Deformer, FaceModel, feature_point_names
from fba.parameters import FAP_COUNT, faps

STEP = 200.0
"""FAP value at which a response is measured."""
JAW = 3
JAW_VALUES = np.array([0.0, 100, 200, 400, 600, 800, 1000, 1400])
"""Values of open_jaw at which its curve is measured: the jaw turns, so its points move on arcs."""


@dataclass(frozen=True, eq=False)
class Responses:
    """What FAPs do to feature points, relative to the FAP's own FAPU: another face's FAPU scale them.

    each: float64 (68, 84, 3), shift for one step of each FAP, in FAPU; zero for FAPs that turn eyes, tongue
    and head. jaw: float64 (J, 84, 3), shift in MNS at each of `JAW_VALUES`.
    """

    each: Float64
    jaw: Float64


@lru_cache(maxsize=4)
def measure_responses(model: FaceModel) -> Responses:
    """Return the responses of a face."""
    deformer = Deformer(model)
    neutral = deformer.feature_points(np.zeros(FAP_COUNT), local=True)
    moving = [fap for fap in faps()[2:] if fap.unit not in ("AU", "")]
    values = np.zeros((len(moving), FAP_COUNT))
    for row, fap in enumerate(moving):
        values[row, fap.number - 1] = STEP
    moved = np.nan_to_num(deformer.feature_points(values, local=True) - neutral)
    each = np.zeros((FAP_COUNT, len(feature_point_names()), 3))
    for row, fap in enumerate(moving):
        each[fap.number - 1] = moved[row] / (STEP * model.fapu[fap.unit])
    opened = np.zeros((len(JAW_VALUES), FAP_COUNT))
    opened[:, JAW - 1] = JAW_VALUES
    jaw = np.nan_to_num(deformer.feature_points(opened, local=True) - neutral) / model.fapu.MNS
    return Responses(each, jaw)

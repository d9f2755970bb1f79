"""Visibility of errors: how far a parameter that is off by a unit moves what is seen, and its weight."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from fba.arrays import Float64
from fba.parameters import BAP_COUNT, FAP_COUNT, bap_steps, fap_groups, fap_steps

PROBE_STEPS = 100
"""Table steps by which a parameter is moved to see what it moves."""
HEAD_TURNS = slice(47, 50)
"""Columns of the FAPs that turn the head."""


@dataclass(frozen=True)
class Tuning:
    """Constants of visibility."""

    head_turn: float = 1e-5 * 180 / np.pi / 0.1 * 0.5  # mm for a unit: 0.1 degrees count as 0.5 mm
    important_groups: tuple[int, ...] = (
        2,
        3,
        8,
    )  # mouth, eyes with lids, outer lips: viewers watch them most
    importance: float = 1.5  # factor of these groups of FAPs
    body_importance: float = 0.1  # bodies are seen from ten times as far as faces
    min_visibility: float = 0.01  # mm for a table step of parameters that move nothing on the built-in models


TUNING = Tuning()


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
    from fba.face import Deformer, FaceModel

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
    from fba.body import BapSolver
    from fba.body.displacement import REACH

    steps = np.asarray(bap_steps("iso"), dtype=np.float64)
    moves = np.diag(PROBE_STEPS * steps)
    solver = BapSolver()
    offsets = np.concatenate([REACH * np.eye(3), np.ones((3, 1))], axis=1)
    posed = np.asarray(solver.pose(moves.astype(np.int32))) @ offsets.T
    rest = np.asarray(solver.pose(np.zeros(BAP_COUNT, np.int32))) @ offsets.T
    distances = np.linalg.norm((posed - rest)[:, :, :3], axis=2).max(axis=(1, 2))
    result: Float64 = np.maximum(1000.0 * distances / (PROBE_STEPS * steps), TUNING.min_visibility / steps)
    return result

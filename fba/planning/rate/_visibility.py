"""How far a parameter that is off by one unit moves what is seen, and how much that counts."""

from __future__ import annotations

from functools import cache

import numpy as np

from fba.arrays import Float64
from fba.codec import weights_of_slots
from fba.parameters import BAP_COUNT, FAP_COUNT, bap_steps, fap_groups, fap_steps

MILLIMETRES = 1000.0
STEPS = 100
"""Table steps by which a parameter is moved to see what it moves."""
HEAD_TURNS = slice(47, 50)
HEAD_RADIANS = 1e-5 * 180 / np.pi / 0.1 * 0.5
"""A FAP that turns the head: 0.1 degrees count as half a millimetre."""
IMPORTANCE = {2: 1.5, 3: 1.5, 8: 1.5}
"""By group of FAPs: mouth, eyes and lids, and outer lips are looked at most."""
BODY_IMPORTANCE = 0.1
"""Bodies are seen from ten times as far as faces."""
MIN_VISIBILITY = 0.01
"""Millimetres for a table step of what moves nothing on the built-in models: it may on others."""


@cache
def error_weights() -> Float64:
    """Return the weight of the squared error of each parameter: float64 (364,), the FAPs, then the BAPs.

    Times (units off)^2 it is the square of the millimetres by which the built-in head's most moved vertex is
    off, in the frame of the head; or, a tenth each, those of the most moved of the points 3 cm off a body's
    joints. Times the square of what counts more. Infinite for visemes and expressions.
    """
    weights: Float64 = np.concatenate([fap_millimetres(), bap_millimetres() * BODY_IMPORTANCE]) ** 2
    weights[:2] = np.inf
    return weights


@cache
def slot_weights() -> Float64:
    """Return the same as `fba.codec.NextPlane` takes it."""
    return weights_of_slots(error_weights())


def fap_millimetres() -> Float64:
    """Return how far one unit of each FAP moves the built-in head, weighed: float64 (68,)."""
    from fba.face import Deformer, FaceModel

    deformer = Deformer(FaceModel.default())
    steps = np.asarray(fap_steps(), dtype=np.float64)
    moves = np.zeros((FAP_COUNT, 2, FAP_COUNT))
    columns = np.arange(FAP_COUNT)
    moves[columns, :, columns] = (STEPS * steps)[:, None] * [1, -1]
    neutral = deformer.local(np.zeros(FAP_COUNT))
    largest = np.array([np.linalg.norm(deformer.local(both) - neutral, axis=2).max() for both in moves])
    result = MILLIMETRES * largest / (STEPS * steps)
    result = np.maximum(result, MIN_VISIBILITY / steps)
    result[HEAD_TURNS] = HEAD_RADIANS
    for group, importance in IMPORTANCE.items():
        result[np.array(fap_groups()[group - 1]) - 1] *= importance
    return result


def bap_millimetres() -> Float64:
    """Return how far one unit of each BAP moves points 3 cm off the body's joints: float64 (296,)."""
    from fba.body import BapSolver
    from fba.body.displacement import REACH

    steps = np.asarray(bap_steps("iso"), dtype=np.float64)
    moves = np.diag(STEPS * steps)
    solver = BapSolver()
    offsets = np.concatenate([REACH * np.eye(3), np.ones((3, 1))], axis=1)
    posed = np.asarray(solver.pose(moves.astype(np.int32))) @ offsets.T
    rest = np.asarray(solver.pose(np.zeros(BAP_COUNT, np.int32))) @ offsets.T
    distances = np.linalg.norm((posed - rest)[:, :, :3], axis=2).max(axis=(1, 2))
    result: Float64 = np.maximum(MILLIMETRES * distances / (STEPS * steps), MIN_VISIBILITY / steps)
    return result

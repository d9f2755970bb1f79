"""Errors: how far what a receiver shows is from the source, on the built-in face and body."""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np

from fba.arrays import Array, Float32, Float64
from fba.body import BapSolver
from fba.face import Deformer, FaceModel
from fba.study.subjects import FACE

HEAD_TURN = slice(47, 50)
"""FAPs 48 to 50: the head's rotation, 1e-5 rad."""
BLOCK = 64
"""Frames whose vertices are in memory at once."""
ARM = 0.03
"""Metres from a joint to the points that show its error, as the Animation Compression Library measures."""
THRESHOLDS = {"face": 0.5, "body": 0.1}
"""Millimetres; 0.1 is the Animation Compression Library's."""


class Errors(NamedTuple):
    """Errors of one subject.

    millimetres: float32 (N,), of a face: of the vertex that is worst in each frame, in the head's frame; of a
    body: of every joint in every frame. degrees: the head's largest; 0 for bodies. units: the largest of a
    parameter, in the standard's units.
    """

    millimetres: Float32
    degrees: float
    units: float


def measure_errors(kind: str, source: Float64, shown: Float64) -> Errors:
    """Return the errors of FAPs (T, 68) or BAPs (T, 296) that are shown in place of a source's."""
    units = float(np.abs(shown - source).max(initial=0.0))
    if kind == FACE:
        turns = np.abs(shown[:, HEAD_TURN] - source[:, HEAD_TURN]).max(initial=0.0)
        return Errors(_face_errors(source, shown), float(np.degrees(1e-5 * turns)), units)
    return Errors(_body_errors(source, shown), 0.0, units)


@cache
def _deformer() -> Deformer:
    return Deformer(FaceModel.default())


@cache
def _solver() -> BapSolver:
    return BapSolver()


def _differing(source: Array, shown: Array) -> Array:
    """Return the numbers of frames that are not shown as they were."""
    return np.flatnonzero((source != shown).any(axis=1))


def _face_errors(source: Float64, shown: Float64) -> Float32:
    """Return the largest displacement of a vertex in each frame, float32 (T,), millimetres."""
    result = np.zeros(len(source), dtype=np.float32)
    frames = _differing(source, shown)
    for start in range(0, len(frames), BLOCK):
        block = frames[start : start + BLOCK]
        apart = _deformer().local(source[block]) - _deformer().local(shown[block])
        result[block] = 1000.0 * np.sqrt(np.einsum("tvi,tvi->tv", apart, apart).max(axis=1))
    return result


def _body_errors(source: Float64, shown: Float64) -> Float32:
    """Return the displacement of the worst of three points 3 cm off each joint, along its axes: float32
    (T x J,), millimetres."""
    count = len(_solver().skeleton)
    result = np.zeros((len(source), count), dtype=np.float32)
    frames = _differing(source, shown)
    for start in range(0, len(frames), BLOCK):
        block = frames[start : start + BLOCK]
        apart = (_solver().pose(source[block]) - _solver().pose(shown[block]))[:, :, :3]
        points = apart[..., 3:] + ARM * apart[..., :3]  # columns: the points along x, y and z
        result[block] = 1000.0 * np.linalg.norm(points, axis=2).max(axis=2)
    return result.reshape(-1)

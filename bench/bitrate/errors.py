"""Errors: how far what a receiver shows is from the source, on the built-in face and body."""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np

from bench.bitrate.subjects import FACE
from fba.arrays import Float32, Float64
from fba.body.displacement import displacements
from fba.face import Deformer, FaceModel
from fba.face.deform.displacements import vertex_distances

HEAD_TURN = slice(47, 50)
"""FAPs 48 to 50: the head's rotation, 1e-5 rad."""
ROOT = slice(180, 183)
"""BAPs 181 to 183: the root's position in millimetres; all others are angles."""
TURN = 2e5 * np.pi
"""A full turn in units of 1e-5 rad, which shows the same pose."""
THRESHOLDS = {"face": 0.5, "body": 10.0}
"""Millimetres within which most should be: what `fba encode --tolerance` keeps to."""


class Errors(NamedTuple):
    """Errors of one subject.

    millimetres: float32 (N,), of a face: of the vertex that is worst in each frame, in the head's frame; of a
    body: of every joint in every frame, at points 3 cm off it. degrees: the head's largest; 0 for bodies.
    feet: the largest of soles that stand, millimetres; 0 for faces. units: the largest of a parameter, in the
    standard's units.
    """

    millimetres: Float32
    degrees: float
    feet: float
    units: float


def measure_errors(kind: str, source: Float64, shown: Float64, rate: float) -> Errors:
    """Return the errors of FAPs (T, 68) or BAPs (T, 296) that are shown in place of a source's.

    rate: frames per second.
    """
    apart = shown - source
    if kind == FACE:
        turn = float(np.degrees(1e-5 * np.abs(apart[:, HEAD_TURN]).max(initial=0.0)))
        millimetres = (1000.0 * vertex_distances(_deformer(), source, shown)).astype(np.float32)
        return Errors(millimetres, turn, 0.0, float(np.abs(apart).max(initial=0.0)))
    root = apart[:, ROOT].copy()
    apart -= TURN * np.rint(apart / TURN)
    apart[:, ROOT] = root
    moved = displacements(source, shown, rate)
    joints = (1000.0 * moved.joints).astype(np.float32).reshape(-1)
    feet = 1000.0 * float(moved.feet.max(initial=0.0))
    return Errors(joints, 0.0, feet, float(np.abs(apart).max(initial=0.0)))


@cache
def _deformer() -> Deformer:
    return Deformer(FaceModel.default())

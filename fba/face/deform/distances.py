"""How far apart the vertices of a face are when it shows two sets of FAPs."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fba.arrays import Float32, Float64
from fba.face.deform._deformer import Deformer

BLOCK = 16
"""Frames whose vertices are held at once."""


def vertex_distances(deformer: Deformer, one: npt.ArrayLike, other: npt.ArrayLike) -> Float64:
    """Return the largest distance between a vertex in one pose and in the other: float64 (T,), metres.

    In the frame of the head, whose rotation counts nothing. one, other: (T, 68), as `Deformer` takes them.
    """
    first, second = np.asarray(one), np.asarray(other)
    result = np.zeros(len(first))
    differs = np.flatnonzero((first != second).any(axis=1))
    for start in range(0, len(differs), BLOCK):
        rows = differs[start : start + BLOCK]
        shifts: Float32 = deformer.local(first[rows]) - deformer.local(second[rows])
        result[rows] = np.sqrt(np.einsum("tvi,tvi->tv", shifts, shifts).max(axis=1))
    return result

"""What one step of each FAP moves on a face, in millimetres."""

from __future__ import annotations

import numpy as np

from fba.arrays import Float64
from fba.face.deform._deformer import Deformer
from fba.parameters import FAP_COUNT, FIRST_LOW_LEVEL_FAP

REACH = 100
"""Value of a FAP, both ways, between which its effect counts as linear."""


def displacements(deformer: Deformer) -> Float64:
    """Return the motion by 1 of each FAP at the vertices that any FAP moves most: float64 (68, P, 3), mm.

    In the frame of the head: its rotation moves nothing. 0 for FAPs that the face does not show.
    """
    columns = range(FIRST_LOW_LEVEL_FAP - 1, FAP_COUNT)
    peaks = set()
    for column in columns:
        size = np.linalg.norm(_motion(deformer, column), axis=1)
        if size.any():
            peaks.add(int(size.argmax()))
    vertices = sorted(peaks)
    result = np.zeros((FAP_COUNT, len(vertices), 3))
    for column in columns:
        result[column] = _motion(deformer, column)[vertices]
    return result


def _motion(deformer: Deformer, column: int) -> Float64:
    """Return the motion of all vertices by 1 of a FAP: float64 (V, 3), mm."""
    poses = np.zeros((2, FAP_COUNT))
    poses[:, column] = REACH, -REACH
    there, back = deformer.local(poses).astype(np.float64)
    motion: Float64 = (there - back) * (1000 / (2 * REACH))
    return motion

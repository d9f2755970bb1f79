"""How lids move on eyeballs of another size: along them, as they did along the old ones."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fba.arrays import Float64, Integer
from fba.face.calibration._eyes import FittedEye, weight_of

LID_FAPS = {19: "left", 20: "right", 21: "left", 22: "right"}


def slid(
    eyes: Mapping[str, FittedEye],
    fap: int,
    borders: Integer,
    before: tuple[Float64, Float64],
    after: tuple[Float64, Float64],
) -> Float64:
    """Displacements (N, K - 1, 3), metres a step, corrected so that the lid keeps to the eyeball.

    before, after: neutral vertices (N, 3) and displacements (N, K - 1, 3) of the old face and of the new
    one. At every border, a vertex comes to lie as many radii from the centre as it did, more or less what
    it lacks of that in the neutral face; forwards or backwards, so that heights stay and lids meet.
    """
    eye = eyes.get(LID_FAPS[fap])
    moves = after[1]
    if eye is None:
        return moves
    steps = np.diff(borders.astype(np.float64))
    zero = int(np.flatnonzero(borders == 0)[0])
    old, new = (_places(*one, steps, zero) for one in (before, after))
    wanted = np.linalg.norm(old - eye.was.centre, axis=2) * eye.size
    arms = new - eye.centre
    depth = wanted**2 - arms[..., 0] ** 2 - arms[..., 1] ** 2
    forward = np.sqrt(np.maximum(depth, 0.0)) - arms[..., 2]
    near = weight_of(eye, old.reshape(-1, 3)).reshape(old.shape[:2]).min(axis=1)
    # A vertex that leaves the front of the eyeball anywhere on its way is none of a lid's edge.
    near *= ((arms[..., 2] > 0) & (depth > 0)).all(axis=1)
    forward = (forward - forward[:, [zero]]) * near[:, None]
    corrected = moves.copy()
    corrected[..., 2] += np.diff(forward, axis=1) / steps
    return corrected


def _places(vertices: Float64, moves: Float64, steps: Float64, zero: int) -> Float64:
    """(N, K, 3): where each vertex is at each border."""
    path = np.concatenate([np.zeros((len(vertices), 1, 3)), moves * steps[:, None]], axis=1).cumsum(axis=1)
    places: Float64 = vertices[:, None] + path - path[:, [zero]]
    return places

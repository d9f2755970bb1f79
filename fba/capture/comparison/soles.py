"""Heights of the soles of the person that is shown: of the mesh, not of joints."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from fba.arrays import Array, Float64
from fba.body import BapSolver, Skeleton
from fba.body.footing import GroundedPoser
from fba.body.model import BodyModel, BodyPart
from fba.capture.comparison.figure import SIDES

SOLE = 0.02
"""Metres above the lowest vertex of a shoe up to which it is sole."""
CHUNK = 1024


def sole_heights(solver: BapSolver, baps: Array) -> dict[str, Float64]:
    """Return by side (T,), height in metres of the lowest point of a shoe of the default person.

    baps: (T, 296). Empty for another skeleton than the default body's.
    """
    model = _soles()
    if solver.skeleton is not Skeleton.default():
        return {}
    shown = GroundedPoser(model.skeleton, solver.convention.name)  # as players show it
    left = model.vertices[:, 0] > 0
    result = {side: np.empty(len(baps)) for side in SIDES}
    for begin in range(0, len(baps), CHUNK):
        rows = slice(begin, begin + CHUNK)
        heights = model.skin(shown.pose(baps[rows]))[..., 1]
        result["l"][rows] = heights[:, left].min(axis=1)
        result["r"][rows] = heights[:, ~left].min(axis=1)
    return result


@cache
def _soles() -> BodyModel:
    """Return the default person's soles alone, which are fewer vertices to move."""
    model = BodyModel.default()
    parts = []
    for part in model.parts:
        if part.kind == "shoe":
            kept = np.flatnonzero(part.vertices[:, 1] < part.vertices[:, 1].min() + SOLE)
            parts.append(_kept(part, kept))
    return replace(model, parts=tuple(parts))


def _kept(part: BodyPart, kept: Array) -> BodyPart:
    """Return a part with these vertices only, and a triangle that no one sees."""
    return BodyPart(
        part.name, part.kind, part.vertices[kept], np.array([[0, 1, 2]], dtype=np.int32),
        part.joints[kept], part.weights[kept],
    )  # fmt: skip

"""How long a unit of a mesh is, judged by the distance between its pupils."""

from __future__ import annotations

import numpy as np

from fba.arrays import Float64
from fba.errors import ModelError
from fba.face.feature_points import row_of

PUPILS = 0.062
"""Metres between the pupils of an adult."""
USUAL = (0.04, 0.08)
"""What passes as the distance between the pupils of a real head, metres."""
UNITS = {"metres": 1.0, "decimetres": 0.1, "centimetres": 0.01, "millimetres": 0.001, "inches": 0.0254}


def metres_per_unit(points: Float64, unit: float | None = None) -> tuple[float, str]:
    """How many metres a unit of the mesh is, and how that was found, in words.

    points: (84, 3). unit: what the user says, taken as it is. Otherwise the unit with which the pupils
    (3.5, 3.6; without them the eyes) stand as far apart as on a real head; where none does, as with
    Candide, the mesh is scaled to an adult's 62 mm. ModelError where that is unknown or `unit` not positive.
    """
    if unit is not None:
        if not (np.isfinite(unit) and unit > 0):
            raise ModelError(f"metres per unit must be positive, not {unit!r}")
        return float(unit), f"1 unit is {unit:g} m, as given"
    apart = pupil_distance(points)
    for name, size in UNITS.items():
        if USUAL[0] <= apart * size <= USUAL[1]:
            return size, f"in {name}: the pupils are {apart * size * 1000:.1f} mm apart"
    return PUPILS / apart, f"of no known unit: scaled so that the pupils are {PUPILS * 1000:.0f} mm apart"


def pupil_distance(points: Float64) -> float:
    """Distance of the pupils, or of the middles between the eye corners; ModelError where unknown."""
    row = row_of()
    for left, right in ((("3.5",), ("3.6",)), (("3.7", "3.11"), ("3.8", "3.12")), (("3.1",), ("3.2",))):
        ends = [points[[row[name] for name in names]].mean(axis=0) for names in (left, right)]
        apart = float(np.linalg.norm(ends[0] - ends[1]))
        if np.isfinite(apart) and apart > 0:
            return apart
    raise ModelError("the pupils (feature points 3.5 and 3.6) are missing: without them a face has no units")

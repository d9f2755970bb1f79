"""FAPU: the face animation parameter units, which scale FAPs to the face that plays them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fba.errors import ModelError
from fba.parameters import faps, point_rows

PER_DISTANCE = 1024
"""Each unit of length is a distance of the face divided by this."""
FAPU_POINTS = ("3.5", "3.6", "3.1", "3.3", "3.2", "3.4", "9.15", "2.2", "8.3", "8.4")
"""The feature points between which the units are measured: no face can do without them."""
AU = 1e-5
"""The angle unit, in radians."""


@dataclass(frozen=True, slots=True)
class Fapu:
    """The units of one face: metres (or the unit of its points) and radians.

    `fapu.MNS * 300` is how far a value of 300 moves a point whose FAP has the unit MNS.
    """

    IRISD: float
    ES: float
    ENS: float
    MNS: float
    MW: float
    AU: float = AU

    @classmethod
    def measure(cls, points: npt.ArrayLike) -> Fapu:
        """Return the FAPU of a neutral face, from its feature points (84, 3) in any unit of length.

        IRISD0 is the height of the eye opening, ES0 the distance between the pupils, ENS0 from the
        pupils down to the nose, MNS0 from the nose down to the mouth, MW0 the width of the mouth; each
        is the mean of left and right where both exist. Raises ModelError where one is not positive.
        """
        array = np.asarray(points, dtype=np.float64)
        if array.shape != (len(point_rows()), 3):
            raise ModelError(
                f"FAPU: feature points must have shape ({len(point_rows())}, 3), not {array.shape}"
            )
        x, y = ({name: float(array[row, axis]) for name, row in point_rows().items()} for axis in (0, 1))
        pupils = (y["3.5"] + y["3.6"]) / 2
        distances = {
            "IRISD": ((y["3.1"] - y["3.3"] + y["3.2"] - y["3.4"]) / 2, "3.1 above 3.3 and 3.2 above 3.4"),
            "ES": (x["3.5"] - x["3.6"], "3.5 left of 3.6"),
            "ENS": (pupils - y["9.15"], "3.5 and 3.6 above 9.15"),
            "MNS": (y["9.15"] - y["2.2"], "9.15 above 2.2"),
            "MW": (x["8.3"] - x["8.4"], "8.3 left of 8.4"),
        }
        for unit, (distance, rule) in distances.items():
            if not (np.isfinite(distance) and distance > 0):
                raise ModelError(
                    f"FAPU: {unit}0 is {distance:g}, but must be positive: feature points {rule} "
                    "(+x is the subject's left, +y up)"
                )
        return cls(**{unit: distance / PER_DISTANCE for unit, (distance, _) in distances.items()})

    def __getitem__(self, unit: str) -> float:
        return float(getattr(self, unit))

    def of_fap(self, number: int) -> float:
        """Return the unit of a FAP by its number."""
        return self[faps()[number - 1].unit]

"""The neutral face: the 84 feature points of an adult head, in metres.

`neutral.csv` lists the left half and the midline in millimetres; the right half is its exact mirror.
The distances follow published norms of adult heads (nasion to chin 119 mm, between the outer eye
corners 91 mm, mouth 52 mm, nose 34 mm wide, head 193 mm long) and the standard's rules for a neutral
face: lids tangent to the iris, pupil a third of it, lips and teeth touching, tongue flat with its tip at
the teeth. Axes: +x the subject's left, +y up, +z forward; the origin lies between the pupils.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from fba.arrays import Float64
from fba.parameters import point_rows
from fba.text_files import packaged_rows

MIRRORED = {
    "2.4": "2.5", "2.6": "2.7", "2.8": "2.9", "2.11": "2.12", "2.13": "2.14",
    "3.1": "3.2", "3.3": "3.4", "3.5": "3.6", "3.7": "3.12", "3.9": "3.10", "3.11": "3.8", "3.13": "3.14",
    "4.1": "4.2", "4.3": "4.4", "4.5": "4.6", "5.1": "5.2", "5.3": "5.4", "6.3": "6.4",
    "8.3": "8.4", "8.5": "8.6", "8.7": "8.8", "8.10": "8.9",
    "9.1": "9.2", "9.5": "9.4", "9.7": "9.6", "9.13": "9.14",
    "10.1": "10.2", "10.3": "10.4", "10.5": "10.6", "10.7": "10.8", "10.9": "10.10", "11.3": "11.2",
}  # fmt: skip
"""Left feature point to its mirror image on the right."""
MATES = {**MIRRORED, **{right: left for left, right in MIRRORED.items()}}
"""Feature point of either side to its mirror image on the other."""
FREE_POINTS = ("7.1", "11.5")
"""Feature points that stand on no surface: inside the head, and above the skin."""


@cache
def names() -> tuple[str, ...]:
    """Return the 84 names, in the order of every array of feature points."""
    return tuple(point_rows())


@cache
def neutral_points() -> Float64:
    """Return (84, 3) float64, metres; read-only."""
    points = np.full((len(names()), 3), np.nan)
    for row in packaged_rows(__package__, "neutral.csv"):
        position = np.array([float(row[axis]) for axis in "xyz"]) / 1000.0
        points[point_rows()[row["point"]]] = position
        if row["point"] in MIRRORED:
            points[point_rows()[MIRRORED[row["point"]]]] = position * (-1.0, 1.0, 1.0)
    points.flags.writeable = False
    return points

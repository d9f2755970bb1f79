"""Places of markers: feature points of the standard, the tragions in front of the ears, the skull."""

from __future__ import annotations

import numpy as np

from fba.arrays import Float64
from fba.parameters import point_rows

SKULL = "head"
"""Place of markers anywhere on the skull, such as on a cap or a head band, which the head alone moves."""
TRAGIONS = {"l_tragion": ("10.7", "10.9"), "r_tragion": ("10.8", "10.10")}
"""In front of the ears, half-way between two points where the ear meets the face."""
RIGID = (SKULL, *TRAGIONS, "9.12", "9.6", "9.7", "11.1", "11.2", "11.3", "11.4", "11.6",
         "10.7", "10.8", "10.9", "10.10")  # fmt: skip
"""Places that the face does not move: they show the head's motion."""
MEASURED = ("2.1", "2.10", "3.1", "3.2", "3.3", "3.4", "4.1", "4.2", "4.3", "4.4", "4.5", "4.6", "5.1", "5.2",
            "5.3", "5.4", "8.1", "8.2", "8.3", "8.4", "8.5", "8.6", "8.7", "8.8", "9.1", "9.2", "9.3",
            "2.2", "2.3", "2.4", "2.5", "2.6", "2.7", "2.8", "2.9")  # fmt: skip
"""Feature points that FAPs are measured from."""
PLACED = ("2.11", "2.12", "2.13", "2.14", "3.7", "3.8", "3.9", "3.10", "3.11", "3.12", "3.13", "3.14", "8.9",
          "8.10", "9.4", "9.5", "9.13", "9.14", "9.15")  # fmt: skip
"""Other points on the skin, which show the face's size and place."""
PUPILS = ("3.5", "3.6")
"""Left and right pupil, which trackers see in pictures: they show the gaze."""
LOWER_LIDS = {"3.1": "3.3", "3.2": "3.4"}
"""Upper lid -> lower lid of the left and the right eye: the middles of their margins."""
LIDS = (*LOWER_LIDS, *LOWER_LIDS.values())
TARGETS = (*RIGID, *MEASURED, *PLACED, *PUPILS)


def target_points(points: Float64) -> dict[str, Float64]:
    """Return the position of each target but the skull on a face. points: float64 (84, 3)."""
    result = {name: points[point_rows()[name]] for name in TARGETS if name in point_rows()}
    for name, between in TRAGIONS.items():
        result[name] = np.mean([points[point_rows()[point]] for point in between], axis=0)
    return result

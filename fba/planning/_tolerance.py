"""`Tolerance`: how far what a stream shows may be from its source."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields


@dataclass(frozen=True)
class Tolerance:
    """How far a face and a body may be from where the source has them, at every frame.

    face: metres by which a vertex of the face may move, in the frame of the head. head: degrees by which each
    of the head's three angles (FAPs 48 to 50) may differ. gaze: the same of the eyes (FAPs 23 to 26).
    joint: metres by which a point 3 cm from a joint may move. foot: metres by which a foot may move while it
    stands on the ground.

    ValueError for what is not a positive, finite number.
    """

    face: float = 0.0005
    head: float = 0.1
    gaze: float = 1.0
    joint: float = 0.01
    foot: float = 0.005

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not (value > 0 and math.isfinite(value)):
                raise ValueError(f"a tolerance is a positive number; {field.name} is {value!r}")

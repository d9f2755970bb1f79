"""Poses in which a body is shown: as its BAPs say, but with hands outside the body and fingers at ease.

For display only: no stream is changed.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property

import numpy as np

from fba.arrays import Bool, Float64
from fba.body import SIDES, BodyModel, GroundedPoser
from fba.body.contact import Contact, find_contact
from fba.choices import Axes
from fba.parameters import baps
from fba.sampling import smoothstep
from fba_player.view.switches import Value

AT_EASE = {
    "index1_flexion": -16, "index2_flexion": -22, "index3_flexion": -12, "index1_pivot": -1,
    "middle1_flexion": -21, "middle2_flexion": -26, "middle3_flexion": -14,
    "ring1_flexion": -25, "ring2_flexion": -29, "ring3_flexion": -16, "ring1_pivot": 1,
    "pinky1_flexion": -28, "pinky2_flexion": -30, "pinky3_flexion": -16, "pinky1_pivot": 3,
    "thumb1_pivot": 36, "thumb2_flexion": -12, "thumb3_flexion": -14,
}  # fmt: skip
"""Degrees of the BAPs of a left hand at ease, by name; `pivot` opens a right hand the other way."""
SAID = 0.15
"""Radians of a finger above which all of its group in `FINGERS` are shown as sent."""
FINGERS = (("index", "middle", "ring", "pinky"), ("thumb",))
"""Those that are at ease together: programs that bend fingers often leave out the thumb."""


class FigurePoser:
    """Poses one body for display. axes: see `BapSolver`.

    `plain` poses it as the BAPs say.
    """

    def __init__(self, body: BodyModel, axes: Axes) -> None:
        self.plain = GroundedPoser(body.skeleton, axes)
        self._body = body

    @cached_property
    def contact(self) -> Contact | None:
        """What keeps hands outside the body; None for one without hands."""
        return find_contact(self._body)

    @cached_property
    def _hands(self) -> list[tuple[Bool, Float64]]:
        """For the fingers and the thumb of each hand, bool (296,), which BAPs are theirs, and float64 (296,),
        these at ease."""
        hands = []
        for side in SIDES:
            names = [bap.name.removeprefix(f"{side}_") if bap.name[0] == side else "" for bap in baps()]
            degrees = np.array([AT_EASE.get(name, 0) for name in names], dtype=np.float64)
            if side == "r":
                degrees[[name.endswith("_pivot") for name in names]] *= -1
            for fingers in FINGERS:
                own = np.array([name.startswith(fingers) for name in names])
                hands.append((own, np.where(own, np.radians(degrees) * 1e5, 0.0)))
        return hands

    def pose(self, values: Float64, switches: Mapping[str, Value]) -> Float64:
        """Return joint matrices (J, 4, 4) for BAPs (296,), with what the switches ask for."""
        if switches["relaxed"]:
            values = values.astype(np.float64)
            for own, at_ease in self._hands:
                said = float(np.abs(values[own]).max()) * 1e-5 / SAID
                values += at_ease * (1.0 - float(smoothstep(np.array(said))))
        matrices = self.plain.pose(values)
        if switches["contact"] and self.contact is not None:
            self.contact.keep_apart(matrices)
        return matrices

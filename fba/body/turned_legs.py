"""Legs that turn the other way: of files whose makers counted hips and knees as the convention `vreng` does.

By the standard, a knee bends by negative flexion. In such a file it bends by positive flexion, and is shown
bent forward.
"""

from __future__ import annotations

import numpy as np

from fba.body.solve.conventions import convention
from fba.body.solve.limits import DEGREES, FULL_TURN
from fba.choices import Axes
from fba.parameters import BAP_COUNT, bap_numbers
from fba.tracks import BodyTrack, batches

BENT = 20.0
"""Degrees from which a knee counts as bent. Captures stretch knees by up to 15 degrees; of 252 bodies in
captures, streams and vectors, only an old file whose legs turn the other way bends them forward by more."""


def find_turned_legs(body: BodyTrack) -> str | None:
    """Return in words that knees bend forward, in more frames than backward; None if they do not."""
    knees = [bap_numbers()[f"{side}_knee_flexion"] - 1 for side in "lr"]
    forward, backward, most = 0, 0, 0.0
    for batch in batches(body):
        angles = batch.values[:, knees] * DEGREES
        angles -= FULL_TURN * np.rint(angles / FULL_TURN)
        forward += int((angles > BENT).any(axis=1).sum())
        backward += int((angles < -BENT).any(axis=1).sum())
        most = max(most, float(angles.max(initial=0.0)))
    if forward <= backward:
        return None
    return (
        f"knees bend forward in {forward} of {len(body)} frames, by up to {most:.0f} degrees: an old file, "
        "whose legs turn the other way?"
    )


def by_the_standard(body: BodyTrack, axes: Axes) -> BodyTrack:
    """Return a body whose BAPs turn by a convention with those of the standard; the same poses.

    Raises ValueError for a convention that differs in more than signs.
    """
    given, wanted = convention(axes), convention()
    if not (np.array_equal(given.bap, wanted.bap) and np.array_equal(given.axis, wanted.axis)):
        raise ValueError(f"the axes {axes!r} differ from the standard's in more than signs")
    signs = np.ones(BAP_COUNT + 1, dtype=np.int32)  # the last is for rotations without a BAP, -1
    signs[given.bap] = given.sign * wanted.sign
    return BodyTrack(body.values * signs[:-1], body.mask)

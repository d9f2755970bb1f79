"""The mouth in speech: every sound has a shape, and sounds close in time blend into each other."""

from __future__ import annotations

import numpy as np

from performance.curves import Float, moments, rows, smooth

PARTS = ("jaw", "top", "bottom", "width", "push", "tip", "tongue")
"""How far the jaw opens, the top lip rises, the bottom lip falls, the corners spread, the lips come forward,
the tip and the body of the tongue rise: in the units of the FAPs that they move."""
REST = "rest"
AHEAD, BEHIND = 0.075, 0.095
"""Seconds by which a sound shows before it begins and after it ends."""


def speech() -> tuple[dict[str, Float], Float]:
    """Each of PARTS over time, (T,), and how much of the mouth speech takes hold of, 0..1.

    A sound pulls with the strength of its stress and of `hold`: lips that must meet, meet.
    """
    time = moments()
    shapes = {row["sound"]: row for row in rows("mouth_shapes.csv")}
    weight = np.full(len(time), float(shapes[REST]["hold"]))
    totals = {part: np.zeros(len(time)) for part in PARTS}
    for row in rows("speech.csv"):
        shape = shapes[row["sound"]]
        start, length = float(row["time"]), float(row["length"])
        distance = np.maximum((start - time) / AHEAD, (time - start - length) / BEHIND)
        pull = float(shape["hold"]) * np.exp(-(np.maximum(distance, 0.0) ** 2) * 2.2)
        # a sound's own stretch is strongest in its middle
        pull *= 1.0 + np.exp(-(((time - start - length / 2) / (0.35 * length + 0.02)) ** 2))
        weight += pull
        for part in PARTS:
            totals[part] += pull * float(shape[part]) * float(row["stress"])
    held = 1.0 - float(shapes[REST]["hold"]) / weight
    return {part: smooth(total / weight, 0.012) for part, total in totals.items()}, smooth(held, 0.02)

"""The mouth in speech: every sound has a shape, and neighbouring sounds blend."""

from __future__ import annotations

import numpy as np

from performance.curves import Float, read_table, sample_times, smooth

PARTS = ("jaw", "top", "bottom", "width", "push", "tip", "tongue")
"""Opening of the jaw, rise of the top lip, fall of the bottom lip, spread of the corners, protrusion of the
lips, rise of the tongue's tip and body: in the units of their FAPs."""
REST = "rest"
AHEAD, BEHIND = 0.075, 0.095
"""Seconds by which a sound is visible before it begins and after it ends."""


def speech() -> tuple[dict[str, Float], Float]:
    """(curves (T,) by PARTS, share (T,) of the mouth that speech controls, 0..1).

    A sound is weighted by `hold`, so that lips that must meet do meet, and scaled by its stress.
    """
    time = sample_times()
    shapes = {row["sound"]: row for row in read_table("mouth_shapes.csv")}
    weight = np.full(len(time), float(shapes[REST]["hold"]))
    totals = {part: np.zeros(len(time)) for part in PARTS}
    for row in read_table("speech.csv"):
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

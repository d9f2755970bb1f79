"""`ShapeMotion`: weights of blendshapes over time, from a capture of any format."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from fba.arrays import Bool, Float64
from fba.capture.sampling import find_gaps
from fba.errors import ModelError


@dataclass(frozen=True, eq=False)
class ShapeMotion:
    """A captured face: weights of shapes, and how head and eyes turn, at the source's own times.

    names: N names of shapes; ARKit's where a shape is one of its 52. weights: float64 (T, N), 0 to 1; NaN in
    rows without a face. times: float64 (T,), seconds from the first row on, increasing. rate: frames per
    second that the source counts in. Left and right are the performer's.

    head: float64 (T, 3), radians, as FAPs 48 to 50 count them: pitch (down), yaw (left), roll (right); None
    where the source has none. eyes: float64 (T, 4), radians, as FAPs 23 to 26: yaw of the left and the right
    eye (left), then their pitch (down); None likewise. start: time of day of the first row, in seconds; None
    where unknown. findings: what a reader repaired or found odd, a sentence each.

    Raises ModelError if the parts contradict each other.
    """

    names: tuple[str, ...]
    weights: Float64
    times: Float64
    rate: Fraction
    head: Float64 | None = None
    eyes: Float64 | None = None
    start: float | None = None
    name: str = ""
    findings: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "rate", Fraction(self.rate))
        count = len(self.times)
        for what, shape in (
            ("weights", (count, len(self.names))),
            ("times", (count,)),
            ("head", (count, 3)),
            ("eyes", (count, 4)),
        ):
            value = getattr(self, what)
            if value is None:
                continue
            array = np.array(value, dtype=np.float64)
            if array.shape != shape:
                raise ModelError(f"ShapeMotion: {what} has shape {array.shape}, not {shape}")
            if np.isinf(array).any():
                raise ModelError(f"ShapeMotion: {what} must be finite, or NaN where no face was seen")
            array.flags.writeable = False
            object.__setattr__(self, what, array)
        if self.rate <= 0:
            raise ModelError(f"ShapeMotion: the rate must be positive, not {self.rate}")
        if count and not (np.isfinite(self.times).all() and (np.diff(self.times) > 0).all()):
            raise ModelError("ShapeMotion: times must be finite, and each later than the one before")
        if len(set(self.names)) != len(self.names):
            raise ModelError("ShapeMotion: a name occurs twice")

    def __len__(self) -> int:
        return len(self.times)

    @property
    def seen(self) -> Bool:
        """Rows (T,) in which a face was seen: all numbers are there."""
        numbers = [one for one in (self.weights, self.head, self.eyes) if one is not None]
        rows: Bool = np.isnan(np.concatenate(numbers, axis=1)).sum(axis=1) == 0
        return rows

    def describe(self) -> dict[str, Any]:
        """Return what is in the capture, for `fba info`: plain numbers, texts and lists of them."""
        seen = self.seen
        gaps = find_gaps(self.times[seen], self.rate)
        angles = {"head": self.head, "eyes": self.eyes}
        return {
            "kind": "blendshapes",
            "rows": len(self),
            "unseen": int((~seen).sum()),
            "seconds": round(float(self.times[-1] - self.times[0]), 6) if len(self) else 0.0,
            "rate": str(self.rate),
            "start": self.start,
            "shapes": list(self.names),
            "still": [name for name, rows in zip(self.names, self.weights[seen].T, strict=True)
                      if not (rows != rows[:1]).any()],
            "angles": {
                what: value is not None and bool(np.nanmax(np.abs(value), initial=0.0) > 0)
                for what, value in angles.items()
            },
            "gaps": [[round(start, 3), round(length, 3)] for start, length in gaps],
            "findings": list(self.findings),
        }  # fmt: skip

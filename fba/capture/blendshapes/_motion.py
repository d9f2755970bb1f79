"""`ShapeMotion`: weights of blendshapes over time, from a capture of any format."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from fba.arrays import Bool, Float64
from fba.capture.blendshapes._rows import describe_rows, find_seen, freeze_rows
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
        freeze_rows(self, {"weights": len(self.names)})
        if len(set(self.names)) != len(self.names):
            raise ModelError("ShapeMotion: a name occurs twice")

    def __len__(self) -> int:
        return len(self.times)

    @property
    def seen(self) -> Bool:
        """Rows (T,) in which a face was seen: all numbers are there."""
        return find_seen(self, self.weights)

    def describe(self) -> dict[str, Any]:
        """Return what is in the capture, for `fba info`: plain numbers, texts and lists of them."""
        return describe_rows(self, "blendshapes", self.names, self.weights)

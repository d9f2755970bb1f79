"""`ActionUnitMotion`: intensities of action units over time, from a tracker of any kind."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from fba.arrays import Float64
from fba.capture.blendshapes.motion import ShapeMotion
from fba.errors import ModelError


@dataclass(frozen=True, eq=False)
class ActionUnitMotion:
    """A captured face: intensities of action units (FACS), turns of head and eyes, at the source's times.

    units: N numbers of action units. intensities: float64 (T, N), 0 to 1, the strongest; NaN in rows without
    a face. times, rate, head, eyes, name, findings: as in `fba.capture.ShapeMotion`. Immutable.

    Raises ModelError if the parts contradict each other.
    """

    units: tuple[int, ...]
    intensities: Float64
    times: Float64
    rate: Fraction
    head: Float64 | None = None
    eyes: Float64 | None = None
    name: str = ""
    findings: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        try:
            checked = self._as_shapes()
        except ModelError as error:
            raise ModelError(error.finding.replace("ShapeMotion", "ActionUnitMotion")) from error
        for ours, theirs in (
            ("intensities", "weights"), ("times", "times"), ("rate", "rate"), ("head", "head"),
            ("eyes", "eyes"),
        ):  # fmt: skip
            object.__setattr__(self, ours, getattr(checked, theirs))

    def __len__(self) -> int:
        return len(self.times)

    def describe(self) -> dict[str, Any]:
        """Return what is in the capture, for `fba info`: plain numbers, texts and lists of them."""
        return {**self._as_shapes().describe(), "kind": "action units"}

    def _as_shapes(self) -> ShapeMotion:
        """Return the same with units as names of shapes, which has the same checks."""
        return ShapeMotion(
            tuple(f"AU{unit:02}" for unit in self.units), self.intensities, self.times, self.rate,
            head=self.head, eyes=self.eyes, name=self.name, findings=self.findings,
        )  # fmt: skip

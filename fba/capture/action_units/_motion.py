"""`ActionUnitMotion`: intensities of action units over time, from a tracker of any kind."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from fba.arrays import Float64
from fba.capture.blendshapes._rows import describe_rows, freeze_rows
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
        freeze_rows(self, {"intensities": len(self.units)})
        if len(set(self.units)) != len(self.units):
            raise ModelError("ActionUnitMotion: a unit occurs twice")

    def __len__(self) -> int:
        return len(self.times)

    @property
    def start(self) -> None:
        """No tracker of action units says at what time of day a film was made."""
        return None

    def describe(self) -> dict[str, Any]:
        """Return what is in the capture, for `fba info`: plain numbers, texts and lists of them."""
        names = [f"AU{unit:02}" for unit in self.units]
        return describe_rows(self, "action units", names, self.intensities)

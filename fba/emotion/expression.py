"""A named expression: its family, its FAPs at full intensity, its place on the plane of emotions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.arrays import Float32
from fba.parameters import EXPRESSIONS, FAP_COUNT

FAMILIES = EXPRESSIONS[1:]
"""Names of the six families, which are those of FAP 2: joy, sadness, anger, fear, disgust, surprise."""
NEUTRAL_POINT = (4.0, 4.0)
"""Activation and evaluation of a face that shows nothing: the middle of Whissel's scales, 1 to 7."""


@dataclass(frozen=True, eq=False)
class Expression:
    """An expression that has a name.

    name: such as "fear". family: one of `FAMILIES`, "" for one that belongs to none. about: what is seen, in
    a few words. faps: float32 (68,), at full intensity; columns 0 and 1 are zero. activation, evaluation:
    Whissel's, None where they are not known. select: of FAP 2, 0 if FAP 2 cannot show it. aliases: other
    names. recipe: intensities of the expressions that it is made from by the rules; empty if it is drawn
    by hand.
    """

    name: str
    family: str
    about: str
    faps: Float32
    activation: float | None = None
    evaluation: float | None = None
    select: int = 0
    aliases: tuple[str, ...] = ()
    recipe: tuple[tuple[str, float], ...] = ()

    def __post_init__(self) -> None:
        values = np.array(self.faps, dtype=np.float32)
        if values.shape != (FAP_COUNT,) or not np.isfinite(values).all():
            raise ValueError(f"the FAPs of {self.name!r} must be {FAP_COUNT} finite numbers")
        if self.family and self.family not in FAMILIES:
            raise ValueError(f"{self.name!r}: {self.family!r} is not one of {', '.join(FAMILIES)}")
        values[:2] = 0
        values.flags.writeable = False
        object.__setattr__(self, "faps", values)

    @property
    def point(self) -> tuple[float, float] | None:
        """Activation and evaluation; None where they are not known."""
        if self.activation is None or self.evaluation is None:
            return None
        return self.activation, self.evaluation

    def __repr__(self) -> str:
        return f"Expression({self.name!r}, family={self.family!r})"

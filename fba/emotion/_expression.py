"""A named expression: its family, its FAPs at full intensity, its point on the plane of emotions.

`whissel.csv` has Whissel's activation and evaluation of words, Table 8-1 of the source (docs/emotion.md).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from fba.arrays import Float32
from fba.parameters import EXPRESSIONS, FAP_COUNT
from fba.text_files import packaged_rows

FAMILIES = EXPRESSIONS[1:]
"""Names of the six families, which FAP 2 can show: joy, sadness, anger, fear, disgust, surprise."""
NEUTRAL_POINT = (4.0, 4.0)
"""Activation and evaluation of a neutral face: the middle of Whissel's scales, 1 to 7."""


@dataclass(frozen=True, eq=False)
class Expression:
    """A named expression.

    name: such as "fear". family: one of `FAMILIES`, or "". about: a description in a few words. faps: float32
    (68,), at full intensity; columns 0 and 1 are zero. activation, evaluation: Whissel's, or None. select:
    of FAP 2, 0 if FAP 2 cannot show it. aliases: other names. recipe: intensities of the expressions from
    which it is mixed by the rules; empty if it is drawn by hand.
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
        """Activation and evaluation, or None."""
        if self.activation is None or self.evaluation is None:
            return None
        return self.activation, self.evaluation

    def __repr__(self) -> str:
        return f"Expression({self.name!r}, family={self.family!r})"


@cache
def whissel_points() -> dict[str, tuple[float, float]]:
    """Return (activation, evaluation) of each word in `whissel.csv`."""
    rows = packaged_rows(__package__, "whissel.csv")
    return {row["word"]: (float(row["activation"]), float(row["evaluation"])) for row in rows}

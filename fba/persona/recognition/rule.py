"""Outputs of a network to classes: unknown, one class, or one and a second (section 4.2.2 of the source)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.arrays import Float64, Intp

LEAST = 0.1
"""l1: the largest output below which an expression is unknown; outputs go from -1 to 1."""
SECOND = 0.6
"""l2: the share of the largest output above which the second one counts, too."""
NONE = -1


@dataclass(frozen=True, eq=False)
class Labels:
    """Classes of frames, as positions in a list of them. first, second: int (T,), -1 for none."""

    first: Intp
    second: Intp

    def __len__(self) -> int:
        return len(self.first)

    def names(self, classes: tuple[str, ...]) -> list[str]:
        """Return a name for each frame: "" for unknown, "LFAU_12", or "LFAU_26/LFAU_12", the principal
        first."""
        return [
            "" if one == NONE else classes[one] if other == NONE else f"{classes[one]}/{classes[other]}"
            for one, other in zip(self.first.tolist(), self.second.tolist(), strict=True)
        ]


def decide(outputs: Float64, *, least: float = LEAST, second: float = SECOND) -> Labels:
    """Return the classes that outputs (T, C) say."""
    order = np.argsort(outputs, axis=1)
    rows = np.arange(len(outputs))
    one = order[:, -1]
    largest = outputs[rows, one]
    other = order[:, -2] if outputs.shape[1] > 1 else np.full(len(outputs), NONE)
    known = largest >= least
    both = known & (outputs[rows, other] > second * largest)
    return Labels(np.where(known, one, NONE), np.where(both, other, NONE))

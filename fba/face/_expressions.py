"""Definitions of the 14 visemes and the 6 expressions: their FAPs at full intensity.

`definitions.csv` lists them for the left half and the midline; the right half and the outer lips copy
their mates. Expressions follow measured vocabularies of the six universal emotions (the mean of each FAP
that one moves, with the standard's signs); FAPs that those leave open are set by eye.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from fba.arrays import Float32
from fba.parameters import EXPRESSION_SELECT_MAX, FAP_COUNT, VISEME_SELECT_MAX, fap_numbers, fill_from_mates
from fba.text_files import packaged_rows

VISEME_NAMES = (
    "none",
    "p b m",
    "f v",
    "T D",
    "t d",
    "k g",
    "tS dZ S",
    "s z",
    "n l",
    "r",
    "A:",
    "e",
    "I",
    "Q",
    "U",
)
"""Example phonemes by viseme_select."""
EXPRESSION_NAMES = ("none", "joy", "sadness", "anger", "fear", "disgust", "surprise")
"""Names of expressions by expression_select."""


@dataclass(frozen=True, eq=False)
class Definitions:
    """FAPs of every viseme and expression at full intensity.

    visemes: float32 (15, 68); expressions: float32 (7, 68). Row = select, row 0 (none) all zero;
    columns 0 and 1 are zero. Raises ValueError on other shapes.
    """

    visemes: Float32
    expressions: Float32

    def __post_init__(self) -> None:
        for name, count in (("visemes", VISEME_SELECT_MAX + 1), ("expressions", EXPRESSION_SELECT_MAX + 1)):
            table = np.array(getattr(self, name), dtype=np.float32)
            if table.shape != (count, FAP_COUNT):
                raise ValueError(f"{name} must have shape ({count}, {FAP_COUNT}), not {table.shape}")
            if not np.isfinite(table).all():
                raise ValueError(f"{name} must be finite")
            table[0] = 0
            table[:, :2] = 0
            table.flags.writeable = False
            object.__setattr__(self, name, table)

    @staticmethod
    def default() -> Definitions:
        """Return the built-in definitions."""
        return _default()


@cache
def _default() -> Definitions:
    tables = {
        "viseme": np.zeros((VISEME_SELECT_MAX + 1, FAP_COUNT), dtype=np.float32),
        "expression": np.zeros((EXPRESSION_SELECT_MAX + 1, FAP_COUNT), dtype=np.float32),
    }
    listed = {kind: np.zeros(table.shape, dtype=bool) for kind, table in tables.items()}
    for row in packaged_rows(__package__, "definitions.csv"):
        entry = (int(row["select"]), fap_numbers()[row["fap"]] - 1)
        tables[row["kind"]][entry] = float(row["value"])
        listed[row["kind"]][entry] = True
    filled = {kind: fill_from_mates(table, listed[kind])[0] for kind, table in tables.items()}
    return Definitions(filled["viseme"].astype(np.float32), filled["expression"].astype(np.float32))

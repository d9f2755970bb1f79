"""Activation and evaluation of words by Whissel: `whissel.csv`, Table 8-1 of the source (docs/emotion.md)."""

from __future__ import annotations

import csv
from functools import cache
from importlib.resources import files


@cache
def whissel_points() -> dict[str, tuple[float, float]]:
    """Return (activation, evaluation) of each word of the table."""
    with (files(__package__) / "whissel.csv").open(encoding="utf-8") as file:
        return {
            row["word"]: (float(row["activation"]), float(row["evaluation"])) for row in csv.DictReader(file)
        }


def family_point(family: str) -> tuple[float, float]:
    """Return (activation, evaluation) of one of the six families."""
    return whissel_points()[family]

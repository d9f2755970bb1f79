"""Checks that the sizes of a face are human. `human.csv` lists the limits, in millimetres.

They reach from children of three to the biggest adults: published norms of both, four standard deviations
beyond the outermost mean, rounded outwards.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import numpy as np

from fba.arrays import Float64
from fba.face.checks._findings import Finding
from fba.face.checks._locations import AXES
from fba.face.feature_points import row_of


@dataclass(frozen=True, slots=True)
class Size:
    """A distance along one axis between two feature points, and its limits in mm."""

    measure: str
    first: str
    second: str
    axis: str
    low: float
    high: float
    what: str


@cache
def human_sizes() -> tuple[Size, ...]:
    """Every size of the table."""
    with (files(__package__) / "human.csv").open(encoding="utf-8") as file:
        return tuple(
            Size(
                row["measure"],
                row["first"],
                row["second"],
                row["axis"],
                float(row["low"]),
                float(row["high"]),
                row["what"],
            )
            for row in csv.DictReader(file)
        )


def check_sizes(points: Float64) -> Iterator[Finding]:
    """Yields a finding per size outside its limits. points: (84, 3), metres, NaN where unknown."""
    for size in human_sizes():
        ends = points[[row_of()[size.first], row_of()[size.second]], AXES[size.axis]]
        found = abs(float(ends[0] - ends[1])) * 1000
        if np.isfinite(found) and not size.low <= found <= size.high:
            yield Finding(
                size.measure,
                "size of a human face",
                f"{found:.1f} mm ({size.first} to {size.second}: {size.what})",
                f"{size.low:g} to {size.high:g} mm",
                "warning",
            )

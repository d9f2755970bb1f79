"""Checks the positions of feature points on a neutral face, by the standard's rules and by anatomy.

`locations.csv` lists them for the left half and the midline; the right half mirrors them. share is the
slack, as a share of the distance between the pupils.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Literal

import numpy as np

from fba.arrays import Float64
from fba.face.checks._findings import Finding
from fba.face.feature_points import MIRRORED, row_of

AXES = {"x": 0, "y": 1, "z": 2}
_DIRECTIONS = {"x": ("left of", "right of"), "y": ("above", "below"), "z": ("before", "behind")}


@dataclass(frozen=True, slots=True)
class Rule:
    """One line of the table. sign: -1 where it was mirrored in x."""

    point: str
    axis: str
    rule: str
    first: str
    second: str
    share: float
    severity: Literal["error", "warning"]
    sign: float = 1.0

    def violation(self, points: Float64, unit: float) -> tuple[str, str] | None:
        """(found, expected) where points (84, 3) break the rule; None where they keep it or are unknown."""
        others = [name for name in (self.first, self.second) if name]
        column = AXES[self.axis]
        value, *limits = (float(points[row_of()[name], column]) for name in (self.point, *others))
        if not np.isfinite([value, *limits]).all():
            return None
        slack, sign = self.share * unit, self.sign
        named = [f"{name}.{self.axis}" for name in others]
        if self.rule == "midway":
            wanted = sum(limits) / 2
            broken = abs(value - wanted) > slack
            text = f"midway between {named[0]} and {named[1]}: {_mm(wanted)} +- {_mm(slack)}"
        elif self.rule == "between":
            broken = not min(limits) - slack <= value <= max(limits) + slack
            text = f"between {named[0]} {_mm(limits[0])} and {named[1]} {_mm(limits[1])}"
        elif self.rule == "level":
            broken = abs(value - limits[0]) > slack
            text = f"{named[0]}: {_mm(limits[0])} +- {_mm(slack)}"
        else:
            broken = sign * (value - limits[0]) <= -slack
            word = _DIRECTIONS[self.axis][0 if sign > 0 else 1]
            text = f"{word} {others[0]}, {named[0]} {_mm(limits[0])}"
        return (f"{self.axis} {_mm(value)}", text) if broken else None


@cache
def rules() -> tuple[Rule, ...]:
    """Every rule of the table, and the mirror image of those for one side."""
    found = []
    with (files(__package__) / "locations.csv").open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            severity: Literal["error", "warning"] = "error" if row["severity"] == "error" else "warning"
            names = [row["point"], row["first"], row["second"]]
            mirrored = [MIRRORED.get(name, name) for name in names]
            for (point, first, second), sign in ((names, 1.0), (mirrored, -1.0)):
                if sign > 0 or mirrored != names:
                    side = sign if row["axis"] == "x" else 1.0
                    rule = row["rule"]
                    found.append(
                        Rule(point, row["axis"], rule, first, second, float(row["share"]), severity, side)
                    )
    return tuple(found)


def check_locations(points: Float64) -> Iterator[Finding]:
    """Yields a finding per broken rule, for feature points (84, 3) in metres, NaN where unknown."""
    unit = float(points[row_of()["3.5"], 0] - points[row_of()["3.6"], 0])
    for left, right in MIRRORED.items():
        pair = points[[row_of()[left], row_of()[right]], 0]
        if np.isfinite(pair).all() and pair[0] <= pair[1]:
            yield Finding(
                f"{left} and {right}",
                "left and right",
                f"x {_mm(pair[0])} and {_mm(pair[1])}",
                f"{left} on the subject's left: x greater than that of {right}",
                "error",
            )
    for rule in rules():
        broken = rule.violation(points, unit)
        if broken is not None:
            yield Finding(f"feature point {rule.point}", f"location: {rule.rule}", *broken, rule.severity)


def _mm(metres: float) -> str:
    return f"{metres * 1000:.1f} mm"

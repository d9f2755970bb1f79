"""Checks the positions of feature points on a neutral face, and the distances between them.

`locations.csv` lists rules of the standard and of anatomy for the left half and the midline; the right half
mirrors them. share is the slack, as a share of the distance between the pupils. `human.csv` lists limits of
sizes in millimetres, from children of three to the biggest adults: published norms of both, four standard
deviations beyond the outermost mean, rounded outwards.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import Literal

import numpy as np

from fba.arrays import Float64
from fba.face.checks._findings import Finding
from fba.face.feature_points import MIRRORED
from fba.parameters import point_rows
from fba.text_files import packaged_rows

AXES = {"x": 0, "y": 1, "z": 2}
_DIRECTIONS = {"x": ("left of", "right of"), "y": ("above", "below"), "z": ("before", "behind")}


@dataclass(frozen=True, slots=True)
class Rule:
    """One line of `locations.csv`. sign: -1 where it was mirrored in x."""

    point: str
    axis: str
    rule: str
    first: str
    second: str
    share: float
    severity: Literal["error", "warning"]
    sign: float = 1.0

    def violation(self, points: Float64, unit: float) -> tuple[str, str] | None:
        """Return the texts (found, expected) where points (84, 3) break the rule; None if not, or unknown."""
        others = [name for name in (self.first, self.second) if name]
        column = AXES[self.axis]
        value, *limits = (float(points[point_rows()[name], column]) for name in (self.point, *others))
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
    """Return every rule of `locations.csv`, and the mirror image of those for one side."""
    result = []
    for row in packaged_rows(__package__, "locations.csv"):
        severity: Literal["error", "warning"] = "error" if row["severity"] == "error" else "warning"
        names = [row["point"], row["first"], row["second"]]
        mirrored = [MIRRORED.get(name, name) for name in names]
        share = float(row["share"])
        for (point, first, second), sign in ((names, 1.0), (mirrored, -1.0)):
            if sign > 0 or mirrored != names:
                side = sign if row["axis"] == "x" else 1.0
                result.append(Rule(point, row["axis"], row["rule"], first, second, share, severity, side))
    return tuple(result)


def check_locations(points: Float64) -> Iterator[Finding]:
    """Yield a finding per broken rule, for feature points (84, 3) in metres, NaN where unknown."""
    unit = float(points[point_rows()["3.5"], 0] - points[point_rows()["3.6"], 0])
    for left, right in MIRRORED.items():
        pair = points[[point_rows()[left], point_rows()[right]], 0]
        if np.isfinite(pair).all() and pair[0] <= pair[1]:
            found = f"x {_mm(pair[0])} and {_mm(pair[1])}"
            expected = f"{left} on the subject's left: x greater than that of {right}"
            yield Finding(f"{left} and {right}", "left and right", found, expected, "error")
    for rule in rules():
        broken = rule.violation(points, unit)
        if broken is not None:
            yield Finding(f"feature point {rule.point}", f"location: {rule.rule}", *broken, rule.severity)


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
    """Return every size of `human.csv`."""
    rows = packaged_rows(__package__, "human.csv")
    return tuple(Size(low=float(row.pop("low")), high=float(row.pop("high")), **row) for row in rows)


def check_sizes(points: Float64) -> Iterator[Finding]:
    """Yield a finding per size outside its limits. points: (84, 3), metres, NaN where unknown."""
    for size in human_sizes():
        ends = points[[point_rows()[size.first], point_rows()[size.second]], AXES[size.axis]]
        millimetres = abs(float(ends[0] - ends[1])) * 1000
        if np.isfinite(millimetres) and not size.low <= millimetres <= size.high:
            found = f"{millimetres:.1f} mm ({size.first} to {size.second}: {size.what})"
            expected = f"{size.low:g} to {size.high:g} mm"
            yield Finding(size.measure, "size of a human face", found, expected, "warning")


def _mm(metres: float) -> str:
    return f"{metres * 1000:.1f} mm"

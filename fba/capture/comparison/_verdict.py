"""What is good, fair or poor: the bounds of every measure, and the parts that differ most."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

GRADES = ("good", "fair", "poor")


@dataclass(frozen=True)
class Bounds:
    """A row of thresholds.csv.

    hold: seconds for which a difference must last to count. fair, poor: thresholds of these verdicts.
    says: what the measure is about. phrase: the end of a sentence about a part, {} for the number.
    """

    measure: str
    unit: str
    hold: float
    fair: float
    poor: float
    says: str
    phrase: str


@cache
def bounds() -> dict[str, Bounds]:
    """Return the bounds by measure."""
    text = (files(__package__) / "thresholds.csv").read_text(encoding="utf-8")
    result = {}
    for row in csv.DictReader(text.splitlines()):
        hold, fair, poor = (float(row[name]) for name in ("hold", "fair", "poor"))
        name = row["measure"]
        result[name] = Bounds(name, row["unit"], hold, fair, poor, row["says"], row["phrase"])
    return result


@dataclass(frozen=True)
class Difference:
    """How far a part of the result differs from the source.

    measure: one of `bounds`. part: "left hand". typical: median over all frames. worst: largest difference
    that lasts as long as the bounds say. frame: where that is.
    """

    measure: str
    part: str
    typical: float
    worst: float
    frame: int

    @property
    def grade(self) -> str:
        """`good`, `fair` or `poor`."""
        limit = bounds()[self.measure]
        return GRADES[(self.worst >= limit.fair) + (self.worst >= limit.poor)]

    @property
    def sentence(self) -> str:
        """Such as "left hand points 40 degrees off"."""
        return f"{self.part} {bounds()[self.measure].phrase.format(f'{self.worst:.0f}')}"

    @property
    def severity(self) -> float:
        """The worst as a multiple of what is poor."""
        return self.worst / bounds()[self.measure].poor


@dataclass(frozen=True)
class Comparison:
    """A captured motion beside the person that a decoder shows.

    frames: how many were compared. differences: those that matter most first.
    """

    frames: int
    differences: tuple[Difference, ...]

    @property
    def verdict(self) -> str:
        """`good`, `fair` or `poor`: that of the worst difference."""
        return GRADES[max((GRADES.index(one.grade) for one in self.differences), default=0)]

    @property
    def reasons(self) -> tuple[Difference, ...]:
        """Differences that are as bad as the verdict; none if it is good."""
        grade = self.verdict
        return tuple(one for one in self.differences if one.grade == grade) if grade != GRADES[0] else ()

    def with_more(self, more: tuple[Difference, ...]) -> Comparison:
        """Return the comparison with other differences among its own."""
        return Comparison(self.frames, in_order((*self.differences, *more)))

    def worst_frames(self, count: int, apart: int) -> tuple[Difference, ...]:
        """Return at most `count` differences, the worst first, of parts and frames that lie apart."""
        chosen: list[Difference] = []
        for one in self.differences:
            if all(abs(one.frame - other.frame) >= apart and one.part != other.part for other in chosen):
                chosen.append(one)
            if len(chosen) == count:
                break
        return tuple(chosen)


def in_order(differences: tuple[Difference, ...]) -> tuple[Difference, ...]:
    """Return differences, those that matter most first."""
    return tuple(sorted(differences, key=lambda one: (-one.severity, one.measure, one.part)))

"""Verdicts good, fair and poor: the bounds of every measure, and the parts that differ most."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

from fba.text_files import packaged_rows

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
    result = {}
    for row in packaged_rows(__package__, "thresholds.csv"):
        hold, fair, poor = (float(row[name]) for name in ("hold", "fair", "poor"))
        name = row["measure"]
        result[name] = Bounds(name, row["unit"], hold, fair, poor, row["says"], row["phrase"])
    return result


@dataclass(frozen=True)
class Difference:
    """How far a part of the result differs from the source.

    measure: a key of `bounds`. part: "left hand". typical: median over all frames. worst: largest difference
    that lasts as long as the bounds say. frame: where the worst is.
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

    frames: number of compared frames. differences: the most severe first.
    """

    frames: int
    differences: tuple[Difference, ...]

    @property
    def verdict(self) -> str:
        """`good`, `fair` or `poor`: that of the worst difference."""
        return max((each.grade for each in self.differences), key=GRADES.index, default=GRADES[0])

    @property
    def reasons(self) -> tuple[Difference, ...]:
        """Differences that are as bad as the verdict; none if it is good."""
        grade = self.verdict
        return tuple(each for each in self.differences if each.grade == grade != GRADES[0])

    def with_more(self, more: tuple[Difference, ...]) -> Comparison:
        """Return the comparison with more differences."""
        return Comparison(self.frames, in_order((*self.differences, *more)))

    def worst_frames(self, count: int, apart: int) -> tuple[Difference, ...]:
        """Return at most `count` differences, the worst first, of different parts and distant frames."""
        chosen: list[Difference] = []
        for each in self.differences:
            if all(abs(each.frame - other.frame) >= apart and each.part != other.part for other in chosen):
                chosen.append(each)
            if len(chosen) == count:
                break
        return tuple(chosen)


def in_order(differences: tuple[Difference, ...]) -> tuple[Difference, ...]:
    """Return differences, the most severe first."""
    return tuple(sorted(differences, key=lambda each: (-each.severity, each.measure, each.part)))

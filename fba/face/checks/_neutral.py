"""Checks that a model's rest position is the standard's neutral face.

Gaze along +z, lids tangent to the iris, the pupil a third of it, lips touching on a line through the
corners of the mouth, teeth touching, the tongue flat with its tip where they meet; feature points where
the standard puts them, and sizes of a human being (ISO/IEC 14496-2, neutral face).
Tolerances are shares of the face's own units: 1 mm on an adult is 0.016 of the distance between the pupils or
0.02 of the mouth's width.

`locations.csv` lists rules of the standard and of anatomy for the left half and the midline; the right half
mirrors them. share is the slack, as a share of the distance between the pupils. `human.csv` lists limits of
sizes in millimetres, from children of three to the biggest adults: published norms of both, four standard
deviations beyond the outermost mean, rounded outwards.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Literal

import numpy as np

from fba.arrays import Float64
from fba.face.checks._findings import Finding
from fba.face.eyeball import LID_POINTS, PUPIL_POINT, Eyeball, eyeballs, gaze, pupil_diameter
from fba.face.fapu import PER_DISTANCE
from fba.face.feature_points import MIRRORED
from fba.parameters import point_rows
from fba.text_files import packaged_rows

if TYPE_CHECKING:
    from fba.face.model import FaceModel, Part

AXES = {"x": 0, "y": 1, "z": 2}
_DIRECTIONS = {"x": ("left of", "right of"), "y": ("above", "below"), "z": ("before", "behind")}
Limits = tuple[float, float]
"""Above the first a deviation is a warning, above the second an error."""

GAZE: Limits = (3.0, 8.0)
"""Degrees between gaze and +z."""
TANGENT: Limits = (0.08, 0.25)
"""Distance of the edge of the iris from a lid margin, as a share of the iris's diameter."""
PUPIL: Limits = (0.15, 0.5)
"""Relative deviation of the pupil's diameter from a third of the iris's."""
IRIS_OF_EYEBALL = (0.38, 0.62)
"""Range of the iris's diameter as a share of the eyeball's; a typical one is 11.7 mm of 24 mm."""
MAX_ROUNDNESS_ERROR = 0.02
"""Root mean square deviation of an eyeball from a sphere, as a share of its radius."""
LIPS: Limits = (0.01, 0.03)
LIP_LINE: Limits = (0.05, 0.15)
TEETH: Limits = (0.02, 0.06)
TONGUE: Limits = (0.08, 0.25)
"""Shares of the width of the mouth."""
MAX_ASYMMETRY = 0.04
"""A larger mean deviation from the mirror image, as a share of the pupils' distance, is a warning."""


def check_neutral(model: FaceModel) -> list[Finding]:
    """Return the deviations of the model's rest position from the standard's neutral face.

    "error" where FAPs would play wrongly, "warning" where it merely looks odd or cannot be checked.
    """
    return [
        *_check_missing(model),
        *check_locations(model.points),
        *_check_eyes(model),
        *_check_lips(model),
        *_check_teeth(model),
        *_check_tongue(model),
        *_check_symmetry(model.points),
        *check_sizes(model.points),
    ]


def _check_missing(model: FaceModel) -> Iterator[Finding]:
    if model.missing:
        count = len(model.missing)
        rule = "present"
        found = f"no {', '.join(model.missing)}"
        expected = "all 84: what depends on these is not checked"
        yield Finding(f"{count} feature point{'s' if count > 1 else ''}", rule, found, expected, "warning")


def _check_eyes(model: FaceModel) -> Iterator[Finding]:
    eyes = eyeballs(model)
    for side in PUPIL_POINT:
        if side not in eyes:
            yield Finding(f"{side} eye", "eyeball", "no part of kind eye", "one on each side", "warning")
            continue
        yield from _check_eye(model, eyes[side])
    for side, (upper, lower) in LID_POINTS.items():
        yield from _check_lids(model, side, upper, lower)


def _check_eye(model: FaceModel, eye: Eyeball) -> Iterator[Finding]:
    subject = f"{eye.side} eye"
    if eye.error > MAX_ROUNDNESS_ERROR * eye.radius:
        rule, found = "eyeball is a sphere", f"{_mm(eye.error)} off it on average"
        yield Finding(subject, rule, found, f"at most {_mm(MAX_ROUNDNESS_ERROR * eye.radius)}", "warning")
    direction = gaze(model, eye)
    if direction is not None:
        angle = float(np.degrees(np.arccos(np.clip(direction[2], -1.0, 1.0))))
        off, limit = f"{angle:.1f} degrees off", f"at most {GAZE[0]:g} degrees"
        yield from _judge(angle, GAZE, subject, "gaze along +z", off, limit)
    iris = model.fapu.IRISD * PER_DISTANCE
    share = iris / (2 * eye.radius)
    if not IRIS_OF_EYEBALL[0] <= share <= IRIS_OF_EYEBALL[1]:
        found = f"iris {_mm(iris)} on an eyeball of {_mm(2 * eye.radius)}, {share:.2f} of it"
        expected = f"{IRIS_OF_EYEBALL[0]:g} to {IRIS_OF_EYEBALL[1]:g} of it"
        yield Finding(subject, "iris fits the eyeball", found, expected, "warning")
    pupil = pupil_diameter(model, eye)
    if pupil is not None:
        rule = "pupil a third of the iris"
        found = f"{_mm(pupil)}, {pupil / iris:.2f} of it"
        expected = f"{_mm(iris / 3)} +- {100 * PUPIL[0]:.0f} %"
        yield from _judge(abs(pupil / (iris / 3) - 1), PUPIL, subject, rule, found, expected)


def _check_lids(model: FaceModel, side: str, upper: str, lower: str) -> Iterator[Finding]:
    """Yield findings unless an iris as big as IRISD0 and centred on the pupil touches both lid margins."""
    iris = model.fapu.IRISD * PER_DISTANCE
    pupil = _point(model, PUPIL_POINT[side])
    for name, edge in ((upper, 0.5 * iris), (lower, -0.5 * iris)):
        height = float(_point(model, name)[1] - pupil[1])
        rule = "lid tangent to the iris"
        found = f"{_mm(height)} above the pupil" if edge > 0 else f"{_mm(-height)} below the pupil"
        expected = f"{_mm(abs(edge))} +- {_mm(TANGENT[0] * iris)}, half of the iris"
        yield from _judge(abs(height - edge) / iris, TANGENT, f"feature point {name}", rule, found, expected)


def _check_lips(model: FaceModel) -> Iterator[Finding]:
    width = model.fapu.MW * PER_DISTANCE
    for upper, lower in (("2.2", "2.3"), ("2.6", "2.8"), ("2.7", "2.9")):
        yield from _check_touching(model, upper, lower, "lips touch", LIPS)
    middle = float(np.mean([_point(model, name)[1] for name in ("2.2", "2.3")]))
    for name in ("2.4", "2.5"):
        off = float(_point(model, name)[1]) - middle
        rule = "lips meet on a level line through the corners"
        found = f"{_mm(off, sign=True)} against their middle"
        expected = f"at most {_mm(LIP_LINE[0] * width)}"
        yield from _judge(abs(off) / width, LIP_LINE, f"feature point {name}", rule, found, expected)


def _check_teeth(model: FaceModel) -> Iterator[Finding]:
    yield from _check_touching(model, "9.10", "9.11", "teeth touch", TEETH)
    width = model.fapu.MW * PER_DISTANCE
    jaws = _jaws(model.of_kind("teeth"))
    if jaws is not None:
        from scipy.spatial import cKDTree

        apart = float(cKDTree(_surface(jaws[0])).query(_surface(jaws[1]))[0].min())
        yield from _judge(
            apart / width,
            TEETH,
            f"parts {jaws[0].name} and {jaws[1].name}",
            "teeth touch",
            f"{_mm(apart)} apart where they are nearest",
            f"at most {_mm(TEETH[0] * width)}",
        )


def _check_touching(model: FaceModel, upper: str, lower: str, rule: str, limits: Limits) -> Iterator[Finding]:
    """Yield a finding unless two points are at the same height. limits: shares of the mouth's width."""
    width = model.fapu.MW * PER_DISTANCE
    gap = float(_point(model, upper)[1] - _point(model, lower)[1])
    found = f"{_mm(abs(gap))} {'apart' if gap > 0 else 'into each other'}"
    expected = f"at most {_mm(limits[0] * width)}"
    yield from _judge(abs(gap) / width, limits, f"feature points {upper} and {lower}", rule, found, expected)


def _surface(part: Part) -> Float64:
    """Return corners, edge midpoints and centres of a part's triangles, dense enough for coarse teeth."""
    corners = part.vertices[part.triangles].astype(np.float64)
    edges = (corners + np.roll(corners, 1, axis=1)) / 2
    return np.concatenate([part.vertices, edges.reshape(-1, 3), corners.mean(axis=1)])


def _jaws(parts: tuple[Part, ...]) -> tuple[Part, Part] | None:
    """Return the highest and the lowest part of the teeth, where there are two."""
    ordered = sorted(
        (p for p in parts if len(p.vertices)), key=lambda part: float(part.vertices[:, 1].mean())
    )
    return (ordered[-1], ordered[0]) if len(ordered) > 1 else None


def _check_tongue(model: FaceModel) -> Iterator[Finding]:
    width = model.fapu.MW * PER_DISTANCE
    tip = _point(model, "6.1")
    for name in ("6.2", "6.3", "6.4"):
        rise = float(_point(model, name)[1] - tip[1])
        yield from _judge(
            abs(rise) / width,
            (TONGUE[0], np.inf),
            f"feature point {name}",
            "tongue flat",
            f"{_mm(rise, sign=True)} against the tip (6.1)",
            f"at most {_mm(TONGUE[0] * width)}",
        )
    boundary = (_point(model, "9.10") + _point(model, "9.11")) / 2
    off = float(tip[1] - boundary[1])
    rule = "tip of the tongue where the teeth meet"
    found = f"{_mm(off, sign=True)} against 9.10 and 9.11"
    expected = f"at most {_mm(TONGUE[0] * width)}"
    yield from _judge(abs(off) / width, TONGUE, "feature point 6.1", rule, found, expected)
    behind = float(_point(model, "9.11")[2] - tip[2])
    if np.isfinite(behind) and not -0.01 * width <= behind <= 0.2 * width:
        yield Finding(
            "feature point 6.1",
            "tip of the tongue at the teeth",
            f"{_mm(behind)} behind 9.11",
            f"0.0 mm to {_mm(0.2 * width)}",
            "error" if behind < -0.05 * width else "warning",
        )


def _check_symmetry(points: Float64) -> Iterator[Finding]:
    rows = np.array([(point_rows()[left], point_rows()[right]) for left, right in MIRRORED.items()])
    left, right = points[rows[:, 0]], points[rows[:, 1]] * (-1.0, 1.0, 1.0)
    known = np.isfinite(left).all(axis=1) & np.isfinite(right).all(axis=1)
    unit = float(points[point_rows()["3.5"], 0] - points[point_rows()["3.6"], 0])
    if known.sum() < 3:
        return
    apart = left[known] - right[known]
    apart[:, 0] -= np.median(apart[:, 0])  # the face need not be centred on x = 0
    distance = np.linalg.norm(apart, axis=1)
    if distance.mean() > MAX_ASYMMETRY * unit:
        worst = list(MIRRORED.items())[int(np.flatnonzero(known)[int(distance.argmax())])]
        found = f"{_mm(distance.mean())} on average, {_mm(distance.max())} for {worst[0]} and {worst[1]}"
        expected = f"{_mm(MAX_ASYMMETRY * unit)} on average, unless the face is meant so"
        yield Finding("left and right", "symmetry", found, expected, "warning")


def _point(model: FaceModel, name: str) -> Float64:
    return np.asarray(model.points[point_rows()[name]])


def _judge(
    deviation: float, limits: Limits, subject: str, rule: str, found: str, expected: str
) -> Iterator[Finding]:
    """Yield a finding where a deviation exceeds the limits; none where it is unknown (NaN)."""
    if deviation > limits[0]:
        yield Finding(subject, rule, found, expected, "error" if deviation > limits[1] else "warning")


def _mm(metres: float, *, sign: bool = False) -> str:
    return f"{metres * 1000:+.1f} mm" if sign else f"{metres * 1000:.1f} mm"


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

"""Check whether a decoded body moves like a person, or would with the other table of BAP steps.

Two tables of BAP quantiser steps are in use and no bit of a stream says which (docs/bitstream.md). Under
the wrong one the root's translation comes out 32 times too large or too small, and joint angles up to 2.7
times. `find_doubt` measures the motion under the table it was decoded with and under the other, and reports
only where the first looks wrong and the second does not. It also looks at angles: animators set joints to
multiples of 5 degrees or 0.1 radians, which only the right table shows (`find_rounder_table`). In a body that
stays in place, the head shows the scale, because it keeps looking ahead while the trunk turns (`HeadBounds`).
The bounds are set so that none of the 177 foreign streams and none of our captures, walks and vectors is
doubted with its own table.

People who sway move their hips over standing feet, so the feet move against the root. A root that moves back
and forth by decimetres while both feet keep their places under it is a skater, or a sway of some millimetres
decoded with too large steps.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from functools import cache

import numpy as np
import numpy.typing as npt

from fba.arrays import Bool, Float64, Int64
from fba.body._skeleton import Skeleton
from fba.body.solve._pose_loops import MILLIMETRE, UNIT
from fba.body.solve.conventions import NO_BAP, convention
from fba.body.solve.limits import DEGREES, FULL_TURN, widest_limits
from fba.parameters import BAP_STEP_TABLES, BapTable, bap_numbers, bap_steps, baps
from fba.tracks import BodyTrack, batches

ROUND_DEGREES = 5.0
"""Unit of angles that were set by hand in degrees."""
ROUND_RADIANS = 0.1
"""Unit of angles that were set by hand in radians."""
ROUND_UNITS = {
    f"{ROUND_DEGREES:g} degrees": ROUND_DEGREES / DEGREES,
    f"{ROUND_RADIANS:g} rad": ROUND_RADIANS / UNIT,
}
"""Both, by name, in units of BAPs."""
MIN_IMPROBABILITY = 6.0
"""Smallest improbability of round angles, see `_improbability`."""
MIN_ADVANTAGE = 2.0
"""Smallest ratio of that to the other table's."""
MIN_IMPROBABILITY_ALL_ROUND = 1.3
"""The same if every key is round with this table, and not with the other."""
RUNS = 32
RUN_FRAMES = 64
"""At most `RUNS` runs of this many successive frames, spread evenly, are examined, to limit the time."""
_FEET = ("l_ankle", "r_ankle", "l_metatarsal", "r_metatarsal")
_ROOT = ("vertical", "lateral", "frontal")


@dataclass(frozen=True)
class Bounds:
    """Bounds of plausible motion, chosen so that no stream is doubted with its own table (see above)."""

    min_seconds: float = 1.0  # shortest motion that is judged
    joint_margin: float = 20.0  # degrees beyond `widest_limits` from which a joint counts
    joint_share: float = 0.3  # difference between the tables in the share of frames with such joints
    sway: float = 0.08  # m/s of the root over standing feet
    slack: float = 2.0  # largest ratio of the root's speed to that of legs and sway
    max_speed: float = 8.0  # m/s, mean over a motion
    walking: float = 0.2  # m/s from which legs certainly walk
    standing: float = 0.15  # share of the legs' speed below which the root stays in place
    slide: float = 0.06  # m that a body slides on resting legs, beyond a quantiser step
    distance: float = 25.0  # m from the origin of a capture to a body that stays in place
    in_place: float = 0.1  # travel of a body that stays in place, share of its distance from the origin
    height_change: float = 1.0  # m, by jumping, crouching and lying down; not counted as travel
    sunk: float = -2.0  # m of the root over that of the default posture: the whole body is underground
    rest: float = 0.02  # m that feet may move against the root on resting legs, in any direction


@dataclass(frozen=True)
class HeadBounds:
    """Bounds of a head that keeps looking ahead while the body turns under it.

    While the pelvis turns by a few degrees, spine and neck turn back by about as much. Of 80 captures by some
    25 makers, 20 have a pelvis that turns by 2 to 45 degrees against the head; in 18 of them the head turns
    back 0.8 to 1.7 times as far, in two 2.4 times.
    """

    min_turn: float = np.radians(2.0)  # of the body, radians
    max_turn: float = np.radians(45.0)
    opposed: float = -0.6  # largest correlation of body and head
    too_far: float = -1.8  # slope of the head over the body below which it looks away
    follows: float = -0.4  # slope above which it follows the body


BOUNDS = Bounds()
HEAD_BOUNDS = HeadBounds()


@dataclass(frozen=True)
class Motion:
    """Measurements of a motion.

    beyond: share of the frames (0..1) in which a joint exceeds all limits by `joint_margin`. travel: speed of
    the root, m/s, without `height_change`. along: the same on the ground only. carried: speed of the lowest
    foot against the root, m/s, at which the legs carry the body. jump: longest step of the root from a frame
    to the next, m. hops: whether a step is longer than a quantiser step. slid: distance that the body slides
    back and forth along the ground while its legs rest, m, less a quantiser step, which rounding alone makes.
    away: distance from the origin along the ground of a body that stays in place, m, else 0. height: median
    height of the root over that of the default posture, m.
    """

    beyond: float
    travel: float
    along: float
    carried: float
    jump: float
    hops: bool
    slid: float
    away: float
    height: float

    @property
    def runs_away(self) -> bool:
        """Whether the root is faster than legs and sway explain, or than any person."""
        return self.travel > min(BOUNDS.max_speed, BOUNDS.slack * (BOUNDS.sway + self.carried))


@dataclass(frozen=True)
class Doubt:
    """A motion that looks wrong with the table of BAP steps it was decoded with, and right with another.

    used, likely: names of the tables. findings: faults, in words.
    """

    used: BapTable
    likely: BapTable
    findings: tuple[str, ...]

    def __str__(self) -> str:
        return (
            f"BAPs look implausible with the BAP steps {self.used!r} ({', '.join(self.findings)}); "
            f"made with --bap-steps {self.likely}?"
        )


def find_doubt(body: BodyTrack, index: npt.ArrayLike, rate: Fraction, used: BapTable) -> Doubt | None:
    """Return the doubt about a body that looks wrong with the table `used` and right with the other, or None.

    index: (T,) numbers of the frames, at rate frames a second. Values must be as decoded; if they are not
    multiples of the table's steps (bap_quant 0, or resampled), the result is None. At most 2048 frames are
    examined, in 20 ms. Raises ValueError for an unknown table.
    """
    steps = bap_steps(used)
    if not len(body):
        return None
    moving = np.flatnonzero(np.concatenate([batch.mask.any(axis=1) for batch in batches(body)]))
    numbers = np.asarray(index, dtype=np.int64)[moving]
    if len(moving) < 2:
        return None
    sampled = _samples(len(moving))
    values = np.concatenate([body[frame : frame + 1].values for frame in moving[sampled].tolist()])
    levels, rests = np.divmod(values.astype(np.int64), steps)
    if rests.any():
        return None
    if (rounder := find_rounder_table(levels, used)) is not None:
        table, unit = rounder
        return Doubt(used, table, (f"angles are odd that {table} makes multiples of {unit}",))
    if numbers[-1] - numbers[0] < BOUNDS.min_seconds * rate:
        return None
    now = measure(levels * steps, numbers[sampled], rate)
    for other in BAP_STEP_TABLES:
        changed = (steps != bap_steps(other)) & levels.any(axis=0)
        if other == used or not changed.any():
            continue
        findings = _new_faults(now, measure(levels * bap_steps(other), numbers[sampled], rate))
        if not findings and not levels[:, _root_columns()].any():
            back = _head_turns_too_far(levels * steps, levels * bap_steps(other))
            if back is not None:
                findings = (f"the head turns back {back:.1f} times as far as the body turns",)
        if findings:
            return Doubt(used, other, findings)
    return None


def measure(values: Int64, index: Int64, rate: Fraction) -> Motion:
    """Return measurements of BAPs, int64 (T, 296), at frame numbers (T,), taken between successive frames."""
    pairs = np.flatnonzero(np.diff(index) == 1)
    root = values[:, _root_columns()]
    steps = np.abs(root[pairs + 1] - root[pairs])
    if np.ptp(root[:, 0]) <= BOUNDS.height_change / MILLIMETRE:
        steps[:, 0] = 0
    quantum = np.gcd.reduce(steps, axis=0)  # rounding alone moves a root by one quantiser step
    lengths = np.linalg.norm(steps, axis=1) * MILLIMETRE
    feet = _feet(values)
    lowest = np.argmin(feet[pairs, :, 1], axis=1)
    swing = feet[pairs + 1, lowest] - feet[pairs, lowest]
    ahead = values.copy()
    ahead[:, bap_numbers()["HumanoidRoot_rt_body_turn"] - 1] = 0  # legs that turn with the body rest, too
    seconds = len(pairs) / float(rate) or 1.0
    return Motion(
        beyond=float(_beyond(values).mean()),
        travel=float(lengths.sum() / seconds),
        along=float(np.linalg.norm(steps[:, 1:], axis=1).sum() * MILLIMETRE / seconds),
        carried=float(np.linalg.norm(swing[:, [0, 2]], axis=1).sum() / seconds),
        jump=float(lengths.max(initial=0.0)),
        hops=bool((steps > quantum).any()),
        slid=_slide_on_resting_legs(root[:, 1:], _feet(ahead), index),
        away=_distance(root[:, 1:]) * MILLIMETRE,
        height=float(np.median(root[:, 0])) * MILLIMETRE,
    )


def _root_columns() -> list[int]:
    """Return the columns of the root's translation: up, sideways, ahead."""
    return [bap_numbers()[f"HumanoidRoot_tr_{axis}"] - 1 for axis in _ROOT]


def _distance(ground: Int64) -> float:
    """Return the distance from the origin of positions (T, 2) that stay in place, mm; 0 if they do not."""
    distance = float(np.linalg.norm(np.median(ground, axis=0)))
    return distance if np.ptp(ground, axis=0).max() < BOUNDS.in_place * distance else 0.0


def _new_faults(now: Motion, other: Motion) -> tuple[str, ...]:
    """Return the faults of `now` that the other reading of the same motion does not have."""
    findings = []
    if now.beyond - other.beyond > BOUNDS.joint_share:
        findings.append(f"joints beyond human limits in {100 * now.beyond:.0f} % of frames")
    if now.runs_away and (now.hops or now.travel > BOUNDS.max_speed) and not other.runs_away:
        findings.append(
            f"the root goes {now.travel:.1f} m/s where the legs carry it {now.carried:.1f} m/s, "
            f"in jumps of up to {now.jump:.1f} m"
        )
    striding = min(now.carried, other.carried) > BOUNDS.walking
    if (
        striding
        and now.along < BOUNDS.standing * now.carried
        and 0.5 < other.along / other.carried < BOUNDS.slack
    ):
        findings.append(f"the root stays where it is while the legs carry it {now.carried:.1f} m/s")
    if now.slid > BOUNDS.slide > other.slid and other.travel < BOUNDS.sway:
        findings.append(f"the body slides {now.slid:.1f} m to and fro on legs that rest")
    if now.away > BOUNDS.distance > other.away:
        findings.append(f"the body stands {now.away:.0f} m away from the origin")
    if now.height < BOUNDS.sunk < other.height:
        findings.append(f"the body {-now.height:.0f} m under the ground")
    beyond = other.beyond - now.beyond > BOUNDS.joint_share
    wrong = (other.runs_away and other.hops) or other.height < BOUNDS.sunk or beyond
    return () if wrong else tuple(findings)


def _head_turns_too_far(values: Int64, other: Int64) -> float | None:
    """Return the turn of the head against the body, relative to the body's, if it is too large.

    values, other: BAPs (T, 296) of the same motion by two tables. None if the head in `values` turns
    back as people's do, or the head in `other` does not.
    """
    now, then = _head_by_body(values), _head_by_body(other)
    if now is None or then is None or not HEAD_BOUNDS.min_turn <= then[0] <= HEAD_BOUNDS.max_turn:
        return None
    return -now[1] if now[1] < HEAD_BOUNDS.too_far <= then[1] <= HEAD_BOUNDS.follows else None


def _head_by_body(values: Int64) -> tuple[float, float] | None:
    """Return the turn of a body, radians, and the slope of its head's; None if not opposed."""
    root, columns = _turning_columns()
    body = np.unwrap(values[:, root] * UNIT)
    head = values[:, columns].sum(axis=1) * UNIT
    if not body.any() or not head.any() or np.ptp(body) == 0 or np.ptp(head) == 0:
        return None
    if np.corrcoef(body, head)[0, 1] > HEAD_BOUNDS.opposed:
        return None
    return float(np.ptp(body)), float(np.polyfit(body, head, 1)[0])


@cache
def _turning_columns() -> tuple[int, tuple[int, ...]]:
    """Return the column of the body's turn, and those of the turns between pelvis and head."""
    spine = tuple(
        bap.number - 1
        for bap in baps()
        if bap.name.endswith("_torsion") and not bap.name.startswith("sacroiliac")
    )
    return bap_numbers()["HumanoidRoot_rt_body_turn"] - 1, spine


def _samples(count: int) -> Int64:
    """Return indices of the frames to examine: all, or runs of successive frames."""
    if count <= RUNS * RUN_FRAMES:
        return np.arange(count)
    starts = np.linspace(0, count - RUN_FRAMES, RUNS).astype(np.int64)
    return np.asarray((starts[:, None] + np.arange(RUN_FRAMES)).reshape(-1))


def _beyond(values: Int64) -> Bool:
    """Return bool (T,): whether a joint exceeds all limits by the margin, ignoring whole turns."""
    turning = np.flatnonzero(widest_limits().any(axis=1))
    low, high = widest_limits()[turning].T
    angles = values[:, turning] * DEGREES
    angles -= FULL_TURN * np.rint((angles - (low + high) / 2) / FULL_TURN)
    return np.asarray(
        ((angles < low - BOUNDS.joint_margin) | (angles > high + BOUNDS.joint_margin)).any(axis=1)
    )


def _feet(values: Int64) -> Float64:
    """Return float64 (T, 4, 3), metres: ankles and balls of the feet, from the root, along the world's axes.

    `BapSolver` poses whole bodies; this turns four points and needs no compiled loop.
    """
    skeleton, rules = Skeleton.default(), convention()
    result = np.empty((len(values), len(_FEET), 3))
    for column, name in enumerate(_FEET):
        point = np.zeros((len(values), 3))
        joint = skeleton.number(name)
        while (parent := int(skeleton.parents[joint])) >= 0:
            point += skeleton.offsets[joint]
            joint = parent
            if skeleton.names[joint] in rules.joints:
                _rotate_points(point, values, rules.joints.index(skeleton.names[joint]))
        result[:, column] = point
    return result


def _rotate_points(point: Float64, values: Int64, row: int) -> None:
    """Turn points (T, 3) in place by the BAPs of a joint, a row of the convention."""
    rules = convention()
    for bap, axis, sign in reversed(list(zip(rules.bap[row], rules.axis[row], rules.sign[row], strict=True))):
        if bap == NO_BAP:
            continue
        angle = values[:, bap] * (sign * UNIT)
        sine, cosine = np.sin(angle), np.cos(angle)
        a, b = (axis + 1) % 3, (axis + 2) % 3
        first, second = point[:, a].copy(), point[:, b].copy()
        point[:, a] = cosine * first - sine * second
        point[:, b] = sine * first + cosine * second


def _slide_on_resting_legs(root: Int64, feet: Float64, index: Int64) -> float:
    """Return the largest distance that a root moves back and forth, metres, while all feet rest under it.

    root: (T, K), millimetres, along the ground. feet: (T, F, 3), metres, from the root. index: (T,) numbers
    of the frames. A quantiser step on each axis is subtracted: rounding alone moves a standing root by it.
    """
    quantum = np.gcd.reduce(root - root[0], axis=0)
    slides = [_back_and_forth(root[run]) - quantum for run in _rests(feet, index)]
    return MILLIMETRE * max(0, int(np.max(slides)))


def _back_and_forth(root: Int64) -> Int64:
    """Return how far each coordinate (T, K) moves forth and back; 0 in one direction, as in a jump."""
    ahead = (root - np.minimum.accumulate(root)).max(axis=0)
    back = (np.maximum.accumulate(root) - root).max(axis=0)
    return np.asarray(np.minimum(ahead, back))


def _rests(feet: Float64, index: Int64) -> Iterator[slice]:
    """Yield the runs of successive frames in which every foot rests, within `Bounds.rest` of the first."""
    begin = 0
    for frame in range(1, len(index)):
        if index[frame] != index[frame - 1] + 1 or np.abs(feet[frame] - feet[begin]).max() > BOUNDS.rest:
            yield slice(begin, frame)
            begin = frame
    yield slice(begin, len(index))


@dataclass(frozen=True)
class Roundness:
    """Roundness of angles.

    score: improbability of this number of round angles by chance. every: whether all keys are round. unit: of
    which they are multiples.
    """

    score: float
    every: bool
    unit: str


def find_rounder_table(levels: Int64, used: BapTable) -> tuple[BapTable, str] | None:
    """Return the table in which angles of levels (T, 296) are far rounder, and the unit; or None."""
    turning = widest_limits().any(axis=1) & (bap_steps(BAP_STEP_TABLES[0]) != bap_steps(BAP_STEP_TABLES[1]))
    columns = np.flatnonzero(turning & levels.any(axis=0))
    quantiser = max(int(np.gcd.reduce(levels[:, columns], axis=None)), 1)
    found = {
        table: _roundness(levels[:, columns] // quantiser, bap_steps(table)[columns] * quantiser)
        for table in BAP_STEP_TABLES
    }
    best = max(found, key=lambda table: found[table].score)
    least = MIN_IMPROBABILITY_ALL_ROUND if found[best].every and not found[used].every else MIN_IMPROBABILITY
    clear = found[best].score > least and found[best].score > MIN_ADVANTAGE * found[used].score
    return (best, found[best].unit) if best != used and clear else None


def _roundness(levels: Int64, steps: Int64) -> Roundness:
    """Return the roundness of levels (T, K), in steps (K,), by the unit that fits best.

    The first and last angle of each joint, and those where it turns back or rests, are counted as keys, each
    value once; if all of them are round, all angles are counted as well.
    """
    changes = np.sign(np.diff(levels, axis=0))
    keys = np.ones(levels.shape, dtype=bool)
    keys[1:-1] = changes[1:] != changes[:-1]
    results = []
    for name, unit in ROUND_UNITS.items():
        at_keys, of_all = (
            _count_round(levels, counted, steps, unit) for counted in (keys, np.ones_like(keys))
        )
        every = at_keys[0] == at_keys[1] > 0
        scores = [_improbability(at_keys[1], at_keys[2])]
        if every:
            scores.append(_improbability(of_all[1], of_all[2]))
        results.append(Roundness(max(scores), every, name))
    return max(results, key=lambda result: result.score)


def _count_round(levels: Int64, counted: Bool, steps: Int64, unit: float) -> tuple[int, int, float]:
    """Return the number of different angles except 0, of round ones, and of those expected by chance."""
    count, hits, expected = 0, 0, 0.0
    for column, chosen, step in zip(levels.T, counted.T, steps.tolist(), strict=True):
        used = np.unique(np.abs(column[chosen & (column != 0)]))
        possible = np.arange(1, max(FULL_TURN / DEGREES / step, 2))
        count += len(used)
        hits += int(_round(used * step, step, unit).sum())
        expected += len(used) * float(_round(possible * step, step, unit).mean())
    return count, hits, expected


def _round(angles: Int64, step: int, unit: float) -> Bool:
    """Return bool (K,): which angles are multiples of unit, as near as the quantiser step allows."""
    return np.abs(angles - unit * np.rint(angles / unit)) <= step / 2


def _improbability(hits: int, expected: float) -> float:
    """Return -log10 of Chernoff's bound on the probability of this number of hits: 6 for one in a million."""
    if hits <= expected:
        return 0.0
    return float((hits * np.log(hits / expected) - hits + expected) / np.log(10))

"""Checks whether a decoded body moves like a person, or would under the other table of BAP steps.

Two tables of BAP quantiser steps are in use and no bit of a stream says which (docs/bitstream.md). Under
the wrong one the root's translation comes out 32 times too large or too small, and joint angles up to 2.7
times. `find_doubt` measures the motion under the table it was decoded with and under the other, and reports
only where the first looks wrong and the second does not. It also looks at angles: people who animate by hand
set joints to whole fives of degrees or tenths of a radian, which come out as such under the right table only
(`_round_angles`). Of a body that stays where it is, the head shows the scale, because it keeps looking ahead
while the trunk turns (`_head_turns`). The bounds are set so that none of the 177 foreign streams and none of
our captures, walks and vectors is doubted when it is decoded with its own table.

People who sway move their hips over feet that stand, so the feet move against the root. A root that goes to
and fro by decimetres while both feet stay where they are under it is a skater, or a sway of some millimetres
read with steps that are too large.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
import numpy.typing as npt

from fba.arrays import Bool, Float64, Int64
from fba.body._head_turns import head_turns_too_far
from fba.body._round_angles import find_rounder_table
from fba.body.skeleton import Skeleton
from fba.body.solve.conventions import NO_BAP, convention
from fba.body.solve.limits import DEGREES, FULL_TURN, widest_limits
from fba.body.solve.pose_loops import MILLIMETRE, UNIT
from fba.parameters import BAP_STEP_TABLES, BapTable, bap_numbers, bap_steps
from fba.tracks import BodyTrack, batches

SAMPLES = 32
RUN = 64
"""At most SAMPLES runs of RUN successive frames, spread evenly, are examined, to bound the cost."""
MIN_SECONDS = 1.0
"""Seconds that a motion must last to be judged."""
MARGIN = 20.0
"""Degrees that a joint must be beyond `limits.widest` to count."""
BEYOND = 0.3
"""Difference between the tables in the share of frames with such a joint that counts as a fault."""
SWAY = 0.08
"""Metres a second that the root may sway over standing feet."""
SLACK = 2.0
"""The root may go this many times as fast as legs and sway carry it."""
FASTEST = 8.0
"""Metres a second that nobody exceeds on average over a whole motion."""
STRIDING = 0.2
"""Metres a second from which the legs certainly walk."""
STANDS = 0.15
"""Share of the legs' speed below which the root counts as staying where it is."""
SLIDES = 0.06
"""Metres that a body on such legs may slide along the ground, beyond what a quantiser step explains."""
AWAY_DISTANCE = 25.0
"""Metres from the origin of a capture beyond which nobody stands who stays in place."""
IN_PLACE = 0.1
"""Share of its distance from the origin within which a body stays that stays in place."""
JUMP = 1.0
"""Metres that the root's height may change by jumping, crouching and lying down, which count as no travel."""
SUNK = -2.0
"""Height of the root over that of the default posture, metres, at which the whole body is underground."""
_FEET = ("l_ankle", "r_ankle", "l_metatarsal", "r_metatarsal")
_ROOT = ("vertical", "lateral", "frontal")
REST_DISTANCE = 0.02
"""Metres that the feet of legs at rest may move against the root, in any direction."""


@dataclass(frozen=True)
class Motion:
    """Measurements of a motion.

    beyond: share of the frames (0..1) in which a joint is `MARGIN` or more beyond all limits. travel: metres
    a second that the root goes, without jumps (see `JUMP`); along: on the ground alone. carried: metres a
    second that the lowest foot moves against the root, which is how fast the legs carry it. jump: metres, the
    longest way of the root from a frame to the next. hops: whether one of these ways is more than a quantiser
    step long. slid: metres that the body slides to and fro along the ground while its legs rest, less the
    quantiser step that rounding alone moves it. away: metres along the ground from the origin of a body that
    stays there (see `IN_PLACE`), else 0. height: metres, median of the root's height over that of the
    default posture.
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
        """Whether the root goes faster than legs and sway can account for, or than anybody does."""
        return self.travel > min(FASTEST, SLACK * (SWAY + self.carried))


@dataclass(frozen=True)
class Doubt:
    """A motion that looks wrong under the table of BAP steps it was decoded with, and right under another.

    used, likely: names of the tables. findings: what is wrong, in words.
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
    """Return the reasons why a body looks wrong under the table `used` and right under the other, or None.

    index: (T,) numbers of the frames, at rate frames a second. Values must be as decoded: where they are not
    multiples of the table's steps (bap_quant 0, or resampled), the table has no effect, and None is
    returned; None as well where both tables or neither look wrong. At most 2048 frames are examined, in
    20 ms. Raises ValueError for an unknown table.
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
    if numbers[-1] - numbers[0] < MIN_SECONDS * rate:
        return None
    now = measure(levels * steps, numbers[sampled], rate)
    for other in BAP_STEP_TABLES:
        changed = (steps != bap_steps(other)) & levels.any(axis=0)
        if other == used or not changed.any():
            continue
        findings = _new_faults(now, measure(levels * bap_steps(other), numbers[sampled], rate))
        if not findings and not levels[:, _root_columns()].any():
            back = head_turns_too_far(levels * steps, levels * bap_steps(other))
            if back is not None:
                findings = (f"the head turns back {back:.1f} times as far as the body turns",)
        if findings:
            return Doubt(used, other, findings)
    return None


def measure(values: Int64, index: Int64, rate: Fraction) -> Motion:
    """Measurements of BAPs int64 (T, 296) at frame numbers (T,), taken between successive frames."""
    pairs = np.flatnonzero(np.diff(index) == 1)
    root = values[:, _root_columns()]
    ways = np.abs(root[pairs + 1] - root[pairs])
    if np.ptp(root[:, 0]) <= JUMP / MILLIMETRE:
        ways[:, 0] = 0
    quantum = np.gcd.reduce(ways, axis=0)  # rounding alone moves a root by one quantiser step
    lengths = np.linalg.norm(ways, axis=1) * MILLIMETRE
    feet = _feet(values)
    lowest = np.argmin(feet[pairs, :, 1], axis=1)
    swing = feet[pairs + 1, lowest] - feet[pairs, lowest]
    ahead = values.copy()
    ahead[:, bap_numbers()["HumanoidRoot_rt_body_turn"] - 1] = 0  # legs that turn with the body rest, too
    seconds = len(pairs) / float(rate) or 1.0
    return Motion(
        beyond=float(_beyond(values).mean()),
        travel=float(lengths.sum() / seconds),
        along=float(np.linalg.norm(ways[:, 1:], axis=1).sum() * MILLIMETRE / seconds),
        carried=float(np.linalg.norm(swing[:, [0, 2]], axis=1).sum() / seconds),
        jump=float(lengths.max(initial=0.0)),
        hops=bool((ways > quantum).any()),
        slid=_slide_on_resting_legs(root[:, 1:], _feet(ahead), index),
        away=_distance(root[:, 1:]) * MILLIMETRE,
        height=float(np.median(root[:, 0])) * MILLIMETRE,
    )


def _root_columns() -> list[int]:
    """Return the columns of the root's translation: up, sideways, ahead."""
    return [bap_numbers()[f"HumanoidRoot_tr_{way}"] - 1 for way in _ROOT]


def _distance(ground: Int64) -> float:
    """Return how far from the origin (T, 2), in mm, along the ground, keep; 0 if they go far themselves."""
    distance = float(np.linalg.norm(np.median(ground, axis=0)))
    return distance if np.ptp(ground, axis=0).max() < IN_PLACE * distance else 0.0


def _new_faults(now: Motion, other: Motion) -> tuple[str, ...]:
    """Return the faults of `now` that the other reading of the same motion does not have."""
    findings = []
    if now.beyond - other.beyond > BEYOND:
        findings.append(f"joints beyond human limits in {100 * now.beyond:.0f} % of frames")
    if now.runs_away and (now.hops or now.travel > FASTEST) and not other.runs_away:
        findings.append(
            f"the root goes {now.travel:.1f} m/s where the legs carry it {now.carried:.1f} m/s, "
            f"in jumps of up to {now.jump:.1f} m"
        )
    striding = now.carried > STRIDING and other.carried > STRIDING
    if striding and now.along < STANDS * now.carried and 0.5 < other.along / other.carried < SLACK:
        findings.append(f"the root stays where it is while the legs carry it {now.carried:.1f} m/s")
    if now.slid > SLIDES > other.slid and other.travel < SWAY:
        findings.append(f"the body slides {now.slid:.1f} m to and fro on legs that rest")
    if now.away > AWAY_DISTANCE > other.away:
        findings.append(f"the body stands {now.away:.0f} m away from the origin")
    if now.height < SUNK < other.height:
        findings.append(f"the body {-now.height:.0f} m under the ground")
    wrong = (other.runs_away and other.hops) or other.height < SUNK or other.beyond - now.beyond > BEYOND
    return () if wrong else tuple(findings)


def _samples(count: int) -> Int64:
    """Return indices of the frames to examine: all of them, or runs of successive ones."""
    if count <= SAMPLES * RUN:
        return np.arange(count)
    starts = np.linspace(0, count - RUN, SAMPLES).astype(np.int64)
    return np.asarray((starts[:, None] + np.arange(RUN)).reshape(-1))


def _beyond(values: Int64) -> Bool:
    """Return bool (T,): whether a joint exceeds all limits by more than `MARGIN`, ignoring whole turns."""
    turning = np.flatnonzero(widest_limits().any(axis=1))
    low, high = widest_limits()[turning].T
    angles = values[:, turning] * DEGREES
    angles -= FULL_TURN * np.rint((angles - (low + high) / 2) / FULL_TURN)
    over: Bool = ((angles < low - MARGIN) | (angles > high + MARGIN)).any(axis=1)
    return over


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
        one, two = (axis + 1) % 3, (axis + 2) % 3
        first, second = point[:, one].copy(), point[:, two].copy()
        point[:, one] = cosine * first - sine * second
        point[:, two] = sine * first + cosine * second


def _slide_on_resting_legs(root: Int64, feet: Float64, index: Int64) -> float:
    """Return how many metres a root goes to and fro, at most, while all feet stay in place under it.

    root: (T, K), millimetres, along the ground. feet: (T, F, 3), metres, from the root. index: (T,) numbers
    of the frames. One quantiser step an axis is taken off: by that much rounding moves a root that stands.
    """
    quantum = np.gcd.reduce(root - root[0], axis=0)
    ways = [_to_and_fro(root[run]) - quantum for run in _rests(feet, index)]
    return MILLIMETRE * max(0, int(np.max(ways)))


def _to_and_fro(root: Int64) -> Int64:
    """Return how far coordinates (T, K) go one way and back, each; 0 for one that goes one way only.

    Who jumps with stiff legs goes one way.
    """
    ahead = (root - np.minimum.accumulate(root)).max(axis=0)
    back = (np.maximum.accumulate(root) - root).max(axis=0)
    shorter: Int64 = np.minimum(ahead, back)
    return shorter


def _rests(feet: Float64, index: Int64) -> Iterator[slice]:
    """Yield the runs of successive frames in which every foot stays where it is under the root.

    A run ends with the frame in which a foot has moved by more than `REST_DISTANCE` from where the run began.
    """
    begin = 0
    for frame in range(1, len(index)):
        if index[frame] != index[frame - 1] + 1 or np.abs(feet[frame] - feet[begin]).max() > REST_DISTANCE:
            yield slice(begin, frame)
            begin = frame
    yield slice(begin, len(index))

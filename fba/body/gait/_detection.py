"""Detection of walking in captured motion: contacts, cycles, the four characteristic poses.

Cycle and poses are those of chapter 5 of the thesis that `fba.body.gait` names. A foot touches the ground
where its heel is furthest ahead of the pelvis, and leaves it where its toes are furthest behind (Zeni,
Richards, Higginson 2008). "Ahead" is where the pelvis faces, so this holds on any ground, on a treadmill, and
on curves. Recoil, passing and anticipation are extrema of the knees and of the swinging thigh.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from typing import Any

import numpy as np

from fba.animation import Animation
from fba.arrays import Bool
from fba.body.gait._anatomy import Anatomy
from fba.body.gait._characters import POSES
from fba.body.gait._signals import SHORTEST_SWING, STEP_SECONDS, Curves
from fba.body.skeleton import Skeleton
from fba.body.solve.solver import BapSolver

UNEVEN = 2.2
"""Largest ratio of the times that the two steps of a cycle take."""
_NAMES = {"l": "left", "r": "right"}


@dataclass(frozen=True)
class Step:
    """Half a cycle: from the contact of one foot to that of the other.

    side: "left" or "right", the foot that touches the ground first and carries the body. poses: frames of
    the four poses, in order. end: frame of the other foot's contact. off: frame in which the other foot left
    the ground, None where the motion does not show that.
    """

    side: str
    poses: tuple[int, int, int, int]
    end: int
    off: int | None

    @property
    def start(self) -> int:
        return self.poses[0]


@dataclass(frozen=True)
class Cycle:
    """Two steps, from a contact of a foot to its next.

    seconds: its length. stride: metres between the footprints. stance: share of the cycle for which the foot
    was on the ground, NaN where the motion does not show when it left. turn: degrees by which the body
    turned left. running: whether both feet were off the ground at some time.
    """

    steps: tuple[Step, Step]
    seconds: float
    stride: float
    stance: float
    turn: float
    running: bool

    @property
    def side(self) -> str:
        return self.steps[0].side

    @property
    def start(self) -> int:
        return self.steps[0].start

    @property
    def end(self) -> int:
        return self.steps[1].end

    @property
    def shares(self) -> tuple[float, ...]:
        """Times of the eight poses, as fractions of the cycle."""
        length = self.end - self.start
        return tuple((frame - self.start) / length for step in self.steps for frame in step.poses)


@dataclass(frozen=True)
class Gait:
    """The steps and cycles of a motion, as `detect` returns them.

    steps: in order of time. cycles: successive ones share a step. Frames are positions in the animation,
    from 0.
    """

    rate: Fraction
    frames: int
    steps: tuple[Step, ...]
    cycles: tuple[Cycle, ...]

    @property
    def keys(self) -> tuple[int, ...]:
        """Frames of all poses of all steps, and the contacts that end them, without repeats, in order."""
        return tuple(sorted({frame for step in self.steps for frame in (*step.poses, step.end)}))

    @property
    def walking(self) -> Bool:
        """(T,) mask of the frames that belong to a step."""
        result = np.zeros(self.frames, dtype=bool)
        for step in self.steps:
            result[step.start : step.end + 1] = True
        return result

    def as_dict(self) -> dict[str, Any]:
        """Return the gait as a dict for JSON, in frames, seconds, metres and degrees."""
        return {
            "frames": self.frames,
            "walking": int(self.walking.sum()),
            "steps": [
                {"side": s.side, **dict(zip(POSES, s.poses, strict=True)), "end": s.end} for s in self.steps
            ],
            "cycles": [
                {
                    "side": c.side, "start": c.start, "end": c.end, "seconds": c.seconds, "stride": c.stride,
                    "stance": None if np.isnan(c.stance) else c.stance, "turn": c.turn, "running": c.running,
                }
                for c in self.cycles
            ],
        }  # fmt: skip

    def lines(self) -> list[str]:
        """Return the gait as lines of text, for people."""
        if not self.steps:
            return ["no steps found: the body does not walk, or less than one step"]
        result = [
            f"{len(self.steps)} steps, {len(self.cycles)} cycles; "
            f"walking in {int(self.walking.sum())} of {self.frames} frames",
            "side   " + "".join(f"{pose:>13}" for pose in POSES) + "          end",
        ]
        result += [f"{s.side:7}" + "".join(f"{frame:13}" for frame in (*s.poses, s.end)) for s in self.steps]
        for c in self.cycles:
            stance = "" if np.isnan(c.stance) else f", stance {100 * c.stance:.0f} %"
            kind = ", running" if c.running else ""
            turn = f", turns {abs(c.turn):.0f} degrees {'left' if c.turn > 0 else 'right'}"
            result.append(
                f"{c.side} cycle {c.start}..{c.end}: {c.seconds:.2f} s, stride {c.stride:.2f} m"
                f"{stance}{turn if abs(c.turn) >= 10 else ''}{kind}"
            )
        return result


def detect(animation: Animation, skeleton: Skeleton | None = None, axes: str = "iso") -> Gait:
    """Return the steps, cycles and characteristic poses in which a body walks forward.

    skeleton: the one whose joints the BAPs turn, the default body where None. axes: a convention's name. Not
    detected are feet that never swing past each other, sideways and backward steps, and steps that the motion
    shows only in part. ValueError where there is no body track.
    """
    if animation.body is None:
        raise ValueError("gait: the animation has no body track")
    skeleton = Skeleton.default() if skeleton is None else skeleton
    anatomy = Anatomy.measure(skeleton)
    count = len(animation)
    if count < 4:
        return Gait(animation.rate, count, (), ())
    curves = Curves.measure(anatomy, BapSolver(skeleton, axes).pose(animation.body.values), animation.times)
    contacts = {letter: curves.contacts(letter) for letter in "lr"}
    offs = {letter: curves.departures(letter) for letter in "lr"}
    order = sorted((frame, letter) for letter, frames in contacts.items() for frame in frames)
    steps = [
        step
        for (start, side), (end, other) in pairwise(order)
        if side != other and (step := _step(curves, side, start, end, offs[other])) is not None
    ]
    cycles = [
        cycle
        for one, two in pairwise(steps)
        if one.end == two.start and (cycle := _cycle(curves, one, two)) is not None
    ]
    return Gait(animation.rate, count, tuple(steps), tuple(cycles))


def _step(curves: Curves, side: str, start: int, end: int, offs: list[int]) -> Step | None:
    other = "l" if side == "r" else "r"
    seconds = float(curves.times[end] - curves.times[start])
    if not STEP_SECONDS[0] <= seconds <= STEP_SECONDS[1] or end - start < 4:
        return None
    swing = curves.heel[other]
    if swing[end] - swing[start : end + 1].min() < SHORTEST_SWING * curves.reach:
        return None
    length = end - start
    first, last = start + max(1, round(0.2 * length)), end - max(1, round(0.2 * length))
    passing = first + int(np.argmax(curves.knee[other][first : last + 1]))
    early_bend = curves.knee[side][start + 1 : passing]
    # where the knee of the standing leg does not bend, the pose is half way
    recoil = start + 1 + int(np.argmax(early_bend)) if len(early_bend) else start + 1
    if not start + 1 < recoil < passing - 1:
        recoil = (start + passing) // 2
    # a thigh that rises until the foot comes down has no extremum before that: half way again
    late_raise = curves.thigh[other][passing + 1 : end - round(0.1 * length)]
    anticipation = passing + 1 + int(np.argmax(late_raise)) if len(late_raise) else passing
    if not passing + 1 < anticipation < end - round(0.1 * length) - 1:
        anticipation = (passing + end) // 2
    if not passing < anticipation < end or not start < recoil < passing:
        return None
    before = [frame for frame in offs if start - length <= frame < passing]
    return Step(_NAMES[side], (start, recoil, passing, anticipation), end, before[-1] if before else None)


def _cycle(curves: Curves, one: Step, two: Step) -> Cycle | None:
    lengths = sorted((one.end - one.start, two.end - two.start))
    if lengths[1] > UNEVEN * lengths[0]:
        return None
    start, end = one.start, two.end
    heel = curves.heel_position[one.side[0]]
    gap = heel[end] - heel[start]
    # the standing foot of the first step leaves the ground in the second
    stance = (two.off - start) / (end - start) if two.off is not None else float("nan")
    running = any(step.off is not None and step.off < step.start for step in (one, two))
    return Cycle(
        (one, two),
        float(curves.times[end] - curves.times[start]),
        float(np.hypot(gap[0], gap[2])),
        stance,
        float(np.degrees(curves.heading[end] - curves.heading[start])),
        running,
    )

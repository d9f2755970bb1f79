"""Detection of walking in captured motion: contacts, cycles, the four characteristic poses.

The poses are those of the source (see `fba.body.gait`). A foot touches the ground where its heel is furthest
ahead of the pelvis, and leaves it where its toes are furthest behind (Zeni, Richards, Higginson 2008).
"Ahead" is where the pelvis faces, so this holds on any ground, on a treadmill, and on curves. Recoil, passing
and anticipation are extrema of the knees and of the swinging thigh, which are found in `Curves`.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from typing import Any

import numpy as np

from fba.animation import Animation
from fba.arrays import Bool, Float64
from fba.body._skeleton import Skeleton
from fba.body.gait._anatomy import Anatomy, body_values
from fba.body.gait._characters import POSES
from fba.body.gait._measure import sole_points
from fba.body.solve.solver import BapSolver
from fba.choices import Axes

_NAMES = {"l": "left", "r": "right"}


@dataclass(frozen=True)
class Tuning:
    """Constants of the detection; lengths are shares of the leg's."""

    max_step_ratio: float = 2.2  # of the durations of the two steps of a cycle
    min_step_seconds: float = 0.2  # from the contact of a foot to that of the other
    max_step_seconds: float = 1.8
    min_swing: float = 0.12  # by which a foot comes forward, relative to the pelvis, in a step
    min_step: float = 0.08  # by which a foot is ahead of the other when it meets the ground
    landing_seconds: float = 0.06  # after its foremost position, in which a foot meets the ground
    leaving_seconds: float = 0.08  # before its hindmost position, and a half of it after, in which it leaves
    touching: float = 0.008  # height of a foot on the ground above its lowest height
    smoothing: float = 0.02  # s, of curves before their extrema are located
    heading_smoothing: float = 0.2  # s, of the direction of the pelvis


TUNING = Tuning()


@dataclass(frozen=True, eq=False)
class Curves:
    """Curves of a motion of T frames; `heel` to `lowest` by side, "l" and "r".

    times: (T,), seconds. heel, toes: (T,), metres ahead of the pelvis. knee: (T,), its bend, radians.
    thigh: (T,), radians that it is raised. heel_position: (T, 3), in the world, metres. lowest: (T,), height
    of the foot's lowest point, metres. heading: (T,), direction of the pelvis, radians about y. reach: length
    of a straight leg, metres.
    """

    times: Float64
    heel: dict[str, Float64]
    toes: dict[str, Float64]
    knee: dict[str, Float64]
    thigh: dict[str, Float64]
    heel_position: dict[str, Float64]
    lowest: dict[str, Float64]
    heading: Float64
    reach: float

    @classmethod
    def measure(cls, anatomy: Anatomy, matrices: Float64, times: Float64) -> Curves:
        """Return the curves of joint matrices (T, J, 4, 4) at times (T,), seconds."""
        number = anatomy.skeleton.number
        rate = (len(times) - 1) / max(float(times[-1] - times[0]), 1e-9)
        pelvis = matrices[:, number("sacroiliac")]
        facing = _smooth(pelvis[:, :3, 2], TUNING.heading_smoothing * rate)
        facing[:, 1] = 0.0
        facing /= np.maximum(np.linalg.norm(facing, axis=1, keepdims=True), 1e-9)
        points = sole_points(anatomy, matrices).points
        heel, toes, knee, thigh, heel_position, lowest = {}, {}, {}, {}, {}, {}
        for row, letter in enumerate("lr"):
            hip, knee_joint, ankle = (
                matrices[:, number(f"{letter}_{j}"), :3, 3] for j in ("hip", "knee", "ankle")
            )

            def ahead(point: Float64) -> Float64:
                return _smooth(np.sum((point - pelvis[:, :3, 3]) * facing, axis=1), TUNING.smoothing * rate)

            upper, lower = knee_joint - hip, ankle - knee_joint
            cosine = np.sum(upper * lower, axis=1)
            cosine /= np.linalg.norm(upper, axis=1) * np.linalg.norm(lower, axis=1)
            heel[letter], toes[letter] = ahead(points[row, 0]), ahead(points[row, 1])
            knee[letter] = _smooth(np.arccos(np.clip(cosine, -1.0, 1.0)), TUNING.smoothing * rate)
            raised = np.arctan2(np.sum(upper * facing, axis=1), -upper[:, 1])
            thigh[letter] = _smooth(raised, TUNING.smoothing * rate)
            heel_position[letter] = points[row, 0]
            lowest[letter] = points[row, ..., 1].min(axis=0)
        heading = np.unwrap(np.arctan2(facing[:, 0], facing[:, 2]))
        return cls(
            times, heel, toes, knee, thigh, heel_position, lowest, heading, anatomy.sides["l"].leg.reach
        )

    def contacts(self, letter: str) -> list[int]:
        """Return the frames in which a foot meets the ground, ahead of the other."""
        height, other = self.lowest[letter], self.heel["l" if letter == "r" else "r"]
        frames = []
        for peak in self._peaks(self.heel[letter]):
            if self.heel[letter][peak] - other[peak] < TUNING.min_step * self.reach:
                continue
            heights = height[peak : peak + self._frames(TUNING.landing_seconds) + 1]
            frames.append(peak + int(np.argmax(heights <= heights.min() + TUNING.touching * self.reach)))
        return frames

    def departures(self, letter: str) -> list[int]:
        """Return the frames in which a foot has just left the ground.

        Little of the time after its hindmost position counts, because a dragged foot stays low in its swing.
        """
        height = self.lowest[letter]
        frames = []
        for peak in self._peaks(-self.toes[letter]):
            near = self._frames(TUNING.leaving_seconds)
            first = max(0, peak - near)
            low = height[max(0, first - near) : peak + 1].min()
            down = np.flatnonzero(height[first : peak + near // 4 + 1] <= low + TUNING.touching * self.reach)
            frames.append(first + int(down[-1]) + 1 if len(down) else peak)
        return frames

    def _frames(self, seconds: float) -> int:
        """Return the number of frames in a time, at least 1."""
        return max(1, round(seconds / max(float(np.median(np.diff(self.times))), 1e-9)))

    def _peaks(self, curve: Float64) -> list[int]:
        """Return the frames of prominent maxima, including those at the ends, as in loops."""
        from scipy.signal import find_peaks

        edge = [float(curve.min()) - 1.0]
        padded = np.concatenate([edge, curve, edge])
        peaks, _ = find_peaks(
            padded, prominence=TUNING.min_swing * self.reach, distance=self._frames(TUNING.min_step_seconds)
        )
        return [int(frame) - 1 for frame in peaks]


def _smooth(curve: Float64, width: float) -> Float64:
    """Return the curve smoothed by a Gaussian of `width` frames, the ends extended by their values."""
    if width < 0.3:
        return curve.copy()
    from scipy.ndimage import gaussian_filter1d

    return np.asarray(gaussian_filter1d(curve, width, axis=0, mode="nearest"))


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


def detect(animation: Animation, skeleton: Skeleton | None = None, axes: Axes = "iso") -> Gait:
    """Return the steps, cycles and characteristic poses in which a body walks forward.

    skeleton: the one whose joints the BAPs turn, the default body where None. axes: a convention's name. Feet
    that never swing past each other, sideways and backward steps, and incomplete steps are not detected.
    ValueError without a body track.
    """
    values = body_values(animation)
    skeleton = Skeleton.default() if skeleton is None else skeleton
    anatomy = Anatomy.measure(skeleton)
    count = len(animation)
    if count < 4:
        return Gait(animation.rate, count, (), ())
    curves = Curves.measure(anatomy, BapSolver(skeleton, axes).pose(values), animation.times)
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
        for first, second in pairwise(steps)
        if first.end == second.start and (cycle := _cycle(curves, first, second)) is not None
    ]
    return Gait(animation.rate, count, tuple(steps), tuple(cycles))


def _step(curves: Curves, side: str, start: int, end: int, offs: list[int]) -> Step | None:
    other = "l" if side == "r" else "r"
    seconds = float(curves.times[end] - curves.times[start])
    if not TUNING.min_step_seconds <= seconds <= TUNING.max_step_seconds or end - start < 4:
        return None
    swing = curves.heel[other]
    if swing[end] - swing[start : end + 1].min() < TUNING.min_swing * curves.reach:
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


def _cycle(curves: Curves, first: Step, second: Step) -> Cycle | None:
    lengths = sorted((first.end - first.start, second.end - second.start))
    if lengths[1] > TUNING.max_step_ratio * lengths[0]:
        return None
    start, end = first.start, second.end
    heel = curves.heel_position[first.side[0]]
    gap = heel[end] - heel[start]
    # the standing foot of the first step leaves the ground in the second
    stance = (second.off - start) / (end - start) if second.off is not None else float("nan")
    running = any(step.off is not None and step.off < step.start for step in (first, second))
    return Cycle(
        (first, second),
        float(curves.times[end] - curves.times[start]),
        float(np.hypot(gap[0], gap[2])),
        stance,
        float(np.degrees(curves.heading[end] - curves.heading[start])),
        running,
    )

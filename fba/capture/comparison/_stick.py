"""`Stick`: the source as a stick figure, with palms and soles as areas."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fba import rotations
from fba.animation import Animation
from fba.arrays import Float64
from fba.body import SIDES, BapSolver, BodyModel
from fba.capture.comparison import _figure as figure
from fba.capture.comparison import _measurement as measurement
from fba.capture.comparison import _path_measures as path_measures
from fba.capture.comparison import _pose_measures as pose_measures
from fba.capture.comparison._path_measures import find_floor, find_standing
from fba.capture.motion import SkeletonMotion
from fba.parameters import BAP_COUNT
from fba.rotations import unit

SOLE_HALF_WIDTH = 0.045
"""Distance from the middle of a sole to its side, in metres."""
HEEL_LENGTH = 0.03
"""Distance from under the ankle to the back of the heel, in metres."""


@dataclass(frozen=True, eq=False)
class Stick:
    """A stick figure, in metres, at the place of the person that it is compared with.

    lines: (N, 2, 3), ends of bones. sides: N times "l", "r" or "". palms: (4, 3) each, from wrist to
    knuckles, counter-clockwise as seen from outside the palm. soles: (4, 3) each.
    """

    lines: Float64
    sides: tuple[str, ...]
    palms: tuple[Float64, ...]
    soles: tuple[Float64, ...]

    @property
    def corners(self) -> Float64:
        """All points (K, 3) of its bones."""
        return self.lines.reshape(-1, 3)


def find_sticks(
    motion: SkeletonMotion,
    animation: Animation,
    mapped: Mapping[str, int],
    frames: Sequence[int],
    *,
    scale: float | None = None,
    up: Float64 | None = None,
) -> list[Stick]:
    """Return the source in some frames, moved to where the result stands; see `measurement.compare`."""
    solver = BapSolver(BodyModel.default().skeleton)  # of the person that is drawn
    assert animation.body is not None
    motion = motion.resample(animation.rate)
    begin = motion.select(slice(0, measurement.PIECE_FRAMES))
    up = figure.find_up(begin, mapped) if up is None else up
    neutral = figure.result_figure(solver, np.zeros((1, BAP_COUNT), dtype=np.int32))
    metres = measurement.source_scale(motion, mapped, neutral, up) if scale is None else scale
    usual = figure.source_figure(begin, mapped, up, metres)
    rate = float(motion.rate)
    standing = find_standing(usual, rate, find_floor([usual], rate).lows)
    levels = pose_measures.level_soles(usual, standing, measurement.rest_figure(motion, mapped, up, metres))
    ground = min((float(np.percentile(toe[:, 1], 5)) for toe in _toes(usual)), default=0.0)
    numbers = np.array(frames, dtype=np.intp)
    chosen = motion.select(numbers)
    source = figure.source_figure(chosen, mapped, up, metres)
    result = figure.result_figure(solver, animation.body.values[numbers])
    result_ground = min((float(np.median(toe[:, 1])) for toe in _toes(neutral)), default=0.0)
    turned, positions = chosen.world()
    positions = positions @ up.T * metres
    sides = _sides(motion, mapped)
    sticks = []
    for row in range(len(chosen)):
        shift = np.array([0.0, result_ground - ground, 0.0])
        hips = path_measures.pelvis(source), path_measures.pelvis(result)
        if hips[0] is not None and hips[1] is not None:
            shift[[0, 2]] = (hips[1] - hips[0])[row, [0, 2]]
        places = positions[row] + shift
        lines = [
            (places[parent], places[joint]) for joint, parent in enumerate(motion.parents) if parent >= 0
        ]
        owners = [sides[joint] for joint, parent in enumerate(motion.parents) if parent >= 0]
        for joint, offset in zip(motion.end_parents, motion.end_offsets, strict=True):
            frame = rotations.matrices(turned[row : row + 1, joint])[0]
            lines.append((places[joint], places[joint] + up @ frame @ offset * metres))
            owners.append(sides[int(joint)])
        palms, soles = [], []
        for side in SIDES:
            knuckles = list(source.knuckles(side).values())
            if len(knuckles) > 1 and f"{side}_wrist" in source.points:
                wrist = source.points[f"{side}_wrist"][row]
                first, last = knuckles[0][row], knuckles[-1][row]
                across = (last - first) * 0.25
                quad = np.array([wrist - across, wrist + across, last, first]) + shift
                palms.append(quad if side == "l" else quad[::-1])
            toe = source.toe(side)
            if side in levels and toe is not None:
                upward = source.frames[f"{side}_ankle"][row] @ levels[side]
                soles.append(_sole(source.points[f"{side}_ankle"][row], toe[row], upward) + shift)
        sticks.append(Stick(np.array(lines), tuple(owners), tuple(palms), tuple(soles)))
    return sticks


def _sole(ankle: Float64, toe: Float64, up: Float64) -> Float64:
    """Return the corners (4, 3) of the area under a foot."""
    ahead = toe - ankle
    ahead = ahead - up * (ahead @ up)
    under = min(float((toe - ankle) @ up), -0.02)
    heel, ball = ankle + up * under - unit(ahead) * HEEL_LENGTH, ankle + ahead + up * under
    across = np.cross(up, unit(ahead)) * SOLE_HALF_WIDTH
    return np.array([heel - across, heel + across, ball + across, ball - across])


def _toes(person: figure.Figure) -> list[Float64]:
    return [toe for side in SIDES if (toe := person.toe(side)) is not None]


def _sides(motion: SkeletonMotion, mapped: Mapping[str, int]) -> list[str]:
    """Return "l", "r" or "" for each joint of the source; unmapped joints have the sides of their parents."""
    sides = {number: joint[0] if joint[:2] in ("l_", "r_") else "" for joint, number in mapped.items()}
    result: list[str] = []
    for joint, parent in enumerate(motion.parents):
        result.append(sides.get(joint, result[parent] if parent >= 0 else ""))
    return result

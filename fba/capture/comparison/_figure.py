"""`Figure`: positions and rotations of joints, in the same form for the source and the result."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from fba import rotations
from fba.arrays import Array, Float64
from fba.body import ROOT, SIDES, BapSolver
from fba.capture.motion import SkeletonMotion, read_axis
from fba.geometry import nearest_rotation
from fba.rotations import unit

FINGERS = ("index", "middle", "ring", "pinky")
MIN_STANDING_LENGTH = 0.6
"""Smallest component of the mean direction from feet to head along the axis along which a person stands."""
MIN_STRETCH = 0.9
"""Smallest ratio of the distance from feet to head to the distance via the hips of a stretched person."""


@dataclass(frozen=True, eq=False)
class Figure:
    """A moving person.

    points: joint of the standard -> (T, 3), metres, y up. frames: joint -> (T, 3, 3), rotations of its axes,
    in whatever directions these are. tips: joint -> (T, 3), the end of its bone if no joint is there: of
    heads, hands and feet.
    """

    points: Mapping[str, Float64]
    frames: Mapping[str, Float64]
    tips: Mapping[str, Float64] = field(default_factory=dict)

    def direction(self, start: str, end: str) -> Float64 | None:
        """Return unit vectors (T, 3) from a joint to another; None if either is missing."""
        if start not in self.points or end not in self.points:
            return None
        return unit(self.points[end] - self.points[start])

    def middle(self, joint: str) -> Float64 | None:
        """Return the points (T, 3) between a left and a right joint, or None."""
        if f"l_{joint}" not in self.points or f"r_{joint}" not in self.points:
            return None
        return (self.points[f"l_{joint}"] + self.points[f"r_{joint}"]) / 2

    def toe(self, side: str) -> Float64 | None:
        """Return the ball (T, 3) or the tip of a foot, or None."""
        return self.points.get(f"{side}_metatarsal", self.tips.get(f"{side}_ankle"))

    def knuckles(self, side: str) -> dict[str, Float64]:
        """Return finger -> knuckle (T, 3) of a hand, from the forefinger on, without missing fingers."""
        names = {finger: f"{side}_{finger}1" for finger in FINGERS}
        return {finger: self.points[name] for finger, name in names.items() if name in self.points}

    def palm(self, side: str, fingers: tuple[str, str]) -> Float64:
        """Return unit normals (T, 3) that point out of a palm, by the knuckles of two fingers."""
        wrist = self.points[f"{side}_wrist"]
        first, last = (self.points[f"{side}_{finger}1"] - wrist for finger in fingers)
        return unit(np.cross(last, first) if side == "l" else np.cross(first, last))


def source_figure(motion: SkeletonMotion, mapped: Mapping[str, int], up: Float64, metres: float) -> Figure:
    """Return the figure of a capture.

    mapped: joint of the standard -> number of the source's. up: (3, 3), from the source's frame to y up, see
    `find_up`. metres: in one unit of the source, as large as the body.
    """
    turned, positions = motion.world()
    positions = positions @ up.T * metres
    points = {joint: positions[:, number] for joint, number in mapped.items()}
    frames = {joint: up @ rotations.matrices(turned[:, number]) for joint, number in mapped.items()}
    tips = {}
    for joint in ("l_ankle", "r_ankle", "l_wrist", "r_wrist", "skullbase"):
        if joint in mapped and (ends := _ends(motion, mapped[joint], frames[joint], metres)):
            tips[joint] = points[joint] + np.mean(ends, axis=0)
    return Figure(points, frames, tips)


def result_figure(solver: BapSolver, baps: Array) -> Figure:
    """Return the figure that a decoder shows for BAPs (T, 296)."""
    skeleton = solver.skeleton
    matrices = solver.pose(baps)
    points = {name: matrices[:, number, :3, 3] for number, name in enumerate(skeleton.names)}
    frames = {name: matrices[:, number, :3, :3] for number, name in enumerate(skeleton.names)}
    tips = {"skullbase": points["skullbase"] + frames["skullbase"][..., 1] * 0.2}
    return Figure(points, frames, tips)


def find_up(motion: SkeletonMotion, mapped: Mapping[str, int]) -> Float64:
    """Return the rotation (3, 3) of the source's frame that makes y point up.

    Up is the axis that the format names, else the axis along which the person stands; if nobody stands, that
    from feet to head in most frames, else that of the rest pose. `prepare` also looks for a floor.
    """
    top = [mapped[j] for j in ("skullbase", "vc7", "l_shoulder", "r_shoulder") if j in mapped]
    low = [mapped[j] for j in ("l_ankle", "r_ankle", "l_knee", "r_knee") if j in mapped]
    if not top or not low:
        return np.eye(3)
    if motion.up:
        return rotations.between(read_axis(motion.up), np.array([0.0, 1.0, 0.0]))
    _, positions = motion.world()
    rest = motion.rest()[None]
    middle = [mapped[j] for j in ("l_hip", "r_hip") if j in mapped] or [mapped[ROOT]]
    head, hips, feet = (positions[:, joints].mean(axis=1) for joints in (top, middle, low))
    reach = np.linalg.norm(head - hips, axis=1) + np.linalg.norm(hips - feet, axis=1)
    straight = np.linalg.norm(head - feet, axis=1) > MIN_STRETCH * reach
    axis = np.array([0.0, 1.0, 0.0])
    for directions in (
        unit(head - feet)[straight],
        unit(head - feet),
        unit(rest[:, top].mean(axis=1) - rest[:, low].mean(axis=1)),
    ):
        mean = directions.mean(axis=0) if len(directions) else np.zeros(3)
        strongest = int(np.argmax(np.abs(mean)))
        if abs(mean[strongest]) > MIN_STANDING_LENGTH:
            axis = np.eye(3)[strongest] * np.sign(mean[strongest])
            break
    return rotations.between(axis, np.array([0.0, 1.0, 0.0]))


def leg_lengths(figure: Figure) -> float:
    """Return the length of the legs, or else the arms, of a figure in its first frame; 0 without either."""
    for chain in (("hip", "knee", "ankle"), ("shoulder", "elbow", "wrist")):
        length = 0.0
        for side in SIDES:
            if all(f"{side}_{joint}" in figure.points for joint in chain):
                ends = [figure.points[f"{side}_{joint}"][0] for joint in chain]
                length += float(np.linalg.norm(np.diff(ends, axis=0), axis=1).sum())
        if length > 0:
            return length
    return 0.0


def degrees_turned(turns: Float64) -> Float64:
    """Return angles (T,) in degrees of rotations (T, 3, 3)."""
    sine = np.linalg.norm(
        np.stack([turns[..., i, j] - turns[..., j, i] for i, j in ((2, 1), (0, 2), (1, 0))], axis=-1), axis=-1
    )
    result: Float64 = np.degrees(np.arctan2(sine, np.trace(turns, axis1=-2, axis2=-1) - 1))
    return result


def mean_rotation(turns: Float64) -> Float64:
    """Return the rotation (3, 3) nearest to the mean of rotations (T, 3, 3)."""
    return nearest_rotation(turns.mean(axis=0))


def _ends(motion: SkeletonMotion, joint: int, frames: Float64, metres: float) -> list[Float64]:
    """Return the lines (T, 3) from a joint to each end or child. frames: (T, 3, 3), its axes in the world."""
    offsets = [motion.end_offsets[n] for n in np.flatnonzero(motion.end_parents == joint)]
    offsets += [motion.offsets[n] for n in np.flatnonzero(motion.parents == joint)]
    return [frames @ (offset * metres) for offset in offsets if np.linalg.norm(offset) > 0]

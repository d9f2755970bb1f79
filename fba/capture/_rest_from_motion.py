"""Find a rest pose from a motion, where the file's rest pose says nothing: all bones along +x, or any pose.

Each joint has axes, relative to which its bone and its neighbours lie. The motion shows which of them are the
axes of the default posture: elbows and knees bend about a single axis, which is fixed in both of their bones;
hips and shoulders are rows from left to right; a head and a pelvis are upright and look ahead while somebody
stands. In most skeletons axes lie exactly along or across bones, so a direction close to an axis is that
axis.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fba import rotations
from fba.arrays import Bool, Float64, Intp
from fba.body import ROOT, Skeleton
from fba.capture import _standing as standing
from fba.capture._named_bones import FINGERS
from fba.capture._rest_alignment import bones
from fba.capture._spine import joints as spine_joints
from fba.capture.motion import MappedMotion, SkeletonMotion
from fba.geometry import nearest_rotation

STANDING_SHARE = 0.25
"""Share of the frames that count as standing: those closest to it."""
MAX_AXIS_ANGLE = 20.0
"""Largest angle, in degrees, between a direction and the joint's axis that it is taken for."""
MAX_INHERITED_ANGLE = 45.0
"""The same where the bone above has this axis."""
MAX_EXACT_ANGLE = 5.0
"""The same for directions that positions of joints give."""
MIN_AXES_SHARE = 0.65
"""Smallest share of directions close to axes that is evidence: of random directions, almost half are."""
MIN_HINGED_SHARE = 0.5
"""Smallest share of elbows and knees that must show their axes for that."""
MIN_BEND = 0.15
"""Smallest sine of the bend of an elbow or a knee that shows the axis."""
LOW_ARM = 0.6
"""Smallest cosine of the angle between an upper arm and straight down at which its clavicle is at rest."""
X, Y, Z = np.eye(3)


@dataclass(frozen=True, eq=False)
class FoundRest:
    """A motion whose rest pose is the default posture. confidence: 0 to 1. reason: of the confidence."""

    motion: SkeletonMotion
    confidence: float
    reason: str


def rest_from_motion(source: MappedMotion, skeleton: Skeleton) -> FoundRest:
    """Return a motion, y up, with the rest pose that it shows."""
    finder = _Finder(source.select(source.motion.spread()), skeleton)
    return finder.apply(source.motion)


class _Bone(NamedTuple):
    """A bone: the joint at its other end, and its unit directions (3,).

    seen: in the axes of its own joint. body: in the default posture.
    """

    aim: str
    seen: Float64
    body: Float64


class _Finder:
    """Works out the rest rotation of each joint: world axes of the default posture from the joint's own."""

    def __init__(self, source: MappedMotion, skeleton: Skeleton) -> None:
        self.source, self.skeleton = source, skeleton
        self.positions = source.positions
        self.turned = rotations.matrices(source.motion.world()[0])  # (T, J, 3, 3)
        self.axes = rotations.matrices(source.motion.axes)
        stance = standing.measure(source.positions)
        tilt = rotations.degrees_between(stance.up, Y)
        self.distance = np.hypot(stance.distance, tilt)
        count = max(1, round(STANDING_SHARE * len(self.distance)))
        self.standing: Intp = np.argsort(self.distance, kind="stable")[:count].astype(np.intp)
        self.left = stance.left
        self.upright = np.broadcast_to(Y, self.left.shape)
        self.rest: dict[int, Float64] = {}
        self.evidence: list[float] = []
        self.on_axes: list[bool] = []

    def apply(self, motion: SkeletonMotion) -> FoundRest:
        """Return the motion, all its frames, with the rest pose."""
        self._trunk()
        self._limbs()
        self._others()
        rest = np.stack([self.rest[number] for number in range(len(motion.names))])
        away = float(self.distance[self.standing].mean())
        bend = float(np.mean(self.evidence)) if self.evidence else 0.0
        exact = float(np.mean(self.on_axes)) if self.on_axes else 0.0
        confidence = 1.3 - away / 60.0
        if bend >= MIN_HINGED_SHARE:  # directions along axes confirm each other, even if nobody stands
            confidence = max(confidence, 0.5 + 1.25 * (exact - MIN_AXES_SHARE))
        reason = (
            f"{100 * exact:.0f} % of directions are axes of joints, {100 * bend:.0f} % of elbows and knees "
            f"bend, people stand to within {away:.0f} degrees"
        )
        return FoundRest(motion.with_rest(rest), float(np.clip(confidence, 0.0, 0.6 + 0.4 * bend)), reason)

    def _line(self, start: str, end: str) -> Float64:
        """Return the line (T, 3) from a joint to another."""
        return self.positions[end] - self.positions[start]

    def _rotations(self, joint: str) -> Float64:
        return self.turned[:, self.source.mapped[joint]]

    def _seen(self, joint: str, directions: Float64, rows: Intp | Bool | slice = slice(None)) -> Float64:
        """Return the mean of world directions (T, 3), unit, as a joint sees it; may be short."""
        seen = np.swapaxes(self._rotations(joint)[rows], 1, 2) @ directions[rows][:, :, None]
        result: Float64 = seen[:, :, 0].mean(axis=0)
        return result

    def _snap(self, joint: str, direction: Float64, within: float, like: Float64 | None = None) -> Float64:
        """Return a direction (3,), or the joint's axis closest to it, if that is within some degrees.

        like: axis of the bone above; the same axis counts within `MAX_INHERITED_ANGLE`.
        """
        direction = rotations.unit(direction)
        axes = self.axes[self.source.mapped[joint]].T  # rows: the joint's axes
        sizes = axes @ direction
        best = int(np.argmax(np.abs(sizes)))
        axis: Float64 = axes[best] * np.sign(sizes[best])
        angle = float(rotations.degrees_between(axis, direction))
        self.on_axes.append(angle <= within)
        inherited = like is not None and float(rotations.degrees_between(axis, like)) < 1.0
        return axis if angle <= (max(within, MAX_INHERITED_ANGLE) if inherited else within) else direction

    def _bone(self, joint: str, *aims: str) -> _Bone | None:
        """Return the bone from a joint to the first of others that the source has, at another place."""
        for aim in aims:
            if joint not in self.source or aim not in self.source:
                continue
            seen = self._seen(joint, self._line(joint, aim))
            if np.linalg.norm(seen) > 1e-9:
                return _Bone(aim, rotations.unit(seen), rotations.unit(self.skeleton.bone(joint, aim)))
        return None

    def _set(self, joint: str, seen: tuple[Float64, Float64], body: tuple[Float64, Float64]) -> None:
        """Let directions in a joint's axes be those of the body in the default posture, the first exactly."""
        self.rest[self.source.mapped[joint]] = _frame(*body) @ _frame(*seen).T

    def _trunk(self) -> None:
        shoulders, chest = self._row("shoulder"), self._row("sternoclavicular")
        spine = [joint for joint in spine_joints(self.skeleton) if joint in self.source]
        back = [joint for joint in spine if joint != "skullbase" and not joint.startswith("vc")]
        for position, joint in enumerate(spine):
            share = min(position / max(len(back) - 1, 1), 1.0)
            row = rotations.unit(
                self.left * (1 - share) + (self.left if shoulders is None else shoulders) * share
            )
            rigid = joint in (ROOT, back[-1])
            if joint == back[-1] and chest is not None and len(back) > 1:
                row = chest
            left = self._seen(joint, row, slice(None) if rigid else self.standing)
            left = self._snap(joint, left, MAX_EXACT_ANGLE if rigid else MAX_AXIS_ANGLE)
            bone = None if joint in (ROOT, spine[-1]) else self._bone(joint, spine[position + 1])
            if bone is None:
                self._set_upright(joint, left)
            else:
                self._set(joint, (bone.seen, left), (bone.body, X))
        if "sacroiliac" in self.source and self.source.mapped["sacroiliac"] not in self.rest:
            left = self._snap("sacroiliac", self._seen("sacroiliac", self.left), MAX_EXACT_ANGLE)
            self._set_upright("sacroiliac", left)

    def _set_upright(self, joint: str, left: Float64) -> None:
        """Let the direction to the left and the mean of what is up while somebody stands be those at rest."""
        up = self._snap(joint, self._seen(joint, self.upright, self.standing), MAX_AXIS_ANGLE)
        self._set(joint, (left, up), (X, Y))

    def _row(self, joint: str) -> Float64 | None:
        """Return unit (T, 3), from a joint on the right to that on the left; None if they coincide."""
        if f"l_{joint}" not in self.source or f"r_{joint}" not in self.source:
            return None
        line = self._line(f"r_{joint}", f"l_{joint}")
        size = float(np.ptp(self.source.motion.world()[1][0], axis=0).max())
        if np.linalg.norm(line, axis=1).min() < 0.01 * size:
            return None
        return rotations.unit(line)

    def _limbs(self) -> None:
        for side in "lr":
            self._hinge(f"{side}_shoulder", f"{side}_elbow", f"{side}_wrist", -X)
            self._hinge(f"{side}_hip", f"{side}_knee", f"{side}_ankle", X)
            self._hand(side)
            self._foot(side)
            self._clavicle(side)
        for side in "lr":
            for bone in bones():
                if bone.joint.startswith(side) and bone.joint[2:-1] in FINGERS:
                    self._finger(bone.joint, bone.aims, side)

    def _hinge(self, upper: str, lower: str, end: str, axis: Float64) -> None:
        """Find the axes of both bones of a limb from the axis about which the joint between them bends."""
        first, second = self._bone(upper, lower), self._bone(lower, end)
        if first is None:
            return
        mean = self._seen(upper, self.left * np.sign(axis[0]), self.standing)
        mean = self._snap(upper, mean, MAX_AXIS_ANGLE)
        if second is None:
            self._set(upper, (first.seen, mean), (first.body, axis))
            return
        bend = np.cross(rotations.unit(self._line(upper, lower)), rotations.unit(self._line(lower, end)))
        sines = np.linalg.norm(bend, axis=1)  # longer where the bend is clearer
        clear = sines > MIN_BEND
        hinged = False
        if clear.any():
            seen = self._seen(upper, bend, clear)
            hinged = float(np.linalg.norm(seen) / max(sines[clear].mean(), 1e-9)) > 0.8
        self.evidence.append(float(hinged))
        if hinged:
            mean = self._snap(upper, _across(seen, first.seen), MAX_AXIS_ANGLE, mean)
        self._set(upper, (first.seen, mean), (first.body, axis))
        # the forearm may also turn about its length: on average its axis is that of the bone above
        like = self._other_axis(upper, mean, lower)
        mean_low = (
            self._seen(lower, bend, clear) if hinged else self._seen(lower, self._rotations(upper) @ mean)
        )
        seen_low = self._snap(lower, _across(mean_low, second.seen), MAX_AXIS_ANGLE, like)
        self._set(lower, (second.seen, seen_low), (second.body, axis))

    def _other_axis(self, joint: str, direction: Float64, other: str) -> Float64 | None:
        """Return the axis of another joint with the same name as this direction; None if it is no axis."""
        sizes = self.axes[self.source.mapped[joint]].T @ direction
        best = int(np.argmax(np.abs(sizes)))
        if abs(sizes[best]) < np.cos(np.radians(1.0)):
            return None
        result: Float64 = self.axes[self.source.mapped[other]][:, best] * np.sign(sizes[best])
        return result

    def _hand(self, side: str) -> None:
        wrist, elbow, index = f"{side}_wrist", f"{side}_elbow", f"{side}_index1"
        if wrist not in self.source or self.source.mapped.get(elbow) not in self.rest:
            return
        bone = self._bone(wrist, *(f"{side}_{finger}1" for finger in ("middle", "index", "ring", "pinky")))
        knuckles = self._bone(index, f"{side}_pinky1", f"{side}_ring1")
        if bone is not None and knuckles is not None:
            across = self._seen(wrist, rotations.unit(self._line(index, knuckles.aim)))
            self._set(wrist, (bone.seen, across), (bone.body, knuckles.body))
            return
        hinge = self.rest[self.source.mapped[elbow]].T @ -X  # as the forearm sees it
        like = self._other_axis(elbow, hinge, wrist)
        seen = self._snap(wrist, self._seen(wrist, self._rotations(elbow) @ hinge), MAX_AXIS_ANGLE, like)
        if bone is not None:
            self._set(wrist, (bone.seen, seen), (bone.body, -X))
            return
        motion = self.source.motion
        ends = motion.end_offsets[motion.end_parents == self.source.mapped[wrist]]
        if len(ends) and np.linalg.norm(ends.mean(axis=0)) > 0:
            along = rotations.unit(ends.mean(axis=0))
        else:
            forearm = rotations.unit(self._line(elbow, wrist))
            along = self._snap(wrist, self._seen(wrist, forearm), MAX_AXIS_ANGLE)
        body = rotations.unit(self.skeleton.bone(wrist, f"{side}_middle1"))
        self._set(wrist, (along, seen), (body, -X))

    def _foot(self, side: str) -> None:
        """Take feet as flat while somebody stands."""
        ankle, toe = f"{side}_ankle", f"{side}_metatarsal"
        if ankle not in self.source:
            return
        height = self.positions[ankle][:, 1]
        low = np.argsort(height, kind="stable")[: max(1, len(height) // 2)].astype(np.intp)
        if len(height) > 1:  # low feet that hardly turn are flat, not on heel or toes
            swing = np.linalg.norm(np.gradient(self._rotations(ankle), axis=0), axis=(1, 2))
            low = low[np.argsort(swing[low], kind="stable")][: max(1, len(low) // 3)]
        up = self._seen(ankle, self.upright, low)
        bone = self._bone(ankle, toe)
        if bone is None:
            self._set(ankle, (up, self._seen(ankle, self.left, low)), (Y, X))
            return
        self._set(ankle, (up, bone.seen), (Y, bone.body * [1.0, 0.0, 1.0]))
        self._keep_turn(self.source.mapped[ankle], self.source.mapped[toe], low)

    def _clavicle(self, side: str) -> None:
        """Take the clavicle as in the default posture while the arm hangs."""
        inner, shoulder, elbow = f"{side}_sternoclavicular", f"{side}_shoulder", f"{side}_elbow"
        if inner not in self.source:
            return
        rows = self.standing
        if shoulder in self.source and elbow in self.source:
            low = np.flatnonzero(rotations.unit(self._line(shoulder, elbow))[:, 1] < -LOW_ARM)
            rows = low if len(low) else rows
        above = number = self.source.mapped[inner]
        while (above := int(self.source.motion.parents[above])) >= 0:
            if above in self.rest:
                self._keep_turn(above, number, rows)
                return

    def _finger(self, joint: str, aims: tuple[str, ...], side: str) -> None:
        wrist = f"{side}_wrist"
        if joint not in self.source or self.source.mapped.get(wrist) not in self.rest:
            return
        flexion = self.rest[self.source.mapped[wrist]].T @ Z
        across = self._seen(joint, self._rotations(wrist) @ flexion)
        bone = self._bone(joint, *aims)
        if bone is not None:
            self._set(joint, (bone.seen, across), (bone.body, Z))

    def _others(self) -> None:
        """Give joints without a counterpart the mean of their turns against the joint above."""
        parents = self.source.motion.parents
        for number, parent in enumerate(parents.tolist()):
            if number in self.rest:
                continue
            near = parent
            if parent < 0:
                children = np.flatnonzero(parents == number).tolist()
                near = next((n for n in children if n in self.rest), self.source.mapped[ROOT])
            self._keep_turn(near, number, self.standing)

    def _keep_turn(self, above: int, joint: int, rows: Intp) -> None:
        """Let the mean turn of a joint against another be that at rest."""
        self.rest[joint] = self.rest[above] @ mean_turn(self.turned[rows, above], self.turned[rows, joint])


def _frame(first: Float64, second: Float64) -> Float64:
    """Return axes as columns (3, 3): the first direction, the second made perpendicular, their product."""
    a = rotations.unit(first)
    b = second - a * (a @ second)
    if np.linalg.norm(b) < 1e-6:
        b = np.cross(a, np.eye(3)[int(np.argmin(np.abs(a)))])
    b = rotations.unit(b)
    return np.stack([a, b, np.cross(a, b)], axis=1)


def _across(direction: Float64, bone: Float64) -> Float64:
    """Return the part of a direction that is perpendicular to a bone."""
    return rotations.unit(direction - bone * (bone @ direction))


def mean_turn(above: Float64, joint: Float64) -> Float64:
    """Return the mean (3, 3) of the rotations (T, 3, 3) of a joint relative to another."""
    return nearest_rotation((np.swapaxes(above, 1, 2) @ joint).sum(axis=0))

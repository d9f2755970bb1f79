"""Find a rest pose from a motion, where the file's rest pose says nothing: all bones along +x, or any pose.

Each joint has axes, relative to which its bone and its neighbours lie. The motion shows which of them are the
axes of the default posture: elbows and knees bend about a single axis, which is fixed in both of their bones;
hips and shoulders are rows from left to right; a head and a pelvis are upright and look ahead while somebody
stands. In most skeletons axes lie exactly along or across bones, so a direction close to an axis is that
axis.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from fba import rotations
from fba.arrays import Bool, Float64, Intp
from fba.body import ROOT, Skeleton
from fba.capture import _standing as standing
from fba.capture._named_bones import FINGERS
from fba.capture._rest_alignment import bones
from fba.capture._spine import joints as spine_joints
from fba.capture.motion import SkeletonMotion
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


def rest_from_motion(motion: SkeletonMotion, mapped: Mapping[str, int], skeleton: Skeleton) -> FoundRest:
    """Return a motion, y up, with the rest pose that it shows.

    mapped: joint of the body -> number of the source's joint.
    """
    return _Finder(motion.select(motion.spread()), mapped, skeleton).apply(motion)


class _Finder:
    """Works out the rest rotation of each joint: world axes of the default posture from the joint's own."""

    def __init__(self, motion: SkeletonMotion, mapped: Mapping[str, int], skeleton: Skeleton) -> None:
        self.motion, self.mapped, self.skeleton = motion, mapped, skeleton
        turned, self.positions = motion.world()
        self.turned = rotations.matrices(turned)  # (T, J, 3, 3)
        self.axes = rotations.matrices(motion.axes)
        stance = standing.measure(self.positions, mapped)
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
        return FoundRest(with_rest(motion, rest), float(np.clip(confidence, 0.0, 0.6 + 0.4 * bend)), reason)

    def _local(self, joint: int, directions: Float64, rows: Intp | Bool | slice = slice(None)) -> Float64:
        """Return the mean of world directions (T, 3), unit, as a joint sees it; may be short."""
        seen = np.swapaxes(self.turned[rows, joint], 1, 2) @ directions[rows][:, :, None]
        result: Float64 = seen[:, :, 0].mean(axis=0)
        return result

    def _snap(self, joint: int, direction: Float64, within: float, like: Float64 | None = None) -> Float64:
        """Return a direction (3,), or the joint's axis closest to it, if that is within some degrees.

        like: axis of the bone above; the same axis counts within `MAX_INHERITED_ANGLE`.
        """
        direction = rotations.unit(direction)
        axes = self.axes[joint].T  # rows: the joint's axes
        sizes = axes @ direction
        best = int(np.argmax(np.abs(sizes)))
        axis: Float64 = axes[best] * np.sign(sizes[best])
        angle = float(rotations.degrees_between(axis, direction))
        self.on_axes.append(angle <= within)
        if angle <= within:
            return axis
        if (
            like is not None
            and angle <= MAX_INHERITED_ANGLE
            and float(rotations.degrees_between(axis, like)) < 1.0
        ):
            return axis
        return direction

    def _bone(self, joint: str, *aims: str) -> tuple[str, Float64] | None:
        """Return the joint at the other end of a bone, and the direction to it as the first joint sees it."""
        for aim in aims:
            if joint not in self.mapped or aim not in self.mapped:
                continue
            line = self.positions[:, self.mapped[aim]] - self.positions[:, self.mapped[joint]]
            local = self._local(self.mapped[joint], line)
            if np.linalg.norm(local) > 1e-9:
                return aim, rotations.unit(local)
        return None

    def _default(self, joint: str, aim: str) -> Float64:
        centres, number = self.skeleton.centres, self.skeleton.number
        return rotations.unit(centres[number(aim)] - centres[number(joint)])

    def _set(self, joint: int, seen: tuple[Float64, Float64], body: tuple[Float64, Float64]) -> None:
        """Let directions in a joint's axes be those of the body in the default posture, the first exactly."""
        self.rest[joint] = _frame(*body) @ _frame(*seen).T

    def _trunk(self) -> None:
        shoulders = self._row("shoulder")
        chest = self._row("sternoclavicular")
        rows = {"hips": self.left, "chest": shoulders if shoulders is not None else self.left}
        spine = [joint for joint in spine_joints(self.skeleton) if joint in self.mapped]
        back = [joint for joint in spine if joint != "skullbase" and not joint.startswith("vc")]
        for position, joint in enumerate(spine):
            number = self.mapped[joint]
            share = min(position / max(len(back) - 1, 1), 1.0)
            row = rotations.unit(rows["hips"] * (1 - share) + rows["chest"] * share)
            rigid = joint in (ROOT, back[-1])
            if joint == back[-1] and chest is not None and len(back) > 1:
                left = self._local(number, chest)
            else:
                left = self._local(number, row, slice(None) if rigid else self.standing)
            left = self._snap(number, left, MAX_EXACT_ANGLE if rigid else MAX_AXIS_ANGLE)
            bone = None if joint in (ROOT, spine[-1]) else self._bone(joint, spine[position + 1])
            if bone is None:
                self._set_upright(number, left)
            else:
                self._set(number, (bone[1], left), (self._default(joint, bone[0]), X))
        if "sacroiliac" in self.mapped and self.mapped["sacroiliac"] not in self.rest:
            number = self.mapped["sacroiliac"]
            self._set_upright(number, self._snap(number, self._local(number, self.left), MAX_EXACT_ANGLE))

    def _set_upright(self, joint: int, left: Float64) -> None:
        """Let the direction to the left and the mean of what is up while somebody stands be those at rest."""
        up = self._snap(joint, self._local(joint, self.upright, self.standing), MAX_AXIS_ANGLE)
        self._set(joint, (left, up), (X, Y))

    def _row(self, joint: str) -> Float64 | None:
        """Return unit (T, 3), from a joint on the right to that on the left; None if they coincide."""
        if f"l_{joint}" not in self.mapped or f"r_{joint}" not in self.mapped:
            return None
        line = self.positions[:, self.mapped[f"l_{joint}"]] - self.positions[:, self.mapped[f"r_{joint}"]]
        size = float(np.ptp(self.positions[0], axis=0).max())
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
        high = self.mapped[upper]
        mean = self._snap(
            high, self._local(high, self.left * np.sign(axis[0]), self.standing), MAX_AXIS_ANGLE
        )
        if second is None:
            self._set(high, (first[1], mean), (self._default(upper, lower), axis))
            return
        low = self.mapped[lower]
        thigh = rotations.unit(self.positions[:, low] - self.positions[:, high])
        shank = rotations.unit(self.positions[:, self.mapped[end]] - self.positions[:, low])
        bend = np.cross(thigh, shank)  # longer where the bend is clearer
        sines = np.linalg.norm(bend, axis=1)
        clear = sines > MIN_BEND
        local = self._local(high, bend, clear) if clear.any() else np.zeros(3)
        spread = float(np.linalg.norm(local) / max(sines[clear].mean(), 1e-9)) if clear.any() else 0.0
        hinged = clear.sum() >= 1 and spread > 0.8
        self.evidence.append(float(hinged))
        seen = self._snap(high, _across(local, first[1]), MAX_AXIS_ANGLE, mean) if hinged else mean
        self._set(high, (first[1], seen), (self._default(upper, lower), axis))
        # the forearm may also turn about its length: on average its axis is that of the bone above
        above = self.turned[:, high] @ seen
        like = _other_axes(self.axes[high], seen, self.axes[low])
        mean_low = self._local(low, bend, clear) if hinged else self._local(low, above)
        seen_low = self._snap(low, _across(mean_low, second[1]), MAX_AXIS_ANGLE, like)
        self._set(low, (second[1], seen_low), (self._default(lower, end), axis))

    def _hand(self, side: str) -> None:
        wrist, elbow = f"{side}_wrist", f"{side}_elbow"
        if wrist not in self.mapped or self.mapped.get(elbow) not in self.rest:
            return
        number, above = self.mapped[wrist], self.mapped[elbow]
        knuckles = [f"{side}_{finger}1" for finger in ("middle", "index", "ring", "pinky")]
        bone = self._bone(wrist, *knuckles)
        ends = self.motion.end_offsets[self.motion.end_parents == number]
        line = self._bone(f"{side}_index1", f"{side}_pinky1") or self._bone(f"{side}_index1", f"{side}_ring1")
        if bone is not None and line is not None:
            row = rotations.unit(
                self.positions[:, self.mapped[line[0]]] - self.positions[:, self.mapped[f"{side}_index1"]]
            )
            across = self._local(number, row)
            self._set(
                number,
                (bone[1], across),
                (self._default(wrist, bone[0]), self._default(f"{side}_index1", line[0])),
            )
            return
        hinge = self.rest[above].T @ -X  # as the forearm sees it
        like = _other_axes(self.axes[above], hinge, self.axes[number])
        seen = self._snap(number, self._local(number, self.turned[:, above] @ hinge), MAX_AXIS_ANGLE, like)
        if bone is not None:
            along, body = bone[1], self._default(wrist, bone[0])
        elif len(ends) and np.linalg.norm(ends.mean(axis=0)) > 0:
            along, body = rotations.unit(ends.mean(axis=0)), self._default(wrist, f"{side}_middle1")
        else:
            forearm = rotations.unit(self.positions[:, number] - self.positions[:, above])
            along = self._snap(number, self._local(number, forearm), MAX_AXIS_ANGLE)
            body = self._default(wrist, f"{side}_middle1")
        self._set(number, (along, seen), (body, -X))

    def _foot(self, side: str) -> None:
        """Take feet as flat while somebody stands."""
        ankle, toe = f"{side}_ankle", f"{side}_metatarsal"
        if ankle not in self.mapped:
            return
        number = self.mapped[ankle]
        height = self.positions[:, number, 1]
        low = np.argsort(height, kind="stable")[: max(1, len(height) // 2)].astype(np.intp)
        if len(height) > 1:  # low feet that hardly turn are flat, not on heel or toes
            swing = np.linalg.norm(np.gradient(self.turned[:, number], axis=0), axis=(1, 2))
            low = low[np.argsort(swing[low], kind="stable")][: max(1, len(low) // 3)]
        up = self._local(number, self.upright, low)
        bone = self._bone(ankle, toe)
        if bone is not None:
            body = self._default(ankle, toe) * [1.0, 0.0, 1.0]
            self._set(number, (up, bone[1]), (Y, body))
            other = self.mapped[toe]
            self.rest[other] = self.rest[number] @ mean_turn(self.turned, number, other, low)
        else:
            left = self._local(number, self.left, low)
            self._set(number, (up, left), (Y, X))

    def _clavicle(self, side: str) -> None:
        """Take the clavicle as in the default posture while the arm hangs."""
        inner, shoulder, elbow = f"{side}_sternoclavicular", f"{side}_shoulder", f"{side}_elbow"
        if inner not in self.mapped:
            return
        number = self.mapped[inner]
        above = self._nearest_above(number)
        rows = self.standing
        if shoulder in self.mapped and elbow in self.mapped:
            arm = rotations.unit(
                self.positions[:, self.mapped[elbow]] - self.positions[:, self.mapped[shoulder]]
            )
            low = np.flatnonzero(arm[:, 1] < -LOW_ARM)
            rows = low if len(low) else rows
        if above is not None:
            self.rest[number] = self.rest[above] @ mean_turn(self.turned, above, number, rows)

    def _finger(self, joint: str, aims: tuple[str, ...], side: str) -> None:
        wrist = self.mapped.get(f"{side}_wrist")
        if joint not in self.mapped or wrist not in self.rest:
            return
        number = self.mapped[joint]
        flexion = self.rest[wrist].T @ Z
        across = self._local(number, self.turned[:, wrist] @ flexion)
        bone = self._bone(joint, *aims)
        if bone is not None:
            self._set(number, (bone[1], across), (self._default(joint, bone[0]), Z))

    def _others(self) -> None:
        """Give joints without a counterpart the mean of their turns against the joint above."""
        for number, parent in enumerate(self.motion.parents):
            if number in self.rest:
                continue
            if parent < 0:
                child = next(
                    (n for n, p in enumerate(self.motion.parents) if int(p) == number and n in self.rest),
                    None,
                )
                near = child if child is not None else self.mapped[ROOT]
                self.rest[number] = self.rest[near] @ mean_turn(self.turned, near, number, self.standing)
            else:
                turn = mean_turn(self.turned, int(parent), number, self.standing)
                self.rest[number] = self.rest[int(parent)] @ turn

    def _nearest_above(self, joint: int) -> int | None:
        """Return the nearest joint above whose rest rotation is set."""
        while (joint := int(self.motion.parents[joint])) >= 0:
            if joint in self.rest:
                return joint
        return None


def with_rest(motion: SkeletonMotion, rest: Float64) -> SkeletonMotion:
    """Return the same motion with another rest pose. rest: (J, 3, 3), world rotations of the joints in it."""
    turned, _ = motion.world()
    inverse = rotations.quaternions(np.swapaxes(rest, 1, 2))
    world = rotations.multiply(turned, np.broadcast_to(inverse, turned.shape))
    local = np.array(world)
    offsets = np.array(motion.offsets)
    for joint, parent in enumerate(motion.parents):
        if parent >= 0:
            local[:, joint] = rotations.multiply(world[:, parent] * [1, -1, -1, -1], world[:, joint])
            offsets[joint] = rest[parent] @ motion.offsets[joint]
    local /= np.linalg.norm(local, axis=-1, keepdims=True)
    ends = np.array(
        [rest[p] @ offset for p, offset in zip(motion.end_parents, motion.end_offsets, strict=True)]
    )
    return replace(
        motion,
        offsets=offsets,
        rotations=local,
        end_offsets=ends.reshape(-1, 3),
        axes=rotations.quaternions(rest @ rotations.matrices(motion.axes)),
    )


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


def _other_axes(axes: Float64, direction: Float64, others: Float64) -> Float64 | None:
    """Return the axis of another joint with the same name as this direction; None if it is no axis."""
    sizes = axes.T @ direction
    best = int(np.argmax(np.abs(sizes)))
    if abs(sizes[best]) < np.cos(np.radians(1.0)):
        return None
    result: Float64 = others[:, best] * np.sign(sizes[best])
    return result


def mean_turn(turned: Float64, above: int, joint: int, rows: Intp) -> Float64:
    """Return the mean (3, 3) of a joint's rotation relative to another."""
    relative = np.swapaxes(turned[rows, above], 1, 2) @ turned[rows, joint]
    return nearest_rotation(relative.sum(axis=0))

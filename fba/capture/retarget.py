"""Wanted world rotations of the body's joints from those of the source, then their BAPs."""

from __future__ import annotations

import warnings
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from fba import rotations
from fba.body import BapSolver, wrapped
from fba.body.solve.solver_loops import joint_angles
from fba.capture import _rest_alignment as rest_alignment
from fba.capture import _spine as spine
from fba.capture.limbs import bone_ik, hinges
from fba.capture.limbs.foot_planting import Footing
from fba.capture.motion import SkeletonMotion
from fba.errors import FbaWarning, Remedy
from fba.parameters import BAP_COUNT, baps

Float = npt.NDArray[np.float64]

CHUNK = 2048
"""Frames solved at a time: joint matrices of a long capture would not fit into memory."""
HINGES = (("shoulder", "elbow"), ("hip", "knee"))
FINGERS = ("thumb", "index", "middle", "ring", "pinky")
LOOSE = 1e-3
"""Weight of a free preference against a bone's direction."""
STIFF = {"thumb": 0.3, "index": 0.1, "middle": 0.1, "ring": 0.1, "pinky": 0.1}
"""The same for fingers, which are often straight: their knuckles then turn no further than this lets them.
Thumbs bend in another plane in every source: bones that pointed quite as the source's would take angles that
thumbs do not reach and that the standard's I planes do not carry."""
FOREARM_SHARE = 0.5
"""Of the hand's twist against the forearm, what the forearm takes: radius and ulna turn about each other."""
CLAVICLE_SHARE = 0.5
"""Of the clavicle's turn, what the joint at the breastbone takes; the one at the shoulder blade has the
rest."""


class Retarget:
    """Wanted world rotations of the body's joints, then their BAPs.

    wanted: joint -> (T, 3, 3). aims: joint -> the joint at the other end of its bone, where the source has
    both. scale: metres for one unit of the source. groups: of the spine, 0 for none but the source's own
    joints; with_anchors: for these besides.
    """

    def __init__(
        self,
        motion: SkeletonMotion,
        mapped: dict[str, int],
        solver: BapSolver,
        scale: float | None,
        groups: int,
        with_anchors: bool,
    ) -> None:
        self.solver, self.motion, self.mapped = solver, motion, mapped
        self.skeleton = solver.skeleton
        alignment = rest_alignment.align(motion, mapped, self.skeleton)
        turned, places = motion.world()
        upright = alignment.upright
        self.upright, self.turned = upright, turned
        self.places = places @ upright.T
        self.wanted: dict[str, Float] = {}
        for joint, correction in alignment.corrections.items():
            source = mapped.get(joint, mapped["HumanoidRoot"])
            world = upright @ rotations.matrices(turned[:, source]) @ upright.T
            self.wanted[joint] = world @ correction
        self.aims = alignment.aims
        anchors = [joint for joint in spine.joints(self.skeleton) if joint in mapped]
        if groups and len(anchors) > 1:
            at = {joint: self.places[:, mapped[joint]] for joint in anchors}
            spine.spread(self.skeleton, self.wanted, at, anchors, groups, with_anchors)
        self.footing = footing = Footing(self)
        for side in "lr":
            self._clavicle(side)
            self._forearm(side)
            for upper, lower in HINGES:
                self._hinge(f"{side}_{upper}", f"{side}_{lower}")
            footing.turn(side)
            for finger in FINGERS:
                self._finger(f"{side}_{finger}")
        self.scale = self._unit() if scale is None else float(scale)
        if not (np.isfinite(self.scale) and self.scale > 0):
            raise ValueError(f"scale must be a positive number, not {scale}")

    def values(self, origin: str, floor: str, plant: bool) -> npt.NDArray[np.int32]:
        """int32 (T, 296): the BAPs that reach the wanted rotations and places."""
        count = len(self.motion)
        numbers = {joint: self.skeleton.number(joint) for joint in self.wanted}
        result = np.zeros((count, BAP_COUNT), dtype=np.int32)
        root = self._root_places()
        if floor != "none":
            self.footing.stand(root, floor, plant)
        if origin != "source":
            place = root[0] if origin == "start" else (root.min(axis=0) + root.max(axis=0)) / 2
            root[:, [0, 2]] -= (place - self.skeleton.centres[0])[[0, 2]]
        previous = None
        for begin in range(0, count, CHUNK):
            end = min(begin + CHUNK, count)
            frames = np.zeros((end - begin, len(self.skeleton), 4, 4))
            frames[:, :, range(4), range(4)] = 1.0
            for joint, number in numbers.items():
                frames[:, number, :3, :3] = self.wanted[joint][begin:end]
            frames[:, 0, :3, 3] = root[begin:end]
            result[begin:end] = self.solver.solve(frames, joints=list(self.wanted), previous=previous)
            previous = result[end - 1]
        return wrapped(result)

    def bone(self, joint: str, aim: str) -> Float:
        vector = (
            self.skeleton.centres[self.skeleton.number(aim)]
            - self.skeleton.centres[self.skeleton.number(joint)]
        )
        unit: Float = vector / np.linalg.norm(vector)
        return unit

    def _direction(self, joint: str) -> Float:
        """(T, 3): where the bone that begins at a joint is to point."""
        return self.wanted[joint] @ self.bone(joint, self.aims[joint])

    def turns(self, joint: str) -> tuple[Float, npt.NDArray[np.int64], Float]:
        """Signed axes (K, 3) of a joint's turns, outermost first, and their numbers (3,) and signs (3,)."""
        rules = self.solver.convention
        row = rules.joints.index(joint)
        count = len(rules.freedoms(joint))
        axes = np.eye(3)[rules.axis[row]] * rules.sign[row][:, None]
        return axes[:count], rules.axis[row], rules.sign[row]

    def before(self, joint: str) -> Float:
        """Wanted rotation (T, 3, 3) of the closest joint above that is turned."""
        number = self.skeleton.number(joint)
        while (number := int(self.skeleton.parents[number])) >= 0:
            if self.skeleton.names[number] in self.wanted:
                return self.wanted[self.skeleton.names[number]]
        return np.broadcast_to(np.eye(3), (len(self.motion), 3, 3))

    def _closest(self, joint: str, local: Float) -> Float:
        axes, numbers, signs = self.turns(joint)
        angles = np.zeros((3, len(local)))
        frames_last = np.ascontiguousarray(np.moveaxis(local, 0, -1))
        joint_angles(frames_last, len(axes), numbers[None], signs[None], angles)
        return angles[: len(axes)].T

    def _swing(self, joint: str, bone: Float | None = None) -> None:
        """Joints with two freedoms: the bone's direction comes before its twist."""
        if joint not in self.aims:
            return
        axes, *_ = self.turns(joint)
        above = self.before(joint)
        wanted = rotations.inside(above, self._direction(joint))
        start = self._closest(joint, np.swapaxes(above, 1, 2) @ self.wanted[joint])
        if bone is None:
            bone = self.bone(joint, self.aims[joint])
        angles = bone_ik.aim(axes, start, bone, wanted, np.full(len(axes), LOOSE))
        self.wanted[joint] = above @ bone_ik.product(axes, angles)

    def _hinge(self, upper: str, lower: str) -> None:
        if self.aims.get(upper) != lower or lower not in self.aims:
            return
        upper_bone, lower_bone = self.bone(upper, lower), self.bone(lower, self.aims[lower])
        axes, *_ = self.turns(lower)
        if abs(axes[0] @ lower_bone) > abs(axes[1] @ lower_bone):
            self._swing(lower)  # a twist outside the flexion swings the bone anywhere by itself
            return
        limits = baps()[self.solver.convention.freedoms(lower)[0]].i_limits or (0, 0)
        hinge = hinges.Hinge(upper_bone, lower_bone, axes[0], axes[1], 1.0 if sum(limits) > 0 else -1.0)
        frame = self.wanted[upper]
        local = np.swapaxes(frame, 1, 2) @ self.wanted[lower]
        angles = hinges.solve(
            hinge, rotations.inside(frame, self._direction(lower)), local, float(self.motion.rate)
        )
        turn, bend = hinges.matrices(hinge, angles)
        self.wanted[upper] = frame @ turn
        self.wanted[lower] = self.wanted[upper] @ bend

    def _clavicle(self, side: str) -> None:
        """Both joints of the clavicle together point at the shoulder."""
        inner, outer, shoulder = f"{side}_sternoclavicular", f"{side}_acromioclavicular", f"{side}_shoulder"
        if self.aims.get(inner) != shoulder:
            return
        if outer not in self.skeleton:
            self._swing(inner)
            return
        centres = [self.skeleton.centres[self.skeleton.number(j)] for j in (inner, outer, shoulder)]
        length = float(np.linalg.norm(centres[2] - centres[0]))
        pieces = [(b - a) / length for a, b in pairwise(centres)]
        axes = np.concatenate([self.turns(inner)[0], self.turns(outer)[0]])
        above = self.before(inner)
        turn = self._closest(inner, np.swapaxes(above, 1, 2) @ self.wanted[inner])
        start = np.concatenate([turn * CLAVICLE_SHARE, turn * (1 - CLAVICLE_SHARE)], axis=1)
        own = turn.shape[1]
        target = bone_ik.Target(
            ((pieces[0], own), (pieces[1], len(axes))), rotations.inside(above, self._direction(inner))
        )
        angles = bone_ik.aim_all(axes, start, (target,), np.full(len(axes), LOOSE))
        self.wanted[inner] = above @ bone_ik.product(axes[:own], angles[:, :own])
        self.wanted[outer] = self.wanted[inner] @ bone_ik.product(axes[own:], angles[:, own:])

    def _forearm(self, side: str) -> None:
        """The forearm takes its share of the hand's twist."""
        elbow, wrist = f"{side}_elbow", f"{side}_wrist"
        if elbow not in self.wanted or wrist not in self.mapped or wrist not in self.skeleton:
            return
        bone = self.bone(elbow, wrist)
        twist = hinges.turn_about(np.swapaxes(self.wanted[elbow], 1, 2) @ self.wanted[wrist], bone)
        self.wanted[elbow] = self.wanted[elbow] @ rotations.turn(bone, FOREARM_SHARE * twist)

    def _finger(self, finger: str) -> None:
        """The knuckle turns so that the plane in which the finger curls is the source's."""
        joints = [f"{finger}{n}" for n in (1, 2, 3)]
        joints = joints[: next((n for n, j in enumerate(joints) if j not in self.aims), 3)]
        if len(joints) < 2:
            if joints:
                self._swing(joints[0])
            return
        above = self.before(joints[0])
        axes: list[Float] = []
        starts: list[Float] = []
        targets = []
        pieces: tuple[tuple[Float, int], ...]
        before = above
        for joint in joints:
            own, *_ = self.turns(joint)
            axes.extend(own)
            starts.append(self._closest(joint, np.swapaxes(before, 1, 2) @ self.wanted[joint]))
            before = self.wanted[joint]
            pieces = ((self.bone(joint, self.aims[joint]), len(axes)),)
            targets.append(bone_ik.Target(pieces, rotations.inside(above, self._direction(joint))))
        turned = np.array(axes)
        start = np.concatenate(starts, axis=1)
        angles = bone_ik.aim_all(turned, start, targets, np.full(len(turned), STIFF[finger[2:]]))
        used = 0
        frame = above
        for joint, own_angles in zip(joints, starts, strict=True):
            count = own_angles.shape[1]
            frame = frame @ bone_ik.product(turned[used : used + count], angles[:, used : used + count])
            self.wanted[joint] = frame
            used += count

    def _unit(self) -> float:
        """Metres of the body for one unit of the source."""
        unit = rest_alignment.scale(self.motion, self.mapped, self.skeleton)
        if unit is None:
            text = (
                "the source has neither whole legs nor whole arms: its unit is unknown; taken as centimetres"
            )
            warnings.warn(
                FbaWarning(text).with_remedies(Remedy("scale", "give another, in metres, with {}", "0.001")),
                stacklevel=4,
            )
            return 0.01
        return unit

    def _root_places(self) -> Float:
        """(T, 3): where the root must be for the middle of the hips to be where the source's is."""
        centres, number = self.skeleton.centres, self.skeleton.number
        hips = [j for j in ("l_hip", "r_hip") if j in self.mapped]
        if len(hips) == 2 and "sacroiliac" in self.skeleton:
            middle = self.places[:, [self.mapped[j] for j in hips]].mean(axis=1) * self.scale
            pelvis = centres[number("sacroiliac")]
            own = centres[[number(j) for j in hips]].mean(axis=0)
            lower = self.wanted["sacroiliac"] @ (own - pelvis)
            place: Float = middle - lower - self.wanted["HumanoidRoot"] @ (pelvis - centres[0])
            return place
        start: Float = self.places[:, self.mapped["HumanoidRoot"]] * self.scale
        return start

"""Captured skeleton motion -> body animation parameters."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from fractions import Fraction
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from fba.animation import Animation, BodyTrack
from fba.body import BapSolver, wrapped
from fba.body.solving import joint_angles
from fba.capture import aiming, hinges, matching, rest, rotations
from fba.capture.motion import SkeletonMotion
from fba.errors import FbaWarning, ModelError
from fba.parameters import BAP_COUNT, baps

Float = npt.NDArray[np.float64]

CHUNK = 2048
"""Frames solved at a time: joint matrices of a long capture would not fit into memory."""
HINGES = (("shoulder", "elbow"), ("hip", "knee"))
ORIGINS = ("source", "start", "middle")
LOOSE = 1e-3
"""Weight of a free preference against a bone's direction."""


def from_skeleton(
    motion: SkeletonMotion,
    rate: Fraction | int | str | None = None,
    *,
    joints: Mapping[str, str] | None = None,
    scale: float | None = None,
    origin: str = "source",
    solver: BapSolver | None = None,
) -> Animation:
    """BAPs of a captured motion: a body track whose mask holds the BAPs of the joints that were found.

    rate: frames a second; the motion's own where None, else resampled (slerp). joints: source joint
    name -> joint of the standard, in place of the built-in families of names. scale: metres of the body
    for one unit of the source's root translation; by default the ratio of leg lengths, so the source's
    unit does not matter and feet do not slide. origin: what stands at the default place: "source", the
    source's own origin; "start", the first frame; "middle", the middle of the path, which keeps long walks
    within what a stream can carry. solver: skeleton and axes; the default body where None.

    Bones point where the source's bones point; the spine's parts turn the vertebrae that carry them;
    where the source turns about an axis that a joint lacks, the joint before or after it turns instead.
    BAPs 181..183 are millimetres from the default standing place. Angles are within +-pi; they are not
    clamped to the standard's ranges.

    Raises ModelError where no family of names fits or the skeleton has no size, ValueError for a bad
    rate, scale or joint name. Warns (FbaWarning) of what it leaves out.
    """
    solver = solver if solver is not None else BapSolver()
    _, mapped = matching.match(motion.names) if joints is None else ("", _given(motion, joints, solver))
    mapped = {joint: number for joint, number in mapped.items() if joint in solver.skeleton}
    if rate is not None:
        motion = motion.resample(rate)
    if not len(motion):
        raise ModelError("the motion has no frames")
    if origin not in ORIGINS:
        raise ValueError(f"origin must be one of {', '.join(ORIGINS)}, not {origin!r}")
    retarget = _Retarget(motion, mapped, solver, scale)
    values = retarget.values(origin)
    moved = np.zeros(BAP_COUNT, dtype=bool)
    turned = {*retarget.wanted, solver.skeleton.names[0]}
    moved[[b.number - 1 for b in baps() if b.joint in turned]] = True
    track = BodyTrack(values, np.broadcast_to(moved, values.shape))
    return Animation(motion.rate, np.arange(len(motion)), None, track, motion.name)


def _given(motion: SkeletonMotion, joints: Mapping[str, str], solver: BapSolver) -> dict[str, int]:
    result = {}
    for source, joint in joints.items():
        if joint not in solver.skeleton:
            raise ValueError(f"joints: the body has no joint {joint!r}")
        if source not in motion.names:
            raise ValueError(f"joints: the motion has no joint {source!r}")
        result[joint] = motion.names.index(source)
    if "HumanoidRoot" not in result:
        raise ValueError("joints: one source joint must be given for HumanoidRoot")
    return result


class _Retarget:
    """Wanted world rotations of the body's joints, then their BAPs."""

    def __init__(
        self, motion: SkeletonMotion, mapped: dict[str, int], solver: BapSolver, scale: float | None
    ) -> None:
        self.solver, self.motion, self.mapped = solver, motion, mapped
        self.skeleton = solver.skeleton
        alignment = rest.align(motion, mapped, self.skeleton)
        turned, places = motion.world()
        upright = alignment.upright
        self.places = places @ upright.T
        self.wanted: dict[str, Float] = {}
        for joint, correction in alignment.corrections.items():
            source = mapped.get(joint, mapped["HumanoidRoot"])
            world = upright @ rotations.matrices(turned[:, source]) @ upright.T
            self.wanted[joint] = world @ correction
        self.aims = alignment.aims
        for side in "lr":
            self._swing(f"{side}_sternoclavicular")
            for upper, lower in HINGES:
                self._hinge(f"{side}_{upper}", f"{side}_{lower}")
            self._foot(side)
        self.scale = self._scale() if scale is None else float(scale)
        if not (np.isfinite(self.scale) and self.scale > 0):
            raise ValueError(f"scale must be a positive number, not {scale}")

    def values(self, origin: str) -> npt.NDArray[np.int32]:
        """int32 (T, 296): the BAPs that reach the wanted rotations and places."""
        count = len(self.motion)
        numbers = {joint: self.skeleton.number(joint) for joint in self.wanted}
        result = np.zeros((count, BAP_COUNT), dtype=np.int32)
        root = self._root_places()
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

    def _bone(self, joint: str, aim: str) -> Float:
        vector = (
            self.skeleton.centres[self.skeleton.number(aim)]
            - self.skeleton.centres[self.skeleton.number(joint)]
        )
        unit: Float = vector / np.linalg.norm(vector)
        return unit

    def _direction(self, joint: str) -> Float:
        """(T, 3): where the bone that begins at a joint is to point."""
        return self.wanted[joint] @ self._bone(joint, self.aims[joint])

    def _turns(self, joint: str) -> tuple[Float, npt.NDArray[np.int64], Float]:
        """Signed axes (K, 3) of a joint's turns, outermost first, and their numbers (3,) and signs (3,)."""
        rules = self.solver.convention
        row = rules.joints.index(joint)
        count = len(rules.freedoms(joint))
        axes = np.eye(3)[rules.axis[row]] * rules.sign[row][:, None]
        return axes[:count], rules.axis[row], rules.sign[row]

    def _before(self, joint: str) -> Float:
        """Wanted rotation (T, 3, 3) of the closest joint above that is turned."""
        number = self.skeleton.number(joint)
        while (number := int(self.skeleton.parents[number])) >= 0:
            if self.skeleton.names[number] in self.wanted:
                return self.wanted[self.skeleton.names[number]]
        return np.broadcast_to(np.eye(3), (len(self.motion), 3, 3))

    def _closest(self, joint: str, local: Float) -> Float:
        axes, numbers, signs = self._turns(joint)
        angles = np.zeros((3, len(local)))
        frames_last = np.ascontiguousarray(np.moveaxis(local, 0, -1))
        joint_angles(frames_last, len(axes), numbers[None], signs[None], angles)
        return angles[: len(axes)].T

    def _swing(self, joint: str, bone: Float | None = None) -> None:
        """Joints with two freedoms: the bone's direction comes before its twist."""
        if joint not in self.aims:
            return
        axes, *_ = self._turns(joint)
        above = self._before(joint)
        wanted = _in(above, self._direction(joint))
        start = self._closest(joint, np.swapaxes(above, 1, 2) @ self.wanted[joint])
        if bone is None:
            bone = self._bone(joint, self.aims[joint])
        angles = aiming.aim(axes, start, bone, wanted, np.full(len(axes), LOOSE))
        self.wanted[joint] = above @ aiming.product(axes, angles)

    def _hinge(self, upper: str, lower: str) -> None:
        if self.aims.get(upper) != lower or lower not in self.aims:
            return
        upper_bone, lower_bone = self._bone(upper, lower), self._bone(lower, self.aims[lower])
        axes, *_ = self._turns(lower)
        if abs(axes[0] @ lower_bone) > abs(axes[1] @ lower_bone):
            self._swing(lower)  # a twist outside the flexion swings the bone anywhere by itself
            return
        limits = baps()[self.solver.convention.freedoms(lower)[0]].i_limits or (0, 0)
        hinge = hinges.Hinge(upper_bone, lower_bone, axes[0], axes[1], 1.0 if sum(limits) > 0 else -1.0)
        frame = self.wanted[upper]
        local = np.swapaxes(frame, 1, 2) @ self.wanted[lower]
        angles = hinges.solve(hinge, _in(frame, self._direction(lower)), local, float(self.motion.rate))
        turn, bend = hinges.matrices(hinge, angles)
        self.wanted[upper] = frame @ turn
        self.wanted[lower] = self.wanted[upper] @ bend

    def _foot(self, side: str) -> None:
        """The ankle lacks the roll of the foot: the subtalar joint, a little lower, takes it."""
        ankle, subtalar, toe = f"{side}_ankle", f"{side}_subtalar", f"{side}_metatarsal"
        if ankle not in self.wanted or subtalar not in self.skeleton:
            return
        foot = self.wanted[ankle]
        if self.aims.get(ankle) != toe:
            self.wanted[subtalar] = foot
            return
        places = {j: self.skeleton.centres[self.skeleton.number(j)] for j in (ankle, subtalar, toe)}
        heel, sole = places[subtalar] - places[ankle], places[toe] - places[subtalar]
        axes, *_ = self._turns(subtalar)
        above, direction = self._before(ankle), self._direction(ankle)
        ankle_axes, *_ = self._turns(ankle)
        start = self._closest(ankle, np.swapaxes(above, 1, 2) @ foot)
        angles = start
        roll = np.zeros((len(foot), 1))
        for _ in range(4):
            bent = heel + aiming.product(axes, roll) @ sole
            bent /= np.linalg.norm(bent, axis=1, keepdims=True)
            angles = aiming.aim(ankle_axes, start, bent, _in(above, direction), np.full(2, LOOSE))
            self.wanted[ankle] = above @ aiming.product(ankle_axes, angles)
            roll = self._closest(subtalar, np.swapaxes(self.wanted[ankle], 1, 2) @ foot)
            roll = np.clip(roll, -1.0, 1.0)
        bent = heel + aiming.product(axes, roll) @ sole
        bent /= np.linalg.norm(bent, axis=1, keepdims=True)
        angles = aiming.aim(ankle_axes, start, bent, _in(above, direction), np.full(2, LOOSE))
        self.wanted[ankle] = above @ aiming.product(ankle_axes, angles)
        self.wanted[subtalar] = self.wanted[ankle] @ aiming.product(axes, roll)

    def _scale(self) -> float:
        """Length of the body's legs over that of the source's."""
        for chain in (("hip", "knee", "ankle"), ("shoulder", "elbow", "wrist")):
            ours = theirs = 0.0
            for side in "lr":
                names = [f"{side}_{part}" for part in chain]
                if not all(name in self.mapped for name in names):
                    continue
                for a, b in pairwise(names):
                    numbers = self.skeleton.number(a), self.skeleton.number(b)
                    ours += float(
                        np.linalg.norm(self.skeleton.centres[numbers[1]] - self.skeleton.centres[numbers[0]])
                    )
                    theirs += float(
                        np.linalg.norm(self.places[0, self.mapped[b]] - self.places[0, self.mapped[a]])
                    )
            if theirs > 0:
                return ours / theirs
        warnings.warn(
            "the source has neither whole legs nor whole arms, so its unit is unknown; taken as centimetres "
            "(pass scale= for another)",
            FbaWarning,
            stacklevel=4,
        )
        return 0.01

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


def _in(frame: Float, direction: Float) -> Float:
    """World directions (T, 3) as seen in frames (T, 3, 3)."""
    result: Float = np.einsum("tji,tj->ti", frame, direction)
    return result

"""Retarget captured skeleton motion to BAPs."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from typing import get_args

import numpy as np

from fba import rotations
from fba.animation import Animation
from fba.arrays import Float64, Int32
from fba.body import BapSolver, Skeleton
from fba.body.solve.solver import solve_track
from fba.capture import _rest_alignment as rest_alignment
from fba.capture import _spine as spines
from fba.capture import retarget
from fba.capture.bones import LIMBS
from fba.capture.motion import SkeletonMotion
from fba.capture.preparation import prepare
from fba.choices import Ground, Origin, SignedUpAxis, Spine
from fba.errors import FbaWarning, ModelError
from fba.limits import DEFAULT_LIMITS, Limits
from fba.tracks import BodyTrack

ORIGINS: tuple[Origin, ...] = get_args(Origin)
GROUNDS: tuple[Ground, ...] = get_args(Ground)
SPINES = {"spread": 2, "joints": 0, "simple": 1, "full": spines.GROUPS}
MAX_FRAMES = 500_000
"""Frames of the longest motion: more than an hour at 120 frames/s."""
FRAME_BYTES = 2400
"""Memory, in bytes, that retargeting takes for each frame."""
JOINT_BYTES = 130
"""Memory, in bytes, that retargeting takes for each joint of the source in a frame."""
MIN_REST_COSINE = np.cos(np.radians(1.0))
"""Smallest cosine of the angle between a bone of a limb at rest and in the default posture."""
MAX_SIZE_DIFFERENCE = 1e-4
"""Share of the body's height by which a joint of the scaled figure may be off its place in the body."""
LIMB_BONES = tuple(bone for limb in LIMBS for bone in pairwise(limb))
"""Joints at both ends of each bone of a limb."""


def from_skeleton(
    motion: SkeletonMotion,
    rate: Fraction | int | str | None = None,
    *,
    joints: Mapping[str, str] | None = None,
    scale: float | None = None,
    origin: Origin = "source",
    ground: Ground = "floor",
    plant: bool = True,
    spine: Spine | int = "spread",
    rest: str | int = "auto",
    up: SignedUpAxis = "auto",
    solver: BapSolver | None = None,
    limits: Limits = DEFAULT_LIMITS,
) -> Animation:
    """Return the BAPs of a captured motion: a body track that sends the BAPs of the joints that were found.

    rate: frames per second; None for the motion's own, else it is resampled. joints: source joint name ->
    joint of the standard, in place of what the motion declares and of the built-in families of names. scale:
    metres of the body for one unit of the source's root translation; None for the ratio of leg lengths, so
    that the source's unit does not matter and feet do not slide.

    origin: what is at the body's default position: "source", the source's own origin; "start", the first
    frame; "middle", the middle of the path, which keeps long walks within the ranges of a stream. ground: how
    the height of the feet is corrected for the body's own proportions: "floor", feet stand on the ground at
    height 0, whatever the height of the source's ground; "source", at the height of the source's ground;
    "none", not corrected. plant: also bend and swing the legs a little, and move the body, so that feet have
    exactly the height of the source's and slip no more than these; no effect with ground "none".

    spine: "spread" divides the spine's rotations between the vertebrae of groups Spine1 and Spine2 and those
    of the source's joints, "full" between all vertebrae; both keep the directions of the source's bones
    exactly. "simple" turns the four vertebrae of group Spine1 only, a number those of the groups Spine1 up to
    that one: these keep the rotation of the head, and the rest as closely as possible. "joints" turns one
    vertebra for each joint of the source. solver: skeleton and axes; None for the default body.

    rest, up: the rest pose and the axis that points up; by default both are found, see
    `fba.capture.preparation.prepare`.

    Bones point in the directions of the source's bones. Where the source turns about an axis that a joint
    lacks, the joint before or after it turns instead. BAPs 181..183 are millimetres from the default standing
    position. Angles are within +-pi; they are not clamped to the standard's ranges. A skeleton of the
    standard's own joints that rests in the default posture (see `is_direct`) is converted
    joint for joint, wherever its feet are: ground has no effect, and spine only if it is "simple", "full" or
    a number.

    limits: what a motion may need at another rate, see `fba.Limits`.

    Raises ModelError if no family of names fits, the root of the solver's skeleton is not HumanoidRoot, the
    source has no size or there are more than 500,000 frames, LimitError for more than the limits allow,
    ValueError for a bad option or joint name. Warns
    (FbaWarning) of missing joints of a limb: they stay in the default posture.
    `fba.capture.retarget_report` measures how close the result comes.
    """
    options = _Options(joints, scale, origin, ground, plant, spine, rest, up)
    solver = solver if solver is not None else BapSolver()
    rate = motion.rate if rate is None else Fraction(rate)
    _check_frames(motion, rate, limits)
    return _retarget(motion, rate, options, solver, limits)


@dataclass(frozen=True)
class _Options:
    """Options of `from_skeleton`."""

    joints: Mapping[str, str] | None
    scale: float | None
    origin: Origin
    ground: Ground
    plant: bool
    spine: Spine | int
    rest: str | int
    up: SignedUpAxis

    def __post_init__(self) -> None:
        if self.origin not in ORIGINS:
            raise ValueError(f"origin must be one of {', '.join(ORIGINS)}, not {self.origin!r}")
        if self.ground not in GROUNDS:
            raise ValueError(f"ground must be one of {', '.join(GROUNDS)}, not {self.ground!r}")
        if not 0 <= self.groups <= spines.GROUPS:
            raise ValueError(f"spine must be {', '.join(SPINES)}, or 1 to 5 groups, not {self.spine!r}")
        if self.scale is not None and not (np.isfinite(self.scale) and self.scale > 0):
            raise ValueError(f"scale must be a positive number, not {self.scale}")

    @property
    def groups(self) -> int:
        """Groups of vertebrae that share the spine's rotations; -1 for what is no choice."""
        if isinstance(self.spine, str):
            return SPINES.get(self.spine, -1)
        return self.spine if isinstance(self.spine, int) else -1

    @property
    def turns_same_joints(self) -> bool:
        """Whether the joints of the source's spine turn, too."""
        return self.spine in ("spread", "joints")

    def is_direct(self, motion: SkeletonMotion, solver: BapSolver) -> bool:
        """Whether a motion is of the standard's own joints and needs no retargeting."""
        return (
            self.joints is None
            and not motion.declared
            and self.turns_same_joints
            and (self.rest, self.up) == ("auto", "auto")
            and is_direct(motion, solver.skeleton)
        )


def _check_frames(motion: SkeletonMotion, rate: Fraction, limits: Limits) -> None:
    """Raise ModelError or LimitError for a motion that has too many frames at a rate, or none."""
    if not len(motion):
        raise ModelError("the motion has no frames")
    frames = int((len(motion) - 1) * max(rate, Fraction(0)) / motion.rate) + 1  # checked before resampling
    if frames > MAX_FRAMES:
        raise ModelError(
            f"the motion has {frames} frames at {float(rate):g} frames/s, more than {MAX_FRAMES}; "
            "cut it into pieces, or give a lower rate"
        )
    if frames > len(motion):
        own_bytes = motion.rotations.nbytes + motion.positions.nbytes
        check_memory(limits, frames, len(motion.names), f"the motion at {float(rate):g} frames/s", own_bytes)


def _retarget(
    motion: SkeletonMotion, rate: Fraction, options: _Options, solver: BapSolver, limits: Limits
) -> Animation:
    """Return the BAPs of a motion at a rate."""
    direct = options.is_direct(motion, solver)
    mapped: dict[str, int] = {}
    if not direct:
        ready = prepare(motion, solver.skeleton, joints=options.joints, rest=options.rest, up=options.up)
        motion, mapped = ready.motion, ready.mapped
    motion = motion.resample(rate, limits=limits)
    missing = [
        joint for limb in LIMBS for joint in limb if any(j in mapped for j in limb) and joint not in mapped
    ]
    if missing:
        warnings.warn(
            f"the source has no joints for {', '.join(missing)}; they stay as they are",
            FbaWarning,
            stacklevel=3,
        )
    if direct:
        turned, root = _direct_targets(motion, solver.skeleton, options.scale)
    else:
        how = retarget.Retargeting(
            options.groups, options.turns_same_joints, options.scale, options.ground, options.plant
        )
        turned, root = retarget.find_targets(motion, mapped, solver, how)
    if options.origin != "source":
        centre = root[0] if options.origin == "start" else (root.min(axis=0) + root.max(axis=0)) / 2
        root[:, [0, 2]] -= (centre - solver.skeleton.centres[0])[[0, 2]]
    track = solve_targets(turned, root, solver)
    return Animation(motion.rate, np.arange(len(root)), None, track, motion.name)


def solve_targets(
    turned: Mapping[str, Float64], root: Float64, solver: BapSolver, previous: Int32 | None = None
) -> BodyTrack:
    """Return the BAPs of targets: joint -> rotations (T, 3, 3) in the world, and the root's path (T, 3).

    previous: BAPs (296,) of the frame before the first.
    """

    def matrices(rows: slice) -> Float64:
        frames = np.zeros((rows.stop - rows.start, len(solver.skeleton), 4, 4))
        frames[:, :, range(4), range(4)] = 1.0
        for joint, rotation in turned.items():
            frames[:, solver.skeleton.number(joint), :3, :3] = rotation[rows]
        frames[:, 0, :3, 3] = root[rows]
        return frames

    return solve_track(solver, turned, len(root), matrices, previous)


def check_memory(limits: Limits, frames: int, joints: int, what: str, source: int) -> None:
    """Raise LimitError if the retargeting of a motion would take more than the limits allow.

    what: "the motion". source: bytes of the file, or the part of it, that the motion comes from.
    """
    limits.check_frames(frames, what)
    limits.check_bytes(frames * (FRAME_BYTES + JOINT_BYTES * joints), what, source=source)


def is_direct(motion: SkeletonMotion, skeleton: Skeleton) -> bool:
    """Return whether the joints are the standard's, by name and hierarchy, and rest in the default posture.

    Files that this project writes are of this kind, and so is motion of any H-Anim figure that rests in the
    default posture. Retargeting would move the spine's rotations to other vertebrae, and turn clavicles and
    forearms as other skeletons need it. A motion without all limbs is not converted directly.
    """
    names = motion.names
    known = len(set(names)) == len(names) and all(name in skeleton for name in names)
    if not known or names[0] != skeleton.names[0]:
        return False
    for number in range(1, len(names)):
        above = int(skeleton.parents[skeleton.number(names[number])])
        while above >= 0 and skeleton.names[above] not in names:
            above = int(skeleton.parents[above])
        if above < 0 or names[motion.parents[number]] != skeleton.names[above]:
            return False
    if not all(upper in names and lower in names for upper, lower in LIMB_BONES):
        return False
    for upper, lower in LIMB_BONES:
        theirs = motion.offsets[names.index(lower)]
        ours = skeleton.centres[skeleton.number(lower)] - skeleton.centres[skeleton.number(upper)]
        if not theirs @ ours >= MIN_REST_COSINE * float(np.linalg.norm(theirs) * np.linalg.norm(ours)) > 0:
            return False
    return True


def _direct_targets(
    motion: SkeletonMotion, skeleton: Skeleton, scale: float | None
) -> tuple[dict[str, Float64], Float64]:
    """Return targets of a motion that `is_direct`, as `fba.capture.retarget.find_targets` does.

    scale: as for `fba.capture.from_skeleton`.
    """
    numbers = [skeleton.number(name) for name in motion.names]
    rest, (turned, _) = motion.rest() - motion.offsets[0], motion.world()
    targets = {name: rotations.matrices(turned[:, column]) for column, name in enumerate(motion.names)}
    default = skeleton.centres[numbers] - skeleton.centres[0]
    metres = scale
    if metres is None:
        metres = float((rest * default).sum() / (rest * rest).sum())
        if float(np.abs(rest * metres - default).max()) >= MAX_SIZE_DIFFERENCE * float(np.ptp(default[:, 1])):
            mapped = {name: column for column, name in enumerate(motion.names)}
            metres = rest_alignment.scale(motion, mapped, skeleton) or metres
    hips = [motion.names.index(f"{side}_hip") for side in "lr"]
    # a body of other proportions has its hips where the source has them
    shift = (rest[hips] * metres - default[hips]).mean(axis=0)
    return targets, motion.positions * metres + shift

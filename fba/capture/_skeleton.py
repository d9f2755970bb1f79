"""Retarget captured skeleton motion to BAPs."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from typing import Any, get_args

import numpy as np

from fba import rotations
from fba.animation import Animation
from fba.arrays import Float64, Int32
from fba.body import ROOT, BapSolver, Skeleton
from fba.body.solve.solver import solve_track
from fba.capture import _rest_alignment as rest_alignment
from fba.capture import _spine as spine
from fba.capture._limbs.foot_planting import plant_feet
from fba.capture._limbs.targets import Targets
from fba.capture._limbs.turning import turn_limbs
from fba.capture.bones import LIMBS
from fba.capture.motion import MappedMotion, SkeletonMotion
from fba.capture.preparation import Preparation, prepare
from fba.choices import Ground, Origin, SignedUpAxis, Spine
from fba.errors import FbaWarning, ModelError, Remedy, warn
from fba.limits import DEFAULT_LIMITS, Limits
from fba.tracks import BodyTrack

ORIGINS: tuple[Origin, ...] = get_args(Origin)
GROUNDS: tuple[Ground, ...] = get_args(Ground)
SPINES = {"spread": 2, "joints": 0, "simple": 1, "full": spine.GROUPS}
MIN_REST_COSINE = np.cos(np.radians(1.0))
"""Smallest cosine of the angle between a bone of a limb at rest and in the default posture."""
MAX_SIZE_DIFFERENCE = 1e-4
"""Share of the body's height by which a joint of the scaled figure may be off its place in the body."""
MAX_HIP_OFFSET = 1e-4
"""Largest distance of the hips from their places in the pelvis, as a share of the distance between them."""
LIMB_BONES = tuple(bone for limb in LIMBS for bone in pairwise(limb))
"""Joints at both ends of each bone of a limb."""


@dataclass(frozen=True, kw_only=True)
class SkeletonOptions:
    """How the motion of a skeleton becomes BAPs.

    scale: metres of the body for one unit of the source's root translation; None for the ratio of leg
    lengths, so that the source's unit does not matter and feet do not slide.

    origin: what is at the body's default position: "source", the source's own origin; "start", the first
    frame; "middle", the middle of the path, which keeps long walks within the ranges of a stream. ground: how
    the height of the feet is corrected for the body's own proportions: "floor", feet stand on the ground at
    height 0, whatever the height of the source's ground; "source", at the height of the source's ground;
    "none", not corrected. plant: also bend and swing the legs a little, and move the body, so that feet have
    exactly the height of the source's and slip no more than these; no effect with ground "none".

    spine: "spread" divides the spine's rotations between the vertebrae of groups Spine1 and Spine2 and those
    of the source's joints, "full" between all vertebrae; both keep the directions of the source's bones
    exactly. "simple" turns the four vertebrae of group Spine1 only, a number those of Spine1 and the next
    groups, that many in all: both keep the rotation of the head, and the rest as closely as possible.
    "joints" turns a vertebra for each joint of the source.

    joints: source joint name -> joint of the standard, in place of what the motion declares and of the
    built-in families of names. rest, up: the rest pose and the axis that points up; by default both are
    found, see `fba.capture.preparation.prepare`.

    Raises ValueError for a wrong value.
    """

    scale: float | None = None
    origin: Origin = "source"
    ground: Ground = "floor"
    plant: bool = True
    spine: Spine | int = "spread"
    joints: Mapping[str, str] | None = None
    rest: str | int = "auto"
    up: SignedUpAxis = "auto"

    def __post_init__(self) -> None:
        if self.origin not in ORIGINS:
            raise ValueError(f"origin must be one of {', '.join(ORIGINS)}, not {self.origin!r}")
        if self.ground not in GROUNDS:
            raise ValueError(f"ground must be one of {', '.join(GROUNDS)}, not {self.ground!r}")
        if not 0 <= self.groups <= SPINES["full"]:
            raise ValueError(f"spine must be {', '.join(SPINES)}, or 1 to 5 groups, not {self.spine!r}")
        if self.scale is not None and not (np.isfinite(self.scale) and self.scale > 0):
            raise ValueError(f"scale must be a positive number, not {self.scale}")

    @property
    def groups(self) -> int:
        """Number of groups of vertebrae that share the spine's rotations; -1 for a wrong choice."""
        if isinstance(self.spine, str):
            return SPINES.get(self.spine, -1)
        return self.spine if isinstance(self.spine, int) else -1

    @property
    def turns_same_joints(self) -> bool:
        """Whether the joints of the source's spine turn, too."""
        return self.spine in ("spread", "joints")


@dataclass(frozen=True, eq=False)
class Captured:
    """An animation that was made of a capture.

    capture: the capture as it was read; None where the file holds FAPs and BAPs themselves. ready: a
    skeleton's motion as it was prepared, with the bones that were found; None where nothing was prepared.
    """

    animation: Animation
    capture: Any = None
    ready: Preparation | None = None


def from_skeleton(
    motion: SkeletonMotion,
    rate: Fraction | int | str | None = None,
    *,
    solver: BapSolver | None = None,
    limits: Limits = DEFAULT_LIMITS,
    **options: Any,
) -> Animation:
    """Return the BAPs of a captured motion: a body track that sends the BAPs of the joints that were found.

    rate: frames per second; None for the motion's own, else it is resampled. solver: skeleton and axes; None
    for the default body. limits: what a motion may need at another rate, see `fba.Limits`. options: the
    fields of `SkeletonOptions`: scale, origin, ground, plant, spine, joints, rest and up. A motion that comes
    with a face has its FAPs, too.

    Bones point in the directions of the source's bones. Where the source turns about an axis that a joint
    lacks, the joint before or after it turns instead. BAPs 181..183 are millimetres from the default standing
    position. Angles are within +-pi; they are not clamped to the standard's ranges. A skeleton of the
    standard's joints that rests in the default posture (see `is_direct`) is converted joint for joint,
    wherever its feet are: ground has no effect, and spine only if it is "simple", "full" or a number.

    Raises ModelError if no family of names fits, the root of the solver's skeleton is not HumanoidRoot, the
    source has no size or there are more than 500,000 frames, LimitError for more than the limits allow,
    ValueError for a wrong option or joint name. Warns (FbaWarning) of missing joints of a limb: they stay in
    the default posture. `fba.capture.retarget_report` measures how close the result comes.
    """
    return retarget_motion(motion, rate, SkeletonOptions(**options), solver=solver, limits=limits).animation


def retarget_motion(
    motion: SkeletonMotion,
    rate: Fraction | int | str | None = None,
    options: SkeletonOptions | None = None,
    *,
    solver: BapSolver | None = None,
    limits: Limits = DEFAULT_LIMITS,
) -> Captured:
    """Return the animation that `from_skeleton` makes, with the motion and its preparation."""
    options = options if options is not None else SkeletonOptions()
    solver = solver if solver is not None else BapSolver()
    rate = motion.rate if rate is None else Fraction(rate)
    _check_frames(motion, rate, limits)
    ready = None
    if not _needs_no_retargeting(motion, options, solver):
        ready = prepare(motion, solver.skeleton, joints=options.joints, rest=options.rest, up=options.up)
    level = (motion if ready is None else ready.motion).resample(rate, limits=limits)
    if ready is None:
        turns, root = _direct_targets(level, solver.skeleton, options.scale)
    else:
        _warn_of_missing(ready.mapped)
        turns, root = find_targets(MappedMotion(level, ready.mapped), solver, options)
    if options.origin != "source":
        centre = root[0] if options.origin == "start" else (root.min(axis=0) + root.max(axis=0)) / 2
        root[:, [0, 2]] -= (centre - solver.skeleton.centres[0])[[0, 2]]
    body = solve_targets(turns, root, solver)
    frames = np.arange(len(root))
    face = None if motion.face is None else motion.face(frames / float(rate))
    return Captured(Animation(rate, frames, face, body, motion.name), motion, ready)


def _needs_no_retargeting(motion: SkeletonMotion, options: SkeletonOptions, solver: BapSolver) -> bool:
    """Whether a motion has the standard's joints, and no option asks for more."""
    return (
        options.joints is None
        and not motion.declared
        and options.turns_same_joints
        and (options.rest, options.up) == ("auto", "auto")
        and is_direct(motion, solver.skeleton)
    )


def _warn_of_missing(mapped: Mapping[str, int]) -> None:
    """Warn of missing joints of limbs that have others."""
    missing = [
        joint for limb in LIMBS for joint in limb if any(j in mapped for j in limb) and joint not in mapped
    ]
    if missing:
        warn(f"the source has no joints for {', '.join(missing)}; they stay as they are", stacklevel=4)


def _check_frames(motion: SkeletonMotion, rate: Fraction, limits: Limits) -> None:
    """Raise ModelError or LimitError for a motion that has too many frames at a rate, or none."""
    if not len(motion):
        raise ModelError("the motion has no frames")
    frames = int((len(motion) - 1) * max(rate, Fraction(0)) / motion.rate) + 1  # checked before resampling
    if frames > motion.MAX_FRAMES:
        raise ModelError(
            f"the motion has {frames} frames at {float(rate):g} frames/s, more than {motion.MAX_FRAMES}; "
            "cut it into pieces, or give a lower rate"
        )
    if frames > len(motion):
        source = motion.rotations.nbytes + motion.positions.nbytes
        motion.check_memory(
            limits, frames, len(motion.names), f"the motion at {float(rate):g} frames/s", source
        )


def is_direct(motion: SkeletonMotion, skeleton: Skeleton) -> bool:
    """Return whether the joints are the standard's, by name and hierarchy, and rest in the default posture.

    This holds for files that this project writes, and for motion of H-Anim figures that rest in the default
    posture. Retargeting would move the spine's rotations to other vertebrae, and turn clavicles and forearms
    as other skeletons need it. A motion without all limbs is not converted directly.
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
        source, body = motion.offsets[names.index(lower)], skeleton.bone(upper, lower)
        if not source @ body >= MIN_REST_COSINE * float(np.linalg.norm(source) * np.linalg.norm(body)) > 0:
            return False
    return True


def _direct_targets(
    motion: SkeletonMotion, skeleton: Skeleton, scale: float | None
) -> tuple[dict[str, Float64], Float64]:
    """Return what `find_targets` does, of a motion that `is_direct`. scale: see `SkeletonOptions`."""
    source = MappedMotion(motion, {name: number for number, name in enumerate(motion.names)})
    rest = motion.rest() - motion.offsets[0]
    default = skeleton.centres[[skeleton.number(name) for name in motion.names]] - skeleton.centres[0]
    metres = scale
    if metres is None:
        metres = float((rest * default).sum() / (rest * rest).sum())
        if float(np.abs(rest * metres - default).max()) >= MAX_SIZE_DIFFERENCE * float(np.ptp(default[:, 1])):
            metres = rest_alignment.scale(source, skeleton) or metres
    hips = [source.mapped[f"{side}_hip"] for side in "lr"]
    # a body of other proportions has its hips where the source has them
    shift = (rest[hips] * metres - default[hips]).mean(axis=0)
    return {name: source.rotations(name) for name in motion.names}, motion.positions * metres + shift


def find_targets(
    source: MappedMotion, solver: BapSolver, options: SkeletonOptions
) -> tuple[dict[str, Float64], Float64]:
    """Return targets of the body's joints and its root, in world axes, for a motion that was prepared.

    They are joint -> rotations (T, 3, 3), and the positions of the root (T, 3) in metres.
    """
    skeleton = solver.skeleton
    alignment = rest_alignment.align(source, skeleton)
    turns = {
        joint: source.rotations(joint if joint in source else ROOT) @ correction
        for joint, correction in alignment.corrections.items()
    }
    ankles = {side: f"{side}_ankle" for side in "lr" if f"{side}_subtalar" in skeleton}
    feet = {side: turns[ankle] for side, ankle in ankles.items() if ankle in turns}
    targets = Targets(solver, source, alignment.aims, turns, feet)
    _turn_pelvis(targets)
    spine.spread(targets, options.groups, options.turns_same_joints)
    turn_limbs(targets)
    metres = _metres_per_unit(targets) if options.scale is None else options.scale
    root = _root_positions(targets, metres)
    if options.ground != "none":
        root = plant_feet(targets, root, metres, options.ground, options.plant)
    return targets.rotations, root


def _turn_pelvis(targets: Targets) -> None:
    """Turn the pelvis to where the hips are, in files in which joints between the two turn as well."""
    source = targets.source
    if "l_hip" not in source or "r_hip" not in source:
        return
    row = source.rest["l_hip"] - source.rest["r_hip"]
    expected = source.rotations(ROOT) @ row
    found = source.positions["l_hip"] - source.positions["r_hip"]
    if np.abs(found - expected).max() <= MAX_HIP_OFFSET * np.linalg.norm(row):
        return
    apart = np.minimum(np.linalg.norm(expected, axis=1), np.linalg.norm(found, axis=1))
    if not apart.min() > 0:
        raise ModelError(
            f"both hips are in one place in frame {int(np.argmin(apart))}, so the pelvis cannot be turned; "
            "map other joints to the hips, or cut that frame"
        )
    turn = rotations.between_all(expected, found)
    for joint in (ROOT, "sacroiliac"):
        if joint in targets.rotations:
            targets.rotations[joint] = turn @ targets.rotations[joint]


def _metres_per_unit(targets: Targets) -> float:
    """Return metres of the body for one unit of the source, from the lengths of limbs.

    Warns (FbaWarning) if there is no limb to compare.
    """
    ratio = rest_alignment.scale(targets.source, targets.skeleton)
    if ratio is not None:
        return ratio
    text = "the source has neither whole legs nor whole arms: its unit is unknown; taken as centimetres"
    warnings.warn(
        FbaWarning(text).with_remedies(Remedy("scale", "give another, in metres, with {}", "0.001")),
        stacklevel=5,
    )
    return 0.01


def _root_positions(targets: Targets, metres: float) -> Float64:
    """Return positions (T, 3) of the root for which the middle of the hips is where the source's is."""
    source, skeleton = targets.source, targets.skeleton
    hips = [joint for joint in ("l_hip", "r_hip") if joint in source]
    if len(hips) < 2 or "sacroiliac" not in skeleton:
        return source.positions[ROOT] * metres
    middle = np.mean([source.positions[joint] for joint in hips], axis=0) * metres
    centres, number = skeleton.centres, skeleton.number
    lower = centres[[number(joint) for joint in hips]].mean(axis=0) - centres[number("sacroiliac")]
    pelvis = skeleton.bone(ROOT, "sacroiliac")
    result: Float64 = middle - targets.rotations["sacroiliac"] @ lower - targets.rotations[ROOT] @ pelvis
    return result


def solve_targets(
    turns: Mapping[str, Float64], root: Float64, solver: BapSolver, previous: Int32 | None = None
) -> BodyTrack:
    """Return the BAPs of targets: joint -> rotations (T, 3, 3) in the world, and the root's path (T, 3).

    previous: BAPs (296,) of the frame before the first.
    """

    def matrices(rows: slice) -> Float64:
        frames = np.zeros((rows.stop - rows.start, len(solver.skeleton), 4, 4))
        frames[:, :, range(4), range(4)] = 1.0
        for joint, turn in turns.items():
            frames[:, solver.skeleton.number(joint), :3, :3] = turn[rows]
        frames[:, 0, :3, 3] = root[rows]
        return frames

    return solve_track(solver, turns, len(root), matrices, previous)

"""Retarget captured skeleton motion to BAPs."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from typing import Any

import numpy as np

from fba import rotations
from fba.animation import Animation
from fba.arrays import Float64, Int32
from fba.body import BapSolver, Skeleton
from fba.body.solve.solver import solve_track
from fba.capture import _rest_alignment as rest_alignment
from fba.capture import _retarget as retarget
from fba.capture._retarget import SkeletonOptions
from fba.capture.bones import LIMBS
from fba.capture.motion import SkeletonMotion
from fba.capture.preparation import Preparation, prepare
from fba.errors import FbaWarning, ModelError
from fba.limits import DEFAULT_LIMITS, Limits
from fba.tracks import BodyTrack

MIN_REST_COSINE = np.cos(np.radians(1.0))
"""Smallest cosine of the angle between a bone of a limb at rest and in the default posture."""
MAX_SIZE_DIFFERENCE = 1e-4
"""Share of the body's height by which a joint of the scaled figure may be off its place in the body."""
LIMB_BONES = tuple(bone for limb in LIMBS for bone in pairwise(limb))
"""Joints at both ends of each bone of a limb."""


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
    if _needs_no_retargeting(motion, options, solver):
        level = motion.resample(rate, limits=limits)
        ready = None
        turned, root = _direct_targets(level, solver.skeleton, options.scale)
    else:
        ready = prepare(motion, solver.skeleton, joints=options.joints, rest=options.rest, up=options.up)
        level = ready.motion.resample(rate, limits=limits)
        _warn_of_missing(ready.mapped)
        turned, root = retarget.find_targets(level, ready.mapped, solver, options)
    if options.origin != "source":
        centre = root[0] if options.origin == "start" else (root.min(axis=0) + root.max(axis=0)) / 2
        root[:, [0, 2]] -= (centre - solver.skeleton.centres[0])[[0, 2]]
    body = solve_targets(turned, root, solver)
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
        warnings.warn(
            f"the source has no joints for {', '.join(missing)}; they stay as they are",
            FbaWarning,
            stacklevel=4,
        )


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
        source = motion.offsets[names.index(lower)]
        body = skeleton.centres[skeleton.number(lower)] - skeleton.centres[skeleton.number(upper)]
        if not source @ body >= MIN_REST_COSINE * float(np.linalg.norm(source) * np.linalg.norm(body)) > 0:
            return False
    return True


def _direct_targets(
    motion: SkeletonMotion, skeleton: Skeleton, scale: float | None
) -> tuple[dict[str, Float64], Float64]:
    """Return targets of a motion that `is_direct`, as `fba.capture._retarget.find_targets` does.

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

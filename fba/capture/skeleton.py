"""Captured skeleton motion -> body animation parameters."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from fractions import Fraction

import numpy as np

from fba.animation import Animation, BodyTrack
from fba.arrays import Int32
from fba.body import BapSolver
from fba.capture import _spine as spines
from fba.capture import _standard_skeleton as standard_skeleton
from fba.capture import matching
from fba.capture.motion import SkeletonMotion
from fba.capture.retarget import find_targets, metres_per_unit, solve_baps
from fba.errors import FbaWarning, ModelError
from fba.parameters import BAP_COUNT, baps

ORIGINS = ("source", "start", "middle")
GROUNDS = ("floor", "source", "none")
SPINES = {"spread": 2, "joints": 0, "simple": 1, "full": spines.GROUPS}
MOST_FRAMES = 500_000
"""More than an hour at 120 frames/s; every frame needs some 20 kB while it is worked on."""
LIMBS = tuple(
    tuple(f"{side}_{joint}" for joint in chain)
    for side in "lr"
    for chain in (("hip", "knee", "ankle"), ("shoulder", "elbow", "wrist"))
)
"""Of a limb that the source has at all, it should have all joints."""


def from_skeleton(
    motion: SkeletonMotion,
    rate: Fraction | int | str | None = None,
    *,
    joints: Mapping[str, str] | None = None,
    scale: float | None = None,
    origin: str = "source",
    ground: str = "floor",
    plant: bool = True,
    spine: str | int = "spread",
    solver: BapSolver | None = None,
) -> Animation:
    """BAPs of a captured motion: a body track whose mask holds the BAPs of the joints that were found.

    rate: frames a second; the motion's own where None, else resampled (slerp). joints: source joint name ->
    joint of the standard, in place of the built-in families of names. scale: metres of the body for one unit
    of the source's root translation; by default the ratio of leg lengths, so the source's unit does not
    matter and feet do not slide. origin: what stands at the default place: "source", the source's own
    origin; "start", the first frame; "middle", the middle of the path, which keeps long walks within what a
    stream can carry. ground: the height of the feet is corrected for the body's own proportions such that
    they stand where the source's stand: "floor", on the ground, height 0, whatever the height of the
    source's ground; "source", at the source's own height; "none", uncorrected. plant: what feet then still
    lack in height, and what they slip on the ground against the source's, legs make up for by bending and
    swinging a little, and the body by moving along; has no say where ground is "none". spine: "spread"
    shares the spine's rotations out over the vertebrae of groups Spine1 and Spine2 and those that the
    source's joints are, "full" over all; both keep the source's bones exactly. "simple" turns the four of
    group Spine1 only, a number the groups Spine1 up to that: these keep the head, and the rest as closely as
    they can. "joints" turns one vertebra for each joint of the source. solver: skeleton and axes; the
    default body where None.

    Bones point where the source's bones point; the spine's parts turn the vertebrae that carry them;
    where the source turns about an axis that a joint lacks, the joint before or after it turns instead.
    BAPs 181..183 are millimetres from the default standing place. Angles are within +-pi; they are not
    clamped to the standard's ranges. A skeleton of the standard's own joints that rests in the default
    posture (`fba.capture._standard_skeleton`) is taken joint for joint, wherever its feet are: ground has no
    say, and spine only where it is "simple", "full" or a number.

    Raises ModelError where no family of names fits, the skeleton has no size or there are more than 500,000
    frames, ValueError for a bad option or joint name. Warns (FbaWarning) of joints that a limb lacks: they
    stay in the default posture. `fba.capture.retarget_report` says how close the result comes.
    """
    solver = solver if solver is not None else BapSolver()
    _, mapped = matching.match(motion.names) if joints is None else ("", _given(motion, joints, solver))
    mapped = {joint: number for joint, number in mapped.items() if joint in solver.skeleton}
    rate = motion.rate if rate is None else Fraction(rate)
    if not len(motion):
        raise ModelError("the motion has no frames")
    frames = int((len(motion) - 1) * max(rate, Fraction(0)) / motion.rate) + 1  # before any is made
    if frames > MOST_FRAMES:
        raise ModelError(
            f"the motion has {frames} frames at {float(rate):g} frames/s, more than {MOST_FRAMES}; "
            "cut it into pieces, or give a lower rate"
        )
    motion = motion.resample(rate)
    if origin not in ORIGINS:
        raise ValueError(f"origin must be one of {', '.join(ORIGINS)}, not {origin!r}")
    if ground not in GROUNDS:
        raise ValueError(f"ground must be one of {', '.join(GROUNDS)}, not {ground!r}")
    groups = SPINES.get(spine, spine) if isinstance(spine, str) else spine
    if not isinstance(groups, int) or not 0 <= groups <= spines.GROUPS:
        raise ValueError(f"spine must be {', '.join(SPINES)}, or 1 to 5 groups, not {spine!r}")
    lacking = [
        joint for limb in LIMBS for joint in limb if any(j in mapped for j in limb) and joint not in mapped
    ]
    if lacking:
        warnings.warn(
            f"the source has no joints for {', '.join(lacking)}; they stay as they are",
            FbaWarning,
            stacklevel=2,
        )
    if (
        joints is None
        and spine in ("spread", "joints")
        and standard_skeleton.is_direct(motion, solver.skeleton)
    ):
        return _track(motion, standard_skeleton.values(motion, solver, scale, origin), set(motion.names))
    targets = find_targets(motion, mapped, solver, groups, with_anchors=spine in ("spread", "joints"))
    metres = metres_per_unit(targets, scale)
    turned = {*targets.rotations, solver.skeleton.names[0]}
    return _track(motion, solve_baps(targets, metres, origin, ground, plant), turned)


def _track(motion: SkeletonMotion, values: Int32, turned: set[str]) -> Animation:
    """The animation; turned: the joints whose BAPs are sent."""
    moved = np.zeros(BAP_COUNT, dtype=bool)
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

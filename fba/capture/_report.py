"""Measure how close BAPs come to the captured motion that they were made from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from fba import rotations
from fba.animation import Animation
from fba.arrays import Float64
from fba.body import BapSolver, ground
from fba.capture import _rest_alignment as rest_alignment
from fba.capture._limbs import soles
from fba.capture.motion import MappedMotion, SkeletonMotion
from fba.capture.preparation import Preparation, prepare
from fba.choices import SignedUpAxis
from fba.errors import ModelError

POSED_FRAMES = 2048
"""Number of frames that are posed at once, which bounds the memory."""
MAX_GROUND_HEIGHT = 0.01
"""Largest height, in metres, of a foot on the ground; also the largest error that `within` counts."""


@dataclass(frozen=True)
class BoneError:
    """Angles in degrees between a bone of the source and that of the body.

    joint, aim: joints of the standard at its ends. source: name of the source's joint. mean, worst: over all
    frames. frame: where the worst is.
    """

    joint: str
    aim: str
    source: str
    mean: float
    worst: float
    frame: int


@dataclass(frozen=True)
class FeetError:
    """Errors in metres of the heights of soles above the ground, while the source's foot is on it.

    ground: height of the source's. frames: number of frames in which a foot is on the ground, counted for
    each foot. mean, worst: of the differences between the source, scaled, and the body. within: share of
    differences up to 1 cm.
    """

    ground: float
    frames: int
    mean: float
    worst: float
    within: float


@dataclass(frozen=True)
class RetargetReport:
    """Result of retargeting a captured skeleton.

    family: of the joint names; empty for joints that the caller gave. bones: in the body's order. feet: None
    if the source has no ankles, or its feet are never on the ground. unused: joints of the source that move
    no joint of the body. missing: joints that BAPs can turn, but the source lacks. found: reason and
    confidence of "bones", "up" and "rest", in words.
    """

    family: str
    frames: int
    bones: tuple[BoneError, ...]
    feet: FeetError | None
    unused: tuple[str, ...]
    missing: tuple[str, ...]
    found: dict[str, str] = field(default_factory=dict)

    @property
    def mean(self) -> float:
        """Mean angle over all bones and frames, degrees; 0 without bones."""
        return float(np.mean([bone.mean for bone in self.bones])) if self.bones else 0.0

    @property
    def worst(self) -> float:
        """Largest angle of any bone in any frame, degrees; 0 without bones."""
        return max((bone.worst for bone in self.bones), default=0.0)


def retarget_report(
    motion: SkeletonMotion,
    animation: Animation,
    *,
    joints: Mapping[str, str] | None = None,
    scale: float | None = None,
    rest: str | int = "auto",
    up: SignedUpAxis = "auto",
    solver: BapSolver | None = None,
) -> RetargetReport:
    """Compare an animation, such as a decoded one, with the motion it was made from.

    joints, scale, rest, up, solver: as they were given to `from_skeleton`. If rates differ, the motion is
    resampled; frames that only one of the two has are left out. ModelError if the animation has no body or no
    frame in common with the motion; errors of names and skeletons as from `from_skeleton`.
    """
    solver = solver if solver is not None else BapSolver()
    if animation.body is None:
        raise ModelError("retarget_report: the animation has no body")
    if not len(motion) or not len(animation):
        raise ModelError("retarget_report: the motion and the animation have no frame in common")
    ready = prepare(motion, solver.skeleton, joints=joints, rest=rest, up=up)
    return measure_bones(ready, animation, scale=scale, solver=solver)


def measure_bones(
    ready: Preparation, animation: Animation, *, scale: float | None = None, solver: BapSolver | None = None
) -> RetargetReport:
    """Return the same as `retarget_report` for a motion that was prepared, and an animation with a body."""
    solver = solver if solver is not None else BapSolver()
    skeleton = solver.skeleton
    source = MappedMotion(ready.motion.resample(animation.rate), ready.mapped)
    assert animation.body is not None
    count = min(len(source.motion), len(animation))

    alignment = rest_alignment.align(source, skeleton)
    order = {name: number for number, name in enumerate(skeleton.names)}
    aims = sorted(alignment.aims.items(), key=lambda pair: order[pair[0]])
    angles = np.zeros((count, len(aims)))
    heights = np.zeros((2, count))
    has_feet = True
    metres = rest_alignment.scale(source, skeleton) if scale is None else scale
    source_soles = soles.source_soles(source, metres) if metres else None
    for begin in range(0, count, POSED_FRAMES):
        end = min(begin + POSED_FRAMES, count)
        matrices = solver.pose(animation.body.values[begin:end])
        for column, (joint, aim) in enumerate(aims):
            body_bone = matrices[:, order[aim], :3, 3] - matrices[:, order[joint], :3, 3]
            if joint in rest_alignment.neutral_joints():
                at_rest = alignment.corrections[joint] @ skeleton.bone(joint, aim)
                source_bone = source.rotations(joint, slice(begin, end)) @ at_rest
            else:
                source_bone = source.positions[aim][begin:end] - source.positions[joint][begin:end]
            angles[begin:end, column] = rotations.degrees_between(body_bone, source_bone)
        frames = {name: matrices[:, number, :3, :3] for name, number in order.items()}
        body = soles.body_soles(skeleton, frames, matrices[:, 0, :3, 3])
        has_feet = body is not None
        if body is not None:
            heights[:, begin:end] = body.lowest
    bones = tuple(
        BoneError(
            joint,
            aim,
            source.motion.names[source.mapped[joint]],
            float(angles[:, column].mean()),
            float(angles[:, column].max()),
            int(angles[:, column].argmax()),
        )
        for column, (joint, aim) in enumerate(aims)
    )
    feet = None
    if has_feet and source_soles is not None:
        feet = _feet(source_soles, heights, float(source.motion.rate))
    used = set(source.mapped.values())
    return RetargetReport(
        ready.family,
        count,
        bones,
        feet,
        tuple(name for number, name in enumerate(source.motion.names) if number not in used),
        tuple(joint for joint in solver.convention.joints if joint in skeleton and joint not in source),
        {
            what: f"{reason} (confidence {ready.confidence[what]:.2f})"
            for what, reason in ready.reasons.items()
        },
    )


def _feet(source: soles.Soles, body: Float64, rate: float) -> FeetError | None:
    """Return the errors of the soles' heights, body (2, T); None if no foot is on the ground."""
    level = ground.level_under(source.lowest, source.points)
    above = soles.settle(source.lowest - level, source.points, rate)[:, : body.shape[1]]
    level = level[:, : body.shape[1]]
    standing = above < MAX_GROUND_HEIGHT
    if not standing.any():
        return None
    # the ground of the body is at height 0 or at the source's: its feet fit one of them better
    errors = [np.abs(body - floor - above)[standing] for floor in (np.zeros_like(level), level)]
    error = min(errors, key=lambda e: float(np.median(e)))
    return FeetError(
        float(np.median(level[standing])),
        int(standing.sum()),
        float(error.mean()),
        float(error.max()),
        float((error <= MAX_GROUND_HEIGHT).mean()),
    )

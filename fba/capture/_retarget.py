"""`SkeletonOptions`, and the targets of joints with which a body moves like a captured skeleton."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import get_args

import numpy as np

from fba import rotations
from fba.arrays import Float64
from fba.body import ROOT, BapSolver
from fba.capture import _rest_alignment as rest_alignment
from fba.capture import _spine as spine
from fba.capture._limbs import bone_ik, hinges
from fba.capture._limbs.foot_planting import plant_feet, turn_foot
from fba.capture._limbs.targets import Targets
from fba.capture._named_bones import FINGERS
from fba.capture.motion import SkeletonMotion
from fba.choices import Ground, Origin, SignedUpAxis, Spine
from fba.errors import FbaWarning, ModelError, Remedy
from fba.parameters import baps

ORIGINS: tuple[Origin, ...] = get_args(Origin)
GROUNDS: tuple[Ground, ...] = get_args(Ground)
SPINES = {"spread": 2, "joints": 0, "simple": 1, "full": spine.GROUPS}
HINGES = (("shoulder", "elbow"), ("hip", "knee"))
SWING_WEIGHT = 1e-3
"""Weight of staying close to the source's angles, relative to that of a bone's direction."""
FINGER_WEIGHTS = {"thumb": 0.3, "index": 0.1, "middle": 0.1, "ring": 0.1, "pinky": 0.1}
"""The same for fingers, which are often straight: the weight keeps their knuckles from turning far. That of
thumbs is larger, as sources bend them in different planes: to point exactly as in the source, they would need
angles that thumbs do not reach and the standard's I planes do not carry."""
FOREARM_SHARE = 0.5
"""Share of the hand's twist that the forearm takes, whose radius and ulna turn about each other."""
MAX_FOREARM_SPEED = 10.0
"""Largest speed of a forearm's twist, in radians per second. Hands that flip faster, as where angles of a
capture change sides, do so at the wrist."""
MAX_HIP_OFFSET = 1e-4
"""Largest distance of the hips from their places in the pelvis, as a share of the distance between them."""
CLAVICLE_SHARE = 0.5
"""Share of the clavicle's turn at the breastbone's joint; the joint at the shoulder blade takes the rest."""


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


def find_targets(
    motion: SkeletonMotion, mapped: dict[str, int], solver: BapSolver, options: SkeletonOptions
) -> tuple[dict[str, Float64], Float64]:
    """Return targets of the body's joints and its root, in world axes.

    They are joint -> rotations (T, 3, 3), and the positions of the root (T, 3) in metres. mapped: joint of
    the body -> number of the source's joint. motion: as `fba.capture.preparation` leaves it.
    """
    skeleton = solver.skeleton
    alignment = rest_alignment.align(motion, mapped, skeleton)
    source_rotations, source_positions = motion.world()
    turned: dict[str, Float64] = {}
    for joint, correction in alignment.corrections.items():
        source = mapped.get(joint, mapped[ROOT])
        turned[joint] = rotations.matrices(source_rotations[:, source]) @ correction
    _turn_pelvis(motion, mapped, source_rotations, source_positions, turned)
    anchors = [joint for joint in spine.joints(skeleton) if joint in mapped]
    if options.groups and len(anchors) > 1:
        positions = {joint: source_positions[:, mapped[joint]] for joint in anchors}
        spine.spread(skeleton, turned, positions, anchors, options.groups, options.turns_same_joints)
    feet = {
        side: turned[f"{side}_ankle"]
        for side in "lr"
        if f"{side}_ankle" in turned and f"{side}_subtalar" in skeleton
    }
    targets = Targets(
        solver, motion, mapped, alignment.aims, source_rotations, source_positions, turned, feet
    )
    for side in "lr":
        _turn_clavicle(targets, side)
        _twist_forearm(targets, side)
        for upper, lower in HINGES:
            _bend_hinge(targets, f"{side}_{upper}", f"{side}_{lower}")
        turn_foot(targets, side)
        for finger in FINGERS:
            _curl_finger(targets, f"{side}_{finger}")
    metres = _metres_per_unit(targets) if options.scale is None else options.scale
    root = _root_positions(targets, metres)
    if options.ground != "none":
        root = plant_feet(targets, root, metres, options.ground, options.plant)
    return targets.rotations, root


def _turn_pelvis(
    motion: SkeletonMotion, mapped: dict[str, int], quaternions: Float64, positions: Float64,
    turned: dict[str, Float64],
) -> None:  # fmt: skip
    """Turn the pelvis to where the hips are, in files in which joints between the two turn as well.

    quaternions, positions: (T, J, 4), (T, J, 3), of the source in the world.
    """
    hips = [mapped[joint] for joint in ("l_hip", "r_hip") if joint in mapped]
    if len(hips) < 2:
        return
    at_rest = motion.rest()
    row = at_rest[hips[0]] - at_rest[hips[1]]
    frames = rotations.matrices(quaternions[:, mapped[ROOT]])
    expected, found = frames @ row, positions[:, hips[0]] - positions[:, hips[1]]
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
        if joint in turned:
            turned[joint] = turn @ turned[joint]


def _metres_per_unit(targets: Targets) -> float:
    """Return metres of the body for one unit of the source, from the lengths of limbs.

    Warns (FbaWarning) if there is no limb to compare.
    """
    ratio = rest_alignment.scale(targets.motion, targets.mapped, targets.skeleton)
    if ratio is not None:
        return ratio
    text = "the source has neither whole legs nor whole arms: its unit is unknown; taken as centimetres"
    warnings.warn(
        FbaWarning(text).with_remedies(Remedy("scale", "give another, in metres, with {}", "0.001")),
        stacklevel=5,
    )
    return 0.01


def _swing(targets: Targets, joint: str) -> None:
    """Turn a joint so that its bone points in its target direction; the twist comes second."""
    axes, *_ = targets.axes(joint)
    above = targets.parent_rotation(joint)
    wanted = rotations.inside(above, targets.direction(joint))
    start = targets.closest_angles(joint, np.swapaxes(above, 1, 2) @ targets.rotations[joint])
    bone = targets.bone(joint, targets.aims[joint])
    angles = bone_ik.aim(axes, start, bone, wanted, np.full(len(axes), SWING_WEIGHT))
    targets.rotations[joint] = above @ bone_ik.product(axes, angles)


def _bend_hinge(targets: Targets, upper: str, lower: str) -> None:
    """Turn a shoulder or hip and bend the elbow or knee below it to point the lower bone in its direction."""
    if targets.aims.get(upper) != lower or lower not in targets.aims:
        return
    upper_bone, lower_bone = targets.bone(upper, lower), targets.bone(lower, targets.aims[lower])
    axes, *_ = targets.axes(lower)
    if abs(axes[0] @ lower_bone) > abs(axes[1] @ lower_bone):
        _swing(targets, lower)  # with the twist outermost, the joint alone points the bone in any direction
        return
    limits = baps()[targets.solver.convention.freedoms(lower)[0]].i_limits or (0, 0)
    hinge = hinges.Hinge(upper_bone, lower_bone, axes[0], axes[1], 1.0 if sum(limits) > 0 else -1.0)
    frame = targets.rotations[upper]
    local = np.swapaxes(frame, 1, 2) @ targets.rotations[lower]
    angles = hinges.solve(
        hinge, rotations.inside(frame, targets.direction(lower)), local, float(targets.motion.rate)
    )
    targets.rotations[upper] = frame @ rotations.turn(hinge.upper, angles[:, 0])
    targets.rotations[lower] = targets.rotations[upper] @ bone_ik.product(axes[:2], angles[:, 1:])


def _turn_clavicle(targets: Targets, side: str) -> None:
    """Turn both joints of the clavicle so that together they point at the shoulder."""
    inner, outer, shoulder = f"{side}_sternoclavicular", f"{side}_acromioclavicular", f"{side}_shoulder"
    if targets.aims.get(inner) != shoulder:
        return
    if outer not in targets.skeleton:
        _swing(targets, inner)
        return
    centres = [targets.skeleton.centres[targets.skeleton.number(j)] for j in (inner, outer, shoulder)]
    length = float(np.linalg.norm(centres[2] - centres[0]))
    pieces = [(b - a) / length for a, b in pairwise(centres)]
    axes = np.concatenate([targets.axes(inner)[0], targets.axes(outer)[0]])
    above = targets.parent_rotation(inner)
    turn = targets.closest_angles(inner, np.swapaxes(above, 1, 2) @ targets.rotations[inner])
    start = np.concatenate([turn * CLAVICLE_SHARE, turn * (1 - CLAVICLE_SHARE)], axis=1)
    inner_axes = turn.shape[1]
    target = bone_ik.Target(
        ((pieces[0], inner_axes), (pieces[1], len(axes))), rotations.inside(above, targets.direction(inner))
    )
    angles = bone_ik.aim_all(axes, start, (target,), np.full(len(axes), SWING_WEIGHT))
    targets.rotations[inner] = above @ bone_ik.product(axes[:inner_axes], angles[:, :inner_axes])
    targets.rotations[outer] = targets.rotations[inner] @ bone_ik.product(
        axes[inner_axes:], angles[:, inner_axes:]
    )


def _twist_forearm(targets: Targets, side: str) -> None:
    """Give the forearm its share of the hand's twist."""
    elbow, wrist = f"{side}_elbow", f"{side}_wrist"
    if elbow not in targets.rotations or wrist not in targets.mapped or wrist not in targets.skeleton:
        return
    bone = targets.bone(elbow, wrist)
    twist = hinges.turn_about(np.swapaxes(targets.rotations[elbow], 1, 2) @ targets.rotations[wrist], bone)
    share = _slow_down(FOREARM_SHARE * twist, MAX_FOREARM_SPEED / float(targets.motion.rate))
    targets.rotations[elbow] = targets.rotations[elbow] @ rotations.turn(bone, share)


def _slow_down(angles: Float64, most: float) -> Float64:
    """Return angles (T,) that change by no more than `most` from frame to frame, and else are the same."""
    if len(angles) < 2 or np.abs(np.diff(angles)).max() <= most:
        return angles
    forwards, backwards = angles.tolist(), angles[::-1].tolist()
    for path in (forwards, backwards):
        for n in range(1, len(path)):
            path[n] = min(max(path[n], path[n - 1] - most), path[n - 1] + most)
    result: Float64 = (np.array(forwards) + np.array(backwards[::-1])) / 2
    return result


def _curl_finger(targets: Targets, finger: str) -> None:
    """Turn a finger's knuckle so that the finger curls in the same plane as the source's."""
    joints = [f"{finger}{n}" for n in (1, 2, 3)]
    joints = joints[: next((n for n, j in enumerate(joints) if j not in targets.aims), 3)]
    if len(joints) < 2:
        if joints:
            _swing(targets, joints[0])
        return
    above = targets.parent_rotation(joints[0])
    axes: list[Float64] = []
    starts: list[Float64] = []
    goals = []
    before = above
    for joint in joints:
        axes.extend(targets.axes(joint)[0])
        starts.append(targets.closest_angles(joint, np.swapaxes(before, 1, 2) @ targets.rotations[joint]))
        before = targets.rotations[joint]
        piece = (targets.bone(joint, targets.aims[joint]), len(axes))
        goals.append(bone_ik.Target((piece,), rotations.inside(above, targets.direction(joint))))
    turned = np.array(axes)
    start = np.concatenate(starts, axis=1)
    angles = bone_ik.aim_all(turned, start, goals, np.full(len(turned), FINGER_WEIGHTS[finger[2:]]))
    used = 0
    frame = above
    for joint, joint_angles in zip(joints, starts, strict=True):
        part = slice(used, used + joint_angles.shape[1])
        frame = frame @ bone_ik.product(turned[part], angles[:, part])
        targets.rotations[joint] = frame
        used = part.stop


def _root_positions(targets: Targets, scale: float) -> Float64:
    """Return positions (T, 3) of the root for which the middle of the hips is where the source's is."""
    centres, number = targets.skeleton.centres, targets.skeleton.number
    hips = [joint for joint in ("l_hip", "r_hip") if joint in targets.mapped]
    if len(hips) < 2 or "sacroiliac" not in targets.skeleton:
        return targets.source_positions[:, targets.mapped[ROOT]] * scale
    middle = targets.source_positions[:, [targets.mapped[joint] for joint in hips]].mean(axis=1) * scale
    pelvis = centres[number("sacroiliac")]
    lower = centres[[number(joint) for joint in hips]].mean(axis=0) - pelvis
    pelvis_shift = targets.rotations["sacroiliac"] @ lower
    result: Float64 = middle - pelvis_shift - targets.rotations[ROOT] @ (pelvis - centres[0])
    return result

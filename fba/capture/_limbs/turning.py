"""Turn the joints of the limbs so that bones point where the source's do, about the axes that joints have."""

from __future__ import annotations

import numpy as np

from fba import rotations
from fba.arrays import Float64
from fba.capture._limbs import bone_ik, hinges
from fba.capture._limbs.foot_planting import turn_foot
from fba.capture._limbs.targets import Targets
from fba.parameters import baps

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
CLAVICLE_SHARE = 0.5
"""Share of the clavicle's turn at the breastbone's joint; the joint at the shoulder blade takes the rest."""


def turn_limbs(targets: Targets) -> None:
    """Turn arms, legs, feet and fingers of both sides."""
    for side in "lr":
        _turn_clavicle(targets, side)
        _twist_forearm(targets, side)
        for upper, lower in HINGES:
            _bend_hinge(targets, f"{side}_{upper}", f"{side}_{lower}")
        turn_foot(targets, side)
        for finger in FINGER_WEIGHTS:
            _curl_finger(targets, f"{side}_{finger}")


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
        hinge, rotations.inside(frame, targets.direction(lower)), local, float(targets.source.motion.rate)
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
    length = float(np.linalg.norm(targets.skeleton.bone(inner, shoulder)))
    pieces = [targets.skeleton.bone(a, b) / length for a, b in ((inner, outer), (outer, shoulder))]
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
    if elbow not in targets.rotations or wrist not in targets.source or wrist not in targets.skeleton:
        return
    bone = targets.bone(elbow, wrist)
    twist = hinges.turn_about(np.swapaxes(targets.rotations[elbow], 1, 2) @ targets.rotations[wrist], bone)
    share = _slow_down(FOREARM_SHARE * twist, MAX_FOREARM_SPEED / float(targets.source.motion.rate))
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

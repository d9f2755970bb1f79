"""The upper body of a walk: spine, head, shoulders, arms, fingers.

Inverse kinematics bring the palms to their positions in the poses, as in the synthesis of
chapter 5 of the thesis that `fba.body.gait` names.
"""

from __future__ import annotations

import numpy as np

from fba.arrays import Float64
from fba.body.gait._anatomy import Side, Writer
from fba.body.gait._characters import Character
from fba.body.gait._curves import cosine_wave, periodic_curve
from fba.body.gait._limb import limb_angles
from fba.body.gait._plan import KNOTS, Plan
from fba.body.skeleton import Skeleton
from fba.body.solve.solver import BapSolver

LUMBAR = tuple(f"vl{n}" for n in (5, 4, 3, 2, 1))
THORAX = tuple(f"vt{n}" for n in range(12, 0, -1))
NECK = tuple(f"vc{n}" for n in range(7, 0, -1))
HEAD = ("skullbase",)
FINGERS = ("index", "middle", "ring", "pinky")
_MORE_CURL = {"index": 0.75, "middle": 0.95, "ring": 1.1, "pinky": 1.2}
"""Factors of the curl of each finger: a hand at rest closes towards the little finger."""

_LATE = 0.02
"""Fraction of the cycle by which arms lag behind the legs."""
_REACH = 0.995
"""Share of its length to which an arm may stretch."""


def _turn_spine(
    writer: Writer, skeleton: Skeleton, joints: tuple[str, ...], axis: int, angle: Float64
) -> None:
    """Turn a part of the spine by an angle, radians, shared evenly among those joints the skeleton has."""
    present = [joint for joint in joints if joint in skeleton]
    for joint in present:
        writer.turn(joint, axis, angle / len(present))


def write_posture(writer: Writer, skeleton: Skeleton, plan: Plan, phase: Float64) -> None:
    """Write the angles of spine, head, shoulder girdles and fingers at phases of the cycle.

    The shoulders turn against the pelvis; the neck turns back, so that the face keeps looking ahead.
    """
    spine, arms = plan.character.spine, plan.character.arms
    kind = plan.interpolation
    constant = np.ones(phase.shape)
    turn = -np.radians(spine.turn) * min(plan.stride_ratio, 1.5) * cosine_wave(KNOTS, phase, kind)
    # the right leg carries first, so the first lean is to the right
    lean = np.radians(spine.lean) * cosine_wave(KNOTS, phase - 0.25, kind)
    nod = np.radians(spine.nod) * np.cos(4.0 * np.pi * phase)
    for joints, x, y, z in (
        (LUMBAR, spine.lumbar, 0.35 * turn, 0.6 * lean),
        (THORAX, spine.thorax, 0.65 * turn, 0.4 * lean),
        (NECK, spine.neck, -0.7 * turn, -0.6 * lean),
        (HEAD, spine.head, -0.3 * turn, -0.4 * lean),
    ):
        bent = np.radians(x) * constant + (nod if joints is HEAD else -nod if joints is NECK else 0.0)
        for axis, values in ((0, bent), (1, y), (2, z)):
            _turn_spine(writer, skeleton, joints, axis, values)
    for letter, sign in (("l", 1.0), ("r", -1.0)):
        girdle = f"{letter}_sternoclavicular"
        if girdle in skeleton:
            writer.turn(girdle, 2, sign * np.radians(arms.up) * constant)
            writer.turn(girdle, 1, -sign * np.radians(arms.forward) * constant)
        for finger in FINGERS:
            for number in (1, 2, 3):
                joint = f"{letter}_{finger}{number}"
                if joint in skeleton:
                    # fingers flex about z: they curl inward, towards the thigh
                    curl = np.radians(arms.curl * _MORE_CURL[finger])
                    writer.turn(joint, 2, -sign * curl * constant)


def _palm_goals(side: Side, character: Character, size: float) -> Float64:
    """Return (8, 3), vectors from the shoulder to the palm in the eight poses of this side's leg, metres."""
    out, down, forward = (np.array(character.curve(field)) for field in ("out", "down", "forward"))
    swing = forward - forward.mean()
    forward = forward.mean() + swing * np.clip(size, 0.0, 1.4)
    goal = np.stack([side.sign * out, -down, forward], axis=-1) * side.arm.reach
    length = np.linalg.norm(goal, axis=-1, keepdims=True)
    result: Float64 = goal * np.minimum(1.0, _REACH * side.arm.reach / length)
    return result


def swing_arms(writer: Writer, plan: Plan, phase: Float64) -> None:
    """Write the angles of shoulders and elbows; writer.values must already hold the spine.

    In the poses the palms are where the character has them; in between, angles are interpolated.
    """
    anatomy, character = plan.anatomy, plan.character
    solver = BapSolver(anatomy.skeleton)
    parents = anatomy.skeleton.parents
    for letter, side in anatomy.sides.items():
        start = 0.0 if letter == "r" else 0.5
        poses = np.mod(KNOTS + start + _LATE, 1.0)
        nearest = np.array([np.argmin(np.abs(np.mod(phase - p + 0.5, 1.0) - 0.5)) for p in poses])
        shoulder = anatomy.skeleton.number(f"{letter}_shoulder")
        matrices = solver.pose(writer.values[nearest])[:, parents[shoulder], :3, :3]
        # goals are relative to a frame that moves with the body, level and facing ahead
        local = np.einsum("tji,tj->ti", matrices, _palm_goals(side, character, plan.stride_ratio))
        twist = -side.sign * np.radians(character.arms.twist)
        upper, bend = side.arm.solve(local, np.full(len(KNOTS), twist))
        x, y, z = limb_angles(upper)
        arm_phase = phase - start - _LATE
        for axis, angle in ((0, x), (1, y), (2, z)):
            writer.turn(
                f"{letter}_shoulder", axis, periodic_curve(KNOTS, angle, arm_phase, plan.interpolation)
            )
        writer.turn(f"{letter}_elbow", 0, -periodic_curve(KNOTS, bend, arm_phase, plan.interpolation))
        wrist = -side.sign * np.radians(character.arms.wrist)
        writer.turn(f"{letter}_wrist", 2, np.full(phase.shape, wrist))

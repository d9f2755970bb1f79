"""What rides on the legs: spine, head, shoulders, fingers."""

from __future__ import annotations

import numpy as np

from fba.arrays import Float64
from fba.body.gait._anatomy import Writer
from fba.body.gait._curves import cosine
from fba.body.gait._plan import KNOTS, Plan
from fba.body.skeleton import Skeleton

LUMBAR = tuple(f"vl{n}" for n in (5, 4, 3, 2, 1))
THORAX = tuple(f"vt{n}" for n in range(12, 0, -1))
NECK = tuple(f"vc{n}" for n in range(7, 0, -1))
HEAD = ("skullbase",)
FINGERS = ("index", "middle", "ring", "pinky")
_MORE_CURL = {"index": 0.75, "middle": 0.95, "ring": 1.1, "pinky": 1.2}
"""A hand at rest closes towards the little finger."""


def spread(writer: Writer, skeleton: Skeleton, joints: tuple[str, ...], axis: int, angle: Float64) -> None:
    """Turn a part of the spine by an angle, radians, shared evenly by those of its joints that there are."""
    there = [joint for joint in joints if joint in skeleton]
    for joint in there:
        writer.turn(joint, axis, angle / len(there))


def hold(writer: Writer, skeleton: Skeleton, plan: Plan, phase: Float64) -> None:
    """Write the posture at phases of the cycle, from the contact of the right foot on.

    The shoulders turn against the pelvis; the neck turns back, so that the face looks ahead.
    """
    spine, arms = plan.character.spine, plan.character.arms
    kind = plan.interpolation
    still = np.ones(phase.shape)
    turn = -np.radians(spine.turn) * min(plan.size, 1.5) * cosine(KNOTS, phase, kind)
    lean = np.radians(spine.lean) * cosine(
        KNOTS, phase - 0.25, kind
    )  # the right leg carries first: to the right
    nod = np.radians(spine.nod) * np.cos(4.0 * np.pi * phase)
    for joints, x, y, z in (
        (LUMBAR, spine.lumbar, 0.35 * turn, 0.6 * lean),
        (THORAX, spine.thorax, 0.65 * turn, 0.4 * lean),
        (NECK, spine.neck, -0.7 * turn, -0.6 * lean),
        (HEAD, spine.head, -0.3 * turn, -0.4 * lean),
    ):
        bent = np.radians(x) * still + (nod if joints is HEAD else -nod if joints is NECK else 0.0)
        for axis, values in ((0, bent), (1, y), (2, z)):
            spread(writer, skeleton, joints, axis, values)
    for letter, way in (("l", 1.0), ("r", -1.0)):
        girdle = f"{letter}_sternoclavicular"
        if girdle in skeleton:
            writer.turn(girdle, 2, way * np.radians(arms.up) * still)
            writer.turn(girdle, 1, -way * np.radians(arms.forward) * still)
        for finger in FINGERS:
            for number in (1, 2, 3):
                joint = f"{letter}_{finger}{number}"
                if joint in skeleton:
                    # below the wrist flexion turns about z: fingers curl towards the thigh, inward
                    curl = np.radians(arms.curl * _MORE_CURL[finger])
                    writer.turn(joint, 2, -way * curl * still)

"""Correct a file's rest pose where the motion shows that it is not what it seems: clavicles and feet.

Files agree on where limbs point at rest, but not on clavicles, which they raise for a T-pose or turn by a
constant angle, and not on feet, which some draw level from the ankle, or rolled with straddled legs. In the
default posture clavicles are as in someone whose arms hang, and soles are flat.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fba import rotations
from fba.arrays import Float64, Intp
from fba.capture import _standing as standing
from fba.capture._rest_from_motion import LOW_ARM, mean_turn, with_rest
from fba.capture.motion import SkeletonMotion

FRAMES = 1000
"""Frames that are looked at."""
FEWEST_LOW = 3
"""Number of frames with a hanging arm that shows how the clavicle rests."""
OWN_CLAVICLE = 5.0
"""Degrees by which clavicles of somebody whose arms hang may differ from the rest pose: the posture of a
person. What exceeds this is the skeleton's."""
SLOW = 0.15
"""Speed of a foot, in sizes of the skeleton per second, up to which it may stand."""
STEADY = 8.0
"""Degrees within which standing feet are turned alike."""
MIRRORED = 9.0
"""Degrees within which the left foot's correction is the mirror image of the right one's."""
MOST_TURN = 40.0
USUAL_SLOPE = -27.0
"""Degrees from level at which feet point from ankle to ball, on average of many skeletons."""


def correct_rest(motion: SkeletonMotion, mapped: Mapping[str, int]) -> SkeletonMotion:
    """Return a motion, y up, whose rest pose has clavicles as with hanging arms, and flat feet."""
    rows = motion.spread(FRAMES)
    few = motion.select(rows)
    quaternions, positions = few.world()
    turned = rotations.matrices(quaternions)
    rest = np.tile(np.eye(3), (len(motion.names), 1, 1))
    for side in "lr":
        _correct_clavicle(side, few, mapped, turned, positions, rest)
    _correct_feet(few, mapped, turned, positions, rows, rest)
    return motion if (rest == np.eye(3)).all() else with_rest(motion, rest)


def _correct_clavicle(
    side: str, motion: SkeletonMotion, mapped: Mapping[str, int], turned: Float64, positions: Float64,
    rest: Float64,
) -> None:  # fmt: skip
    needed = [f"{side}_{joint}" for joint in ("sternoclavicular", "shoulder", "elbow")]
    if not all(joint in mapped for joint in needed):
        return
    inner, shoulder, elbow = (mapped[joint] for joint in needed)
    arm = rotations.unit(positions[:, elbow] - positions[:, shoulder])
    low = np.flatnonzero(arm[:, 1] < -LOW_ARM)
    above = int(motion.parents[inner])
    if above < 0 or len(low) < FEWEST_LOW:
        return
    turn = mean_turn(turned, above, inner, low)
    angle = float(np.degrees(np.arccos(np.clip((np.trace(turn) - 1) / 2, -1.0, 1.0))))
    if angle > OWN_CLAVICLE:
        rest[inner] = rotations.part(np.eye(3), turn, 1.0 - OWN_CLAVICLE / angle)


def _correct_feet(
    motion: SkeletonMotion, mapped: Mapping[str, int], turned: Float64, positions: Float64, rows: Intp,
    rest: Float64,
) -> None:  # fmt: skip
    at_rest = motion.rest()
    size = float(np.ptp(at_rest, axis=0).max())
    ups = []
    for side in "lr":
        ankle = mapped.get(f"{side}_ankle")
        if ankle is None or len(rows) < 2:
            return
        seconds = np.gradient(rows.astype(np.float64)) / float(motion.rate)
        speed = np.linalg.norm(np.gradient(positions[:, ankle], axis=0), axis=1) / (seconds * size)
        height = positions[:, ankle, 1]
        low = np.flatnonzero(height <= np.median(height))
        still = low[np.argsort(speed[low], kind="stable")][: max(1, len(low) // 3)]
        if speed[still].max() > SLOW:
            return
        up = turned[still, ankle][:, 1].mean(axis=0)  # world up as the foot sees it
        if np.degrees(np.arccos(np.clip(np.linalg.norm(up), 0.0, 1.0))) > STEADY:
            return
        ups.append(rotations.unit(up))
    facing = standing.measure(at_rest[None], mapped)
    ahead, left = np.cross(facing.left[0], [0.0, 1.0, 0.0]), facing.left[0]
    pitch = [float(np.degrees(np.arctan2(up @ ahead, up[1]))) for up in ups]
    roll = [float(np.degrees(np.arctan2(up @ left, up[1]))) for up in ups]
    pitches = abs(pitch[0] - pitch[1]) < MIRRORED
    rolls = abs(roll[0] + roll[1]) < MIRRORED
    for number, side in enumerate("lr"):
        ankle, toe = mapped[f"{side}_ankle"], mapped.get(f"{side}_metatarsal")
        mean_pitch, mean_roll = sum(pitch) / 2, (roll[0] - roll[1]) / 2 * (1 if number == 0 else -1)
        if not pitches or toe is None:
            mean_pitch = 0.0
        elif toe is not None:
            bone = at_rest[toe] - at_rest[ankle]
            slope = float(np.degrees(np.arctan2(bone[1], bone @ ahead)))
            if abs(slope + mean_pitch - USUAL_SLOPE) > abs(slope - USUAL_SLOPE):
                mean_pitch = 0.0
        if not rolls:
            mean_roll = 0.0
        if max(abs(mean_pitch), abs(mean_roll)) > MOST_TURN or max(abs(mean_pitch), abs(mean_roll)) < 2.0:
            continue
        up = (
            np.array([0.0, 1.0, 0.0])
            + np.tan(np.radians(mean_pitch)) * ahead
            + np.tan(np.radians(mean_roll)) * left
        )
        turn = rotations.between(up, np.array([0.0, 1.0, 0.0]))
        for joint in range(ankle, len(motion.names)):
            above = joint
            while above > ankle:
                above = int(motion.parents[above])
            if above == ankle:
                rest[joint] = turn

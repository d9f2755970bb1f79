"""Correct clavicles and feet of a file's rest pose by what the motion shows of them.

Files agree on where limbs point at rest, but some raise clavicles for a T-pose or turn them by a constant
angle, and some draw feet level from the ankle, or rolled with straddled legs. In the default posture
clavicles are as in someone whose arms hang, and soles are flat.
"""

from __future__ import annotations

import numpy as np

from fba import rotations
from fba.arrays import Float64, Intp
from fba.capture import _standing as standing
from fba.capture._rest_from_motion import LOW_ARM, mean_turn
from fba.capture.motion import MappedMotion, SkeletonMotion

MAX_FRAMES = 1000
"""Largest number of frames, spread evenly over the motion, that are examined."""
MIN_HANGING_FRAMES = 3
"""Smallest number of frames with a hanging arm that show how the clavicle rests."""
MAX_PERSONAL_TURN = 5.0
"""Largest angle, in degrees, between clavicles with hanging arms and at rest that is due to the person's
posture. The rest of a larger angle is due to the skeleton."""
MAX_STANDING_SPEED = 0.15
"""Largest speed of a standing foot, in sizes of the skeleton per second."""
MAX_STANDING_TURN = 8.0
"""Largest angle, in degrees, between the rotations of a standing foot."""
MAX_ASYMMETRY = 9.0
"""Largest difference, in degrees, between the correction of a foot and the mirror image of the other's."""
FOOT_TURN_RANGE = (2.0, 40.0)
"""Smallest and largest correction of a foot, in degrees: less is noise, and more is another rest pose."""
USUAL_SLOPE = -27.0
"""Average slope of feet from ankle to ball over many skeletons, in degrees from level."""
UP = np.array([0.0, 1.0, 0.0])


def correct_rest(source: MappedMotion) -> SkeletonMotion:
    """Return a motion, y up, whose rest pose has clavicles as with hanging arms, and flat feet."""
    motion = source.motion
    rows = motion.spread(MAX_FRAMES)
    sample = source.select(rows)
    rest = np.tile(np.eye(3), (len(motion.names), 1, 1))
    for side in "lr":
        _correct_clavicle(side, sample, rest)
    _correct_feet(sample, rows, rest)
    return motion if (rest == np.eye(3)).all() else motion.with_rest(rest)


def _correct_clavicle(side: str, sample: MappedMotion, rest: Float64) -> None:
    joints = inner, shoulder, elbow = [f"{side}_{j}" for j in ("sternoclavicular", "shoulder", "elbow")]
    if not all(joint in sample for joint in joints):
        return
    arm = rotations.unit(sample.positions[elbow] - sample.positions[shoulder])
    low = np.flatnonzero(arm[:, 1] < -LOW_ARM)
    number = sample.mapped[inner]
    above = int(sample.motion.parents[number])
    if above < 0 or len(low) < MIN_HANGING_FRAMES:
        return
    turn = mean_turn(sample.motion.joint_rotations(above, low), sample.rotations(inner, low))
    angle = float(np.degrees(np.arccos(np.clip((np.trace(turn) - 1) / 2, -1.0, 1.0))))
    if angle > MAX_PERSONAL_TURN:
        rest[number] = rotations.part(np.eye(3), turn, 1.0 - MAX_PERSONAL_TURN / angle)


def _correct_feet(sample: MappedMotion, rows: Intp, rest: Float64) -> None:
    """Turn the rest of both feet. rows: numbers of the sample's frames in the whole motion."""
    size = float(np.ptp(sample.motion.rest(), axis=0).max())
    ups = []
    for side in "lr":
        ankle = f"{side}_ankle"
        if ankle not in sample or len(rows) < 2:
            return
        seconds = np.gradient(rows.astype(np.float64)) / float(sample.motion.rate)
        speed = np.linalg.norm(np.gradient(sample.positions[ankle], axis=0), axis=1) / (seconds * size)
        height = sample.positions[ankle][:, 1]
        low = np.flatnonzero(height <= np.median(height))
        still = low[np.argsort(speed[low], kind="stable")][: max(1, len(low) // 3)]
        if speed[still].max() > MAX_STANDING_SPEED:
            return
        up = sample.rotations(ankle, still)[:, 1].mean(axis=0)  # world up as the foot sees it
        if np.degrees(np.arccos(np.clip(np.linalg.norm(up), 0.0, 1.0))) > MAX_STANDING_TURN:
            return
        ups.append(rotations.unit(up))
    facing = standing.measure_rest(sample)
    ahead, left = np.cross(facing.left[0], UP), facing.left[0]
    pitch = [float(np.degrees(np.arctan2(up @ ahead, up[1]))) for up in ups]
    roll = [float(np.degrees(np.arctan2(up @ left, up[1]))) for up in ups]
    mean_pitch = sum(pitch) / 2 if abs(pitch[0] - pitch[1]) < MAX_ASYMMETRY else 0.0
    mean_roll = (roll[0] - roll[1]) / 2 if abs(roll[0] + roll[1]) < MAX_ASYMMETRY else 0.0
    for side, own_roll in (("l", mean_roll), ("r", -mean_roll)):
        ankle, toe = f"{side}_ankle", f"{side}_metatarsal"
        own_pitch = 0.0
        if toe in sample:
            bone = sample.rest[toe] - sample.rest[ankle]
            slope = float(np.degrees(np.arctan2(bone[1], bone @ ahead)))
            if abs(slope + mean_pitch - USUAL_SLOPE) <= abs(slope - USUAL_SLOPE):
                own_pitch = mean_pitch
        if FOOT_TURN_RANGE[0] <= max(abs(own_pitch), abs(own_roll)) <= FOOT_TURN_RANGE[1]:
            up = UP + np.tan(np.radians(own_pitch)) * ahead + np.tan(np.radians(own_roll)) * left
            rest[sample.motion.descendants(sample.mapped[ankle])] = rotations.between(up, UP)

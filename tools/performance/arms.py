"""Arms and hands: from pose to pose, forearm after upper arm, hand after forearm, fingers last."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from performance.curves import Float, delay, read_table, sample_times, wander
from performance.turning import follow_poses, follow_values, rotation_about, rotation_between_directions

SOFTNESS = 0.085
LAG = 0.045
"""Seconds by which each part follows the one above it."""
WAVES = 2.1
"""Swings to and fro a second."""
FINGERS = ("Index", "Middle", "Ring", "Pinky")
SPREADS = (1.0, 0.1, -0.6, -1.4)


def animate_arm(side: str, wave: Float) -> dict[str, Rotation]:
    """World rotations (T,) of upper arm, forearm and hand for a heading of 0; wave: (T,), 0..1."""
    sign = 1.0 if side == "Left" else -1.0
    schedule = _schedule(side)
    bone, front, down = np.array([sign, 0, 0]), np.array([0, 0, 1.0]), np.array([0, -1.0, 0])
    poses: dict[str, dict[str, Rotation]] = {"Arm": {}, "ForeArm": {}, "Hand": {}}
    for row in read_table("arm_poses.csv"):
        upper, fore, hand, palm = (
            np.array([float(v) for v in row[part].split()]) * (sign, 1, 1)
            for part in ("upper", "fore", "hand", "palm")
        )
        poses["Arm"][row["pose"]] = rotation_between_directions((bone, front), (upper, fore))
        poses["ForeArm"][row["pose"]] = rotation_between_directions((bone, down), (fore, palm))
        poses["Hand"][row["pose"]] = rotation_between_directions((bone, down), (hand, palm))
    result = {}
    for number, (part, known) in enumerate(poses.items()):
        moved = follow_poses(schedule, known, SOFTNESS + 0.015 * number)
        result[part] = Rotation.from_quat(delay(moved.as_quat(), LAG * number))
    swing = np.sin(2 * np.pi * WAVES * (sample_times() - 1.5))
    idle = 0.8 * wander(3 if sign > 0 else 5)
    toward = (sign * -0.35, 0.0, 1.0)
    result["Arm"] = rotation_about(toward, 2.5 * delay(swing, 0.05) * wave + idle) * result["Arm"]
    result["ForeArm"] = rotation_about(toward, 17 * swing * wave + idle) * result["ForeArm"]
    flick = 17 * swing * wave + 15 * delay(swing * wave, 0.10) + delay(idle, 0.1)
    result["Hand"] = rotation_about(toward, flick) * result["Hand"]
    return result


def animate_fingers(side: str, wave: Float) -> dict[str, Rotation]:
    """Rotations (T,) of all finger joints relative to their parents, by joint; wave: (T,), 0..1."""
    sign = 1.0 if side == "Left" else -1.0
    table = {
        row["pose"]: np.array(
            [[float(v) for v in row[f.lower()].split()] for f in (*FINGERS, "Thumb")]
            + [[float(row["spread"]), 0, 0]]
        )
        for row in read_table("finger_poses.csv")
    }
    named = {row["pose"]: table[row["fingers"]] for row in read_table("arm_poses.csv")}
    values = follow_values(_schedule(side), named, SOFTNESS + 0.03)
    loose = 6 * delay(np.sin(2 * np.pi * WAVES * (sample_times() - 1.5)) * wave, 0.16)
    result = {}
    for number, finger in enumerate(FINGERS):
        curl = delay(values[:, number], LAG * (3 + 0.5 * number))
        curl = curl + (loose * (0.5 + 0.2 * number))[:, None] * (1.0, 0.0, 0.0)
        spread = delay(values[:, 5, 0], LAG * 3) * SPREADS[number]
        name = f"{side}Hand{finger}"
        result[f"{name}1"] = rotation_about((0, 0, -sign), curl[:, 0]) * rotation_about((0, -sign, 0), spread)
        result[f"{name}2"] = rotation_about((0, 0, -sign), curl[:, 1])
        result[f"{name}3"] = rotation_about((0, 0, -sign), curl[:, 2])
    bend, oppose, tip = delay(values[:, 4], LAG * 3).T
    result[f"{side}HandThumb1"] = rotation_about((1, 0, 0), oppose) * rotation_about((0, sign, 0), bend)
    result[f"{side}HandThumb2"] = rotation_about((0, sign, 0), tip)
    result[f"{side}HandThumb3"] = rotation_about((0, sign, 0), tip)
    return result


def _schedule(side: str) -> str:
    return next(row["keys"] for row in read_table("gestures.csv") if row["side"] == side)

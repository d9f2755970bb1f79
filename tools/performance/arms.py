"""Arms and hands: from pose to pose, forearm after upper arm, hand after forearm, fingers last."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from performance.curves import Float, late, moments, rows, wander
from performance.turning import about, passing, pointing, weights

SOFTNESS = 0.085
LAG = 0.045
"""Seconds by which each part follows the one above it."""
WAVES = 2.1
"""Swings to and fro a second."""
FINGERS = ("Index", "Middle", "Ring", "Pinky")
SPREADS = (1.0, 0.1, -0.6, -1.4)


def arm(side: str, wave: Float) -> dict[str, Rotation]:
    """World rotations of upper arm, forearm and hand, were the body's heading 0; wave: how much, 0..1."""
    sign = 1.0 if side == "Left" else -1.0
    schedule = _schedule(side)
    bone, front, down = np.array([sign, 0, 0]), np.array([0, 0, 1.0]), np.array([0, -1.0, 0])
    poses: dict[str, dict[str, Rotation]] = {"Arm": {}, "ForeArm": {}, "Hand": {}}
    for row in rows("arm_poses.csv"):
        upper, fore, hand, palm = (
            np.array([float(v) for v in row[part].split()]) * (sign, 1, 1)
            for part in ("upper", "fore", "hand", "palm")
        )
        poses["Arm"][row["pose"]] = pointing((bone, front), (upper, fore))
        poses["ForeArm"][row["pose"]] = pointing((bone, down), (fore, palm))
        poses["Hand"][row["pose"]] = pointing((bone, down), (hand, palm))
    result = {}
    for number, (part, known) in enumerate(poses.items()):
        moved = passing(schedule, known, SOFTNESS + 0.015 * number)
        result[part] = Rotation.from_quat(late(moved.as_quat(), LAG * number))
    swing = np.sin(2 * np.pi * WAVES * (moments() - 1.5))
    idle = 0.8 * wander(3 if sign > 0 else 5)
    toward = (sign * -0.35, 0.0, 1.0)
    result["Arm"] = about(toward, 2.5 * late(swing, 0.05) * wave + idle) * result["Arm"]
    result["ForeArm"] = about(toward, 17 * swing * wave + idle) * result["ForeArm"]
    flick = 17 * swing * wave + 15 * late(swing * wave, 0.10) + late(idle, 0.1)
    result["Hand"] = about(toward, flick) * result["Hand"]
    return result


def fingers(side: str, wave: Float) -> dict[str, Rotation]:
    """Rotations of all finger joints against their parents."""
    sign = 1.0 if side == "Left" else -1.0
    table = {
        row["pose"]: np.array(
            [[float(v) for v in row[f.lower()].split()] for f in (*FINGERS, "Thumb")]
            + [[float(row["spread"]), 0, 0]]
        )
        for row in rows("finger_poses.csv")
    }
    named = {row["pose"]: table[row["fingers"]] for row in rows("arm_poses.csv")}
    values = weights(_schedule(side), named, SOFTNESS + 0.03)
    loose = 6 * late(np.sin(2 * np.pi * WAVES * (moments() - 1.5)) * wave, 0.16)
    result = {}
    for number, finger in enumerate(FINGERS):
        curl = late(values[:, number], LAG * (3 + 0.5 * number))
        curl = curl + (loose * (0.5 + 0.2 * number))[:, None] * (1.0, 0.0, 0.0)
        spread = late(values[:, 5, 0], LAG * 3) * SPREADS[number]
        name = f"{side}Hand{finger}"
        result[f"{name}1"] = about((0, 0, -sign), curl[:, 0]) * about((0, -sign, 0), spread)
        result[f"{name}2"] = about((0, 0, -sign), curl[:, 1])
        result[f"{name}3"] = about((0, 0, -sign), curl[:, 2])
    bend, oppose, tip = late(values[:, 4], LAG * 3).T
    result[f"{side}HandThumb1"] = about((1, 0, 0), oppose) * about((0, sign, 0), bend)
    result[f"{side}HandThumb2"] = about((0, sign, 0), tip)
    result[f"{side}HandThumb3"] = about((0, sign, 0), tip)
    return result


def _schedule(side: str) -> str:
    return next(row["keys"] for row in rows("gestures.csv") if row["side"] == side)

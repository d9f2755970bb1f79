"""Legs from moving hips to standing feet: two bones, bent at the knee."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from performance.curves import Float
from performance.skeleton import offsets
from performance.turning import rotation_between_directions

ANKLES = {"Left": (11.0, 7.7, -2.2), "Right": (-10.5, 7.7, 1.6)}
"""Positions of the ankles, centimetres."""
TOES_OUT = {"Left": 12.0, "Right": 9.0}
"""Degrees by which the feet point outward."""

SOFT = 0.25
"""Centimetres over which the limit changes smoothly from one leg's to the other's."""


def hip_rise(hips: Float, bend: Float) -> Float:
    """(T,) centimetres by which hips (T, 2, 3), left and right, may rise until the straighter leg has a bend
    of (T,) degrees.
    """
    upper, lower = (float(np.linalg.norm(offsets()[f"Left{part}"])) for part in ("Leg", "Foot"))
    reach = np.sqrt(upper**2 + lower**2 + 2 * upper * lower * np.cos(np.deg2rad(bend)))
    ankles = np.array([ANKLES[side] for side in ("Left", "Right")])
    aside = hips[:, :, [0, 2]] - ankles[:, [0, 2]]
    room = ankles[:, 1] + np.sqrt(reach[:, None] ** 2 - np.sum(aside**2, axis=2)) - hips[:, :, 1]
    result: Float = -SOFT * np.log(np.sum(np.exp(-room / SOFT), axis=1))
    return result


def solve_leg(side: str, hip: Float) -> dict[str, Rotation]:
    """World rotations (T,) of thigh, shank, foot and toes for positions (T, 3) of the hip, centimetres."""
    outward = TOES_OUT[side] * (1 if side == "Left" else -1)
    foot = Rotation.from_euler("Y", outward, degrees=True)
    pole = Rotation.from_euler("Y", 0.8 * outward, degrees=True).apply([0.0, 0.0, 1.0])
    thigh, shank = offsets()[f"{side}Leg"], offsets()[f"{side}Foot"]
    upper, lower = float(np.linalg.norm(thigh)), float(np.linalg.norm(shank))
    reach = np.array(ANKLES[side]) - hip
    distance = np.linalg.norm(reach, axis=1)
    if distance.max() > 0.999 * (upper + lower):
        raise ValueError(f"the {side.lower()} leg is too short for a hip {distance.max():.1f} cm off")
    along = reach / distance[:, None]
    front = pole - along * (along @ pole)[:, None]
    front /= np.linalg.norm(front, axis=1, keepdims=True)
    cosine = (upper**2 + distance**2 - lower**2) / (2 * upper * distance)
    knee = upper * (along * cosine[:, None] + front * np.sqrt(1 - cosine**2)[:, None])
    forward = np.array([0.0, 0.0, 1.0])
    standing = Rotation.from_quat(np.broadcast_to(foot.as_quat(), (len(hip), 4)))
    return {
        "UpLeg": rotation_between_directions((thigh, forward), (knee, front)),
        "Leg": rotation_between_directions((shank, forward), (reach - knee, front)),
        "Foot": standing,
        "ToeBase": standing,
    }

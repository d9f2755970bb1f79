"""The body: hips, spine and head by keys, breathing and swaying; legs and arms follow."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from performance.arms import animate_arm, animate_fingers
from performance.curves import SECONDS, Float, delay, read_tracks, sample_times, smooth, wander
from performance.legs import hip_rise, solve_leg
from performance.skeleton import joints, offsets
from performance.turning import from_yaw_roll_pitch, interpolate, rotation_about

BREATHS = 3
"""In the whole performance."""
HEAD_SHARE = 0.45
"""Share of the head's turn against the chest that is the head's own (FAPs 48..50), not the neck's."""


@dataclass(frozen=True)
class BodyMotion:
    """The motion of the body.

    local: joint -> rotations (T,) relative to its parent. root: (T, 3), centimetres. head: world rotations
    (T,) of the head, including its FAPs. own: (T, 3), the part of them in FAPs 48..50, degrees.
    """

    local: dict[str, Rotation]
    root: Float
    head: Rotation
    own: Float


def animate() -> BodyMotion:
    """The motion of the whole performance, at `curves.RATE` samples a second."""
    key = read_tracks("body_keys.csv")
    breath = np.sin(2 * np.pi * BREATHS * sample_times() / SECONDS - 0.6)
    sway = 0.35 * wander(1, 1, 5)
    ahead = key["pelvis_z"] + 0.35 * wander(2, 1, 5)
    root = offsets()["Hips"] + np.stack([key["pelvis_x"] + sway, np.zeros_like(sway), ahead], axis=1)
    yaw = key["chest_yaw"] + 0.7 * wander(8)
    world = {
        "Hips": from_yaw_roll_pitch(
            key["pelvis_yaw"] + 0.4 * wander(4), key["pelvis_roll"], key["pelvis_pitch"]
        )
    }
    thighs = [root + world["Hips"].apply(offsets()[f"{side}UpLeg"]) for side in ("Left", "Right")]
    root[:, 1] += smooth(hip_rise(np.stack(thighs, axis=1), key["knee_bend"]), 0.05)
    chest = from_yaw_roll_pitch(yaw, key["chest_roll"] + 0.4 * wander(6), key["chest_pitch"] - 0.9 * breath)
    world["Spine"] = interpolate(world["Hips"], chest, 0.35)
    world["Spine1"] = interpolate(world["Hips"], chest, 0.7)
    world["Spine2"] = chest
    head = from_yaw_roll_pitch(
        key["head_yaw"] + 1.0 * wander(11, 2, 9),
        key["head_roll"] + 0.9 * wander(12, 2, 9),
        key["head_pitch"] + 0.8 * wander(13, 2, 9) - 0.25 * breath,
    )
    angles = HEAD_SHARE * (chest.inv() * head).as_euler("YZX", degrees=True)
    world["Head"] = head * from_yaw_roll_pitch(*angles.T).inv()
    world["Neck"] = interpolate(chest, world["Head"], 0.5)
    for side, sign in (("Left", 1.0), ("Right", -1.0)):
        raised = key[f"clavicle_{side.lower()}"] + 1.1 * delay(breath, 0.1)
        world[f"{side}Shoulder"] = chest * rotation_about((0, 0, sign), raised)
        wave = key["wave"] * (side == "Right")
        heading = rotation_about((0, 1, 0), yaw)
        for part, turn in animate_arm(side, wave).items():
            world[f"{side}{part}"] = heading * turn
        hip = root + world["Hips"].apply(offsets()[f"{side}UpLeg"])
        world |= {f"{side}{part}": turn for part, turn in solve_leg(side, hip).items()}
    local = animate_fingers("Left", np.zeros(len(root))) | animate_fingers("Right", key["wave"])
    for joint in joints():
        if joint.name in world:
            above = world.get(joint.parent)
            local[joint.name] = world[joint.name] if above is None else above.inv() * world[joint.name]
    return BodyMotion(local, root, head, angles)

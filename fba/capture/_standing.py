"""Measure how far joints are from those of a person who stands: upright, symmetric, with straight limbs.

The same measure tells whether a file's rest pose is one that a person can take, and in which frames of a
motion somebody stands.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fba.arrays import Bool, Float64
from fba.body import ROOT
from fba.rotations import degrees_between, unit

MAX_ANGLES = {
    "thigh": 45.0,
    "knee": 50.0,
    "back": 40.0,
    "shoulders": 40.0,
    "legs": 40.0,
    "arms": 50.0,
    "elbow": 60.0,
    "toes": 100.0,
    "clavicles": 75.0,
}
"""Largest angles in degrees of a rest pose: thigh from straight down, bend of knees and elbows, back and neck
from straight up, shoulders against hips, left limbs against the mirrored right ones, toes from ahead,
clavicles from the side."""
FREE_ANGLES = {
    "thigh": 8.0,
    "knee": 8.0,
    "back": 10.0,
    "shoulders": 6.0,
    "legs": 5.0,
    "arms": 8.0,
    "elbow": 15.0,
    "toes": 35.0,
    "clavicles": 75.0,
}
"""Largest angles in degrees of somebody who stands upright, of the same parts."""
LIMB_BONES = (
    ("hip", "knee"), ("knee", "ankle"), ("shoulder", "elbow"), ("elbow", "wrist"), ("ankle", "metatarsal"),
)  # fmt: skip
"""Joints at both ends of the bones of limbs."""


@dataclass(frozen=True, eq=False)
class Stance:
    """How poses stand. up, left: unit (T, 3), of the trunk. angles: part -> (T,), see `MAX_ANGLES`."""

    up: Float64
    left: Float64
    angles: dict[str, Float64]

    @property
    def possible(self) -> Bool:
        """Whether each pose (T,) could be a rest pose."""
        result: Bool = np.ones(len(self.up), dtype=np.bool_)
        for what, angle in self.angles.items():
            result &= angle <= MAX_ANGLES[what]
        return result

    @property
    def distance(self) -> Float64:
        """Root mean square angle (T,), in degrees, by which parts differ from standing upright."""
        parts = [np.maximum(angle - FREE_ANGLES[what], 0.0) for what, angle in self.angles.items()]
        return np.sqrt(np.mean(np.square(parts), axis=0)) if parts else np.zeros(len(self.up))

    def worst(self, row: int) -> str:
        """Return the part that is farthest from standing in a pose: "thigh 87 degrees"."""
        if not self.angles:
            return "nothing"
        part = max(self.angles, key=lambda each: float(self.angles[each][row]) / MAX_ANGLES[each])
        return f"{part} {self.angles[part][row]:.0f} degrees"


def measure(positions: Float64, mapped: Mapping[str, int]) -> Stance:
    """Return how poses stand. positions: (T, J, 3), in any axes. mapped: body's joint -> source's joint."""
    axes = _trunk_axes(positions, mapped)

    def bone(start: str, end: str) -> Float64 | None:
        """Return unit directions (T, 3) between joints: their parts along left, up and ahead."""
        if start not in mapped or end not in mapped:
            return None
        line = positions[:, mapped[end]] - positions[:, mapped[start]]
        return unit((axes @ line[:, :, None])[:, :, 0])

    angles: dict[str, Float64] = {}

    def add(part: str, angle: Float64) -> None:
        """Keep the larger angle of a part."""
        angles[part] = np.maximum(angles.get(part, np.zeros(len(positions))), angle)

    left, up, ahead = np.eye(3)
    limbs = {}
    for side, outwards in (("l", left), ("r", -left)):
        for start, end in LIMB_BONES:
            limbs[side, start] = bone(f"{side}_{start}", f"{side}_{end}")
        if (thigh := limbs[side, "hip"]) is not None:
            add("thigh", degrees_between(thigh, -up))
            if (shank := limbs[side, "knee"]) is not None:
                add("knee", degrees_between(thigh, shank))
        if (arm := limbs[side, "shoulder"]) is not None and (fore := limbs[side, "elbow"]) is not None:
            add("elbow", degrees_between(arm, fore))
        if (foot := limbs[side, "ankle"]) is not None:
            add("toes", degrees_between(foot * (1 - up) + 1e-9 * ahead, ahead))
        if (clavicle := bone(f"{side}_sternoclavicular", f"{side}_shoulder")) is not None:
            add("clavicles", degrees_between(clavicle, outwards))
    for part, start in (("legs", "hip"), ("legs", "knee"), ("arms", "shoulder"), ("arms", "elbow")):
        left_bone, right_bone = limbs["l", start], limbs["r", start]
        if left_bone is not None and right_bone is not None:
            add(part, degrees_between(left_bone, right_bone * [-1.0, 1.0, 1.0]))
    if (shoulders := bone("r_shoulder", "l_shoulder")) is not None:
        add("shoulders", degrees_between(shoulders, left))
    if (neck := bone("vc7", "skullbase")) is not None:
        add("back", degrees_between(neck, up) * 0.8)
    return Stance(axes[:, 1], axes[:, 0], angles)


def _trunk_axes(positions: Float64, mapped: Mapping[str, int]) -> Float64:
    """Return rows (T, 3, 3): left, up and ahead, as the hips and the trunk above them show."""

    def middle(*joints: str) -> Float64 | None:
        numbers = [mapped[joint] for joint in joints if joint in mapped]
        result: Float64 | None = positions[:, numbers].mean(axis=1) if len(numbers) == len(joints) else None
        return result

    pairs = [
        positions[:, mapped[f"l_{joint}"]] - positions[:, mapped[f"r_{joint}"]]
        for joint in ("hip", "shoulder", "knee")
        if f"l_{joint}" in mapped and f"r_{joint}" in mapped
    ]
    left = next((pair for pair in pairs if np.linalg.norm(pair, axis=1).min() > 0), None)
    if left is None:
        left = pairs[0] if pairs else np.tile([1.0, 0.0, 0.0], (len(positions), 1))
    left = unit(left)
    below = middle("l_hip", "r_hip")
    below = positions[:, mapped[ROOT]] if below is None else below
    tops = [middle("l_shoulder", "r_shoulder"), middle("vc7"), middle("skullbase")]
    above = next((top for top in tops if top is not None), None)
    if above is None:
        feet = middle("l_ankle", "r_ankle")
        feet = middle("l_knee", "r_knee") if feet is None else feet
        above = 2 * below - feet if feet is not None else below + np.array([0.0, 1.0, 0.0])
    up = above - below
    up = unit(up - left * np.sum(up * left, axis=1, keepdims=True))
    return np.stack([left, up, np.cross(left, up)], axis=1)


def row_turn(frames: Float64, row: Float64, at_rest: Float64) -> float:
    """Return degrees between a row as a joint sees it, on average, and the same row in the rest pose.

    frames: (T, 3, 3), rotations of the joint against the rest pose. row: (T, 3), in the world, from the right
    hip to the left one, or the same of shoulders. at_rest: (3,). 0 if the row has no length.
    """
    mean = np.einsum("tij,ti->j", frames, unit(row))
    return float(degrees_between(mean, at_rest))

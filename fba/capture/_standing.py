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
from fba.capture.motion import MappedMotion
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


def measure(positions: Mapping[str, Float64]) -> Stance:
    """Return how poses stand. positions: joint of the body -> (T, 3), in any axes."""
    axes = _trunk_axes(positions)

    def bone(start: str, end: str) -> Float64 | None:
        """Return unit directions (T, 3) between joints: their parts along left, up and ahead."""
        if start not in positions or end not in positions:
            return None
        return unit((axes @ (positions[end] - positions[start])[:, :, None])[:, :, 0])

    angles: dict[str, Float64] = {}

    def add(part: str, angle: Float64) -> None:
        """Keep the larger angle of a part."""
        angles[part] = np.maximum(angles.get(part, np.zeros(len(axes))), angle)

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


def measure_rest(source: MappedMotion) -> Stance:
    """Return how a source stands in its rest pose, T = 1."""
    return measure({joint: position[None] for joint, position in source.rest.items()})


def _trunk_axes(positions: Mapping[str, Float64]) -> Float64:
    """Return rows (T, 3, 3): left, up and ahead, as the hips and the trunk above them show."""

    def middle(*joints: str) -> Float64 | None:
        if not all(joint in positions for joint in joints):
            return None
        result: Float64 = np.mean([positions[joint] for joint in joints], axis=0)
        return result

    pairs = [
        positions[f"l_{joint}"] - positions[f"r_{joint}"]
        for joint in ("hip", "shoulder", "knee")
        if f"l_{joint}" in positions and f"r_{joint}" in positions
    ]
    left = next((pair for pair in pairs if np.linalg.norm(pair, axis=1).min() > 0), None)
    if left is None:
        left = pairs[0] if pairs else np.broadcast_to([1.0, 0.0, 0.0], positions[ROOT].shape)
    left = unit(left)
    below = middle("l_hip", "r_hip")
    below = positions[ROOT] if below is None else below
    tops = [middle("l_shoulder", "r_shoulder"), middle("vc7"), middle("skullbase")]
    above = next((top for top in tops if top is not None), None)
    if above is None:
        feet = middle("l_ankle", "r_ankle")
        feet = middle("l_knee", "r_knee") if feet is None else feet
        above = 2 * below - feet if feet is not None else below + np.array([0.0, 1.0, 0.0])
    up = above - below
    up = unit(up - left * np.sum(up * left, axis=1, keepdims=True))
    return np.stack([left, up, np.cross(left, up)], axis=1)

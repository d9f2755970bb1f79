"""Weights of the skin about the joints of limbs, which determine how it bends."""

from __future__ import annotations

import numpy as np

from fba.arrays import Float64
from fba.body import Skeleton
from fba.sampling import smoothstep
from tools.figure.cutting import Cloth
from tools.figure.person import Person

HINGES = (
    ("?_shoulder", "?_elbow", "?_wrist", (0.0, 0.0, 1.0), 0.040, 0.056),
    ("?_elbow", "?_wrist", "?_middle1", (0.0, 0.0, 1.0), 0.040, 0.040),
    ("?_hip", "?_knee", "?_ankle", (0.0, 0.0, -1.0), 0.060, 0.070),
)
"""Upper joint, bending joint, next joint; direction of the side that folds; metres to both sides of the joint
over which weights change from one to the other, on the side that folds and on the one that stretches."""
LIMB = 0.06
"""Approximate distance from bone to skin, metres."""
ARMHOLE = (0.026, 0.068)
"""Metres to both sides of a sleeve's seam over which weights change from trunk to arm: at the armpit and at
the top."""
SET = (0.020, 0.045)
"""Metres from the shoulder outwards to that seam: at the armpit and at the top."""
BEHIND = 0.022
"""How much further out it is at the back of the armpit, which an arm in front would carry downwards."""
PIT = (-0.01, -0.13, 0.01)
"""Position of the armpit relative to the left shoulder, metres."""
ARMPIT = (-0.24, -0.12)
"""Heights from the shoulder between which the arm begins to carry the side of the trunk, metres."""
BLADE = (-0.13, -0.01)
"""Heights from the shoulder between which the blade begins to carry the trunk, metres."""
EASING_ROUNDS = 10
"""Rounds of smoothing the weights of trunk, arms and legs over neighbours."""
HANGING, HANGING_ROUNDS = (0.86, 1.04), 20
"""Heights (m) between which weights are smoothed more, for even hems of shirts, and rounds of it."""


def ease_limb_weights(person: Person, positions: dict[str, Float64], weights: Float64) -> Float64:
    """Return (V, J) weights, replaced about the joints of limbs. positions: of the joints, by name."""
    weights = weights.copy()
    _ease_shoulders(person, positions, weights)
    number = {name: n for n, name in enumerate(Skeleton.default().names)}
    for upper, joint, lower, inside, fold, stretch in HINGES:
        for side in "lr":
            above, middle, below = (name.replace("?", side) for name in (upper, joint, lower))
            bones = [positions[middle] - positions[above], positions[below] - positions[middle]]
            along = sum(bone / np.linalg.norm(bone) for bone in bones)
            along = along / np.linalg.norm(along)
            away = person.vertices - positions[middle]
            turned = np.clip(away @ np.array(inside) / LIMB, -1.0, 1.0) / 2 + 0.5
            reach = stretch + (fold - stretch) * turned
            share = smoothstep(away @ along / (2 * reach) + 0.5)
            both = weights[:, number[above]] + weights[:, number[middle]]
            weights[:, number[middle]] = both * share
            weights[:, number[above]] = both * (1 - share)
    body = np.linalg.norm(person.vertices[:, None] - [positions[f"{s}_wrist"] for s in "lr"], axis=2).min(
        axis=1
    )
    free = smoothstep((body - 0.12) / 0.08) * smoothstep((1.45 - person.vertices[:, 1]) / 0.06)
    free *= smoothstep((person.vertices[:, 1] - 0.14) / 0.06)
    for side in "lr":  # an armpit keeps its fold
        pit = positions[f"{side}_shoulder"] + np.array(PIT) * (1 if side == "l" else -1, 1, 1)
        free *= 1 - 0.7 * np.exp(-((np.linalg.norm(person.vertices - pit, axis=1) / 0.06) ** 2))
    mesh = Cloth(person.vertices, person.vertices, weights, weights, person.triangles)
    weights = mesh.smooth_rows(weights, free, EASING_ROUNDS)
    free *= smoothstep((person.vertices[:, 1] - HANGING[0]) / 0.05)
    free *= smoothstep((HANGING[1] - person.vertices[:, 1]) / 0.05) * (person.arms < 0.3)
    return mesh.smooth_rows(weights, free, HANGING_ROUNDS)


def _ease_shoulders(person: Person, positions: dict[str, Float64], weights: Float64) -> None:
    """Replace weights about the shoulders, in place: they change at the plane of a sleeve's seam."""
    names = Skeleton.default().names
    for side, sign in (("l", 1.0), ("r", -1.0)):
        joint = positions[f"{side}_shoulder"]
        away = (person.vertices - joint) * (sign, 1.0, 1.0)
        high = smoothstep((away[:, 1] - ARMPIT[0]) / (ARMPIT[1] - ARMPIT[0]))
        top = smoothstep((away[:, 1] + 0.05) / 0.10)
        reach = ARMHOLE[0] + (ARMHOLE[1] - ARMHOLE[0]) * top
        behind = smoothstep(-away[:, 2] / 0.05) * (1 - top)
        out = away[:, 0] - SET[0] - (SET[1] - SET[0]) * top - BEHIND * behind
        share = smoothstep(out / (2 * reach) + 0.5) * np.maximum(high, smoothstep((person.arms - 0.15) / 0.5))
        arm = names.index(f"{side}_shoulder")
        rest = [n for n, name in enumerate(names) if not _belongs_to_arm(name, side)]
        near = (away[:, 1] > ARMPIT[0]) & (away[:, 0] < 0.12) & (away[:, 0] > -0.12)
        girdle = names.index(f"{side}_acromioclavicular")
        spine = [n for n, name in enumerate(names) if name.startswith("v")]
        low = weights[:, girdle] * (1 - smoothstep((away[:, 1] - BLADE[0]) / (BLADE[1] - BLADE[0])))
        low *= smoothstep(weights[:, spine].sum(axis=1) / 0.2)
        weights[:, spine] *= 1 + (low / np.maximum(weights[:, spine].sum(axis=1), 1e-9))[:, None]
        weights[:, girdle] -= low
        trunk = weights[:, rest].sum(axis=1)
        lone = near & (trunk < 1e-3)
        weights[lone, girdle] = trunk[lone] = 1.0
        others = weights[
            :, [n for n, name in enumerate(names) if _belongs_to_arm(name, side) and n != arm]
        ].sum(axis=1)
        share = np.maximum(share - others, 0.0)
        keep = np.where(near, (1 - share - others) / np.maximum(trunk, 1e-9), 1.0)
        weights[:, rest] *= keep[:, None]
        weights[near, arm] = share[near]


def _belongs_to_arm(name: str, side: str) -> bool:
    """Return whether a joint moves the skin of an arm from the shoulder on."""
    return name[:2] == f"{side}_" and name[2:].startswith(("shoulder", "elbow", "wrist"))

"""Move legs as little as possible, so that feet reach their targets.

The knee bends or stretches until hip and ankle have the right distance, then the leg swings about the hip. A
leg that is almost straight cannot change its length without bending a lot: the straighter it is, the less it
changes its length, and the rest of the error remains.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba import rotations
from fba.arrays import Float64

STIFF = 0.05
"""Change of length in metres per radian of the knee, below which a leg counts as almost straight."""
ROUNDS = 3
"""Iterations that find the bend of the knee."""


@dataclass(frozen=True, eq=False)
class Leg:
    """Positions (T, 3) of hip, knee and ankle, and unit axes (T, 3) of the knee."""

    hip: Float64
    knee: Float64
    ankle: Float64
    axis: Float64


def pliancy(leg: Leg) -> Float64:
    """Return (T,), the share of a change of length that a leg makes: 0 if straight, close to 1 if bent."""
    slope = _lengths(leg)[1]
    result: Float64 = slope * slope / (slope * slope + STIFF * STIFF)
    return result


def reach(leg: Leg, move: Float64) -> tuple[Float64, Float64]:
    """Return world turns (T, 3, 3) of thigh and shank that move the ankle by move (T, 3), in metres."""
    target = leg.ankle + move - leg.hip
    wanted = np.linalg.norm(target, axis=1)
    bend = np.zeros(len(move))
    shank = leg.ankle - leg.knee
    length, slope = _lengths(leg)
    share = slope / (slope * slope + STIFF * STIFF)
    goal = length + (wanted - length) * slope * share  # less for straighter legs
    ankle = leg.ankle
    for _ in range(ROUNDS):
        bend += (goal - length) * share
        ankle = leg.knee + (rotations.turn(leg.axis, bend) @ shank[..., None])[..., 0]
        length = np.linalg.norm(ankle - leg.hip, axis=1)
    swing = rotations.between_all(ankle - leg.hip, target)
    return swing, swing @ rotations.turn(leg.axis, bend)


def _lengths(leg: Leg) -> tuple[Float64, Float64]:
    """Return the distances (T,) from hip to ankle, and their changes (T,) per radian of the knee."""
    line = leg.ankle - leg.hip
    length = np.maximum(np.linalg.norm(line, axis=1), 1e-9)
    moved = np.cross(leg.axis, leg.ankle - leg.knee)
    return length, np.sum(moved * line, axis=1) / length

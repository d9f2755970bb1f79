"""Legs moved by as little as possible, so that the foot goes where it is wanted.

The knee bends or stretches until hip and ankle are as far apart as they need to be, then the whole leg swings
about the hip. A leg that is almost straight cannot change its length without bending by a lot: it changes it
by less the straighter it is, smoothly, and what is left stays as it was.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba import rotations
from fba.arrays import Float64

STIFF = 0.05
"""Metres of length a radian of the knee changes: below this, the leg counts as almost straight."""
ROUNDS = 3


@dataclass(frozen=True, eq=False)
class Leg:
    """Places (T, 3) of hip, knee and ankle, and the axis (T, 3), unit, about which the knee turns."""

    hip: Float64
    knee: Float64
    ankle: Float64
    axis: Float64


def pliancy(leg: Leg) -> Float64:
    """(T,), 0 for a straight leg, close to 1 for a bent one: which share of a change of length it follows."""
    slope = _lengths(leg)[1]
    result: Float64 = slope * slope / (slope * slope + STIFF * STIFF)
    return result


def reach(leg: Leg, move: Float64) -> tuple[Float64, Float64]:
    """World turns (T, 3, 3) of the thigh, and of the shank, that move the ankle by move (T, 3), metres."""
    target = leg.ankle + move - leg.hip
    wanted = np.linalg.norm(target, axis=1)
    bend = np.zeros(len(move))
    shank = leg.ankle - leg.knee
    length, slope = _lengths(leg)
    share = slope / (slope * slope + STIFF * STIFF)
    goal = length + (wanted - length) * slope * share  # what a leg as straight as this may do
    ankle = leg.ankle
    for _ in range(ROUNDS):
        bend += (goal - length) * share
        ankle = leg.knee + (rotations.turn(leg.axis, bend) @ shank[..., None])[..., 0]
        length = np.linalg.norm(ankle - leg.hip, axis=1)
    swing = rotations.between_all(ankle - leg.hip, target)
    return swing, swing @ rotations.turn(leg.axis, bend)


def _lengths(leg: Leg) -> tuple[Float64, Float64]:
    """(T,) each: from hip to ankle, and by how much a radian more of the knee changes that."""
    line = leg.ankle - leg.hip
    length = np.maximum(np.linalg.norm(line, axis=1), 1e-9)
    moved = np.cross(leg.axis, leg.ankle - leg.knee)
    return length, np.sum(moved * line, axis=1) / length

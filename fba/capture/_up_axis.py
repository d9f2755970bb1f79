"""Which axis of a source points up, and the same motion with another axis up."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from fba import rotations
from fba.arrays import Float64
from fba.capture import _standing as standing
from fba.capture.motion import SkeletonMotion, read_axis

UPS = ("+x", "-x", "+y", "-y", "+z", "-z")
CLEAR_UP = 0.75
"""Length of the mean of upright directions from which on the motion says which way is up."""
FLOOR_NEAR = 0.12
"""Share of the size within which the lowest joints are at height 0."""


def find_up_axis(
    motion: SkeletonMotion,
    positions: Float64,
    mapped: Mapping[str, int],
    at_rest: standing.Stance,
    up: str,
) -> tuple[str, float, str]:
    """Return the axis that points up, the confidence, and a reason.

    positions: (T, J, 3), of the source. up: as given.
    """
    if up != "auto":
        return up, 1.0, f"{up} as given"
    if motion.up and motion.declared:  # VRM: such files are not turned on the way
        return motion.up, 1.0, f"{motion.up}, as the format says"
    stance = standing.measure(positions, mapped)
    weight = np.exp(-((stance.distance / 20.0) ** 2)) + 0.02
    mean = (stance.up * weight[:, None]).sum(axis=0) / weight.sum()
    axis = nearest_axis(mean)
    clear = float(mean @ axis)
    stands = bool((stance.angles.get("thigh", np.zeros(1)) <= standing.MOST["thigh"]).any())
    own = nearest_axis(at_rest.up[0]) if bool(at_rest.possible[0]) else None
    own = read_axis(motion.up) if motion.up else own
    source = "as the format says" if motion.up else "as in the rest pose"
    if own is None and not stands and axis[0] != 0:
        return _name(axis), 0.4, f"perhaps {_name(axis)}: trunks point along it, but nobody ever stands"
    if own is None or (own == axis).all():
        if clear >= CLEAR_UP or (own is not None and clear > 0):
            agrees = f", {source}" if own is not None else ""
            return _name(axis), max(clear, 0.8 if own is not None else 0.0), (
                f"{_name(axis)}: people stand along it{agrees} ({100 * clear:.0f} %)"
            )  # fmt: skip
        return _name(axis), clear * 0.6, f"perhaps {_name(axis)}: the body is upright for little of the time"
    floors = [_stands_on_zero(positions, candidate) for candidate in (own, axis)]
    if stands and clear >= CLEAR_UP and (floors[1] or not floors[0]):
        return _name(axis), 0.8, (
            f"{_name(axis)}: the body stands along it while it moves, not along {_name(own)}, {source}"
        )  # fmt: skip
    sure = 0.7 if not stands or clear < CLEAR_UP or floors[0] else 0.4
    return _name(own), sure, f"{_name(own)}, {source}; the body hardly stands upright"


def find_upright(motion: SkeletonMotion, mapped: Mapping[str, int]) -> Float64:
    """Return the rotation (3, 3) of the axes of a rest pose that brings the one closest to its up to +y."""
    stance = standing.measure(motion.rest()[None], mapped)
    return rotations.between(nearest_axis(stance.up[0]), np.array([0.0, 1.0, 0.0]))


def turn_axes(motion: SkeletonMotion, turn: Float64) -> SkeletonMotion:
    """Return the same motion in other axes of the world. turn: (3, 3), from the old axes to the new."""
    quaternion = rotations.quaternions(turn[None])[0]
    inverse = quaternion * [1, -1, -1, -1]
    local = rotations.multiply(
        rotations.multiply(np.broadcast_to(quaternion, motion.rotations.shape), motion.rotations),
        np.broadcast_to(inverse, motion.rotations.shape),
    )
    return replace(
        motion,
        offsets=motion.offsets @ turn.T,
        rotations=local / np.linalg.norm(local, axis=-1, keepdims=True),
        positions=motion.positions @ turn.T,
        end_offsets=motion.end_offsets @ turn.T,
        axes=rotations.quaternions(turn @ rotations.matrices(motion.axes)),
    )


def nearest_axis(direction: Float64) -> Float64:
    axis = np.zeros(3)
    best = int(np.argmax(np.abs(direction)))
    axis[best] = np.sign(direction[best]) or 1.0
    return axis


def _name(axis: Float64) -> str:
    best = int(np.argmax(np.abs(axis)))
    return ("+" if axis[best] > 0 else "-") + "xyz"[best]


def _stands_on_zero(positions: Float64, axis: Float64) -> bool:
    """Whether the lowest joints are close to height 0 along an axis."""
    size = float(np.ptp(positions, axis=1).max())
    lowest = float(np.percentile((positions @ axis).min(axis=1), 20))
    return abs(lowest) < FLOOR_NEAR * size

"""Which axis of a source points up, and the same motion with another axis up."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from fba import rotations
from fba.arrays import Float64
from fba.capture import _standing as standing
from fba.capture.motion import SAMPLE_FRAMES, SkeletonMotion, read_axis

UPS = ("+x", "-x", "+y", "-y", "+z", "-z")
TRUNK = ("l_hip", "r_hip", "l_shoulder", "r_shoulder")


@dataclass(frozen=True)
class Tuning:
    """Constants of the search for the axis that points up."""

    min_up_length: float = 0.75  # length of the mean of upright directions, 0 to 1, that is clear
    max_floor_distance: float = 0.06  # share of a body's height within which joints are on the floor
    max_rest_speed: float = 0.2  # speed of a joint at rest, in heights of the body per second
    rest_interval: float = 0.1  # seconds between the two moments whose comparison shows whether a joint rests
    max_off_centre: float = 0.15  # of a body's middle from the joints that carry it, in its heights
    min_carried_share: float = 0.4  # share of frames in which joints rest on a floor, if there is one
    leg_share: float = 0.5  # share of a body's height that a leg takes


TUNING = Tuning()


@dataclass(frozen=True)
class Up:
    """The axis of a source that points up.

    axis: such as "+z". confidence: 0 to 1. reason: for people. doubt: what speaks against the axis, where it
    is not that of the rest pose, or people seem to lie or hang; else empty. instead: the other likely axis.
    """

    axis: str
    confidence: float
    reason: str
    doubt: str = ""
    instead: str = "+y"


@dataclass(frozen=True)
class _Floor:
    """The floor at the low end of an axis: whether joints rest on it, and whether these carry the body."""

    touched: bool
    carries: bool


@dataclass(frozen=True, eq=False)
class _Moments:
    """Places (T, J, 3) of joints, and where they are some seconds later."""

    places: Float64
    later: Float64
    seconds: float


def find_up_axis(
    motion: SkeletonMotion,
    positions: Float64,
    mapped: Mapping[str, int],
    at_rest: standing.Stance,
    up: str,
) -> Up:
    """Return the axis that points up.

    positions: (T, J, 3), of the source in some frames. up: as the caller gave it.

    What the format says counts, else the axis of the rest pose, unless joints rest on a floor along another
    axis and not along this axis: feet and head of somebody who lies, crawls, hangs or flies do not show it.
    """
    if up != "auto":
        return Up(up, 1.0, f"{up} as given")
    if motion.up:
        return Up(motion.up, 1.0, f"{motion.up}, as the format says")
    stance = standing.measure(positions, mapped)
    weight = np.exp(-((stance.distance / 20.0) ** 2)) + 0.02
    mean = (stance.up * weight[:, None]).sum(axis=0) / weight.sum()
    axis = nearest_axis(mean)
    clear = float(mean @ axis)
    stands = bool((stance.angles.get("thigh", np.zeros(1)) <= standing.MAX_ANGLES["thigh"]).any())
    upright = stands and clear >= TUNING.min_up_length
    trunk = _name(axis)
    if not bool(at_rest.possible[0]):
        return _find_freely(motion, mapped, trunk, clear, stands)
    rest_axis = _name(nearest_axis(at_rest.up[0]))
    if rest_axis == trunk and clear >= TUNING.min_up_length:
        reason = f"{rest_axis}: people stand along it, as in the rest pose ({100 * clear:.0f} %)"
        return Up(rest_axis, max(clear, 0.8), reason)
    moments = _find_moments(motion)
    floors = {name: _find_floor(moments, mapped, name) for name in UPS}
    stood = upright and floors[trunk].carries
    if floors[rest_axis].carries or (floors[rest_axis].touched and not stood):
        doubt = ""
        if trunk != rest_axis and clear >= TUNING.min_up_length and floors[trunk].touched:
            doubt = f"joints rest on a floor along it, as in the rest pose, but trunks point along {trunk}"
        return Up(
            rest_axis, 0.8, f"{rest_axis}, as in the rest pose: joints rest on a floor along it", doubt, trunk
        )
    others = [trunk] if upright else []
    floor_axis = next((name for name in (*others, "+y", "+z") if floors[name].carries), None)
    if floor_axis is None:
        doubt = f"bodies are stretched along {trunk}, and joints rest on no floor along any axis"
        reason = f"{rest_axis}, as in the rest pose; joints rest on no floor along any axis"
        return Up(rest_axis, 0.6, reason, doubt if trunk != rest_axis else "", trunk)
    does = "people stand" if floor_axis == trunk else "joints rest on a floor"
    reason = f"{floor_axis}: {does} along it, and nothing rests along {rest_axis}, the rest pose's"
    doubt = (
        f"{does} along it, while the rest pose stands along {rest_axis}, where no joint rests in the motion"
    )
    return Up(floor_axis, 0.7, reason, doubt, rest_axis)


def _find_freely(
    motion: SkeletonMotion, mapped: Mapping[str, int], trunk: str, clear: float, stands: bool
) -> Up:
    """Return the axis that points up in a file whose rest pose nobody can take.

    trunk: the axis along which trunks point. clear: how clearly, 0 to 1. stands: whether anybody stands.
    """
    if not stands and trunk[1] == "x":
        return Up(trunk, 0.4, f"perhaps {trunk}: trunks point along it, but nobody ever stands")
    first = [trunk] if clear >= TUNING.min_up_length and trunk in ("+y", "+z") else []
    moments = _find_moments(motion)
    floors = {name: _find_floor(moments, mapped, name) for name in {"+y", "+z", trunk}}
    floor_axis = next((name for name in (*first, "+y", "+z") if floors[name].touched), trunk)
    if floor_axis != trunk:
        doubt = f"joints rest on a floor along it, but trunks point along {trunk}, and nobody can rest so"
        return Up(floor_axis, 0.6, f"{floor_axis}: joints rest on a floor along it", doubt, trunk)
    if clear < TUNING.min_up_length:
        return Up(trunk, clear * 0.6, f"perhaps {trunk}: the body is upright for little of the time")
    doubt = ""
    if trunk != "+y" and floors["+y"].carries:
        doubt = "trunks point along it, but joints rest on a floor along +y as well"
    elif trunk != "+y" and not floors[trunk].touched:
        doubt = "trunks point along it, but joints rest on no floor"
    return Up(trunk, clear, f"{trunk}: people stand along it ({100 * clear:.0f} %)", doubt)


def _find_moments(motion: SkeletonMotion) -> _Moments:
    """Return where joints are in some frames, and a little later."""
    step = max(1, round(TUNING.rest_interval * motion.rate))
    last = max(len(motion) - 1 - step, 0)
    rows = np.unique(np.linspace(0, last, min(last + 1, SAMPLE_FRAMES)).astype(np.intp))
    later = np.minimum(rows + step, len(motion) - 1)
    return _Moments(
        motion.select(rows).world()[1], motion.select(later).world()[1], step / float(motion.rate)
    )


def _find_floor(moments: _Moments, mapped: Mapping[str, int], up: str) -> _Floor:
    """Return what joints rest on if an axis points up: the lowest of all that keep their places."""
    places = moments.places
    joints = sorted(set(mapped.values()))
    size = _height(places, mapped)
    axis = read_axis(up)
    heights = places[:, joints] @ axis
    level = float(np.percentile(heights.min(axis=1), 10))
    moved = np.linalg.norm(moments.later[:, joints] - places[:, joints], axis=2)
    rests = (heights < level + TUNING.max_floor_distance * size) & (
        moved < TUNING.max_rest_speed * size * moments.seconds
    )
    touched = rests.any(axis=1)
    middle = [joints.index(mapped[name]) for name in TRUNK if name in mapped] or list(range(len(joints)))
    flat = places[:, joints] * (1 - np.abs(axis))
    centre = flat[:, middle].mean(axis=1)
    ends = [np.where(rests[..., None], flat, -sign * np.inf) for sign in (1, -1)]
    room = TUNING.max_off_centre * size
    above = ((centre < ends[0].max(axis=1) + room) & (centre > ends[1].min(axis=1) - room)).all(axis=1)
    return _Floor(
        float(touched.mean()) >= TUNING.min_carried_share,
        float((touched & above).mean()) >= TUNING.min_carried_share,
    )


def _height(places: Float64, mapped: Mapping[str, int]) -> float:
    """Return the height of a body in the source's unit, by its legs; without legs, the largest extent."""
    for side in "lr":
        chain = [mapped.get(f"{side}_{joint}") for joint in ("hip", "knee", "ankle")]
        if None not in chain:
            bones = np.diff(places[0, [joint for joint in chain if joint is not None]], axis=0)
            return float(np.linalg.norm(bones, axis=1).sum()) / TUNING.leg_share
    return float(np.ptp(places, axis=1).max())


def find_upright(motion: SkeletonMotion, mapped: Mapping[str, int]) -> Float64:
    """Return the rotation (3, 3) to +y of the axis that is closest to the upward direction at rest."""
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
    """Return the axis (3,), along x, y or z, that is closest to a direction."""
    axis = np.zeros(3)
    best = int(np.argmax(np.abs(direction)))
    axis[best] = np.sign(direction[best]) or 1.0
    return axis


def _name(axis: Float64) -> str:
    best = int(np.argmax(np.abs(axis)))
    return ("+" if axis[best] > 0 else "-") + "xyz"[best]

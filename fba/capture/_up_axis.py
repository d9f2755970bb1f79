"""Which axis of a source points up."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.arrays import Float64
from fba.capture import _standing as standing
from fba.capture.motion import SAMPLE_FRAMES, MappedMotion, read_axis

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
    """The floor at the low end of an axis.

    touched: whether joints rest on it. carries: whether these carry the body. at_zero: whether it is at the
    height 0 of the file, as most makers of captures have it.
    """

    touched: bool
    carries: bool
    at_zero: bool


def find_up_axis(source: MappedMotion, sample: MappedMotion, at_rest: standing.Stance, up: str) -> Up:
    """Return the axis that points up.

    sample: some frames of the source. at_rest: how it rests. up: as the caller gave it.

    What the format says counts, else the axis of the rest pose, unless joints rest on a floor along another
    axis and not along this axis: feet and head of somebody who lies, crawls, hangs or flies do not show it.
    """
    if up != "auto":
        return Up(up, 1.0, f"{up} as given")
    if source.motion.up:
        return Up(source.motion.up, 1.0, f"{source.motion.up}, as the format says")
    stance = standing.measure(sample.positions)
    weight = np.exp(-((stance.distance / 20.0) ** 2)) + 0.02
    mean = (stance.up * weight[:, None]).sum(axis=0) / weight.sum()
    axis = nearest_axis(mean)
    clear = float(mean @ axis)
    stands = bool((stance.angles.get("thigh", np.zeros(1)) <= standing.MAX_ANGLES["thigh"]).any())
    upright = stands and clear >= TUNING.min_up_length
    trunk = _name(axis)
    if not bool(at_rest.possible[0]):
        return _find_freely(source, trunk, clear, stands)
    rest_axis = _name(nearest_axis(at_rest.up[0]))
    if rest_axis == trunk and clear >= TUNING.min_up_length:
        reason = f"{rest_axis}: people stand along it, as in the rest pose ({100 * clear:.0f} %)"
        return Up(rest_axis, max(clear, 0.8), reason)
    floors = _find_floors(source)
    stood = upright and floors[trunk].carries
    if stood and floors[trunk].at_zero:
        doubt = f"people stand along it, at height 0, while the rest pose stands along {rest_axis}"
        reason = f"{trunk}: people stand along it, at height 0 of the file"
        return Up(trunk, 0.8, reason, doubt, rest_axis)
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


def _find_freely(source: MappedMotion, trunk: str, clear: float, stands: bool) -> Up:
    """Return the axis that points up in a file whose rest pose nobody can take.

    trunk: the axis along which trunks point. clear: how clearly, 0 to 1. stands: whether anybody stands.
    """
    if not stands and trunk[1] == "x":
        return Up(trunk, 0.4, f"perhaps {trunk}: trunks point along it, but nobody ever stands")
    first = [trunk] if clear >= TUNING.min_up_length and trunk in ("+y", "+z") else []
    floors = _find_floors(source)
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


def _find_floors(source: MappedMotion) -> dict[str, _Floor]:
    """Return axis that may point up -> what joints rest on: the lowest of all that keep their places."""
    count, rate = len(source.motion), source.motion.rate
    step = max(1, round(TUNING.rest_interval * rate))
    last = max(count - 1 - step, 0)
    rows = np.unique(np.linspace(0, last, min(last + 1, SAMPLE_FRAMES)).astype(np.intp))
    sample, later = source.select(rows), source.select(np.minimum(rows + step, count - 1))
    joints = sorted(source.mapped, key=source.mapped.__getitem__)
    middle = [joints.index(name) for name in TRUNK if name in joints] or list(range(len(joints)))
    positions = np.stack([sample.positions[joint] for joint in joints], axis=1)
    moves = np.stack([later.positions[joint] for joint in joints], axis=1) - positions
    size = _height(sample)
    still = np.linalg.norm(moves, axis=2) < TUNING.max_rest_speed * size * (step / float(rate))
    result = {}
    for name in UPS:
        axis = read_axis(name)
        heights = positions @ axis
        level = float(np.percentile(heights.min(axis=1), 10))
        rests = (heights < level + TUNING.max_floor_distance * size) & still
        touched = rests.any(axis=1)
        flat = positions * (1 - np.abs(axis))
        centre = flat[:, middle].mean(axis=1)
        ends = [np.where(rests[..., None], flat, -sign * np.inf) for sign in (1, -1)]
        room = TUNING.max_off_centre * size
        above = ((centre < ends[0].max(axis=1) + room) & (centre > ends[1].min(axis=1) - room)).all(axis=1)
        shares = float(touched.mean()), float((touched & above).mean())
        rested, carried = (share >= TUNING.min_carried_share for share in shares)
        result[name] = _Floor(rested, carried, abs(level) < TUNING.max_floor_distance * size)
    return result


def _height(sample: MappedMotion) -> float:
    """Return the height of a body in the source's unit, by its legs; without legs, the largest extent."""
    for side in "lr":
        leg = [
            sample.positions[j][0] for j in (f"{side}_hip", f"{side}_knee", f"{side}_ankle") if j in sample
        ]
        if len(leg) == 3:
            return float(np.linalg.norm(np.diff(leg, axis=0), axis=1).sum()) / TUNING.leg_share
    return float(np.ptp(sample.motion.world()[1], axis=1).max())


def nearest_axis(direction: Float64) -> Float64:
    """Return the axis (3,), along x, y or z, that is closest to a direction."""
    axis = np.zeros(3)
    best = int(np.argmax(np.abs(direction)))
    axis[best] = np.sign(direction[best]) or 1.0
    return axis


def _name(axis: Float64) -> str:
    best = int(np.argmax(np.abs(axis)))
    return ("+" if axis[best] > 0 else "-") + "xyz"[best]

"""Turn the feet of the retargeted body, and move its legs so that feet stand where the source's do.

Legs move as little as possible: the knee bends or stretches until hip and ankle have the right distance, then
the leg swings about the hip. A leg that is almost straight must bend a lot to change its length: the
straighter it is, the less it changes its length, and the rest of the error remains.

Toes bend like the source's, and up where the ground is in their way: when the heel rises, toes stay on the
ground, while stiff toes would stick centimetres into it. A joint of toes has a single axis, and many sources
have no such joint.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba import rotations
from fba.arrays import Float64
from fba.body import ground
from fba.body.footing import OUTLINE, TIP, lowest_edge
from fba.capture._limbs import bone_ik, soles
from fba.capture._limbs.soles import joint_frames
from fba.capture._limbs.targets import Targets

FOOT_ITERATIONS = 4
"""Number of iterations that find rotations of ankle and subtalar joint for an exact direction of a foot."""
MAX_TOE_DROP = 0.5
"""Largest distance of toes below the rest of the sole, as a share of the foot's height above the ground."""
LEG_ITERATIONS = 3
"""Number of iterations that move the legs: turning a foot moves its sole again."""
MIN_KNEE_SLOPE = 0.05
"""Change of length, in metres per radian of the knee, below which a leg is almost straight."""
KNEE_ITERATIONS = 3
"""Number of iterations that find the bend of the knee."""
MAX_TOE_BEND = np.radians(60.0)
"""Largest bend of the toes, in radians, that the ground causes."""
TOE_HALVINGS = 12
"""Number of bisections that find the angle of the toes: to a 4000th of the range."""


def turn_foot(targets: Targets, side: str) -> None:
    """Divide the target rotation of a foot between its ankle and subtalar joint.

    The ankle has no roll; the subtalar joint, a little lower, has.
    """
    ankle, subtalar, toe = f"{side}_ankle", f"{side}_subtalar", f"{side}_metatarsal"
    if side not in targets.feet:
        return
    foot = targets.feet[side]
    if targets.aims.get(ankle) != toe:
        _split_foot(targets, ankle, subtalar, foot)
        return
    heel, sole = targets.skeleton.bone(ankle, subtalar), targets.skeleton.bone(subtalar, toe)
    direction = foot @ targets.bone(ankle, toe)
    for _ in range(FOOT_ITERATIONS):  # the bone between the two joints turns with the ankle only
        _split_foot(targets, ankle, subtalar, foot)
        foot = rotations.between_all(targets.rotations[ankle] @ heel + foot @ sole, direction) @ foot
    _split_foot(targets, ankle, subtalar, foot)


def _split_foot(targets: Targets, ankle: str, subtalar: str, foot: Float64) -> None:
    """Set both joints so that together they turn the foot: flexion, twist and roll reach any rotation."""
    above = targets.parent_rotation(ankle)
    ankle_axes = targets.axes(ankle)[0]
    axes = np.concatenate([ankle_axes, targets.axes(subtalar)[0]])
    targets.rotations[subtalar] = foot
    handedness = np.linalg.det(axes) if len(axes) == 3 else 0.0
    if abs(handedness) < 0.5:
        return
    last = rotations.inside(above, foot @ axes[2]) @ axes.T  # the last axis, as the foot turns it
    outer = np.arctan2(-handedness * last[:, 1], last[:, 2])
    inner = np.arctan2(handedness * last[:, 0], np.hypot(last[:, 1], last[:, 2]))
    targets.rotations[ankle] = above @ bone_ik.product(ankle_axes, np.stack([outer, inner], axis=1))


def plant_feet(targets: Targets, root: Float64, scale: float, floor: str, plant: bool) -> Float64:
    """Return positions of the root (T, 3), in metres, at which the feet stand as the source's do.

    root: the positions before. scale: metres for a unit of the source. floor: "floor" for a ground at height
    0, else for that of the source. plant: move the legs, too, which changes the targets.
    """
    root = root.copy()
    rate = float(targets.source.motion.rate)
    source = soles.source_soles(targets.source, scale)
    if source is None or soles.body_soles(targets.skeleton, targets.rotations, root) is None:
        return root
    level = ground.level_under(source.lowest, source.points)
    above = soles.settle(source.lowest - level, source.points, rate)
    under = np.zeros_like(level) if floor == "floor" else level
    bends = [_source_bend(targets, side) for side in "lr"]
    room = MAX_TOE_DROP * above + source.balls
    body = _settle_toes(targets, root, bends, room, np.full_like(above, -np.inf))
    stiff = np.ones_like(above)
    if plant and all(targets.aims.get(f"{side}_hip") == f"{side}_knee" for side in "lr"):
        # a straight leg counts most in the height of the body: a bent one can adapt
        stiff = 1.0 - np.array([length_share(_leg(targets, side, root)) for side in "lr"])
        raised = soles.lift(above, body.lowest - under, stiff, rate)
        body = _settle_toes(targets, root, bends, room, under - raised)
        common, along = soles.slips(source.points, body.points, level, rate)
        root[:, [0, 2]] += common
        ups = soles.heights(above, body.lowest - under + raised, rate)
        for side, pitch in zip("lr", soles.pitches(body.points, ups, above), strict=True):
            targets.feet[side] = pitch @ targets.feet[side]
            turn_foot(targets, side)
        done = np.zeros_like(above)
        for _ in range(LEG_ITERATIONS):
            body = _settle_toes(targets, root, bends, room, under - raised)
            ups = soles.heights(above, body.lowest - under + raised, rate, done)
            done += ups
            for side, up, course in zip("lr", ups, along, strict=True):
                _move_foot(targets, side, root, np.stack([course[:, 0], up, course[:, 1]], axis=1))
            along = np.zeros_like(along)
        body = _settle_toes(targets, root, bends, room, under - raised)
    lowest = body.lowest - under
    raised = soles.lift(above, lowest, stiff, rate)
    root[:, 1] += raised + soles.rise_above(-(lowest + raised).min(axis=0), rate)
    return root


def _settle_toes(
    targets: Targets, root: Float64, bends: list[Float64], room: Float64, level: Float64
) -> soles.Soles:  # fmt: skip
    """Bend the toes, and return the soles of the body. bends, room, level: (2, T), see `_bend_toes`."""
    for number, side in enumerate("lr"):
        _bend_toes(targets, side, root, bends[number], room[number], level[number])
    result = soles.body_soles(targets.skeleton, targets.rotations, root)
    assert result is not None
    return result


def _move_foot(targets: Targets, side: str, root: Float64, move: Float64) -> None:
    """Bend a leg so that its foot moves by move (T, 3), metres."""
    thigh, shank = move_ankle(_leg(targets, side, root), move)
    targets.rotations[f"{side}_hip"] = thigh @ targets.rotations[f"{side}_hip"]
    targets.rotations[f"{side}_knee"] = shank @ targets.rotations[f"{side}_knee"]
    turn_foot(targets, side)


def _leg(targets: Targets, side: str, root: Float64) -> Leg:
    """Return the world positions of a leg's joints, and the axis of its knee."""
    knee = f"{side}_knee"
    frames = joint_frames(targets.skeleton, targets.rotations, root, f"{side}_ankle")
    axes, *_ = targets.axes(knee)
    bone = targets.bone(knee, f"{side}_ankle")
    outermost = abs(axes[0] @ bone) < abs(axes[-1] @ bone)
    axis = frames[f"{side}_hip"][1] @ axes[0] if outermost else frames[knee][1] @ axes[-1]
    hip, middle, ankle = (frames[f"{side}_{joint}"][0] for joint in ("hip", "knee", "ankle"))
    return Leg(hip, middle, ankle, axis)


@dataclass(frozen=True, eq=False)
class Leg:
    """Positions (T, 3) of hip, knee and ankle, and unit axes (T, 3) of the knee."""

    hip: Float64
    knee: Float64
    ankle: Float64
    axis: Float64


def length_share(leg: Leg) -> Float64:
    """Return the shares (T,) of a wanted change of length that a leg makes: 0 if straight, near 1 if bent."""
    slope = _leg_lengths(leg)[1]
    return slope * slope / (slope * slope + MIN_KNEE_SLOPE * MIN_KNEE_SLOPE)


def move_ankle(leg: Leg, move: Float64) -> tuple[Float64, Float64]:
    """Return world turns (T, 3, 3) of thigh and shank that move the ankle by move (T, 3), in metres."""
    target = leg.ankle + move - leg.hip
    wanted = np.linalg.norm(target, axis=1)
    bend = np.zeros(len(move))
    shank = leg.ankle - leg.knee
    length, slope = _leg_lengths(leg)
    share = slope / (slope * slope + MIN_KNEE_SLOPE * MIN_KNEE_SLOPE)
    goal = length + (wanted - length) * slope * share  # less for straighter legs
    ankle = leg.ankle
    for _ in range(KNEE_ITERATIONS):
        bend += (goal - length) * share
        ankle = leg.knee + (rotations.turn(leg.axis, bend) @ shank[..., None])[..., 0]
        length = np.linalg.norm(ankle - leg.hip, axis=1)
    swing = rotations.between_all(ankle - leg.hip, target)
    return swing, swing @ rotations.turn(leg.axis, bend)


def _leg_lengths(leg: Leg) -> tuple[Float64, Float64]:
    """Return the distances (T,) from hip to ankle, and their changes (T,) per radian of the knee."""
    line = leg.ankle - leg.hip
    length = np.maximum(np.linalg.norm(line, axis=1), 1e-9)
    moved = np.cross(leg.axis, leg.ankle - leg.knee)
    return length, np.sum(moved * line, axis=1) / length


def _source_bend(targets: Targets, side: str) -> Float64:
    """Return the bend (T,) of the source's toes in radians, upwards; 0 for a source without toes."""
    joint = f"{side}_metatarsal"
    if joint not in targets.rotations:
        return np.zeros(len(targets.source.motion))
    above = targets.parent_rotation(joint)
    return targets.closest_angles(joint, np.swapaxes(above, 1, 2) @ targets.rotations[joint])[:, 0]


def _bend_toes(
    targets: Targets, side: str, root: Float64, bend: Float64, room: Float64, ground: Float64
) -> None:
    """Turn the toes by a bend (T,), and further up where they would be under the ground.

    root: (T, 3), positions of the root in metres. room: (T,), metres by which toes may be below the rest of
    the sole. ground: (T,), height of the ground, which they are not under, unless the rest of the sole is.
    """
    joint = f"{side}_metatarsal"
    frames = joint_frames(targets.skeleton, targets.rotations, root, joint)
    axis = targets.axes(joint)[0][0]
    above_it = targets.parent_rotation(joint)
    # heights of the tips: level + still + across cos(angle) + raised sin(angle)
    points = np.array([
        [x if side == "l" else -x, y - targets.skeleton.centres[targets.skeleton.number(joint)][1], z]
        for _, x, y, z in TIP
    ])  # fmt: skip
    up = above_it[:, 1]
    along = np.outer(points @ axis, axis)
    still, across, raised = (up @ part.T for part in (along, points - along, np.cross(axis, points)))
    level = frames[joint][0][:, 1]
    sole = lowest_edge(targets.skeleton, frames, side, OUTLINE)
    floor = np.maximum(sole - room, np.minimum(sole, ground))

    def lowest(angle: Float64) -> Float64:
        heights = still + across * np.cos(angle)[:, None] + raised * np.sin(angle)[:, None]
        result: Float64 = level + heights.min(axis=1)
        return result

    low, high = bend, np.maximum(bend, MAX_TOE_BEND)
    enough = lowest(bend) >= floor
    for _ in range(TOE_HALVINGS):
        middle = (low + high) / 2
        fits = lowest(middle) >= floor
        low, high = np.where(fits, low, middle), np.where(fits, middle, high)
    angle = np.where(enough, bend, high)
    if joint in targets.rotations or angle.any():
        targets.rotations[joint] = above_it @ rotations.turn(axis, angle)

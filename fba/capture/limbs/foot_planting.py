"""Turn the feet of the retargeted body, and move its legs so that feet stand where the source's do."""

from __future__ import annotations

import numpy as np

from fba import rotations
from fba.arrays import Float64
from fba.body import ground
from fba.capture.limbs import _leg_ik as leg_ik
from fba.capture.limbs import bone_ik, soles, toes
from fba.capture.limbs.targets import Targets

STEPS = 4
"""Iterations that find the rotations of ankle and subtalar joint with which a foot points exactly."""
HANGING = 0.5
"""Share of a foot's height above the ground by which toes may hang below the rest of it."""
ROUNDS = 3
"""Iterations that move the legs: turning a foot moves its sole again."""


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
    centres = {j: targets.skeleton.centres[targets.skeleton.number(j)] for j in (ankle, subtalar, toe)}
    heel, sole = centres[subtalar] - centres[ankle], centres[toe] - centres[subtalar]
    direction = foot @ targets.bone(ankle, toe)
    for _ in range(STEPS):  # the bone between the two joints turns with the ankle only
        _split_foot(targets, ankle, subtalar, foot)
        foot = rotations.between_all(targets.rotations[ankle] @ heel + foot @ sole, direction) @ foot
    _split_foot(targets, ankle, subtalar, foot)


def _split_foot(targets: Targets, ankle: str, subtalar: str, foot: Float64) -> None:
    """Set both joints so that together they turn the foot: flexion, twist and roll reach any rotation."""
    above = targets.parent_rotation(ankle)
    own = targets.axes(ankle)[0]
    axes = np.concatenate([own, targets.axes(subtalar)[0]])
    targets.rotations[subtalar] = foot
    handedness = np.linalg.det(axes) if len(axes) == 3 else 0.0
    if abs(handedness) < 0.5:
        return
    last = rotations.inside(above, foot @ axes[2]) @ axes.T  # the last axis, as the foot turns it
    outer = np.arctan2(-handedness * last[:, 1], last[:, 2])
    inner = np.arctan2(handedness * last[:, 0], np.hypot(last[:, 1], last[:, 2]))
    targets.rotations[ankle] = above @ bone_ik.product(own, np.stack([outer, inner], axis=1))


def plant_feet(targets: Targets, root: Float64, scale: float, floor: str, plant: bool) -> Float64:
    """Return positions of the root (T, 3), in metres, at which the feet stand as the source's do.

    root: positions to start from. scale: metres for one unit of the source. floor: "floor" for a ground at
    height 0, else it is that of the source. plant: also move the legs, which changes the targets.
    """
    root = root.copy()
    rate = float(targets.motion.rate)
    source = soles.source_soles(
        targets.motion, targets.mapped, targets.source_rotations, targets.source_positions, scale
    )
    if source is None or soles.body_soles(targets.skeleton, targets.rotations, root) is None:
        return root
    middles = source.points.mean(axis=1)
    level = ground.find(source.lowest, middles).under(middles)
    above = soles.settle(source.lowest - level, source.points, rate)
    under = np.zeros_like(level) if floor == "floor" else level
    bends = [toes.source_bend(targets, side) for side in "lr"]
    room = HANGING * above + source.balls
    body = _settle_toes(targets, root, bends, room, np.full_like(above, -np.inf))
    stiff = np.ones_like(above)
    if plant and all(targets.aims.get(f"{side}_hip") == f"{side}_knee" for side in "lr"):
        # a straight leg counts most in the height of the body: a bent one can adapt
        stiff = 1.0 - np.array([leg_ik.pliancy(_leg(targets, side, root)) for side in "lr"])
        raised = soles.lift(above, body.lowest - under, stiff, rate)
        body = _settle_toes(targets, root, bends, room, under - raised)
        common, along = soles.slips(source.points, body.points, level, rate)
        root[:, [0, 2]] += common
        ups = soles.heights(above, body.lowest - under + raised, rate)
        for side, pitch in zip("lr", soles.pitches(body.points, ups, above), strict=True):
            targets.feet[side] = pitch @ targets.feet[side]
            turn_foot(targets, side)
        done = np.zeros_like(above)
        for _ in range(ROUNDS):
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
    """Bend the toes, and return the soles of the body. bends, room, level: (2, T), see `toes.bend_toes`."""
    for number, side in enumerate("lr"):
        toes.bend_toes(targets, side, root, bends[number], room[number], level[number])
    result = soles.body_soles(targets.skeleton, targets.rotations, root)
    assert result is not None
    return result


def _move_foot(targets: Targets, side: str, root: Float64, move: Float64) -> None:
    """Bend a leg so that its foot moves by move (T, 3), metres."""
    thigh, shank = leg_ik.reach(_leg(targets, side, root), move)
    targets.rotations[f"{side}_hip"] = thigh @ targets.rotations[f"{side}_hip"]
    targets.rotations[f"{side}_knee"] = shank @ targets.rotations[f"{side}_knee"]
    turn_foot(targets, side)


def _leg(targets: Targets, side: str, root: Float64) -> leg_ik.Leg:
    """Return the world positions of a leg's joints, and the axis of its knee."""
    knee = f"{side}_knee"
    frames = {
        name: (position, frame)
        for name, position, frame in soles.joint_frames(
            targets.skeleton, targets.rotations, root, f"{side}_ankle"
        )
    }
    axes, *_ = targets.axes(knee)
    bone = targets.bone(knee, f"{side}_ankle")
    outermost = abs(axes[0] @ bone) < abs(axes[-1] @ bone)
    axis = frames[f"{side}_hip"][1] @ axes[0] if outermost else frames[knee][1] @ axes[-1]
    hip, middle, ankle = (frames[f"{side}_{joint}"][0] for joint in ("hip", "knee", "ankle"))
    return leg_ik.Leg(hip, middle, ankle, axis)

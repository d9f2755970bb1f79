"""Find the soles of source and body, and how far feet must move to stand like the source's.

Bones point in the directions of the source's, but thigh, shank and foot have other proportions. So soles end
up millimetres to centimetres higher or lower than the source's, and slip a little while the source's stand
still; the height of the ground differs, too. First the whole body is raised or lowered in each frame, so that
the foot on the ground is as high above it as the source's; legs correct the rest
(`fba.capture._limbs.foot_planting.move_ankle`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fba import rotations
from fba.arrays import Bool, Float64
from fba.body import SIDES, BodyModel, Skeleton
from fba.body.footing import SOLE, lowest_edge
from fba.body.stance import HEEL, find_standing, heel_and_ball
from fba.capture._limbs._coupled_paths import chain
from fba.capture.motion import MappedMotion

LEVEL_SECONDS = 0.2
"""Seconds over which the height of the ground under feet that stand is averaged."""
MIN_FOOT_LENGTH = 0.05
"""Smallest distance, in metres, from an ankle ahead to the front of a source's foot."""
ANKLE_HEIGHT = 0.076
"""Height of the default skeleton's ankle above the ground, in metres."""
BALL_DISTANCE = 0.15
"""Distance from the default skeleton's ankle ahead to the ball of the foot, in metres."""
ON_GROUND = 0.015
"""Height of a foot, in metres, at which its influence on the height of the body falls to 1/e."""
USUAL_WEIGHT = 0.02
"""Weight of the usual height, which counts while no foot is on the ground."""
SMOOTHING_SECONDS = 0.02
"""Seconds over which corrections are averaged."""
MAX_FULL_CORRECTION = 0.012
"""Height above the ground, in metres, below which a leg moves its foot by the whole error."""
MAX_SOLE_HEIGHT = 0.004
"""Largest height of a sole above its target, in metres, at which its leg does not move."""
MAX_SOLE_DEPTH = 0.003
"""Largest depth of a sole below its target, in metres, at which the body rises and its leg does not move."""
PITCH_SHARE = 0.9
"""Share of the height correction of a foot on its ball that its own pitch makes."""
MAX_PITCH = np.radians(6.0)
"""Largest change of a foot's pitch, in radians."""
MAX_AIR_PITCH = np.radians(6.0)
"""Largest change, in radians, of the pitch of a foot in the air whose toes would be under the ground."""
MIN_TIPTOE_HEIGHT = 0.02
"""Smallest height of the heel above the ball, in metres, of a foot that stands mostly on its ball."""
MIN_LEVER = 0.1
"""Smallest horizontal distance, in metres, that is assumed from heel to ball."""
MAX_MOVE = 0.03
"""Largest distance, in metres, by which a leg moves its foot."""
MAX_RISE = 0.025
"""Largest distance, in metres, by which a leg lifts its foot: knees bend more for it."""
MAX_AIR_RISE = 0.015
"""Largest distance, in metres, by which a leg lifts a foot in the air that would be under the ground. The
body as a whole rises by the rest."""
MAX_UNSEEN_DEPTH = 0.002
"""Largest invisible depth under the ground, in metres."""
AIR_WEIGHT = 0.002
"""Weight of keeping the motion of a foot in the air, relative to that of no slip on the ground."""
RETURN_WEIGHT = 0.3
"""Weight, per second squared, of the position without correction: a foot in the air returns to it within a
sixth of a second, a foot on the ground over seconds."""
BODY_RETURN_WEIGHT = 1.0
"""Weight, per second squared, of the uncorrected position of the body as a whole."""


@dataclass(frozen=True, eq=False)
class Soles:
    """Soles of the left and the right foot, in metres.

    lowest: (2, T), height of the lowest point. points: (2, 2, T, 3), heel, and ball or tip, whichever the
    source has. balls: (2, T), how much higher than the lowest point the ball's sole is.
    """

    lowest: Float64
    points: Float64
    balls: Float64


def source_soles(source: MappedMotion, metres: float) -> Soles | None:
    """Return the source's soles, or None if it lacks an ankle.

    metres: of the body for one unit of the source. The points of a sole are ankle, joints and bone ends below
    it, and a heel. If no point is behind the ankle, the heel is as far behind it as the body's, and as far
    below it as the lowest point of the rest pose.
    """
    if "l_ankle" not in source or "r_ankle" not in source:
        return None
    motion = source.motion
    rest, positions = motion.rest(), motion.world()[1]
    lows, points, balls = [], [], []
    for side in SIDES:
        ankle = source.mapped[f"{side}_ankle"]
        turn = motion.joint_rotations(ankle)
        foot = motion.descendants(ankle)
        at_rest = [rest[joint] - rest[ankle] for joint in foot]
        moving = [positions[:, joint] for joint in foot]
        for parent, offset in zip(motion.end_parents.tolist(), motion.end_offsets, strict=True):
            if parent in foot:
                at_rest.append(rest[parent] + offset - rest[ankle])
                moving.append(positions[:, parent] + motion.joint_rotations(parent) @ offset)
        ahead = max(at_rest, key=lambda point: float(np.hypot(point[0], point[2]))) * [1.0, 0.0, 1.0]
        ahead /= max(float(np.linalg.norm(ahead)), 1e-9)
        along = [float(point @ ahead) * metres for point in at_rest]
        depth = min(float(point[1]) for point in at_rest)
        if max(along) < MIN_FOOT_LENGTH:  # the foot ends at the ankle: its front is that of the body
            depth = min(depth, -ANKLE_HEIGHT / metres)
            ahead = np.cross(source.rest["l_ankle"] - source.rest["r_ankle"], [0.0, 1.0, 0.0])
            ahead /= max(float(np.linalg.norm(ahead)), 1e-9)
            point = np.array([0.0, depth, 0.0]) + ahead * (BALL_DISTANCE / metres)
            at_rest.append(point)
            along.append(BALL_DISTANCE)
            moving.append(positions[:, ankle] + turn @ point)
        if min(along) < -HEEL / 2:
            heel = moving[int(np.argmin(along))]
        else:
            behind = np.array([0.0, depth, 0.0]) - ahead * (HEEL / metres)
            heel = positions[:, ankle] + turn @ behind
            moving.append(heel)
        ball = source.mapped.get(f"{side}_metatarsal")
        front = moving[int(np.argmax(along))] if ball is None else positions[:, ball]
        lowest = np.min([point[:, 1] for point in moving], axis=0)
        thick = 0.0 if ball is None else float(rest[ball, 1] - rest[ankle, 1]) - depth
        balls.append(np.zeros(len(lowest)) if ball is None else front[:, 1] - thick - lowest)
        lows.append(lowest)
        points.append([heel, front])
    return Soles(np.array(lows) * metres, np.array(points) * metres, np.maximum(balls, 0.0) * metres)


def body_soles(skeleton: Skeleton, turns: Mapping[str, Float64], root: Float64) -> Soles | None:
    """Return the body's soles, or None if it lacks a joint of the feet.

    turns: joint -> world rotations (T, 3, 3); other joints turn with their parents. root: (T, 3), metres.
    The lowest points are of the soles' edge, see `fba.body.footing`: for the default skeleton those of the
    person that is shown, who has other proportions and stands with the lower foot where the skeleton does.
    """
    lows, points, balls = [], [], []
    shown = BodyModel.default().skeleton if skeleton is Skeleton.default() else skeleton
    shown_lows = []
    for side in SIDES:
        last = f"{side}_metatarsal"
        if last not in skeleton:
            return None
        frames = joint_frames(skeleton, turns, root, last)
        ends = heel_and_ball(skeleton, frames, side)
        if ends is None:
            return None
        points.append(ends)
        lows.append(lowest_edge(skeleton, frames, side, SOLE))
        balls.append(ends[1][:, 1] - lows[-1])
        if shown is not skeleton:
            shown_lows.append(lowest_edge(shown, joint_frames(shown, turns, root, last), side, SOLE))
    lowest = np.array(lows)
    if shown_lows:
        lowest = np.array(shown_lows) + lowest.min(axis=0) - np.min(shown_lows, axis=0)
    return Soles(lowest, np.array(points), np.array(balls))


def joint_frames(
    skeleton: Skeleton, turns: Mapping[str, Float64], root: Float64, last: str
) -> dict[str, tuple[Float64, Float64]]:
    """Return position (T, 3) and rotation (T, 3, 3) of the joints from the root to `last`, by name.

    turns, root: as for `body_soles`.
    """
    path = [skeleton.number(last)]
    while skeleton.parents[path[-1]] >= 0:
        path.append(int(skeleton.parents[path[-1]]))
    position, frame = root, np.broadcast_to(np.eye(3), (len(root), 3, 3))
    result = {}
    for number in reversed(path):
        name, parent = skeleton.names[number], int(skeleton.parents[number])
        if parent >= 0:
            position = position + frame @ (skeleton.centres[number] - skeleton.centres[parent])
        frame = turns.get(name, frame)
        result[name] = position, frame
    return result


def lift(above: Float64, body: Float64, stiff: Float64, rate: float) -> Float64:
    """Return (T,), metres to raise the body by, so that feet are as high as the source's.

    above: (2, T), target heights in metres above the ground. body: (2, T), heights without correction. stiff:
    (2, T), weight of each foot. The foot closer to the ground counts most.
    """
    lacking = above - body
    contact = grounded(above)
    usual = float(np.median(lacking[contact > 0.5])) if (contact > 0.5).any() else float(np.median(lacking))
    weight = contact * stiff
    correction = (weight * (lacking - usual)).sum(axis=0)
    result = usual + correction / (weight.sum(axis=0) + USUAL_WEIGHT * stiff.mean(axis=0))
    return smooth(result, rate)


def settle(above: Float64, points: Float64, rate: float) -> Float64:
    """Return heights (2, T) of soles, 0 where they stand: errors of the capture there are removed.

    above: (2, T), metres above the ground. points: (2, 2, T, 3), of the soles. The ground of a foot goes from
    its height where it stands (`fba.body.stance.find_standing`) to its height where it stands next. No result
    is under the ground.
    """
    if above.shape[1] > 1:
        lowest = above.min(axis=0)
        stands = find_standing(above, points, rate)
        support = _levels(lowest, (stands & (above <= lowest)).any(axis=0), rate)
        grounds = [
            _levels(foot, on, rate) if on.any() else support for foot, on in zip(above, stands, strict=True)
        ]
        above = above - np.array(grounds)
    return np.maximum(above, 0.0)


def _levels(height: Float64, stands: Bool, rate: float) -> Float64:
    """Return the height (T,) of the ground under a foot at heights (T,): that of the foot where it stands."""
    if not stands.any():
        return np.zeros_like(height)
    frames = np.arange(len(height))
    return smooth(np.interp(frames, frames[stands], height[stands]), rate * LEVEL_SECONDS / SMOOTHING_SECONDS)


def grounded(above: Float64) -> Float64:
    """Return the contact of feet with the ground at these heights: 1 on the ground, less above."""
    return np.exp(-((np.maximum(above, 0.0) / ON_GROUND) ** 2))


def heights(above: Float64, body: Float64, rate: float, done: Float64 | float = 0.0) -> Float64:
    """Return (2, T), metres to raise each foot by after the body was: as little as needed.

    Feet in the air are raised only where they would be under the ground. done: (2, T), by how much they have
    been raised before.
    """
    lacking = above - body
    needed = np.maximum(lacking - MAX_SOLE_DEPTH, 0.0) - np.maximum(-lacking - MAX_SOLE_HEIGHT, 0.0)
    moves = np.array([smooth(foot, rate) for foot in needed * grounded(above - MAX_FULL_CORRECTION)])
    dips = np.array([rise_above(foot, rate) for foot in -body])
    moves = np.clip(done + moves, -MAX_MOVE, MAX_RISE) - done
    dips = np.minimum(done + dips, np.maximum(done, MAX_AIR_RISE)) - done
    return moves + np.maximum(dips - np.maximum(moves, 0.0), 0.0)


def rise_above(depth: Float64, rate: float) -> Float64:
    """Return metres (T,), 0 or more, to raise points at depths (T,) under the ground, until no depth is seen.

    They rise a little before and after, too, so that the motion does not start abruptly.
    """
    needed = np.maximum(depth - MAX_UNSEEN_DEPTH, 0.0)
    return np.maximum(needed, smooth(needed, rate))


def pitches(body: Float64, ups: Float64, above: Float64) -> Float64:
    """Return (2, T, 3, 3), world turns of the feet: those on their balls pitch to correct their heights.

    body: (2, 2, T, 3), points of the soles. ups: (2, T), metres to raise the feet by; legs make the rest.
    above: (2, T), target heights: in the air, feet pitch further.
    """
    sole = body[:, 1] - body[:, 0]
    length = np.maximum(np.hypot(sole[..., 0], sole[..., 2]), MIN_LEVER)
    most = MAX_AIR_PITCH + (MAX_PITCH - MAX_AIR_PITCH) * grounded(above)
    angle = np.clip(PITCH_SHARE * tiptoe(body) * ups / length, -most, most)
    across = np.stack([-sole[..., 2], np.zeros_like(length), sole[..., 0]], axis=-1)
    across /= np.maximum(np.linalg.norm(across, axis=-1, keepdims=True), 1e-9)
    return rotations.turn(across, angle)


def tiptoe(body: Float64) -> Float64:
    """Return (2, T): 0 for feet on their heels, 1 on their balls. body: (2, 2, T, 3), points of the soles."""
    return 0.5 - 0.5 * np.tanh((body[:, 1, :, 1] - body[:, 0, :, 1]) / MIN_TIPTOE_HEIGHT)


def slips(source: Float64, body: Float64, level: Float64, rate: float) -> tuple[Float64, Float64]:
    """Return corrections in metres along x and z, with which feet on the ground move as the source's.

    They are (T, 2) for the body, and (2, T, 2) for each foot after that. source, body: (2, 2, T, 3), points
    of the soles. level: (2, T), height of the ground under the source's. The velocity of a point on the
    ground becomes the source's; all other corrections are as small as possible. The body moves as far as that
    helps, because that turns no bone.
    """
    contact = grounded(source[..., 1] - level[:, None])
    contact = np.minimum(contact[..., 1:], contact[..., :-1])
    drift = -(contact[..., None] * np.diff(body - source, axis=2)[..., [0, 2]]).sum(axis=1)
    firm = contact.sum(axis=1)
    common = _path(drift.sum(axis=0), firm.sum(axis=0), BODY_RETURN_WEIGHT, rate)
    remaining = drift - firm[..., None] * np.diff(common, axis=0)
    return common, np.array([_path(remaining[foot], firm[foot], RETURN_WEIGHT, rate) for foot in range(2)])


def _path(aim: Float64, firm: Float64, back: float, rate: float) -> Float64:
    """Return a correction over time (T, 2), whose changes come close to given ones.

    aim: (T - 1, 2), changes from frame to frame times their weights. firm: (T - 1,), the weights. back:
    weight of 0.
    """
    count = len(firm) + 1
    bonds = (firm + AIR_WEIGHT) * rate
    result = np.zeros((2, count))
    for axis in range(2):
        pull = np.zeros(count)
        pull[1:] += aim[:, axis] * rate
        pull[:-1] -= aim[:, axis] * rate
        chain(np.full(count, back / rate), bonds, pull, result[axis])
    path = result.T
    length = np.linalg.norm(path, axis=1, keepdims=True)
    bounded: Float64 = path * (MAX_MOVE * np.tanh(length / MAX_MOVE) / np.maximum(length, 1e-12))
    return bounded


def smooth(values: Float64, rate: float) -> Float64:
    """Return values (T,) smoothed by a moving average, applied twice."""
    half = max(1, round(SMOOTHING_SECONDS * rate))
    for _ in range(2):
        sums = np.concatenate([[0.0], np.cumsum(np.pad(values, half, mode="edge"))])
        values = (sums[2 * half + 1 :] - sums[: -2 * half - 1]) / (2 * half + 1)
    return values

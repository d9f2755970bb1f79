"""Soles: where the source's and the body's touch the ground, and how far they are to be moved to agree.

Bones point where the source's point, but thigh, shank and foot have other proportions: so at the same leg
length and the same angles, soles end up millimetres to centimetres higher or lower than the source's, slip a
little where the source's stand, and sources differ in where their ground is. First the body is raised or
lowered as a whole, frame by frame, such that the foot on the ground is as high above it as the source's is;
what then is still lacking, legs make up for (`fba.capture.limbs._leg_ik`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fba import rotations
from fba.arrays import Float64
from fba.body.skeleton import Skeleton
from fba.capture.limbs._coupled_paths import chain
from fba.capture.motion import SkeletonMotion

TOES = 0.06
"""Metres from the metatarsal joint to the tip of the toes of the default body."""
HEEL = 0.045
"""Metres by which a heel stands behind its ankle."""
ON_GROUND = 0.015
"""Metres over which a foot above the ground loses its say in how high the body is."""
SETTLED = 0.02
"""The say of neither foot being on the ground."""
SMOOTH = 0.03
"""Seconds over which corrections are averaged."""
WITHIN = 0.012
"""Metres above the ground up to which a leg moves its foot by all that is needed."""
TOLERATED = 0.005
"""Metres by which a sole may be off before its leg moves for it."""
PITCH_SHARE = 0.8
"""Of the height that a foot on its ball lacks, what the foot itself makes up for by its pitch."""
MOST_PITCH = np.radians(3.0)
TIPTOE = 0.02
"""Metres by which a heel is above the ball of a foot that stands on the ball only."""
LEVER = 0.1
"""Metres from ankle to ball, seen from above, at least."""
FARTHEST = 0.03
"""Metres: no leg moves its foot by more."""
SWING = 0.002
"""Weight of a foot in the air keeping its course, against that of one on the ground keeping its place."""
RETURN = 0.3
"""Weight of being where the retargeted leg alone would be, per second squared: a foot in the air comes back
within a sixth of a second, one on the ground drifts back over seconds."""


RETURN_BODY = 1.0
"""The same for the body as a whole, which is to stay where the source's is."""


@dataclass(frozen=True, eq=False)
class Soles:
    """Of the left and the right foot, metres: lowest (2, T), the height of the lowest point. points: (2, 2,
    T, 3), the heel, and the ball or the tip, whatever the source has.
    """

    lowest: Float64
    points: Float64


def source_soles(motion: SkeletonMotion, mapped: Mapping[str, int], upright: Float64, turned: Float64,
                 places: Float64, metres: float) -> Soles | None:  # fmt: skip
    """The source's soles. None where it has not both ankles.

    turned: (T, J, 4) world rotations of the source's own frame, places: (T, J, 3), upright, in its units.
    metres: of the body for one of them. A sole's points are the ankle's and its descendants' joints and ends,
    and a heel: where the source has none behind the ankle, as far behind as the body's, and as deep below as
    the lowest of them in the rest pose.
    """
    if "l_ankle" not in mapped or "r_ankle" not in mapped:
        return None
    rest = motion.rest()
    lows, points = [], []
    for side in "lr":
        ankle = mapped[f"{side}_ankle"]
        foot = [ankle]
        for joint, parent in enumerate(motion.parents):
            if int(parent) in foot:
                foot.append(joint)
        at_rest = [(rest[joint] - rest[ankle]) @ upright.T for joint in foot]
        moving = [places[:, joint] for joint in foot]
        for parent, offset in zip(motion.end_parents, motion.end_offsets, strict=True):
            if int(parent) in foot:
                at_rest.append((rest[parent] + offset - rest[ankle]) @ upright.T)
                turn = upright @ rotations.matrices(turned[:, parent])
                moving.append(places[:, parent] + turn @ offset)
        ahead = max(at_rest, key=lambda point: float(np.hypot(point[0], point[2]))) * [1.0, 0.0, 1.0]
        ahead /= max(float(np.linalg.norm(ahead)), 1e-9)
        along = [float(point @ ahead) * metres for point in at_rest]
        if min(along) < -HEEL / 2:
            heel = moving[int(np.argmin(along))]
        else:
            behind = [0.0, min(float(point[1]) for point in at_rest), 0.0] - ahead * (HEEL / metres)
            turn = upright @ rotations.matrices(turned[:, ankle]) @ upright.T
            heel = places[:, ankle] + turn @ behind
            moving.append(heel)
        ball = mapped.get(f"{side}_metatarsal")
        front = moving[int(np.argmax(along))] if ball is None else places[:, ball]
        lows.append(np.min([point[:, 1] for point in moving], axis=0))
        points.append([heel, front])
    return Soles(np.array(lows) * metres, np.array(points) * metres)


def body_soles(skeleton: Skeleton, wanted: Mapping[str, Float64], root: Float64, toes: bool) -> Soles | None:
    """The body's soles: heel, ball, and tip of the toes where toes. None where it lacks parts of feet.

    wanted: joint -> world rotations (T, 3, 3); joints that are not there turn with their parents. root: (T,
    3).
    """
    lows, points = [], []
    for side in "lr":
        parts = [f"{side}_ankle", f"{side}_subtalar", f"{side}_midtarsal", f"{side}_metatarsal"]
        if not all(joint in skeleton for joint in parts):
            return None
        centres = skeleton.centres
        ankle, ball = centres[skeleton.number(parts[0])], centres[skeleton.number(parts[3])]
        soles = {
            parts[1]: np.array([ankle[0], 0.0, ankle[2] - HEEL]),
            parts[2]: np.array([ball[0], 0.0, ball[2]]),
        }
        if toes:
            soles[parts[3]] = np.array([ball[0], 0.0, ball[2] + TOES])
        found = []
        for name, place, frame in followed(skeleton, wanted, root, parts[3]):
            if name in soles:
                found.append(place + frame @ (soles[name] - centres[skeleton.number(name)]))
        lows.append(np.min([point[:, 1] for point in found], axis=0))
        points.append(found[:2])
    return Soles(np.array(lows), np.array(points))


def followed(
    skeleton: Skeleton, wanted: Mapping[str, Float64], root: Float64, last: str
) -> list[tuple[str, Float64, Float64]]:
    """From the root down to a joint: name, place (T, 3) and rotation (T, 3, 3); see `body_soles`."""
    path = [skeleton.number(last)]
    while skeleton.parents[path[-1]] >= 0:
        path.append(int(skeleton.parents[path[-1]]))
    place, frame = root, np.broadcast_to(np.eye(3), (len(root), 3, 3))
    result = []
    for number in reversed(path):
        name, parent = skeleton.names[number], int(skeleton.parents[number])
        if parent >= 0:
            place = place + frame @ (skeleton.centres[number] - skeleton.centres[parent])
        frame = wanted.get(name, frame)
        result.append((name, place, frame))
    return result


def lift(above: Float64, body: Float64, stiff: Float64, rate: float) -> Float64:
    """(T,), metres to raise the body by, so that feet are as high as the source's.

    above: (2, T), heights wanted, in metres above the ground; body: (2, T), those that are. stiff: (2, T), by
    how much each foot's say counts. The foot closer to the ground has the say.
    """
    lacking = above - body
    say = grounded(above)
    usual = float(np.median(lacking[say > 0.5])) if (say > 0.5).any() else float(np.median(lacking))
    say = say * stiff
    result = usual + (say * (lacking - usual)).sum(axis=0) / (say.sum(axis=0) + SETTLED * stiff.mean(axis=0))
    return smoothed(result, rate)


def grounded(above: Float64) -> Float64:
    """The say of feet at heights above the ground, 0 to 1."""
    say: Float64 = np.exp(-((np.maximum(above, 0.0) / ON_GROUND) ** 2))
    return say


def heights(above: Float64, body: Float64, rate: float) -> Float64:
    """(2, T), metres to raise each foot by, after the body was: no more than needed, nothing in the air."""
    lacking = above - body
    needed = np.sign(lacking) * np.maximum(np.abs(lacking) - TOLERATED, 0.0)
    moves = np.array([smoothed(foot, rate) for foot in needed * grounded(above - WITHIN)])
    result: Float64 = np.clip(moves, -FARTHEST, FARTHEST)
    return result


def pitches(body: Float64, ups: Float64) -> Float64:
    """(2, T, 3, 3), world turns of the feet: what stands on its ball raises or lowers that, by some of ups.

    body: (2, 2, T, 3), points of the soles; ups: (2, T), metres to raise the feet by. Legs do the rest.
    """
    sole = body[:, 1] - body[:, 0]
    length = np.maximum(np.hypot(sole[..., 0], sole[..., 2]), LEVER)
    angle = np.clip(PITCH_SHARE * tiptoe(body) * ups / length, -MOST_PITCH, MOST_PITCH)
    across = np.stack([-sole[..., 2], np.zeros_like(length), sole[..., 0]], axis=-1)
    across /= np.maximum(np.linalg.norm(across, axis=-1, keepdims=True), 1e-9)
    return rotations.turn(across, angle)


def tiptoe(body: Float64) -> Float64:
    """(2, T), 0 for feet on their heels, 1 on their balls, of points of the soles (2, 2, T, 3)."""
    result: Float64 = 0.5 - 0.5 * np.tanh((body[:, 1, :, 1] - body[:, 0, :, 1]) / TIPTOE)
    return result


def slips(source: Float64, body: Float64, level: Float64, rate: float) -> tuple[Float64, Float64]:
    """Metres along x and z to move the body by, (T, 2), and then each foot, (2, T, 2), so that feet move on
    the ground as the source's do.

    source, body: (2, 2, T, 3), points of the soles. level: (2, T), the ground under the source's. The courses
    that are sought differ from the body's own by as little as can be; their velocity is the source's where
    a point is on the ground. As much as it can, the body moves, which turns no bone.
    """
    say = grounded(source[..., 1] - level[:, None])
    say = np.minimum(say[..., 1:], say[..., :-1])
    drift = -(say[..., None] * np.diff(body - source, axis=2)[..., [0, 2]]).sum(axis=1)
    firm = say.sum(axis=1)
    whole = _course(drift.sum(axis=0), firm.sum(axis=0), RETURN_BODY, rate)
    left = drift - firm[..., None] * np.diff(whole, axis=0)
    return whole, np.array([_course(left[foot], firm[foot], RETURN, rate) for foot in range(2)])


def _course(aim: Float64, firm: Float64, back: float, rate: float) -> Float64:
    """(T, 2): aim (T - 1, 2), changes from frame to frame times their weights firm (T - 1,)."""
    count = len(firm) + 1
    bonds = (firm + SWING) * rate
    result = np.zeros((2, count))
    for axis in range(2):
        pull = np.zeros(count)
        pull[1:] += aim[:, axis] * rate
        pull[:-1] -= aim[:, axis] * rate
        chain(np.full(count, back / rate), bonds, pull, result[axis])
    course = result.T
    length = np.linalg.norm(course, axis=1, keepdims=True)
    bounded: Float64 = course * (FARTHEST * np.tanh(length / FARTHEST) / np.maximum(length, 1e-12))
    return bounded


def smoothed(values: Float64, rate: float) -> Float64:
    """Moving average, twice over."""
    half = max(1, round(SMOOTH * rate))
    for _ in range(2):
        sums = np.concatenate([[0.0], np.cumsum(np.pad(values, half, mode="edge"))])
        values = (sums[2 * half + 1 :] - sums[: -2 * half - 1]) / (2 * half + 1)
    return values

"""Feet that stand on the ground as the source's do.

Bones point where the source's point, but thigh, shank and foot have other proportions: so at the same leg
length and the same angles, soles end up millimetres to centimetres higher or lower than the source's, and
sources differ in where their ground is. Here the body is raised or lowered as a whole, frame by frame, such
that the foot on the ground is as high above it as the source's is. Only heights change, no angle.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from fba.body.skeleton import Skeleton
from fba.capture import rotations
from fba.capture.motion import SkeletonMotion

Float = npt.NDArray[np.float64]

TOES = 0.06
"""Metres from the metatarsal joint to the tip of the toes of the default body."""
ON_GROUND = 0.015
"""Metres over which a foot above the ground loses its say in how high the body is."""
SETTLED = 0.02
"""The say of neither foot being on the ground."""
LOWEST = 5
"""Percentile of the lower foot's height that is the ground: single frames may dip through it."""
FAR = 0.15
"""Metres: a ground further than this from height 0 is no ground, but a chair, or a leap cut out."""
SMOOTH = 0.03
"""Seconds over which corrections are averaged."""


def source_heights(motion: SkeletonMotion, mapped: Mapping[str, int], upright: Float, turned: Float,
                   places: Float) -> Float | None:  # fmt: skip
    """(2, T), in units of the source: the lowest point of the left and of the right foot.

    turned: (T, J, 4) world rotations of the source's own frame, places: (T, J, 3), upright. Points are the
    ankle's and its descendants' joints and ends, and the heel, as deep below the ankle as the lowest of them
    in the rest pose. None where the source has not both ankles.
    """
    if "l_ankle" not in mapped or "r_ankle" not in mapped:
        return None
    rest = motion.rest() @ upright.T
    heights = []
    for side in "lr":
        ankle = mapped[f"{side}_ankle"]
        foot = {ankle}
        for joint, parent in enumerate(motion.parents):
            if int(parent) in foot:
                foot.add(joint)
        lowest = places[:, sorted(foot), 1].min(axis=1)
        deepest = float(rest[sorted(foot), 1].min())
        for parent, offset in zip(motion.end_parents, motion.end_offsets, strict=True):
            if int(parent) in foot:
                end = upright @ rotations.matrices(turned[:, parent]) @ offset
                lowest = np.minimum(lowest, places[:, parent, 1] + (end[:, 1]))
                deepest = min(deepest, float(rest[parent, 1] + (upright @ offset)[1]))
        below = upright.T @ np.array([0.0, deepest - rest[ankle, 1], 0.0])
        heel = upright @ rotations.matrices(turned[:, ankle]) @ below
        heights.append(np.minimum(lowest, places[:, ankle, 1] + heel[:, 1]))
    return np.array(heights)


def body_heights(skeleton: Skeleton, wanted: Mapping[str, Float], root: Float, toes: bool) -> Float | None:
    """(2, T), metres: the lowest point of either foot: heel, ball, and tip of the toes where toes.

    wanted: joint -> world rotations (T, 3, 3); joints that are not there turn with their parents. root: (T,
    3).
    """
    heights = []
    for side in "lr":
        chain = [f"{side}_ankle", f"{side}_subtalar", f"{side}_midtarsal", f"{side}_metatarsal"]
        if not all(joint in skeleton for joint in chain):
            return None
        path = [skeleton.number(chain[-1])]
        while skeleton.parents[path[-1]] >= 0:
            path.append(int(skeleton.parents[path[-1]]))
        place = root
        frame = np.broadcast_to(np.eye(3), (len(root), 3, 3))
        centres = skeleton.centres
        ankle, ball = centres[skeleton.number(chain[0])], centres[skeleton.number(chain[3])]
        soles = {chain[1]: (ankle[0], 0.0, ankle[2]), chain[2]: (ball[0], 0.0, ball[2])}
        if toes:
            soles[chain[3]] = (ball[0], 0.0, ball[2] + TOES)
        lowest = np.full(len(root), np.inf)
        for number in reversed(path):
            name, parent = skeleton.names[number], int(skeleton.parents[number])
            if parent >= 0:
                place = place + frame @ (centres[number] - centres[parent])
            frame = wanted.get(name, frame)
            if name in soles:
                point = place + frame @ (np.array(soles[name]) - centres[number])
                lowest = np.minimum(lowest, point[:, 1])
        heights.append(lowest)
    return np.array(heights)


def ground(heights: Float) -> float:
    """The height (metres) of the ground under feet (2, T) that stand on it now and then; 0 where they never
    do."""
    level = float(np.percentile(heights.min(axis=0), LOWEST))
    return level if abs(level) <= FAR else 0.0


def lift(source: Float, body: Float, level: float, floor: float, rate: float) -> Float:
    """(T,), metres to raise the body by, so that feet are as high above floor as the source's above level.

    source, body: (2, T), heights of both feet in metres. The foot closer to the ground has the say.
    """
    above = source - level
    lacking = above - (body - floor)
    say = np.exp(-((np.maximum(above, 0.0) / ON_GROUND) ** 2))
    usual = float(np.median(lacking[say > 0.5])) if (say > 0.5).any() else float(np.median(lacking))
    result = usual + (say * (lacking - usual)).sum(axis=0) / (say.sum(axis=0) + SETTLED)
    half = max(1, round(SMOOTH * rate))
    for _ in range(2):
        sums = np.concatenate([[0.0], np.cumsum(np.pad(result, half, mode="edge"))])
        result = (sums[2 * half + 1 :] - sums[: -2 * half - 1]) / (2 * half + 1)
    smooth: Float = result
    return smooth

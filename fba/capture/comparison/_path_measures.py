"""How a result goes otherwise than its source: its way, its soles and the floor, and from frame to frame.

Each function returns rows of `Row`: name, part and values (T,), 0 or more; NaN where nothing can be compared.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fba.arrays import Bool, Float64
from fba.body import SIDES
from fba.capture.comparison._figure import Figure, degrees_turned
from fba.capture.comparison._pose_measures import LIMBS, TURNING, WORDS, Row
from fba.capture.comparison._standing import foot_points
from fba.rotations import degrees_between, unit

HINGED = {"shoulder": ("shoulder", "elbow", "wrist"), "hip": ("hip", "knee", "ankle")}
"""The joints of limbs whose middle one is a hinge, by the first."""
MIN_BEND = 0.12
"""Smallest sine of the bend of an elbow or a knee at which its plane is defined."""
TEAR_DISTANCE = 0.5
"""Metres that hips do not move from one frame to the next."""
TEAR_SPEED = 20.0
"""Metres per second that hips do not reach."""


def paths(source: Figure, result: Figure) -> Iterator[Row]:
    """Distances in mm between the hips; where both are on the whole does not count (`--origin`)."""
    theirs, ours = (pelvis(one) for one in (source, result))
    if theirs is not None and ours is not None:
        apart = ours - theirs
        yield Row("path", "hips", 1000 * np.linalg.norm(apart - np.median(apart, axis=0), axis=1))


def floors(
    source: Figure,
    soles: dict[str, Float64],
    standing: dict[str, Bool],
    level: float | None,
    ground: float | None = None,
) -> Iterator[Row]:
    """Heights in mm by which soles miss the floor while the source's foot stands; NaN in other frames.

    soles: by side (T,), height in metres of the lowest point of the person's shoe. level: height of the
    floor, None for that where the feet stand most. ground: that of the source, see `find_floor`; None for
    what these frames say. The source's foot is level where it usually stands. Where
    it is lower, since its ground drifts, the person's is on the floor; or as low, if there is no floor.
    """
    heights = {side: _lowest(source, side) for side in soles}
    known = {side: height for side, height in heights.items() if height is not None and standing[side].any()}
    if not known:
        return
    if ground is None:
        ground = float(np.median(np.concatenate([known[side][standing[side]] for side in known])))
    own = np.concatenate([soles[side][standing[side]] for side in known])
    floor = float(np.median(own)) if level is None else level
    for side, height in known.items():
        above, own_sole = height - ground, soles[side] - floor
        highest = np.maximum(above, 0.0)
        lowest = above if level is None else highest
        off = np.maximum(np.maximum(lowest - own_sole, own_sole - highest), 0.0)
        yield Row("floor", f"{WORDS[side]} sole", np.where(standing[side], 1000 * off, np.nan))


def slips(source: Figure, result: Figure, standing: dict[str, Bool], rate: float) -> Iterator[Row]:
    """Speeds in cm/s at which standing feet slip along the floor while the source's do not; NaN elsewhere."""
    for side in SIDES:
        toe, shown = source.toe(side), result.toe(side)
        if side not in standing or toe is None or shown is None:
            continue
        change = np.diff(shown - toe, axis=0, append=(shown - toe)[-1:])[:, [0, 2]]
        speed = 100 * rate * np.linalg.norm(change, axis=1)
        yield Row("slip", f"{WORDS[side]} foot", np.where(standing[side], speed, np.nan))


def jumps(source: Figure, result: Figure) -> Iterator[Row]:
    """Angles in degrees, and ways in mm, by which parts move from frame to frame, and the source's do not."""
    pairs = [(part, joint, shown) for part, joint, shown in TURNING]
    pairs += [
        (f"{WORDS[side]} {what}", f"{side}_{start}", f"{side}_{start}")
        for side in SIDES
        for what, start, _ in LIMBS
    ]
    for part, joint, shown in pairs:
        if joint not in source.frames or shown not in result.frames:
            continue
        theirs, ours = _steps(source.frames[joint]), _steps(result.frames[shown])
        if joint[2:] in HINGED and shown == joint:
            theirs = np.maximum(theirs, _plane_steps(source, joint))
        near = np.pad(theirs, 1, mode="edge")
        most = np.maximum(np.maximum(near[:-2], near[1:-1]), near[2:])
        yield Row("jump", part, np.maximum(ours - most, 0.0))
    hips = [pelvis(one) for one in (source, result)]
    if hips[0] is not None and hips[1] is not None:
        theirs, ours = hips[0], hips[1]
        apart = np.diff(ours - theirs, axis=0, prepend=(ours - theirs)[:1])
        yield Row("leap", "hips", 1000 * np.linalg.norm(apart, axis=1))


def find_tears(root: Float64, rate: float) -> tuple[Bool, Float64]:
    """Return bool (T,), frames before or after a tear in the capture, and metres (T,) of each tear.

    A tear is a leap that nobody makes, as where a camera lost a person: the longest part between two tears is
    the capture. root: (T, 3), its path in metres.
    """
    leaps = np.linalg.norm(np.diff(root, axis=0, prepend=root[:1]), axis=1)
    torn = (leaps > TEAR_DISTANCE) & (leaps * rate > TEAR_SPEED)
    part = np.cumsum(torn)
    lost: Bool = (part != int(np.bincount(part).argmax())) | torn
    return lost, np.where(torn, leaps, 0.0)


def pelvis(figure: Figure) -> Float64 | None:
    """Return (T, 3), the point between the hips, else the root; None without either."""
    middle = figure.middle("hip")
    return figure.points.get("HumanoidRoot") if middle is None else middle


def _lowest(figure: Figure, side: str) -> Float64 | None:
    """Return (T,), the height of the lowest point of a foot."""
    points = foot_points(figure, side)
    return np.min([point[:, 1] for point in points], axis=0) if points else None


def _steps(frames: Float64) -> Float64:
    """Return (T,), angles in degrees from each frame to the next before it; 0 for the first."""
    return np.concatenate([[0.0], degrees_turned(np.swapaxes(frames[:-1], 1, 2) @ frames[1:])])


def _plane_steps(source: Figure, joint: str) -> Float64:
    """Return (T,), angles in degrees by which the plane of a bent limb turns from the frame before.

    An elbow or a knee of the body bends about one axis: where the plane of the source's leaps, the upper bone
    turns about its length. 0 where the limb is straight, and for the first frame.
    """
    side, upper = joint.split("_")
    names = [f"{side}_{name}" for name in HINGED[upper]]
    if not all(name in source.points for name in names):
        return np.zeros(len(source.frames[joint]))
    first, middle, last = (source.points[name] for name in names)
    normal = np.cross(unit(middle - first), unit(last - middle))  # as long as the sine of the bend
    bent = np.linalg.norm(normal, axis=1) > MIN_BEND
    steps = np.where(bent[1:] & bent[:-1], degrees_between(normal[1:], normal[:-1]), 0.0)
    return np.concatenate([[0.0], steps])

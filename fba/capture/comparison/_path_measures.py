"""Measures of paths: where feet stand, of the hips, of soles and the floor, and from frame to frame."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from fba.arrays import Bool, Float64
from fba.body import ROOT, SIDES
from fba.capture.comparison._figure import Figure, degrees_turned
from fba.capture.comparison._pose_measures import LIMBS, TURNING, WORDS, Row
from fba.rotations import degrees_between, unit

MAX_STANDING_SPEED = 0.25
"""Largest speed of a standing foot, in metres per second."""
MAX_STANDING_HEIGHT = 0.05
"""Largest height of a standing foot above the lowest heights, in metres."""
MAX_HEIGHT_DIFFERENCE = 0.3
"""Largest height, in metres, of a standing foot above the other: one that is always higher is in the air."""


class Floor(NamedTuple):
    """Where the feet of a source stand, in metres.

    lows: by side, the largest height at which a foot may stand. ground: the usual height at which feet stand;
    None if they never do. level: height of the person's floor; None where it has none.
    """

    lows: dict[str, float]
    ground: float | None
    level: float | None


def find_floor(sources: Iterable[Figure], rate: float, level: float | None = None) -> Floor:
    """Return where feet stand in all pieces of a motion together: in a piece they may never stand."""
    still: dict[str, list[Bool]] = {side: [] for side in SIDES}
    ends: dict[str, list[Float64]] = {side: [] for side in SIDES}
    lowest: dict[str, list[Float64]] = {side: [] for side in SIDES}
    for source in sources:
        for side in SIDES:
            if points := foot_points(source, side):
                still[side].append(_still(points, rate))
                ends[side].append(points[-1][:, 1])
                lowest[side].append(np.min([point[:, 1] for point in points], axis=0))
    heights = {side: np.concatenate(ends[side]) for side in SIDES if ends[side]}
    lows = {side: float(np.percentile(at, 5)) + MAX_STANDING_HEIGHT for side, at in heights.items()}
    lowest_of_both = min(lows.values(), default=0.0)
    lows = {side: min(low, lowest_of_both + MAX_HEIGHT_DIFFERENCE) for side, low in lows.items()}
    standing = [
        np.concatenate(lowest[side])[np.concatenate(still[side]) & (at < lows[side])]
        for side, at in heights.items()
    ]
    together = np.concatenate(standing) if standing else np.zeros(0)
    return Floor(lows, float(np.median(together)) if len(together) else None, level)


def find_standing(source: Figure, rate: float, lows: Mapping[str, float]) -> dict[str, Bool]:
    """Return by side bool (T,): whether a foot of the source stands: low, and hardly moving."""
    return {
        side: _still(points, rate) & (points[-1][:, 1] < lows[side])
        for side in SIDES
        if side in lows and (points := foot_points(source, side))
    }


def foot_points(source: Figure, side: str) -> list[Float64]:
    """Return the ankle (T, 3) and the end (T, 3) of a foot, without those that are missing."""
    return [point for point in (source.points.get(f"{side}_ankle"), source.toe(side)) if point is not None]


def _still(points: Sequence[Float64], rate: float) -> Bool:
    """Return bool (T,): whether any of the points (T, 3) hardly moves."""
    steps = np.diff(points, axis=1, append=np.array(points)[:, -1:])
    still: Bool = (np.linalg.norm(steps, axis=2) * rate < MAX_STANDING_SPEED).any(axis=0)
    return still


HINGED = {"shoulder": ("shoulder", "elbow", "wrist"), "hip": ("hip", "knee", "ankle")}
"""The joints of limbs whose middle one is a hinge, by the first."""
MIN_BEND = 0.12
"""Smallest sine of the bend of an elbow or a knee at which its plane is defined."""
MAX_STEP = 0.5
"""Largest possible distance of hips from one frame to the next, in metres."""
MAX_SPEED = 20.0
"""Largest possible speed of hips, in metres per second."""


def paths(source: Figure, result: Figure) -> Iterator[Row]:
    """Distances in mm between the hips, apart from a constant shift (`--origin`)."""
    apart = _hips_apart(source, result)
    if apart is not None:
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
    floor; None for the height at which the feet usually stand. ground: height of the source's floor, see
    `find_floor`; None to find it in these frames. Where the source's foot is lower, since its ground drifts,
    the person's sole should be on the floor; without a floor it may also be as low as the source's.
    """
    heights = {
        side: height
        for side in soles
        if (height := _lowest(source, side)) is not None and standing[side].any()
    }
    if not heights:
        return
    if ground is None:
        ground = float(np.median(np.concatenate([heights[side][standing[side]] for side in heights])))
    if level is None:
        floor = float(np.median(np.concatenate([soles[side][standing[side]] for side in heights])))
    else:
        floor = level
    for side, height in heights.items():
        above, sole = height - ground, soles[side] - floor
        highest = np.maximum(above, 0.0)
        lowest = above if level is None else highest
        off = np.maximum(np.maximum(lowest - sole, sole - highest), 0.0)
        yield Row("floor", f"{WORDS[side]} sole", np.where(standing[side], 1000 * off, np.nan))


def slips(source: Figure, result: Figure, standing: dict[str, Bool], rate: float) -> Iterator[Row]:
    """Speeds in cm/s at which standing feet slip along the floor while the source's do not; NaN elsewhere."""
    for side in SIDES:
        toe, result_toe = source.toe(side), result.toe(side)
        if side not in standing or toe is None or result_toe is None:
            continue
        apart = result_toe - toe
        change = np.diff(apart, axis=0, append=apart[-1:])[:, [0, 2]]
        speed = 100 * rate * np.linalg.norm(change, axis=1)
        yield Row("slip", f"{WORDS[side]} foot", np.where(standing[side], speed, np.nan))


def jumps(source: Figure, result: Figure) -> Iterator[Row]:
    """Angles in degrees, and distances in mm, by which parts move between frames more than the source's."""
    limbs = [
        (f"{WORDS[side]} {bone}", f"{side}_{start}", f"{side}_{start}")
        for side in SIDES
        for bone, start, _ in LIMBS
    ]
    for part, joint, shown in (*TURNING, *limbs):
        if joint not in source.frames or shown not in result.frames:
            continue
        steps = _steps(source.frames[joint])
        if joint[2:] in HINGED and shown == joint:
            steps = np.maximum(steps, _plane_steps(source, joint))
        near = np.pad(steps, 1, mode="edge")
        most = np.maximum(np.maximum(near[:-2], near[1:-1]), near[2:])
        yield Row("jump", part, np.maximum(_steps(result.frames[shown]) - most, 0.0))
    apart = _hips_apart(source, result)
    if apart is not None:
        change = np.diff(apart, axis=0, prepend=apart[:1])
        yield Row("leap", "hips", 1000 * np.linalg.norm(change, axis=1))


def find_tears(root: Float64, rate: float) -> tuple[Bool, Float64]:
    """Return the frames (T,) that are torn off from the capture, and the length (T,) of each tear, metres.

    A tear is an impossible leap, as where a camera lost a person; the longest part between two tears is the
    capture. root: (T, 3), its path in metres.
    """
    leaps = np.linalg.norm(np.diff(root, axis=0, prepend=root[:1]), axis=1)
    torn = (leaps > MAX_STEP) & (leaps * rate > MAX_SPEED)
    part = np.cumsum(torn)
    lost: Bool = (part != int(np.bincount(part).argmax())) | torn
    return lost, np.where(torn, leaps, 0.0)


def pelvis(figure: Figure) -> Float64 | None:
    """Return the point (T, 3) between the hips, else the root; None without either."""
    middle = figure.middle("hip")
    return figure.points.get(ROOT) if middle is None else middle


def _hips_apart(source: Figure, result: Figure) -> Float64 | None:
    """Return the lines (T, 3) from the source's hips to the result's; None where either has no hips."""
    start, end = pelvis(source), pelvis(result)
    return None if start is None or end is None else end - start


def _lowest(figure: Figure, side: str) -> Float64 | None:
    """Return the heights (T,) of the lowest point of a foot."""
    points = foot_points(figure, side)
    return np.min([point[:, 1] for point in points], axis=0) if points else None


def _steps(frames: Float64) -> Float64:
    """Return the angles (T,), in degrees, of the turns from frame to frame; 0 for the first."""
    return np.concatenate([[0.0], degrees_turned(np.swapaxes(frames[:-1], 1, 2) @ frames[1:])])


def _plane_steps(source: Figure, joint: str) -> Float64:
    """Return the angles (T,), in degrees, by which the plane of a bent limb turns from the frame before.

    An elbow or a knee of the body bends about a single axis: where the source's plane leaps, the body's upper
    bone turns about its length. 0 where the limb is straight, and for the first frame.
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

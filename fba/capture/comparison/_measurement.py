"""Compare a captured motion with the person that a decoder shows."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import cache

import numpy as np
from scipy.ndimage import minimum_filter1d

from fba.animation import Animation
from fba.arrays import Array, Float64
from fba.body import SIDES, BapSolver, BodyModel, BodyPart, GroundedPoser, Skeleton
from fba.capture.comparison import _figure as figure
from fba.capture.comparison import _path_measures as path_measures
from fba.capture.comparison import _pose_measures as pose_measures
from fba.capture.comparison._figure import Figure
from fba.capture.comparison._path_measures import Floor, find_floor, find_standing
from fba.capture.comparison._pose_measures import Row
from fba.capture.comparison._verdict import Comparison, Difference, bounds, in_order
from fba.capture.motion import SkeletonMotion
from fba.errors import ModelError
from fba.parameters import BAP_COUNT

PIECE_FRAMES = 8192
"""Number of frames that are compared at once, which bounds the memory; each piece is measured by itself."""
RUN_COUNT = 4
"""Number of runs of frames that represent a long motion."""
UNKNOWN_UNIT = 0.01
"""Metres in a unit of a source without limbs that tell its size, as for `from_skeleton`."""
MIN_MOTION = 10.0
"""Degrees that a joint must turn to count as moving."""
LIMB_JOINTS = {
    "left arm": ("l_shoulder", "l_elbow"), "right arm": ("r_shoulder", "r_elbow"),
    "left leg": ("l_hip", "l_knee"), "right leg": ("r_hip", "r_knee"), "head": ("skullbase", "vc7"),
}  # fmt: skip
"""Joints that each limb needs to move."""
SOLE_THICKNESS = 0.02
"""Metres above the lowest vertex of a shoe within which its vertices belong to the sole."""
SKINNED_FRAMES = 1024
"""Number of frames whose soles are skinned at once, which bounds the memory."""


def compare(
    motion: SkeletonMotion,
    animation: Animation,
    mapped: Mapping[str, int],
    *,
    scale: float | None = None,
    up: Float64 | None = None,
    level: float | None = 0.0,
    solver: BapSolver | None = None,
    most: int | None = None,
) -> Comparison:
    """Return how an animation, best after decoding, differs from the motion that it was made from.

    mapped: joint of the standard -> number of the source's. scale: metres of the body in a unit of the
    source; None for the ratio of legs, or else arms. up: (3, 3), the rotation that makes the source's y point
    up; None for that of `find_up`. level: height of the floor in metres; None without a floor: soles may then
    be at any constant height. solver: as for `from_skeleton`. most: largest number of frames to compare: a
    longer motion is compared in four runs, spread evenly; None for no limit.

    If rates differ, the motion is resampled; frames that only one of the two has are left out. ModelError if
    the animation has no body or no frame in common with the motion.
    """
    solver = solver if solver is not None else BapSolver()
    if animation.body is None:
        raise ModelError("the animation has no body to compare with the motion")
    motion = motion.resample(animation.rate)
    count = min(len(motion), len(animation))
    if not count:
        raise ModelError("the motion and the animation have no frame in common")
    first = motion.select(slice(0, min(count, PIECE_FRAMES)))
    up = figure.find_up(first, mapped) if up is None else up
    neutral = figure.result_figure(solver, np.zeros((1, BAP_COUNT), dtype=np.int32))
    metres = source_scale(motion, mapped, neutral, up) if scale is None else scale
    rest = rest_figure(motion, mapped, up, metres)
    rate = float(motion.rate)
    lost, tears = path_measures.find_tears(motion.positions[:count] * metres, rate)
    pieces = _pieces(count, most)
    floor = find_floor(
        (figure.source_figure(motion.select(piece), mapped, up, metres) for piece in pieces), rate, level
    )
    by_part: dict[tuple[str, str], list[Difference]] = {}
    for piece in pieces:
        baps = animation.body.values[piece]
        source = figure.source_figure(motion.select(piece), mapped, up, metres)
        result = figure.result_figure(solver, baps)
        soles = sole_heights(solver, baps)
        for row in _measure(source, result, rest, neutral, soles, rate, floor):
            kept = row._replace(values=np.where(lost[piece], np.nan, row.values))
            by_part.setdefault((row.name, row.part), []).append(_difference(kept, rate, piece.start))
    differences = [
        replace(max(parts, key=lambda part: part.worst), typical=float(np.mean([p.typical for p in parts])))
        for parts in by_part.values()
    ]
    differences += _unmatched(first, mapped)
    if tears.any():
        differences.append(_difference(Row("tear", "capture", tears), rate, 0))
    compared = sum(piece.stop - piece.start for piece in pieces)
    return Comparison(compared, in_order(tuple(differences)))


def _pieces(count: int, most: int | None) -> list[slice]:
    """Return the frames to compare, in pieces."""
    if most is None or count <= most:
        return [slice(begin, min(begin + PIECE_FRAMES, count)) for begin in range(0, count, PIECE_FRAMES)]
    length = most // RUN_COUNT
    return [
        slice(begin, begin + length)
        for begin in np.linspace(0, count - length, RUN_COUNT).astype(int).tolist()
    ]


def source_scale(motion: SkeletonMotion, mapped: Mapping[str, int], neutral: Figure, up: Float64) -> float:
    """Return metres of the body in a unit of the source, by the lengths of limbs; 0.01 without limbs."""
    length = figure.leg_lengths(figure.source_figure(motion.select(slice(0, 1)), mapped, up, 1.0))
    return figure.leg_lengths(neutral) / length if length > 0 else UNKNOWN_UNIT


def _measure(
    source: Figure,
    result: Figure,
    rest: Figure,
    neutral: Figure,
    soles: dict[str, Float64],
    rate: float,
    floor: Floor,
) -> Iterator[Row]:
    standing = find_standing(source, rate, floor.lows)
    yield from pose_measures.directions(source, result)
    yield from pose_measures.palms(source, result, rest)
    yield from pose_measures.turns(source, result)
    yield from pose_measures.feet(source, result, standing, rest)
    yield from pose_measures.heads(source, result, rest)
    yield from pose_measures.clavicles(source, result, neutral)
    yield from path_measures.paths(source, result)
    yield from path_measures.floors(source, soles, standing, floor.level, floor.ground)
    yield from path_measures.slips(source, result, standing, rate)
    yield from path_measures.jumps(source, result)
    yield from pose_measures.leg_twists(result)


def _difference(row: Row, rate: float, begin: int) -> Difference:
    """Return the typical and the worst value of a row whose first frame has the number `begin`."""
    known = row.values[~np.isnan(row.values)]
    typical = float(np.median(known)) if len(known) else 0.0
    values = np.nan_to_num(row.values, nan=0.0)
    frames = min(max(1, round(bounds()[row.name].hold * rate)), len(values))
    held = minimum_filter1d(values, frames, mode="nearest") if frames > 1 else values
    worst = int(held.argmax())
    return Difference(row.name, row.part, typical, float(held[worst]), begin + worst)


def _unmatched(motion: SkeletonMotion, mapped: Mapping[str, int]) -> list[Difference]:
    """Return the limbs without a source, if the source has joints that move and are not mapped."""
    used = set(mapped.values())
    from_first = np.abs((motion.rotations * motion.rotations[:1]).sum(axis=-1)).min(axis=0)
    turned = np.degrees(2 * np.arccos(np.clip(from_first, 0.0, 1.0)))
    moving = [
        number for number in range(len(motion.names)) if number not in used and turned[number] > MIN_MOTION
    ]
    return [
        Difference("unmatched", limb, float(len(moving)), float(len(moving)), 0)
        for limb, joints in LIMB_JOINTS.items()
        if moving and not any(joint in mapped for joint in joints)
    ]


def rest_figure(motion: SkeletonMotion, mapped: Mapping[str, int], up: Float64, metres: float) -> Figure:
    """Return the source in the rest pose of its file."""
    unturned = np.tile([1.0, 0.0, 0.0, 0.0], (1, len(motion.names), 1))
    return figure.source_figure(replace(motion.select(slice(0, 1)), rotations=unturned), mapped, up, metres)


def sole_heights(solver: BapSolver, baps: Array) -> dict[str, Float64]:
    """Return, by side, the heights (T,) in metres of the lowest point of the default person's shoe.

    The heights are those of the mesh, not of joints. baps: (T, 296). Empty unless the skeleton is the
    default body's.
    """
    model = _sole_model()
    if solver.skeleton is not Skeleton.default():
        return {}
    shown = GroundedPoser(model.skeleton, solver.convention.name)  # as players show it
    left = model.vertices[:, 0] > 0
    result = {side: np.empty(len(baps)) for side in SIDES}
    for begin in range(0, len(baps), SKINNED_FRAMES):
        rows = slice(begin, begin + SKINNED_FRAMES)
        heights = model.skin(shown.pose(baps[rows]))[..., 1]
        result["l"][rows] = heights[:, left].min(axis=1)
        result["r"][rows] = heights[:, ~left].min(axis=1)
    return result


@cache
def _sole_model() -> BodyModel:
    """Return the default person reduced to the soles, which have few vertices to skin."""
    model = BodyModel.default()
    parts = []
    for part in model.parts:
        if part.kind == "shoe":
            kept = np.flatnonzero(part.vertices[:, 1] < part.vertices[:, 1].min() + SOLE_THICKNESS)
            parts.append(_keep_vertices(part, kept))
    return replace(model, parts=tuple(parts))


def _keep_vertices(part: BodyPart, kept: Array) -> BodyPart:
    """Return a part with these vertices only, and a single triangle, which nobody draws."""
    return BodyPart(
        part.name, part.kind, part.vertices[kept], np.array([[0, 1, 2]], dtype=np.int32),
        part.joints[kept], part.weights[kept],
    )  # fmt: skip

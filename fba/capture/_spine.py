"""Distribute the rotations of the source's few spine joints over the vertebrae of the body.

A source has two to six joints between hips and head, the body twenty-four. In the middle of each source
bone, a vertebra has the bone's rotation; between these, rotations are interpolated spherically, from the
pelvis up to the skull base. The bone below the neck has its rotation up to the first thoracic vertebra, which
carries the shoulders: these do not turn with the head. Then all vertebrae of a source bone turn together by a
small correction, so that the line from the first to the last points exactly in the direction of the source's
bone.

With fewer groups of the standard (from Spine1, the simple spine of four joints, to Spine5, all of them), each
vertebra that may turn carries the line to the next that may, along the source's spine. Then all turn a little
more, so that the errors of the bones' directions become as small as possible.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from fba import rotations
from fba.arrays import Float64
from fba.body import Skeleton
from fba.capture._limbs.targets import Targets
from fba.parameters import baps

SHOULDERS = "vt1"
"""Vertebra that carries the clavicles."""
ABOVE_SHOULDERS = ("vc", "skullbase")
"""Beginnings of the names of joints of neck and head."""
GROUPS = 5
"""Number of groups, Spine1 to Spine5."""
CHUNK_FRAMES = 2048
"""Number of frames that are solved at once, which bounds the memory."""
ITERATIONS = 5
"""Number of iterations of the least squares."""
TURN_WEIGHT = 0.05
"""Weight of keeping turns small, relative to that of the directions of bones."""


def joints(skeleton: Skeleton) -> list[str]:
    """Return the joints from the root up to the skull base."""
    if "skullbase" not in skeleton:
        return [skeleton.names[0]]
    joint = skeleton.number("skullbase")
    chain = [joint]
    while skeleton.parents[joint] >= 0:
        joint = int(skeleton.parents[joint])
        chain.append(joint)
    return [skeleton.names[joint] for joint in reversed(chain)]


def turning(skeleton: Skeleton, groups: int) -> list[str]:
    """Return the vertebrae of the standard's groups Spine1 up to a number, from the root upwards."""
    allowed = {b.joint for b in baps() if b.group_name in {f"Spine{n}" for n in range(1, groups + 1)}}
    return [joint for joint in joints(skeleton) if joint in allowed]


def heights(skeleton: Skeleton, chain: list[str]) -> Float64:
    """Return the heights (N,) of joints above the first, along the spine."""
    centres = skeleton.centres[[skeleton.number(joint) for joint in chain]]
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(centres, axis=0), axis=1))])


@dataclass(frozen=True, eq=False)
class _SourceSpine:
    """The source's spine, by heights on that of the body.

    anchors: heights of its joints. positions: of each, (T, 3). levels: heights at which rotations are known,
    the middles of bones and both ends. rotations: (T, 3, 3), at each. shoulders: the height at which the
    clavicles begin.
    """

    anchors: list[float]
    positions: list[Float64]
    levels: list[float]
    rotations: list[Float64]
    shoulders: float

    def rotation_between(self, low: float, high: float) -> Float64:
        """Return the rotation of a vertebra at `low` and of those above it that do not turn, up to `high`."""
        middle = (low + high) / 2
        level = min(middle, self.shoulders) if low <= self.shoulders < high else middle
        upper, share = _place(self.levels, level)
        return rotations.part(self.rotations[upper - 1], self.rotations[upper], share)

    def position_at(self, level: float) -> Float64:
        """Return the source's position (T, 3) at a height."""
        upper, share = _place(self.anchors, level)
        result: Float64 = self.positions[upper - 1] * (1 - share) + self.positions[upper] * share
        return result


def _place(levels: list[float], level: float) -> tuple[int, float]:
    """Return the number of the level above a height, and the share of the way to it from the level below."""
    upper = int(np.clip(np.searchsorted(levels, level), 1, len(levels) - 1))
    low, high = levels[upper - 1], levels[upper]
    return upper, float(np.clip((level - low) / max(high - low, 1e-12), 0.0, 1.0))


def _source_spine(targets: Targets, anchors: list[str], height: Mapping[str, float]) -> _SourceSpine:
    """Return the source's spine. anchors: its joints. height: of the body's joints."""
    levels = [height[joint] for joint in anchors]
    middles = [levels[0], *((low + high) / 2 for low, high in pairwise(levels)), levels[-1]]
    turns = [targets.rotations[joint] for joint in (anchors[0], *anchors)]
    below_neck = (n for n in reversed(range(len(anchors))) if not anchors[n].startswith(ABOVE_SHOULDERS))
    chest = next(below_neck, 0)
    shoulders = height.get(SHOULDERS, 0.0)
    if middles[chest + 1] < shoulders < middles[min(chest + 2, len(middles) - 1)]:
        middles.insert(chest + 2, shoulders)
        turns.insert(chest + 2, turns[chest + 1])
    positions = [targets.source.positions[joint] for joint in anchors]
    return _SourceSpine(levels, positions, middles, turns, shoulders)


def spread(targets: Targets, groups: int, with_anchors: bool) -> None:
    """Replace the targets of the spine's joints that the source has by those of all vertebrae that turn.

    The targets are the rotation of the bone above each joint, for the last of the joint itself. groups:
    number of the standard's groups. with_anchors: the joints that the source has turn, too.
    """
    skeleton, turns = targets.skeleton, targets.rotations
    chain = joints(skeleton)
    anchors = [joint for joint in chain if joint in targets.source]
    if not groups or len(anchors) < 2:
        return
    turning_joints = {*turning(skeleton, groups), *(anchors if with_anchors else ())}
    between = chain[chain.index(anchors[0]) + 1 : chain.index(anchors[-1]) + 1]
    free = [joint for joint in between if joint in turning_joints]
    if not free:
        return
    height = dict(zip(chain, heights(skeleton, chain).tolist(), strict=True))
    source = _source_spine(targets, anchors, height)
    pinned = list(anchors if groups >= GROUPS or with_anchors else [anchors[0], *free])
    if pinned[-1] != anchors[-1]:
        pinned.append(anchors[-1])
    head = turns[anchors[-1]]
    for joint in anchors[1:]:
        turns.pop(joint, None)
    for low, high in pairwise(pinned):
        between = chain[chain.index(low) + 1 : chain.index(high)]
        turns |= _bend([low, *(joint for joint in between if joint in free), high], skeleton, height, source)
    turns[anchors[-1]] = head
    if pinned != anchors:
        _correct_directions(targets, anchors, free)


def _bend(
    path: list[str], skeleton: Skeleton, height: Mapping[str, float], source: _SourceSpine
) -> dict[str, Float64]:
    """Return the rotations of all joints of a path but the last, whose line then points as the source's."""
    centres = [skeleton.centres[skeleton.number(joint)] for joint in path]
    bent = [source.rotation_between(height[low], height[high]) for low, high in pairwise(path)]
    line = sum(
        (turn @ (end - start) for turn, (start, end) in zip(bent, pairwise(centres), strict=True)),
        np.zeros(3),
    )
    aim = source.position_at(height[path[-1]]) - source.position_at(height[path[0]])
    shortest = np.linalg.norm(aim, axis=1).min()
    correction = rotations.between_all(line, aim) if shortest > 1e-9 else np.eye(3)
    return {joint: correction @ turn for joint, turn in zip(path[:-1], bent, strict=True)}


def _correct_directions(targets: Targets, anchors: list[str], free: list[str]) -> None:
    """Turn free joints a little more, so that the lines between anchors point as the source's do."""
    chain, positions = joints(targets.skeleton), targets.source.positions
    centres = targets.skeleton.centres[[targets.skeleton.number(joint) for joint in chain]]
    ends = [chain.index(joint) for joint in anchors]
    turning_numbers = sorted({ends[0], *(chain.index(joint) for joint in free if joint != anchors[-1])})
    parts = np.stack([targets.rotations[chain[number]] for number in turning_numbers])
    lines = np.stack([positions[above] - positions[below] for below, above in pairwise(anchors)])
    for begin in range(0, parts.shape[1], CHUNK_FRAMES):
        chunk = slice(begin, begin + CHUNK_FRAMES)
        parts[:, chunk] = _refine(
            list(parts[:, chunk]), turning_numbers, centres, ends, list(lines[:, chunk])
        )
    targets.rotations.update(
        {chain[number]: part for number, part in zip(turning_numbers, parts, strict=True)}
    )


def _refine(
    parts: list[Float64], turning: list[int], centres: Float64, ends: list[int], lines: list[Float64]
) -> list[Float64]:
    """Return parts of the spine, turned so that the errors of all source bones become as small as possible.

    parts: rotations (T, 3, 3) of the vertebrae that turn, each with those above it that do not. turning:
    numbers of these vertebrae in the chain. centres: (N, 3), of the chain. ends: numbers of the anchors in
    it. lines: (T, 3), from each anchor to the next in the source.
    """
    count, frames = len(parts), len(parts[0])
    below = np.searchsorted(turning, np.arange(len(centres) - 1), side="right") - 1
    steps = np.diff(centres, axis=0)
    pieces = np.zeros((len(lines), count, 3))
    for bone, (low, high) in enumerate(pairwise(ends)):
        for segment in range(low, high):
            pieces[bone, below[segment]] += steps[segment]
    wanted = [line / np.maximum(np.linalg.norm(line, axis=1, keepdims=True), 1e-12) for line in lines]
    for _ in range(ITERATIONS):
        normal = np.zeros((frames, 3 * count, 3 * count)) + TURN_WEIGHT * TURN_WEIGHT * np.eye(3 * count)
        pull = np.zeros((frames, 3 * count))
        for bone, direction in enumerate(wanted):
            if np.linalg.norm(lines[bone], axis=1).min() < 1e-9:
                continue
            arms = [part @ piece for part, piece in zip(parts, pieces[bone], strict=True)]
            line = np.sum(arms, axis=0)
            length = np.maximum(np.linalg.norm(line, axis=1), 1e-9)[:, None]
            slopes = np.concatenate(
                [-np.tensordot(arm / length, rotations.LEVI_CIVITA, axes=1) for arm in arms], axis=2
            )
            across = np.eye(3) - line[:, :, None] * line[:, None, :] / (length * length)[:, :, None]
            slopes = across @ slopes
            normal += np.swapaxes(slopes, 1, 2) @ slopes
            pull += (np.swapaxes(slopes, 1, 2) @ (direction - line / length)[:, :, None])[:, :, 0]
        turns = np.linalg.solve(normal, pull[:, :, None])[:, :, 0].reshape(frames, count, 3)
        angle = np.linalg.norm(turns, axis=2)
        axis = turns / np.maximum(angle, 1e-12)[:, :, None]
        parts = [rotations.turn(axis[:, k], angle[:, k]) @ part for k, part in enumerate(parts)]
    return parts

"""Distribute the rotations of the source's few spine joints over the vertebrae of the body.

A source has two to six joints between hips and head, the body twenty-four. In the middle of each source
bone, a vertebra has the bone's rotation; between these, rotations are interpolated spherically, from the
pelvis up to the skull base. The bone below the neck has its rotation up to the first thoracic vertebra, which
carries the shoulders: these do not turn with the head. Then all vertebrae of a source bone turn together by a
small correction, so that the line from the first to the last points exactly in the direction of the source's
bone.

With fewer groups of the standard (from Spine1, the simple spine of four joints, to Spine5, all of them), each
vertebra that may turn carries the line to the next such one, along the source's spine. Then all turn a little
more, so that the errors of the bones' directions become as small as possible.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from fba import rotations
from fba.arrays import Float64
from fba.body import Skeleton
from fba.parameters import baps

TOP = "vt1"
"""Vertebra that carries the clavicles."""
HEAD = ("vc", "skullbase")
"""What joints of neck and head begin with."""
GROUPS = 5
"""Groups Spine1 to Spine5."""
CHUNK = 2048
"""Frames solved at once."""
STEPS = 5
"""Iterations of the least squares."""
KEEP = 0.05
"""Weight of small turns, relative to the directions of bones."""


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


def spread(
    skeleton: Skeleton,
    wanted: dict[str, Float64],
    positions: dict[str, Float64],
    anchors: list[str],
    groups: int,
    with_anchors: bool,
) -> None:
    """Replace the rotations of anchors in wanted by those of all vertebrae that turn.

    wanted: joint -> (T, 3, 3), rotation of the bone above it, or of the joint itself for the last. anchors:
    joints of the spine that the source has, from the root upwards, at least two. positions: anchor -> (T, 3),
    in the source. groups: number of the standard's groups. with_anchors: the anchors turn, too.
    """
    chain = joints(skeleton)
    first, last = chain.index(anchors[0]), chain.index(anchors[-1])
    centres = np.array([skeleton.centres[skeleton.number(joint)] for joint in chain])
    height = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(centres, axis=0), axis=1))])
    anchor_heights = [height[chain.index(joint)] for joint in anchors]
    keys = [
        anchor_heights[0],
        *((a + b) / 2 for a, b in pairwise(anchor_heights)),
        anchor_heights[-1],
    ]
    turned = [wanted[anchors[0]], *(wanted[joint] for joint in anchors)]
    chest = next((n for n, joint in reversed(list(enumerate(anchors))) if not joint.startswith(HEAD)), 0)
    top = chain.index(TOP) if TOP in chain else 0
    if keys[chest + 1] < height[top] < keys[min(chest + 2, len(keys) - 1)]:
        keys.insert(chest + 2, float(height[top]))
        turned.insert(chest + 2, turned[chest + 1])

    def rotation_between(joint: int, end: int) -> Float64:
        """Return the rotation of a vertebra, and of those above it that do not turn, up to another one."""
        middle = (height[joint] + height[end]) / 2
        return rotation_at(min(middle, height[top]) if joint <= top < end else middle)

    def rotation_at(level: float) -> Float64:
        upper = int(np.clip(np.searchsorted(keys, level), 1, len(keys) - 1))
        low, high = keys[upper - 1], keys[upper]
        share = float(np.clip((level - low) / max(high - low, 1e-12), 0.0, 1.0))
        return rotations.part(turned[upper - 1], turned[upper], share)

    def position_at(level: float) -> Float64:
        upper = int(np.clip(np.searchsorted(anchor_heights, level), 1, len(anchor_heights) - 1))
        low, high = anchor_heights[upper - 1], anchor_heights[upper]
        share = float(np.clip((level - low) / max(high - low, 1e-12), 0.0, 1.0))
        result: Float64 = positions[anchors[upper - 1]] * (1 - share) + positions[anchors[upper]] * share
        return result

    turning_joints = {*turning(skeleton, groups), *(anchors if with_anchors else ())}
    free = [joint for joint in chain[first + 1 : last + 1] if joint in turning_joints]
    if not free:
        return
    pinned = anchors if groups >= GROUPS or with_anchors else [anchors[0], *free]
    if pinned[-1] != anchors[-1]:
        pinned = [*pinned, anchors[-1]]
    head = wanted[anchors[-1]]
    for joint in anchors[1:]:
        wanted.pop(joint, None)
    for low_joint, high_joint in pairwise(pinned):
        low, high = chain.index(low_joint), chain.index(high_joint)
        inside = [n for n in range(low, high) if n == low or chain[n] in free]
        ends = [*inside[1:], high]
        bent = {n: rotation_between(n, end) for n, end in zip(inside, ends, strict=True)}
        line = sum(
            (bent[n] @ (centres[end] - centres[n]) for n, end in zip(inside, ends, strict=True)),
            np.zeros(3),
        )
        way = position_at(height[high]) - position_at(height[low])
        length = np.linalg.norm(way, axis=1).min()
        turn = rotations.between_all(line, way) if length > 1e-9 else np.eye(3)
        for n in inside:
            wanted[chain[n]] = turn @ bent[n]
    wanted[anchors[-1]] = head
    if pinned != anchors:
        lines = [positions[above] - positions[below] for below, above in pairwise(anchors)]
        at_ends = [chain.index(joint) for joint in anchors]
        own = sorted({first, *(chain.index(joint) for joint in free if joint != anchors[-1])})
        before = np.stack([wanted[chain[n]] for n in own])
        course = np.stack(lines)
        for begin in range(0, before.shape[1], CHUNK):  # matrices of a whole capture would not fit
            chunk = slice(begin, begin + CHUNK)
            before[:, chunk] = _refine(list(before[:, chunk]), own, centres, at_ends, list(course[:, chunk]))
        wanted.update({chain[n]: part for n, part in zip(own, before, strict=True)})


def _refine(
    parts: list[Float64], own: list[int], centres: Float64, ends: list[int], lines: list[Float64]
) -> list[Float64]:
    """Return parts of the spine, turned so that the errors of all source bones become as small as possible.

    parts: rotations (T, 3, 3) of the vertebrae own, and of those above them up to the next one. centres: (N,
    3), of the chain. ends: numbers of the anchors in it. lines: (T, 3), from each anchor to the next in the
    source.
    """
    count, frames = len(parts), len(parts[0])
    below = np.searchsorted(own, np.arange(len(centres) - 1), side="right") - 1
    steps = np.diff(centres, axis=0)
    pieces = np.zeros((len(lines), count, 3))
    for bone, (low, high) in enumerate(pairwise(ends)):
        for segment in range(low, high):
            pieces[bone, below[segment]] += steps[segment]
    wanted = [line / np.maximum(np.linalg.norm(line, axis=1, keepdims=True), 1e-12) for line in lines]
    for _ in range(STEPS):
        normal = np.zeros((frames, 3 * count, 3 * count)) + KEEP * KEEP * np.eye(3 * count)
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

"""The source's few spine joints spread over the vertebrae of the body.

A source has two to six joints between hips and head, the body twenty-four. Along the spine, the source's
rotations hold in the middle of its bones; between these middles the vertebrae turn by spherical
interpolation, from the pelvis up to the skull base. Then all vertebrae of a source bone are turned together
by the little that their line still lacks, so that it points exactly where the source's bone points.

With fewer groups of the standard (Spine1, the simple spine of four joints, to Spine5, all of them), the
vertebrae that may turn take over the bones: each carries the line to the next one, along the source's, and
then all turn a little more, so that the bones of the source are missed by as little as these few can.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from fba import rotations
from fba.arrays import Float64
from fba.body.skeleton import Skeleton
from fba.parameters import baps

GROUPS = 5
"""Groups Spine1 to Spine5."""
CHUNK = 2048
"""Frames worked on at a time."""
STEPS = 5
KEEP = 0.05
"""Weight of turning a part no further than it must, against a bone's direction."""


def joints(skeleton: Skeleton) -> list[str]:
    """From the root up to the skull base."""
    if "skullbase" not in skeleton:
        return [skeleton.names[0]]
    joint = skeleton.number("skullbase")
    chain = [joint]
    while skeleton.parents[joint] >= 0:
        joint = int(skeleton.parents[joint])
        chain.append(joint)
    return [skeleton.names[joint] for joint in reversed(chain)]


def turning(skeleton: Skeleton, groups: int) -> list[str]:
    """The vertebrae of the standard's groups Spine1 up to a number, root upwards."""
    allowed = {b.joint for b in baps() if b.group_name in {f"Spine{n}" for n in range(1, groups + 1)}}
    return [joint for joint in joints(skeleton) if joint in allowed]


def spread(
    skeleton: Skeleton,
    wanted: dict[str, Float64],
    places: dict[str, Float64],
    anchors: list[str],
    groups: int,
    with_anchors: bool,
) -> None:
    """Replaces the rotations of anchors in wanted by those of all vertebrae that turn.

    anchors: joints of the spine that the source has, root first and upwards, two at least. wanted: joint ->
    (T, 3, 3), rotations of the bones above them; the last one's is its own. places: anchor -> (T, 3), the
    source's places of the anchors. groups: of the standard. with_anchors: the anchors turn besides the
    groups.
    """
    chain = joints(skeleton)
    first, last = chain.index(anchors[0]), chain.index(anchors[-1])
    centres = np.array([skeleton.centres[skeleton.number(joint)] for joint in chain])
    height = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(centres, axis=0), axis=1))])
    at = [height[chain.index(joint)] for joint in anchors]
    keys = [at[0], *((a + b) / 2 for a, b in pairwise(at)), at[-1]]
    turned = [wanted[anchors[0]], *(wanted[joint] for joint in anchors)]

    def rotation(where: float) -> Float64:
        upper = int(np.clip(np.searchsorted(keys, where), 1, len(keys) - 1))
        low, high = keys[upper - 1], keys[upper]
        share = float(np.clip((where - low) / max(high - low, 1e-12), 0.0, 1.0))
        return rotations.part(turned[upper - 1], turned[upper], share)

    def place(where: float) -> Float64:
        upper = int(np.clip(np.searchsorted(at, where), 1, len(at) - 1))
        low, high = at[upper - 1], at[upper]
        share = float(np.clip((where - low) / max(high - low, 1e-12), 0.0, 1.0))
        result: Float64 = places[anchors[upper - 1]] * (1 - share) + places[anchors[upper]] * share
        return result

    turn_too = {*turning(skeleton, groups), *(anchors if with_anchors else ())}
    free = [joint for joint in chain[first + 1 : last + 1] if joint in turn_too]
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
        bent = {n: rotation((height[n] + height[end]) / 2) for n, end in zip(inside, ends, strict=True)}
        line = sum(
            (bent[n] @ (centres[end] - centres[n]) for n, end in zip(inside, ends, strict=True)),
            np.zeros(3),
        )
        way = place(height[high]) - place(height[low])
        length = np.linalg.norm(way, axis=1).min()
        turn = rotations.between_all(line, way) if length > 1e-9 else np.eye(3)
        for n in inside:
            wanted[chain[n]] = turn @ bent[n]
    wanted[anchors[-1]] = head
    if pinned != anchors:
        lines = [places[above] - places[below] for below, above in pairwise(anchors)]
        at_ends = [chain.index(joint) for joint in anchors]
        own = sorted({first, *(chain.index(joint) for joint in free if joint != anchors[-1])})
        before = np.stack([wanted[chain[n]] for n in own])
        course = np.stack(lines)
        for begin in range(0, before.shape[1], CHUNK):  # matrices of a whole capture would not fit
            few = slice(begin, begin + CHUNK)
            before[:, few] = _settled(list(before[:, few]), own, centres, at_ends, list(course[:, few]))
        wanted.update({chain[n]: part for n, part in zip(own, before, strict=True)})


def _settled(
    parts: list[Float64], own: list[int], centres: Float64, ends: list[int], lines: list[Float64]
) -> list[Float64]:
    """Parts of the spine, turned a little more, so that all source bones together are missed by the least.

    parts: rotations (T, 3, 3) of the vertebrae own, and of those above them up to the next. centres: (N, 3)
    of the chain. ends: numbers of the anchors in it; lines: (T, 3), the source's from each to the next.
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

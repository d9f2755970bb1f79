"""Twists of the arms, distributed along them.

BAPs twist a whole forearm at the elbow, and a hand at the wrist; skin that followed only the joints would be
wrung there. In a real arm the twist grows along the bone. So before skinning, each vertex of an arm is turned
about its bone by the difference.
"""

from __future__ import annotations

import numpy as np

from fba.arrays import Float32, Float64, Int32
from fba.body.skeleton import Skeleton
from fba.body.skin._loops import Twisting
from fba.easing import smoothstep

LIMB = ("shoulder", "elbow", "wrist")
WRIST_FROM = 0.35
"""Share of the forearm, from the elbow, beyond which its skin takes part in the twist of the wrist."""
MIN_ARM_WEIGHT = 0.02
"""Weight of the arm above which a vertex belongs to it."""
MIN_TWIST_SHARE = 1e-3
"""Share of a twist above which a vertex is turned; others are left out."""


def find_twists(
    skeleton: Skeleton, bind: Float64, vertices: Float32, joints: Int32, weights: Float32
) -> Twisting:
    """Return tables of the arms' twists for the compiled loop; empty if the skeleton has no arms.

    rows: vertices; those of bone b are rows[starts[b]:starts[b + 1]]. shares: (N, 2), shares of the twists of
    the bone's joint and of the next joint by which they are turned beforehand. centre, axis: line of the bone
    as modelled. child_axis: axis of the next joint's twist.
    """
    rows, shares, bones, axes = [], [], [], []
    for side in ("l_", "r_"):
        names = [side + name for name in LIMB]
        if not all(name in skeleton for name in names):
            continue
        shoulder, elbow, wrist = (skeleton.number(name) for name in names)
        carried = [_carried_share(skeleton, number, joints, weights) for number in (shoulder, elbow, wrist)]
        along = [_along(bind, pair, vertices) for pair in ((shoulder, elbow), (elbow, wrist))]
        arm = carried[0] > MIN_ARM_WEIGHT
        upper = arm & (along[0] < 1)
        # The shoulder's own twist is not distributed: its skin is wide, and part of it belongs to the trunk.
        own, child = np.zeros(len(vertices)), -carried[1]
        for bone in (upper, arm & ~upper):
            turned = np.flatnonzero(bone & (np.maximum(np.abs(own), np.abs(child)) > MIN_TWIST_SHARE))
            rows.append(turned)
            shares.append(np.stack([own[turned], child[turned]], axis=1))
            share_along = np.clip(along[1], 0.0, 1.0)
            own = share_along - carried[1]
            child = smoothstep((share_along - WRIST_FROM) / (1 - WRIST_FROM)) - carried[2]
        bones += [(shoulder, elbow), (elbow, wrist)]
        axes += [_axis(bind, shoulder, elbow), _axis(bind, elbow, wrist)]
    pairs = np.array(bones, dtype=np.int64).reshape(-1, 2)
    axis = np.array(axes).reshape(-1, 3)
    return Twisting(
        rows=np.concatenate([np.zeros(0, dtype=np.int64), *rows]),
        shares=np.concatenate([np.zeros((0, 2)), *shares]),
        starts=np.cumsum([0, *(len(each) for each in rows)]).astype(np.int64),
        joint=pairs[:, 0].copy(),
        child=pairs[:, 1].copy(),
        centre=bind[pairs[:, 0], :3, 3].copy(),
        axis=axis,
        child_axis=axis[np.arange(len(axis)) // 2 * 2 + 1] if len(axis) else axis,  # the forearm's
    )


def _axis(bind: Float64, joint: int, child: int) -> Float64:
    """Return the unit vector (3,) along a bone as modelled."""
    bone = bind[child, :3, 3] - bind[joint, :3, 3]
    unit: Float64 = bone / max(float(np.linalg.norm(bone)), 1e-12)
    return unit


def _carried_share(skeleton: Skeleton, joint: int, joints: Int32, weights: Float32) -> Float64:
    """Return (V,) total weight of a joint and its descendants for each vertex."""
    below = np.isin(joints, skeleton.descendants(joint))
    total: Float64 = (weights * below).sum(axis=1, dtype=np.float64)
    return total


def _along(bind: Float64, pair: tuple[int, int], vertices: Float32) -> Float64:
    """Return (V,) positions of vertices along a bone: 0 at its joint, 1 at the next."""
    start, end = bind[pair[0], :3, 3], bind[pair[1], :3, 3]
    bone = end - start
    share: Float64 = (vertices - start) @ bone / max(float(bone @ bone), 1e-12)
    return share

"""Shoulder blades that go with the arms, and armpits drawn taut.

An arm that is lifted turns its shoulder blade and collar bone along. BAPs often move the shoulder alone, and
skin that only took part in that would be folded deep between neck and arm. What carries the skin of the
shoulder girdle is therefore turned by a share of the arm's swing, less what BAPs turn the girdle themselves.
Joints stay where they are.

Between arm and ribs, dual quaternions would swing the skin of the armpit out in an arc about the shoulder:
a bag below a raised arm. It is stretched there, so matrices, which take the straight way, have it.
"""

from __future__ import annotations

import numpy as np

from fba.arrays import Float32, Float64, Int32
from fba.body.skeleton import Skeleton
from fba.body.skin._girdle_loops import Girdle
from fba.easing import smoothstep

CHAIN = ("sternoclavicular", "acromioclavicular", "shoulder", "elbow")
TAUT = 0.7
"""The share that matrices have in the armpit."""
BELOW = (0.03, 0.08)
"""Metres below the shoulder between which they come to have it."""
LEAST = 0.02
"""Vertices that the arm carries by less, or by all but less, are not between."""


def find_girdle(
    skeleton: Skeleton, bind: Float64, vertices: Float32, joints: Int32, weights: Float32
) -> Girdle:
    """Tables of both shoulder girdles for the compiled loop; empty if the skeleton has none.

    Its first fields have a row for each side. joints: the joint that carries the girdle, those of collar
    bone and blade, and the shoulder. centre: where the collar bone turns. arm: unit vector along the upper
    arm as modelled. rows, shares: vertices of the armpits, and how far matrices move them.
    """
    chains, centres, arms = [], [], []
    taut = np.zeros(len(vertices))
    for side in ("l_", "r_"):
        names = [side + name for name in CHAIN]
        if not all(name in skeleton for name in names):
            continue
        inner, outer, shoulder, elbow = (skeleton.number(name) for name in names)
        trunk = int(skeleton.parents[inner])
        way = bind[elbow, :3, 3] - bind[shoulder, :3, 3]
        length = float(np.linalg.norm(way))
        if trunk < 0 or length < 1e-9:
            continue
        chains.append((trunk, inner, outer, shoulder))
        centres.append(bind[inner, :3, 3])
        arms.append(way / length)
        carried = (weights * np.isin(joints, _below(skeleton, shoulder))).sum(axis=1)
        low = bind[shoulder, 1, 3] - vertices[:, 1].astype(np.float64)
        between = (carried > LEAST) & (carried < 1 - LEAST)
        taut = np.maximum(taut, TAUT * between * smoothstep((low - BELOW[0]) / (BELOW[1] - BELOW[0])))
    rows = np.flatnonzero(taut)
    return Girdle(
        np.array(chains, dtype=np.int64).reshape(-1, 4),
        np.array(centres, dtype=np.float64).reshape(-1, 3),
        np.array(arms, dtype=np.float64).reshape(-1, 3),
        rows.astype(np.int64),
        taut[rows].astype(np.float32),
    )


def _below(skeleton: Skeleton, joint: int) -> list[int]:
    """A joint and all that hang on it."""
    found = [joint]
    for number, parent in enumerate(skeleton.parents.tolist()):
        if parent in found:
            found.append(number)
    return found

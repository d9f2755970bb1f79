"""Shoulder blades that turn with the arms, and armpits that stay taut.

Lifting an arm turns its shoulder blade and collar bone. BAPs often turn the shoulder alone, and skin that
followed only that would fold deeply between neck and arm. So the joints that carry the skin of the shoulder
girdle are turned by a share of the arm's swing, less what BAPs have turned them already. The positions of
joints do not change.

Between arm and ribs, dual quaternions would swing the skin of the armpit out in an arc about the shoulder, as
a bag below a raised arm. Real skin is stretched there, so linear skinning, which moves it in a straight line,
is blended in.
"""

from __future__ import annotations

import numpy as np

from fba.arrays import Float32, Float64, Int32
from fba.body.skeleton import Skeleton
from fba.body.skin._girdle_loops import Girdle
from fba.easing import smoothstep

CHAIN = ("sternoclavicular", "acromioclavicular", "shoulder", "elbow")
TAUT = 0.7
"""Share of linear skinning in the armpit."""
BELOW = (0.03, 0.08)
"""Metres below the shoulder between which linear skinning rises from none to that share."""
MIN_SHARE = 0.02
"""Weight of the arm, and of the trunk, that a vertex of the armpit has at least."""


def find_girdle(
    skeleton: Skeleton, bind: Float64, vertices: Float32, joints: Int32, weights: Float32
) -> Girdle:
    """Return tables of both shoulder girdles for the compiled loop; empty if the skeleton has none.

    Its first fields have a row for each side. joints: the joint that carries the girdle, those of collar
    bone and blade, and the shoulder. centre: the point that the collar bone turns about. arm: unit vector
    along the upper arm as modelled. rows, shares: vertices of the armpits, and their shares of linear
    skinning.
    """
    chains, centres, arms = [], [], []
    taut = np.zeros(len(vertices))
    for side in ("l_", "r_"):
        names = [side + name for name in CHAIN]
        if not all(name in skeleton for name in names):
            continue
        inner, outer, shoulder, elbow = (skeleton.number(name) for name in names)
        trunk = int(skeleton.parents[inner])
        arm = bind[elbow, :3, 3] - bind[shoulder, :3, 3]
        length = float(np.linalg.norm(arm))
        if trunk < 0 or length < 1e-9:
            continue
        chains.append((trunk, inner, outer, shoulder))
        centres.append(bind[inner, :3, 3])
        arms.append(arm / length)
        carried = (weights * np.isin(joints, skeleton.descendants(shoulder))).sum(axis=1)
        depth = bind[shoulder, 1, 3] - vertices[:, 1].astype(np.float64)
        between = (carried > MIN_SHARE) & (carried < 1 - MIN_SHARE)
        taut = np.maximum(taut, TAUT * between * smoothstep((depth - BELOW[0]) / (BELOW[1] - BELOW[0])))
    rows = np.flatnonzero(taut)
    return Girdle(
        np.array(chains, dtype=np.int64).reshape(-1, 4),
        np.array(centres, dtype=np.float64).reshape(-1, 3),
        np.array(arms, dtype=np.float64).reshape(-1, 3),
        rows.astype(np.int64),
        taut[rows].astype(np.float32),
    )

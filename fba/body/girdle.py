"""Shoulder blades that go with the arms.

An arm that is lifted turns its shoulder blade and collar bone along. BAPs often move the shoulder alone, and
skin that only took part in that would be folded deep between neck and arm. What carries the skin of the
shoulder girdle is therefore turned by a share of the arm's swing, less what BAPs turn the girdle themselves.
Joints stay where they are.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fba.body.skeleton import Skeleton
from fba.body.skinning_loops import Girdle

Float64 = npt.NDArray[np.float64]

CHAIN = ("sternoclavicular", "acromioclavicular", "shoulder", "elbow")


def girdle(skeleton: Skeleton, bind: Float64) -> Girdle:
    """What the compiled loop needs to turn both shoulder girdles; nothing where the skeleton has none.

    Each of its fields has a row for each side. joints: the joint that carries the girdle, those of collar
    bone and blade, and the shoulder. centre: where the collar bone turns. arm: unit vector along the upper
    arm as modelled.
    """
    joints, centres, arms = [], [], []
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
        joints.append((trunk, inner, outer, shoulder))
        centres.append(bind[inner, :3, 3])
        arms.append(way / length)
    return Girdle(
        np.array(joints, dtype=np.int64).reshape(-1, 4),
        np.array(centres, dtype=np.float64).reshape(-1, 3),
        np.array(arms, dtype=np.float64).reshape(-1, 3),
    )

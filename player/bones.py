"""The body as its joints: a capsule along every bone, a small sphere at every joint."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fba.body import Skeleton
from player.shapes import CAPSULE_FLOATS, spheres, srgb

Float32 = npt.NDArray[np.float32]
Float64 = npt.NDArray[np.float64]

BONE = (*srgb("#c3c8cf"), 0.12)
JOINT = (*srgb("#e08a3c"), 0.25)
SLENDERNESS = 0.105
"""Radius of a bone by its length, between the limits below."""
RADII = (0.0045, 0.019)
SPINE_RADIUS = 0.0095
"""Vertebrae are shorter than thick: their length says nothing."""
JOINT_PER_BONE = 1.22
SPINE = ("vl", "vt", "vc", "sacroiliac", "skullbase")


class Bones:
    """Capsules of all joints of a skeleton in any pose.

    skeleton: gives the joints, their parents and, from the default posture, how thick each bone is.
    """

    def __init__(self, skeleton: Skeleton) -> None:
        centres = np.asarray(skeleton.centres, dtype=np.float64)
        self._child = np.flatnonzero(np.asarray(skeleton.parents) >= 0)
        self._parent = np.asarray(skeleton.parents)[self._child]
        length = np.linalg.norm(centres[self._child] - centres[self._parent], axis=1)
        radius = np.clip(SLENDERNESS * length, *RADII)
        spine = [skeleton.names[child].startswith(SPINE) for child in self._child]
        radius = np.where(spine, SPINE_RADIUS, radius)
        self._fixed = np.zeros((len(self._child), CAPSULE_FLOATS), dtype=np.float32)
        self._fixed[:, 3] = radius
        self._fixed[:, 7] = radius * 0.8
        self._fixed[:, 11] = 1.0
        self._fixed[:, 12:16] = BONE
        size = np.zeros(len(centres))
        np.maximum.at(size, self._child, radius)
        np.maximum.at(size, self._parent, np.where(spine, radius, np.minimum(radius, 0.02)))
        self._sizes = np.maximum(size, RADII[0]) * JOINT_PER_BONE

    def capsules(self, matrices: Float64) -> Float32:
        """(2J - 1, 16) capsules for joint matrices (J, 4, 4): the bones, then a sphere at every joint."""
        places = matrices[:, :3, 3]
        bones = self._fixed.copy()
        bones[:, 0:3] = places[self._parent]
        bones[:, 4:7] = places[self._child]
        bones[:, 8:11] = matrices[self._parent, :3, 2]
        return np.concatenate([bones, spheres(places, self._sizes, JOINT)])

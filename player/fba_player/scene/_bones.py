"""The body as its joints: a capsule along every bone, a small sphere at every joint."""

from __future__ import annotations

import numpy as np

from fba.arrays import Float32, Float64
from fba.body import Skeleton
from fba.face.model import FaceModel
from fba.face.tables import HEAD
from fba_player.view.view import CAPSULE_FLOATS, spheres, srgb

BONE = (*srgb("#c3c8cf"), 0.12)
JOINT = (*srgb("#e08a3c"), 0.25)
SLENDERNESS = 0.105
"""Radius of a bone as a share of its length, within the limits below."""
RADII = (0.0045, 0.019)
SPINE_RADIUS = 0.0095
"""Radius of vertebrae (m), which are shorter than thick."""
JOINT_PER_BONE = 1.22
HEAD_RADIUS = 0.006
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


class Pivots:
    """The centres of rotation of a head and its eyes as joints, and bones between them.

    head: (3,) metres, in the neutral face. others: (N, 3). scale: size of the face, 1 for an adult's.
    """

    def __init__(self, head: Float64, others: Float64, scale: float) -> None:
        self._places = np.concatenate([head[None], others])
        self._scale = scale

    def capsules(self, matrix: Float64) -> Float32:
        """(2N + 1, 16) capsules: a bone from the head's joint to every other, then a sphere at each.

        matrix: (4, 4), the turned head's frame into the world.
        """
        places = (self._places @ matrix[:3, :3].T + matrix[:3, 3]).astype(np.float32)
        bones = np.zeros((len(places) - 1, CAPSULE_FLOATS), dtype=np.float32)
        bones[:, 0:3], bones[:, 4:7] = places[0], places[1:]
        bones[:, 3] = HEAD_RADIUS * 0.75 * self._scale
        bones[:, 7] = bones[:, 3] * 0.7
        bones[:, 8:12] = (0.0, 0.0, 1.0, 1.0)
        bones[:, 12:16] = BONE
        sizes = np.full(len(places), HEAD_RADIUS * 0.8 * self._scale)
        sizes[0] = HEAD_RADIUS * self._scale
        return np.concatenate([bones, spheres(places, sizes, JOINT)])


def face_pivots(model: FaceModel, scale: float = 1.0) -> Pivots:
    """The centres of all rotations in a face's tables."""
    head, others = np.zeros(3), []
    for table in model.tables:
        for transform in table.transforms:
            if transform.kind == "rotation":
                if transform.part == HEAD:
                    head = np.array(transform.centre)
                elif transform.centre not in others:
                    others.append(transform.centre)
    return Pivots(head, np.array(others, dtype=np.float64).reshape(-1, 3), scale)

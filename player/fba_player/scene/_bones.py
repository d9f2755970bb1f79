"""What is drawn of joints: a capsule along every bone, a sphere at every joint, shadows on the ground."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.arrays import Float32, Float64, Intp
from fba.body import Skeleton
from fba.face import HEAD, FaceModel
from fba_player.view._view import CAPSULE_FLOATS, spheres, srgb

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
SHADOWS = (
    ("HumanoidRoot", 0.55, 0.42, 0.97),
    ("l_midtarsal", 0.20, 0.55, 0.03),
    ("r_midtarsal", 0.20, 0.55, 0.03),
    ("l_subtalar", 0.16, 0.40, 0.04),
    ("r_subtalar", 0.16, 0.40, 0.04),
)
"""Joints with a shadow: its radius (m), its darkness, and the joint's height at rest (m)."""


@dataclass(frozen=True, eq=False)
class Bones:
    """Bones, joints and soft shadows of a skeleton in any pose.

    parents, children: the joints (B,) at the ends of each bone. templates: float32 (B, 16), the capsules of
    bones before their ends are known. joint_radii: (J,), metres. shadow_joints: the joints of `SHADOWS`.
    """

    parents: Intp
    children: Intp
    templates: Float32
    joint_radii: Float64
    shadow_joints: tuple[int, ...]

    @classmethod
    def from_skeleton(cls, skeleton: Skeleton) -> Bones:
        """Return the bones of a skeleton, as thick as their lengths in the default posture suggest."""
        centres = np.asarray(skeleton.centres, dtype=np.float64)
        children = np.flatnonzero(np.asarray(skeleton.parents) >= 0)
        parents = np.asarray(skeleton.parents)[children]
        length = np.linalg.norm(centres[children] - centres[parents], axis=1)
        spine = [skeleton.names[child].startswith(SPINE) for child in children]
        radius = np.where(spine, SPINE_RADIUS, np.clip(SLENDERNESS * length, *RADII))
        templates = np.zeros((len(children), CAPSULE_FLOATS), dtype=np.float32)
        templates[:, 3] = radius
        templates[:, 7] = radius * 0.8
        templates[:, 11] = 1.0
        templates[:, 12:16] = BONE
        size = np.zeros(len(centres))
        np.maximum.at(size, children, radius)
        np.maximum.at(size, parents, np.where(spine, radius, np.minimum(radius, 0.02)))
        joint_radii = np.maximum(size, RADII[0]) * JOINT_PER_BONE
        shadow_joints = tuple(skeleton.names.index(name) for name, *_ in SHADOWS)
        return cls(parents, children, templates, joint_radii, shadow_joints)

    def capsules(self, matrices: Float64) -> Float32:
        """Return (2J - 1, 16) capsules for joint matrices (J, 4, 4): the bones, then spheres at joints."""
        positions = matrices[:, :3, 3]
        bones = self.templates.copy()
        bones[:, 0:3] = positions[self.parents]
        bones[:, 4:7] = positions[self.children]
        bones[:, 8:11] = matrices[self.parents, :3, 2]
        return np.concatenate([bones, spheres(positions, self.joint_radii, JOINT)])

    def shadows(self, matrices: Float64) -> Float32:
        """Return float32 (K, 4): shadows under hips and feet, fainter with height, as in `View.blobs`."""
        shadows = []
        for joint, (_, radius, darkness, rest) in zip(self.shadow_joints, SHADOWS, strict=True):
            x, y, z = matrices[joint, :3, 3]
            height = max(float(y) - rest, 0.0)
            shadows.append((x, z, radius * (1 + height), darkness / (1 + 4 * height)))
        return np.array(shadows, dtype=np.float32)


class Pivots:
    """The centres of rotation of a head and its eyes as joints, and bones between them.

    head: (3,) metres, in the neutral face. others: (N, 3). scale: size of the face, 1 for an adult's.
    """

    def __init__(self, head: Float64, others: Float64, scale: float) -> None:
        self._centres = np.concatenate([head[None], others])
        self._scale = scale

    def capsules(self, matrix: Float64) -> Float32:
        """Return (2N + 1, 16) capsules: a bone from the head's joint to every other, then a sphere at each.

        matrix: (4, 4), the turned head's frame into the world.
        """
        centres = (self._centres @ matrix[:3, :3].T + matrix[:3, 3]).astype(np.float32)
        bones = np.zeros((len(centres) - 1, CAPSULE_FLOATS), dtype=np.float32)
        bones[:, 0:3], bones[:, 4:7] = centres[0], centres[1:]
        bones[:, 3] = HEAD_RADIUS * 0.75 * self._scale
        bones[:, 7] = bones[:, 3] * 0.7
        bones[:, 8:12] = (0.0, 0.0, 1.0, 1.0)
        bones[:, 12:16] = BONE
        radii = np.full(len(centres), HEAD_RADIUS * 0.8 * self._scale)
        radii[0] = HEAD_RADIUS * self._scale
        return np.concatenate([bones, spheres(centres, radii, JOINT)])


def find_pivots(model: FaceModel, scale: float = 1.0) -> Pivots:
    """Return the centres of all rotations in a face's tables."""
    head, others = np.zeros(3), []
    for table in model.tables:
        for transform in table.transforms:
            if transform.kind == "rotation":
                if transform.part == HEAD:
                    head = np.array(transform.centre)
                elif transform.centre not in others:
                    others.append(transform.centre)
    return Pivots(head, np.array(others, dtype=np.float64).reshape(-1, 3), scale)

"""How much light reaches a body past its folds, and the limbs that keep the sky from it as it moves.

Occlusion by folds is computed once, in the bind pose. Limbs, trunk and head count as capsules between
joints; what they hide of the sky is computed where the body is drawn (face.vert), and so are shadows.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fba.arrays import Float32, Float64, Intp
from fba.body import BodyModel
from fba_player._figure.baked_shapes import load_baked, unpack
from fba_player._figure.face_light import cached_visibility

UNOBSTRUCTED_LIGHT = (1.0, 0.95, 0.0, 0.25)
"""Light that reaches an unobstructed body: key, sky, through, rim; it shades itself most from behind."""
CAPSULES = (
    ("sacroiliac", "vt4", 0.115),
    ("vc2", "skullbase", 0.085),
    ("l_shoulder", "l_elbow", 0.046), ("r_shoulder", "r_elbow", 0.046),
    ("l_elbow", "l_wrist", 0.036), ("r_elbow", "r_wrist", 0.036),
    ("l_wrist", "l_middle1", 0.038), ("r_wrist", "r_middle1", 0.038),
    ("l_hip", "l_knee", 0.072), ("r_hip", "r_knee", 0.072),
    ("l_knee", "l_ankle", 0.05), ("r_knee", "r_ankle", 0.05),
)  # fmt: skip
"""Joints at both ends, and the radius (m) for a body 1.75 m tall."""
ADULT_HEIGHT = 1.75
"""Metres."""
FOLD_STRENGTH = 0.75
"""Strength of occlusion by folds: below 1, as cloth lets light through and the posture changes."""


@dataclass(frozen=True, eq=False)
class BodyLight:
    """Light on a body; see `build_body_light`.

    ends: (K, 2), the joints at both ends of its capsules, and radii: (K,), metres. Occlusion comes with
    the library's own figures; of others it is computed on first use, in about a second.
    """

    body: BodyModel
    ends: Intp
    radii: Float64

    @cached_property
    def open_sky(self) -> Float32:
        """(V,): the share of the sky that the body's folds leave to each vertex."""
        stored = load_baked(self.body.parts)
        open_ = unpack(stored["values"], stored["step"])[:, 0] if stored else self.bake()
        return np.asarray(1 - FOLD_STRENGTH * (1 - np.clip(open_, 0, 1)), dtype=np.float32)

    def bake(self) -> Float32:
        """Compute what reaches each vertex of the sky: float32 (V,), 0..1."""
        body = self.body
        every = np.ones(len(body.vertices), dtype=bool)
        return cached_visibility(body.vertices, body.normals, body.triangles, every).open

    @cached_property
    def light(self) -> Float32:
        """float32 (V, 4), as `FaceMesh.light`: what folds leave of the light."""
        light = np.tile(np.array(UNOBSTRUCTED_LIGHT, dtype=np.float32), (len(self.body.vertices), 1))
        light[:, [1, 3]] *= self.open_sky[:, None]
        return light

    def limbs(self, joints: Float64) -> Float32:
        """Return float32 (2 K, 4), as `FaceMesh.limbs`, for joint matrices (J, 4, 4)."""
        limbs = np.empty((len(self.ends), 2, 4), dtype=np.float32)
        limbs[:, :, :3] = joints[self.ends, :3, 3]
        limbs[:, :, 3] = self.radii[:, None]
        return limbs.reshape(-1, 4)


def build_body_light(body: BodyModel) -> BodyLight:
    """Return the light on a body."""
    names = body.skeleton.names
    limbs = [row for row in CAPSULES if row[0] in names and row[1] in names]
    ends = np.array([[names.index(a), names.index(b)] for a, b, _ in limbs], dtype=np.intp).reshape(-1, 2)
    tall = float(np.ptp(body.vertices[:, 1])) if len(body.vertices) else ADULT_HEIGHT
    share = 0.92 if "head" in {part.kind for part in body.parts} else 0.85  # up to the crown, or to the neck
    radii = np.array([row[2] for row in limbs]) * (tall / share / ADULT_HEIGHT if tall > 0 else 1.0)
    return BodyLight(body, ends, radii)

"""The ground under a figure: soft shadows and a grid."""

from __future__ import annotations

import numpy as np

from fba.arrays import Float32, Float64
from fba_player.view.camera import Subject
from fba_player.view.view import Grid

SHADOWS = (
    ("HumanoidRoot", 0.55, 0.42, 0.97),
    ("l_midtarsal", 0.20, 0.55, 0.03),
    ("r_midtarsal", 0.20, 0.55, 0.03),
    ("l_subtalar", 0.16, 0.40, 0.04),
    ("r_subtalar", 0.16, 0.40, 0.04),
)
"""Joints with a shadow: its radius (m), its darkness, and the joint's height at rest (m)."""
REACH = 7.0
"""Radius of a grid, in steps."""


def shadows(joints: Float64, names: tuple[str, ...]) -> Float32:
    """float32 (K, 4): soft shadows under hips and feet, fainter with height, as in `View.blobs`."""
    found = []
    for name, radius, darkness, rest in SHADOWS:
        x, y, z = joints[list(names).index(name), :3, 3]
        height = max(float(y) - rest, 0.0)
        found.append((x, z, radius * (1 + height), darkness / (1 + 4 * height)))
    return np.array(found, dtype=np.float32)


def no_shadows() -> Float32:
    """float32 (0, 4): no shadows."""
    return np.zeros((0, 4), dtype=np.float32)


def body_grid(joints: Float64) -> Grid:
    """A grid of metres on the floor around the body's root."""
    return Grid(0.0, 1.0, (float(joints[0, 0, 3]), float(joints[0, 2, 3])), REACH)


def face_grid(subject: Subject, lowest: float, scale: float) -> Grid:
    """A grid of tenths of a metre at height `lowest`, under a head of size `scale`, 1 for an adult's."""
    x, _, z = subject.centre
    step = 10.0 ** round(np.log10(max(scale, 1e-9)) - 1)
    return Grid(lowest, step, (x, z), step * 2 * REACH)

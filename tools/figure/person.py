"""The figure that becomes the built-in person: finer where limbs bend, wider in the shoulders.

The standard's default posture lets the arms hang straight down. The figure's own shoulders are so narrow
that its hands would then hang inside its thighs; here shoulders are set apart, and hips drawn in, both
within what adults measure.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from fba.arrays import Bool, Float64, Int64
from fba.sampling import smoothstep
from tools.figure import figure
from tools.figure.subdivide import refine

WIDER = 0.024
"""Metres by which each shoulder is moved out: joints 0.37 m apart, average for adults of this height."""
NECK, GIRDLE = 0.085, 0.155
"""Metres from the midline: up to the first nothing is moved out, from the second on everything."""
CHEST = (1.10, 1.34)
"""Heights over which moving out the trunk fades in, metres."""
CHEST_LEAST = 0.25
"""Share of it at the waist."""
SLIMMER = 0.024
"""Metres by which the outside of each thigh is moved in."""
THIGH, THIGH_HIGH = 0.81, 0.17
"""Height of its middle, and its extent, metres."""
BENDS = (
    ("?_knee", (0.0, 0.0, 1.0), 0.090), ("?_elbow", (0.0, 0.0, -1.0), 0.064),
    ("?_hip", (0.0, 0.0, -1.0), 0.150),
)  # fmt: skip
"""Joints about which the surface is refined: direction of the side that stretches, and radius in metres."""
PAST = 0.02
"""Metres by which the refined region extends to the other side."""


@dataclass(frozen=True, eq=False)
class Person:
    """The figure in the person's proportions.

    vertices (V, 3), metres. triangles (F, 3). tile (F,): texture of each, 0 the head's. inner (F,): mask of
    triangles within mouth and eye sockets. blend: sparse (V, the figure's vertices), interpolates values of
    these to the vertices. arms (V,): weight of the arms.
    """

    vertices: Float64
    triangles: Int64
    tile: Int64
    inner: Bool
    blend: Any
    arms: Float64

    def vertices_of(self, faces: Bool) -> Bool:
        """Return (V,) mask of the vertices that any of the faces uses."""
        used = np.zeros(len(self.vertices), dtype=bool)
        used[self.triangles[faces]] = True
        return used


def make_person(surface: figure.Surface, positions: dict[str, Float64], arms: Float64) -> Person:
    """Return the person made from a figure. positions: of joints, by name. arms (V,): weight of the arms."""
    middle = surface.vertices[surface.quads].mean(axis=1)
    chosen = np.zeros(len(middle), dtype=bool)
    for joint, side, reach in BENDS:
        for letter in "lr":
            away = middle - positions[joint.replace("?", letter)]
            chosen |= (np.linalg.norm(away * (0.6, 1.0, 0.6), axis=1) < reach) & (
                away @ np.array(side) > -PAST
            )
    refined = refine(surface, chosen)
    arms = refined.blend @ arms  # type: ignore[operator]
    high = (surface.vertices[surface.quads][:, :, 1] > figure.EYE_LEVEL - 0.12).all(axis=1)
    vertices = np.concatenate([surface.vertices, refined.vertices[len(surface.vertices) :]])
    return Person(
        reproportion(vertices, arms),
        refined.triangles,
        surface.tile[refined.quads],
        ((surface.tile == 1) & high)[refined.quads],
        refined.blend,
        arms,
    )


def reproportion(positions: Float64, arms: Float64) -> Float64:
    """Return points (N, 3) of the figure in the person's proportions. arms (N,): weight of the arms."""
    x, height = np.abs(positions[:, 0]), positions[:, 1]
    chest = CHEST_LEAST + (1 - CHEST_LEAST) * smoothstep((height - CHEST[0]) / (CHEST[1] - CHEST[0]))
    chest *= smoothstep((height - 0.95) / 0.15)
    trunk = smoothstep((x - NECK) / (GIRDLE - NECK)) * chest
    out = WIDER * (arms + (1 - arms) * trunk)
    level = np.exp(-(((height - THIGH) / THIGH_HIGH) ** 2))
    out -= SLIMMER * (1 - arms) * level * smoothstep((x - 0.06) / 0.12)
    moved = positions.copy()
    moved[:, 0] += np.sign(positions[:, 0]) * out
    return moved

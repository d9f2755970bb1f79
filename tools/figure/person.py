"""The figure that becomes the built-in person: finer where limbs bend, wider in the shoulders.

The standard's default posture lets the arms hang straight down. The figure's own shoulders are so narrow
that its hands would then hang inside its thighs; here shoulders are set apart, and hips drawn in, both
within what adults measure.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import figure
import numpy as np
import numpy.typing as npt
from subdivide import refine

Float64 = npt.NDArray[np.float64]
Int64 = npt.NDArray[np.int64]

WIDER = 0.024
"""Metres that each shoulder is set out: joints 0.37 m apart, in the middle of adults of this height."""
NECK, GIRDLE = 0.085, 0.155
"""Metres from the midline: nearer than the first nothing is set out, from the second on everything."""
CHEST = (1.10, 1.34)
"""Heights between which the trunk comes to be set out."""
CHEST_LEAST = 0.25
"""What the waist takes of it."""
SLIMMER = 0.012
"""Metres that the outside of each thigh is drawn in."""
THIGH, THIGH_HIGH = 0.84, 0.15
"""Where, and over how much height."""
BENDS = (("?_knee", (0.0, 0.0, 1.0), 0.090), ("?_elbow", (0.0, 0.0, -1.0), 0.064))
"""Joints about which the surface is cut finer: the side that stretches when they bend, and how far."""
PAST = 0.02
"""How far this reaches round to the other side, metres."""


@dataclass(frozen=True, eq=False)
class Person:
    """vertices (V, 3), metres. triangles (F, 3). tile (F,): the texture that each lay on, 0 the head's.
    inner (F,): within mouth and eye sockets. blend: sparse (V, the figure's vertices), what carries a
    value of these to them. arms (V,): how far they are the arms'."""

    vertices: Float64
    triangles: Int64
    tile: Int64
    inner: npt.NDArray[np.bool_]
    blend: Any
    arms: Float64

    def vertices_of(self, faces: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
        """(V,) vertices that any of the faces uses."""
        used = np.zeros(len(self.vertices), dtype=bool)
        used[self.triangles[faces]] = True
        return used


def person(surface: figure.Surface, places: dict[str, Float64], arms: Float64) -> Person:
    """The person on a figure. places: its joints by name. arms (V,): how far the arms carry each vertex."""
    middle = surface.vertices[surface.quads].mean(axis=1)
    chosen = np.zeros(len(middle), dtype=bool)
    for joint, side, reach in BENDS:
        for letter in "lr":
            away = middle - places[joint.replace("?", letter)]
            chosen |= (np.linalg.norm(away * (0.6, 1.0, 0.6), axis=1) < reach) & (
                away @ np.array(side) > -PAST
            )
    refined = refine(surface, chosen)
    arms = refined.blend @ arms  # type: ignore[operator]
    high = (surface.vertices[surface.quads][:, :, 1] > figure.EYE_LEVEL - 0.12).all(axis=1)
    vertices = np.concatenate([surface.vertices, refined.vertices[len(surface.vertices) :]])
    return Person(
        proportioned(vertices, arms),
        refined.triangles,
        surface.tile[refined.quads],
        ((surface.tile == 1) & high)[refined.quads],
        refined.blend,
        arms,
    )


def proportioned(places: Float64, arms: Float64) -> Float64:
    """Places (N, 3) of the figure as those of the person. arms (N,): how far they are the arms'."""
    x, height = np.abs(places[:, 0]), places[:, 1]
    chest = CHEST_LEAST + (1 - CHEST_LEAST) * _smooth((height - CHEST[0]) / (CHEST[1] - CHEST[0]))
    chest *= _smooth((height - 0.95) / 0.15)
    trunk = _smooth((x - NECK) / (GIRDLE - NECK)) * chest
    out = WIDER * (arms + (1 - arms) * trunk)
    level = np.exp(-(((height - THIGH) / THIGH_HIGH) ** 2))
    out -= SLIMMER * (1 - arms) * level * _smooth((x - 0.06) / 0.12)
    moved = places.copy()
    moved[:, 0] += np.sign(places[:, 0]) * out
    return moved


def _smooth(value: Float64) -> Float64:
    t = np.clip(value, 0.0, 1.0)
    return t * t * (3 - 2 * t)

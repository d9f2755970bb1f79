"""Eyeballs: spheres with rings at the rims of pupil and iris, so that a pupil can grow."""

from __future__ import annotations

import numpy as np

from fba.arrays import Float64, Int64
from tools.figure.looks import Colour
from tools.figure.meshes import Mesh, tube

AROUND = 40
SCLERA = np.array([0.80, 0.76, 0.72])
"""Linear light."""
LIMBUS = np.array([0.055, 0.050, 0.045])
PUPIL = np.array([0.004, 0.004, 0.004])
VEIN = np.array([0.62, 0.30, 0.26])


def eyeball(centre: Float64, radius: float, iris: float, tones: tuple[Colour, Colour]) -> Mesh:
    """Return an eyeball looking along +z.

    The first vertex is the middle of the pupil. iris: its diameter; the pupil's is a third of it. tones:
    inner and outer colour of the iris.
    """
    edge, pupil = np.arcsin(iris / 2 / radius), np.arcsin(iris / 6 / radius)
    polar = np.concatenate([
        np.linspace(0, pupil, 3)[1:], np.linspace(pupil, edge, 7)[1:], edge + np.array([0.02, 0.05, 0.09]),
        np.linspace(edge + 0.09, np.pi, 12)[1:-1],
    ])  # fmt: skip
    turn = np.linspace(0, 2 * np.pi, AROUND, endpoint=False)
    ring = np.stack(np.broadcast_arrays(
        np.sin(polar)[:, None] * np.cos(turn), np.sin(polar)[:, None] * np.sin(turn), np.cos(polar)[:, None],
    ), axis=-1)  # fmt: skip
    unit = np.concatenate([[[0, 0, 1.0]], ring.reshape(-1, 3), [[0, 0, -1.0]]])
    triangles = _sphere(len(polar))
    colours = _colours(polar, turn, (pupil, edge), tones).reshape(-1, 4)
    first, last = np.append(PUPIL, 0.9)[None], np.append(VEIN * 0.6, 0.9)[None]
    return centre + unit * radius, triangles, np.concatenate([first, colours, last])


def _sphere(rings: int) -> Int64:
    """Return triangles of a sphere: its first vertex, rings, its last vertex."""
    first, last = 1 + np.arange(AROUND), 1 + np.arange(AROUND) + (rings - 1) * AROUND
    cap = np.stack([np.zeros(AROUND, dtype=int), first, np.roll(first, -1)], axis=1)
    end = np.stack([last, np.full(AROUND, rings * AROUND + 1), np.roll(last, -1)], axis=1)
    return np.concatenate([cap, 1 + tube(rings, AROUND), end])


def _colours(
    polar: Float64, turn: Float64, rims: tuple[float, float], tones: tuple[Colour, Colour]
) -> Float64:
    """Return (R, N, 4) colours at angles from the gaze (R,) and around it (N,). rims: of pupil and iris."""
    pupil, edge = rims
    inner, outer = np.array(tones)
    random = np.random.default_rng(3)
    depth = np.clip((polar - pupil) / (edge - pupil), 0, 1)[:, None, None]
    streak = 0.75 + 0.5 * random.random((1, len(turn), 1)) * (1 - 0.5 * depth)
    near = np.clip(1 - 1.6 * depth, 0, 1) ** 1.5
    iris = (inner * near + outer * (1 - near)) * streak
    iris = iris * (1 - depth**12) + LIMBUS * depth**12
    away = np.clip((polar - edge) / 0.09, 0, 1)[:, None, None]
    back = np.clip((polar - 0.9) / 0.9, 0, 1)[:, None, None]
    white = LIMBUS * (1 - away) ** 2 + SCLERA * (1 - (1 - away) ** 2)
    white = white * (1 - 0.5 * back) + VEIN * 0.5 * back
    colour = np.where((polar <= pupil + 1e-9)[:, None, None], PUPIL, np.where(depth < 1, iris, white))
    gloss = np.full((len(polar), len(turn), 1), 0.9)
    return np.concatenate([np.broadcast_to(colour, (len(polar), len(turn), 3)), gloss], axis=2)

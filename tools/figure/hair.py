"""The layer of hair over the scalp: how thick it is, and which way it is combed."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
from looks import Hair
from scipy.interpolate import PchipInterpolator

from fba.arrays import Float64
from fba.sampling import smoothstep

MIDDLE = np.array([0.0, 0.012, -0.085])
"""Point of the skull from which hair stands away."""
TOP = (0.030, 0.085)
"""Heights between which the hair reaches the thickness of the top, metres."""
CALM = (0.080, 0.098)
"""Heights of the skin between which locks cease to stand out, metres."""
PARTING = 0.030
"""x of the parting, on the subject's left, metres."""
GROOVE = 0.0021
"""Half its width."""
AXIS = -0.085
"""z of the vertical axis around which the angles of the hairline are measured."""


def grow(vertices: Float64, hair: Hair) -> Float64:
    """Return vertices (V, 3) of the skin with those of the scalp at the outside of the hair; symmetric."""
    folded = vertices * np.where(vertices[:, :1] < 0, (-1.0, 1.0, 1.0), (1.0, 1.0, 1.0))
    above = height_above_hairline(folded)
    full = hair.sides + hair.top * smoothstep((folded[:, 1] - TOP[0]) / (TOP[1] - TOP[0]))
    # Not on the crown, whose highest point is a feature point.
    lumps = hair.lumps * (1 - smoothstep((folded[:, 1] - CALM[0]) / (CALM[1] - CALM[0])))
    full = full + lumps * (noise(folded, 0.013, 41) + 0.6 * noise(folded, 0.006, 42))
    # Locks end in a rounded edge, not in a ramp.
    share = np.sqrt(np.clip(above / hair.rise, 0.0, 1.0)) * smoothstep(above / 0.004)
    away = vertices - MIDDLE
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    return vertices + away * (share * np.maximum(full, 0.0))[:, None]


def height_above_hairline(positions: Float64) -> Float64:
    """Return (N,) metres above the hairline of points (N, 3): positive on the scalp, -1 behind ears."""
    with (Path(__file__).parent / "hairline.csv").open(encoding="utf-8") as file:
        line = np.array([[float(row["degrees"]), float(row["y"]) / 1000] for row in csv.DictReader(file)])
    around = np.degrees(np.arctan2(np.abs(positions[:, 0]), positions[:, 2] - AXIS))
    height = PchipInterpolator(line[:, 0], line[:, 1])
    slope = height.derivative()(around) * 180 / np.pi / 0.08
    above = (positions[:, 1] - height(around)) / np.sqrt(1 + slope**2)
    ear = (np.abs(positions[:, 0]) > 0.0765) & (positions[:, 1] < 0.006)
    ear &= (positions[:, 2] > -0.122) & (positions[:, 2] < -0.100)
    return np.where(ear, -1.0, above)


def scalp(positions: Float64, edge_width: float = 0.004) -> Float64:
    """Return (N,) density of hair at points (N, 3): 0 on the face, 1 on the scalp.

    edge_width: metres over which the hair thins out at its edge.
    """
    return smoothstep(height_above_hairline(positions) / edge_width + 0.5)


def noise(positions: Float64, scale: float, seed: int) -> Float64:
    """Return (N,) smooth noise in -1..1 at points (N, 3); scale: size of its grains, metres."""
    from scipy.ndimage import map_coordinates

    lattice = np.random.default_rng(seed).uniform(-1, 1, (48, 48, 48))
    return map_coordinates(lattice, (positions / scale).T, order=1, mode="grid-wrap")


def combed(p: Float64) -> Float64:
    """Return (N, 3) directions in which hair lies at points (N, 3): from the parting sideways and back."""
    side = np.where(p[:, 0] > PARTING, 1.0, -1.0)
    over = smoothstep((p[:, 1] - 0.045) / 0.045)[:, None] * smoothstep((p[:, 2] + 0.17) / 0.05)[:, None]
    across = np.stack([side, np.full(len(p), -0.25), np.full(len(p), -0.55)], axis=1)
    down = np.stack([np.zeros(len(p)), np.full(len(p), -1.0), np.full(len(p), -0.45)], axis=1)
    # At the forehead hair grows upwards and back, before it falls to the side.
    back = np.stack([side * 0.35, np.full(len(p), 1.0), np.full(len(p), -0.5)], axis=1)
    front = smoothstep((0.016 - height_above_hairline(p)) / 0.012) * smoothstep((p[:, 1] - 0.03) / 0.03)
    front = (front * smoothstep((p[:, 2] + 0.075) / 0.03))[:, None]
    return front * back + (1 - front) * (over * across + (1 - over) * down)


def in_parting(p: Float64) -> Float64:
    """Return (N,) 1 in the parting, 0 beside it, for points (N, 3)."""
    along = smoothstep((p[:, 2] + 0.125) / 0.03) * smoothstep((p[:, 1] - 0.06) / 0.015)
    return along * np.exp(-(((p[:, 0] - PARTING) / GROOVE) ** 2))

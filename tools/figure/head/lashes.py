"""Eyelashes: thin bent blades that stand on the margins of the lids."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.arrays import Float64
from tools.figure.meshes import Mesh, blade_triangles, join

COLOUR = np.array([0.030, 0.020, 0.014])
"""Linear light."""
MIDDLE_FAN = 0.42
"""Share of the margin at which lashes lean neither to the nose nor to the temple."""


@dataclass(frozen=True)
class Row:
    """Lashes of one lid.

    count. first, last: shares of the margin from its inner corner between which they stand. length, width:
    of the longest, metres. sizes: shares of that length at the four places of `PLACES`. start, end: which way
    they point at root and tip: outwards from the eye, upwards, forwards. segments: straight pieces of a lash.
    """

    count: int
    first: float
    last: float
    length: float
    width: float
    sizes: tuple[float, float, float, float]
    start: tuple[float, float, float]
    end: tuple[float, float, float]
    segments: int


PLACES = (0.15, 0.5, 0.75, 0.96)
UPPER = Row(
    68, 0.22, 0.95, 0.0062, 0.00017, (0.30, 0.78, 1.0, 0.72), (0.92, -0.40, 0.42), (0.20, 1.05, 0.40), 2
)
LOWER = Row(
    23, 0.34, 0.93, 0.0028, 0.00012, (0.40, 0.75, 1.0, 0.70), (0.95, -0.25, 0.30), (0.55, -0.80, 0.15), 2
)


def lashes(margin: Float64, centre: Float64, row: Row) -> Mesh:
    """Return lashes of one lid of the left eye, one connected piece each.

    margin: (N, 3) points along the lid's margin from the inner to the outer corner. centre: the eyeball's.
    """
    random = np.random.default_rng(23)
    blades = []
    run = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(margin, axis=0), axis=1))])
    along = row.first + (row.last - row.first) * np.linspace(0, 1, row.count) ** 0.92
    # A few neighbours lean towards each other at their tips.
    lean = np.repeat(random.normal(0, 0.05, row.count), random.integers(1, 4, row.count))[: row.count]
    for share, by in zip(np.clip(along + random.normal(0, 0.002, row.count), 0.02, 0.99), lean, strict=True):
        root = np.array([np.interp(share * run[-1], run, margin[:, axis]) for axis in range(3)])
        full = row.length * np.interp(share, PLACES, row.sizes) * random.uniform(0.72, 1.08)
        fan = (share - MIDDLE_FAN) * 0.95 + by + random.normal(0, 0.04)
        blades.append(_blade(root, centre, full, fan, row))
    pattern, colours = blade_triangles(row.segments), np.tile([*COLOUR, 0.35], (len(blades[0]), 1))
    return join([(blade, pattern, colours) for blade in blades])


def _blade(root: Float64, centre: Float64, length: float, lean: float, row: Row) -> Float64:
    """Return vertices of a lash; lean: how far it points to the temple."""
    outward = root - centre
    outward /= np.linalg.norm(outward)
    fan = np.array([lean, 0.0, 0.0])
    start = outward * row.start[0] + fan + (0.0, *row.start[1:])
    end = outward * row.end[0] + fan * 1.15 + (0.0, *row.end[1:])
    side = np.array([1.0, 0.0, -0.25 * np.sign(outward[0])])
    side /= np.linalg.norm(side)
    place, points = root.copy(), []
    for k in range(row.segments + 1):
        t = k / row.segments
        width = row.width * (1 - 0.8 * t)
        points += [place - side * width / 2, place + side * width / 2] if k < row.segments else [place]
        direction = start * (1 - t) + end * t
        place = place + direction / np.linalg.norm(direction) * length / row.segments
    return np.array(points)

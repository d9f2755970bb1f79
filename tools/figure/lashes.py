"""Eyelashes: thin bent blades that stand on the margins of the lids."""

from __future__ import annotations

import numpy as np
from meshes import Mesh, join

from fba.arrays import Float64, Int64

COLOUR = np.array([0.012, 0.008, 0.006])
"""Linear light."""
UPPER = 108
SEGMENTS = 3
LENGTH = 0.0060
WIDTH = 0.00021


def lashes(margin: Float64, centre: Float64) -> Mesh:
    """Return upper lashes of the left eye, one connected piece each.

    margin: (N, 3) points along the upper lid's margin from the inner to the outer corner. centre: the
    eyeball's.
    """
    random = np.random.default_rng(23)
    blades = []
    run = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(margin, axis=0), axis=1))])
    along = 0.18 + 0.74 * np.linspace(0, 1, UPPER) ** 0.92 + random.normal(0, 0.003, UPPER)
    for share in np.clip(along, 0.02, 0.99):
        root = np.array([np.interp(share * run[-1], run, margin[:, axis]) for axis in range(3)])
        full = LENGTH * np.interp(share, [0.15, 0.5, 0.75, 0.96], [0.5, 0.95, 1.0, 0.62])
        full *= 0.72 + 0.42 * random.random()
        blades.append(_blade(root, centre, full, share, random))
    pattern, colours = _pattern(), np.tile([*COLOUR, 0.35], (len(blades[0]), 1))
    return join([(blade, pattern, colours) for blade in blades])


def _pattern() -> Int64:
    """Return triangles of one blade: pairs of vertices along it, one at its tip."""
    triangles = []
    for k in range(SEGMENTS - 1):
        a, b, c, d = 2 * k, 2 * k + 1, 2 * k + 2, 2 * k + 3
        triangles += [[a, b, d], [a, d, c]]
    last = 2 * (SEGMENTS - 1)
    return np.array([*triangles, [last, last + 1, last + 2]])


def _blade(
    root: Float64, centre: Float64, length: float, share: float, random: np.random.Generator
) -> Float64:
    outward = root - centre
    outward /= np.linalg.norm(outward)
    # They fan out: inner ones lean to the nose, outer ones to the temple.
    fan = np.array([(share - 0.42) * 0.95 + random.normal(0, 0.16), 0.0, 0.0])
    start = outward * 0.92 + fan + np.array([0, -0.35, 0.40])
    end = outward * 0.25 + fan * 1.15 + np.array([0, 1.0, 0.45])
    side = np.array([1.0, 0.0, -0.25 * np.sign(outward[0])])
    side /= np.linalg.norm(side)
    place, points = root.copy(), []
    for k in range(SEGMENTS + 1):
        t = k / SEGMENTS
        width = WIDTH * (1 - 0.75 * t)
        points += [place - side * width / 2, place + side * width / 2] if k < SEGMENTS else [place]
        direction = start * (1 - t) + end * t
        place = place + direction / np.linalg.norm(direction) * length / SEGMENTS
    return np.array(points)

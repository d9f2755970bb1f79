"""Locks that stand out from the layer of hair: narrow strips that break its outline."""

from __future__ import annotations

import numpy as np

from fba.arrays import Float64, Integer
from fba.rotations import unit
from tools.figure.head.hair import (
    MIDDLE,
    RADIUS,
    TONES,
    height_above_hairline,
    noise,
    shine,
    strand_places,
    strand_points,
)
from tools.figure.looks import ALEX, Hair
from tools.figure.meshes import Mesh, blade_triangles, join

SEGMENTS = 2
GLOSS = 0.1
GROUPS = (
    # name; count; heights above the hairline of the roots; length; width; how far the tips stand out, metres
    ("front", 64, (0.004, 0.022), (0.012, 0.030), 0.00026, 0.0045),
    ("crown", 19, (0.026, 1.0), (0.018, 0.034), 0.00034, 0.0035),
    ("stray", 92, (0.026, 1.0), (0.024, 0.055), 0.00018, 0.0080),
)
NEIGHBOURS = 8
"""Vertices between which the depth of the layer is interpolated."""


def locks(bare: Float64, grown: Float64, triangles: Integer, hair: Hair) -> Mesh:
    """Return the locks of a figure, one connected piece each; equally many of each figure, at the same roots.

    bare, grown: (V, 3), the skin without and with its layer of hair. triangles: (F, 3). Colours are those of
    the first figure.
    """
    depth, blades, colours = _Depth(bare, grown), [], []
    for seed, (name, count, heights, lengths, width, lift) in enumerate(GROUPS):
        random = np.random.default_rng(91 + seed)
        roots = _roots(bare, triangles, name, heights, count, random)
        length = random.uniform(*lengths, count)
        bend = random.normal(0.0, 0.08, count) + 0.20 * noise(roots, 0.012, 92)  # neighbours alike
        lifts = lift * random.uniform(0.3, 1.3, count) * hair.loose
        if hair.curly:
            bend, length = np.sign(bend) * random.uniform(1.4, 3.0, count), length * 0.40
            lifts = -lifts if name != "crown" else lifts  # hidden: single curls would look like scratches
        paths = _paths(roots, length, bend, lifts, depth)
        blades += [_blade(path, width * random.uniform(0.6, 1.3)) for path in paths]
        colours += list(_colours(random.normal(0.0, 0.15, count) + 0.3 * shine(unit(roots - MIDDLE)[:, 1])))
    pattern = blade_triangles(SEGMENTS)
    return join([(b, pattern, np.tile(c, (len(b), 1))) for b, c in zip(blades, colours, strict=True)])


class _Depth:
    """How far the layer of hair is from `MIDDLE`, by direction."""

    def __init__(self, bare: Float64, grown: Float64) -> None:
        from scipy.spatial import cKDTree

        near = height_above_hairline(bare) > -0.03
        away = grown[near] - MIDDLE
        self._radius = np.linalg.norm(away, axis=1)
        self._tree = cKDTree(away / self._radius[:, None])

    def __call__(self, directions: Float64) -> Float64:
        """Return (N,) metres for directions (N, 3)."""
        apart, nearest = self._tree.query(unit(directions), k=NEIGHBOURS)
        share = 1 / (apart + 0.003) ** 2
        return (self._radius[nearest] * share).sum(axis=1) / share.sum(axis=1)


def _roots(
    bare: Float64,
    triangles: Integer,
    group: str,
    heights: tuple[float, float],
    count: int,
    random: np.random.Generator,
) -> Float64:
    """Return (count, 3) points of the bare scalp, evenly spread over the places of a group.

    heights: above the hairline, metres.
    """
    corners = bare[triangles]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    area *= np.abs(height_above_hairline(corners.mean(axis=1)) - heights[0]) < heights[1] - heights[0] + 0.01
    chosen = random.choice(len(triangles), 60 * count, p=area / area.sum())
    points = np.einsum("nk,nkd->nd", random.dirichlet(np.ones(3), len(chosen)), corners[chosen])
    above = height_above_hairline(points)
    fits = (above > heights[0]) & (above < heights[1])
    if group == "front":
        fits &= (points[:, 2] > -0.055) & (points[:, 1] > 0.060)
    return points[fits][:count]


def _paths(roots: Float64, length: Float64, bend: Float64, lift: Float64, depth: _Depth) -> Float64:
    """Return (N, SEGMENTS + 1, 3) points along locks that lie as the strands below them, or bend aside."""
    places = strand_places(roots)
    start = strand_points(places)
    along = unit(strand_points(places + 0.01) - start)
    aside = np.cross(start, along)
    paths = []
    for share in np.linspace(0, 1, SEGMENTS + 1):
        turn = bend * share
        ahead = length * share * np.sinc(turn / np.pi)
        off = length * share * np.sinc(turn / 2 / np.pi) * np.sin(turn / 2)
        q = unit(start * RADIUS + along * ahead[:, None] + aside * off[:, None])
        paths.append(MIDDLE + q * (depth(q) - 0.0006 + (lift + 0.0006) * share**1.4)[:, None])
    return np.stack(paths, axis=1)


def _blade(path: Float64, width: float) -> Float64:
    """Return vertices of a strip along a path (N, 3): pairs, and one at its tip."""
    points = []
    forward = np.gradient(path, axis=0)
    side = unit(np.cross(forward, path - MIDDLE))
    for k, share in enumerate(np.linspace(0, 1, len(path))[:-1]):
        half = side[k] * width / 2 * (0.7 + 0.9 * share - 1.3 * share**2)
        points += [path[k] - half, path[k] + half]
    return np.array([*points, path[-1]])


def _colours(tones: Float64) -> Float64:
    """Return (N, 4) linear light and gloss of locks; tones: as of `hair.paint_locks`."""
    shown = np.stack([np.interp(tones, TONES, [c[k] for c in ALEX.hair.colours]) for k in range(3)], axis=1)
    return np.concatenate([(shown / 255) ** 2.2, np.full((len(tones), 1), GLOSS)], axis=1)

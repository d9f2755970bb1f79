"""The line between the lips of a face whose skin ends there: the loop of open edges around its mouth."""

from __future__ import annotations

import numpy as np

from fba.arrays import Float64, Intp
from fba.face.authoring.surface.surface import weld_parts
from fba.face.model import Part

FEWEST = 8
"""Fewest vertices of the loop."""
NEAR = 0.08
"""Most distance of the loop from the lips, in distances of the pupils."""
SIZES = (0.15, 1.3)
"""Least and most width of a mouth, in distances of the pupils."""
HIGHEST = 0.8
"""Most height of an open mouth, by its width."""


def mouth_points(
    skin: Part, drop: Float64, upper: Float64, lower: Float64, apart: float
) -> dict[str, Float64]:
    """Inner points of the lips (2.2 to 2.9) on the open edges around a mouth; none without such a loop.

    drop: (V,) how far an opening jaw lowers each vertex of the skin. upper, lower: (3,) places near
    the middles of the lips. apart: distance of the pupils.
    """
    surface = weld_parts([skin], (skin.kind,))
    places = surface.vertices
    for loop in _loops(surface.open_edges):
        ring = places[loop]
        width, height = np.ptp(ring[:, 0]), np.ptp(ring[:, 1])
        away = max(float(np.linalg.norm(ring - lip, axis=1).min()) for lip in (upper, lower))
        if len(loop) < FEWEST or away > NEAR * apart or height > HIGHEST * width:
            continue
        if SIZES[0] * apart < width < SIZES[1] * apart:
            falls = np.zeros(len(places))
            falls[surface.number] = drop[surface.pool]
            return _points(ring, falls[loop], float(upper[0]))
    return {}


def _points(ring: Float64, falls: Float64, middle: float) -> dict[str, Float64]:
    """Points on a ring (N, 3) around a mouth. falls: (N,) of its vertices. middle: the x of the midline."""
    left, right = int(ring[:, 0].argmax()), int(ring[:, 0].argmin())
    order = np.arange(len(ring))
    first, last = sorted((left, right))
    arcs = (order[first + 1 : last], np.concatenate([order[last + 1 :], order[:first]]))
    if not all(len(arc) for arc in arcs):
        return {}
    points = {"2.4": ring[left], "2.5": ring[right]}
    for arc, names in zip(
        sorted(arcs, key=lambda arc: float(falls[arc].mean())),
        (("2.6", "2.2", "2.7"), ("2.8", "2.3", "2.9")),
        strict=True,
    ):
        for name, corner, share in zip(names, (left, left, right), (0.5, 0.0, 0.5), strict=True):
            x = middle + share * (ring[corner, 0] - middle)
            points[name] = ring[arc[int(np.abs(ring[arc, 0] - x).argmin())]]
    return points


def _loops(edges: Intp) -> list[Intp]:
    """Closed loops of edges (E, 2), each as its vertices in order; edges that branch form no loop."""
    ends: dict[int, list[int]] = {}
    for a, b in edges.tolist():
        ends.setdefault(a, []).append(b)
        ends.setdefault(b, []).append(a)
    loops: list[Intp] = []
    visited: set[int] = set()
    for start in ends:
        walk: list[int] = []
        here = start
        while here not in visited and len(ends[here]) == 2:
            visited.add(here)
            walk.append(here)
            here = next((there for there in ends[here] if there not in visited), start)
        if len(walk) > 2 and start in ends[walk[-1]]:
            loops.append(np.array(walk, dtype=np.intp))
    return loops

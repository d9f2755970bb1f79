"""The openings of a face: margins of lids, and the line between lips of a skin that ends there.

The margins are a loop of edges around the eye, as seen from the front; the line is one of open edges.
"""

from __future__ import annotations

import numpy as np

from fba.arrays import Float64, Intp
from fba.face.authoring.surface.surface import Surface, weld_parts
from fba.face.model import Part

MARGIN_REACH = 1.6
"""Distance from the eyeball's axis, in its radii, within which margins are sought."""
VISIBLE_DEPTH = 0.02
"""Depth behind the front of the eyeball, in its radii, up to which a vertex is visible."""
HIDDEN_DEPTH = 0.08
"""Depth beyond which a vertex is surely hidden: eyeballs are not quite round, and some lids cut into them."""
MAX_LENGTH_RATIO = 1.1
"""A loop that is visible all around may be this many times as long as the shortest loop."""
MAX_STARTS = 60
"""Number of edges, at most, from which loops are sought."""
MIN_LOOP_VERTICES = 8
"""Number of vertices that the loop around a mouth has at least."""
MAX_LIP_DISTANCE = 0.08
"""Distance up to which that loop is off the lips, in distances of the pupils."""
MOUTH_WIDTHS = (0.15, 1.3)
"""Limits of the width of a mouth, in distances of the pupils."""
MAX_OPENING = 0.8
"""Height up to which a mouth may be open, as a share of its width."""


def find_eye_loop(surface: Surface, centre: Float64, radius: float) -> Intp:
    """Return the vertices (N,) of the shortest loop of visible edges around an eye's axis, in order.

    It is empty where there is no loop.

    centre: (3,), radius: of the eyeball, in the unit of the surface. The face looks to +z. Lids are thick: of
    the loops around their back and their front edges, one that the eyeball does not hide is taken.
    """
    (seen, seen_length), (any_loop, length) = (
        _shortest_loop(surface, centre, radius, hidden) for hidden in (VISIBLE_DEPTH, HIDDEN_DEPTH)
    )
    return seen if seen_length < MAX_LENGTH_RATIO * length else any_loop


def _shortest_loop(surface: Surface, centre: Float64, radius: float, hidden: float) -> tuple[Intp, float]:
    """Return the vertices (N,) of the shortest loop around an eye's axis, and its length.

    Without a loop there are no vertices, and the length is infinite.

    hidden: depth behind the front of the eyeball, in its radii, beyond which vertices do not count.
    """
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import dijkstra

    none = np.zeros(0, dtype=np.intp), np.inf
    arms = surface.vertices - centre
    across = np.hypot(arms[:, 0], arms[:, 1])
    front = np.sqrt(np.maximum(radius**2 - across**2, 0.0))
    visible = (across < MARGIN_REACH * radius) & (arms[:, 2] > front - hidden * radius)
    edges = surface.edges[visible[surface.edges].all(axis=1)]
    if not len(edges):
        return none
    vertices, local = np.unique(edges, return_inverse=True)
    edges = local.reshape(-1, 2)
    points = arms[vertices]
    a, b = points[edges[:, 0]], points[edges[:, 1]]
    length = np.linalg.norm(b - a, axis=1)
    length = np.maximum(length, 1e-9 * radius)
    # a loop around the axis crosses the half plane above it an odd number of times: it ends on another sheet
    below, above = a[:, 0] < 0, b[:, 0] < 0
    share = a[:, 0] / np.where(below != above, a[:, 0] - b[:, 0], 1.0)
    crossing = (below != above) & (a[:, 1] + share * (b[:, 1] - a[:, 1]) > 0)
    count = len(vertices)
    ends = np.concatenate([edges, edges + count])
    ends[:, 1] = np.where(np.tile(crossing, 2), (ends[:, 1] + count) % (2 * count), ends[:, 1])
    graph = csr_array((np.tile(length, 2), ends.T), shape=(2 * count, 2 * count))
    starts = edges[crossing][:, 0]
    if not len(starts):
        return none
    starts = np.unique(starts)
    # the margins are nearest to the axis
    starts = starts[np.argsort(points[starts, 1], kind="stable")][:MAX_STARTS]
    away, before = dijkstra(graph, directed=False, indices=starts, return_predecessors=True)
    round_trip = away[np.arange(len(starts)), starts + count]
    best = int(round_trip.argmin())
    if not np.isfinite(round_trip[best]):
        return none
    walk = [int(starts[best]) + count]
    while walk[-1] != starts[best]:
        walk.append(int(before[best, walk[-1]]))
    loop = np.asarray(vertices[np.array(walk[1:], dtype=np.intp) % count])
    return loop, float(round_trip[best])


def lid_points_of_loop(points: Float64, loop: Intp, x: float) -> dict[str, int]:
    """Return the vertices of a loop that are the middles of the lids and the corners of the eye.

    points: (N, 3) of the surface. x: of the pupil. Names: "upper", "lower", "left", "right" (the subject's).
    """
    ring = points[loop]
    left, right = int(ring[:, 0].argmax()), int(ring[:, 0].argmin())
    first, last = sorted((left, right))
    inside = np.arange(first + 1, last)
    outside = np.concatenate([np.arange(last + 1, len(loop)), np.arange(first)])
    if not len(inside) or not len(outside):
        return {}
    arcs = sorted((inside, outside), key=lambda arc: float(ring[arc, 1].mean()))
    lower, upper = (int(arc[np.abs(ring[arc, 0] - x).argmin()]) for arc in arcs)
    return {
        name: int(loop[row])
        for name, row in (("upper", upper), ("lower", lower), ("left", left), ("right", right))
    }


def mouth_points(
    skin: Part, drop: Float64, upper: Float64, lower: Float64, apart: float
) -> dict[str, Float64]:
    """Return the inner points of the lips (2.2 to 2.9) on the open edges around a mouth; none without a loop.

    drop: (V,) how far an opening jaw lowers each vertex of the skin. upper, lower: (3,) places near
    the middles of the lips. apart: distance of the pupils.
    """
    surface = weld_parts([skin], (skin.kind,))
    places = surface.vertices
    for loop in _closed_loops(surface.open_edges):
        ring = places[loop]
        width, height = np.ptp(ring[:, 0]), np.ptp(ring[:, 1])
        away = max(float(np.linalg.norm(ring - lip, axis=1).min()) for lip in (upper, lower))
        if len(loop) < MIN_LOOP_VERTICES or away > MAX_LIP_DISTANCE * apart or height > MAX_OPENING * width:
            continue
        if MOUTH_WIDTHS[0] * apart < width < MOUTH_WIDTHS[1] * apart:
            falls = np.zeros(len(places))
            falls[surface.number] = drop[surface.pool]
            return _inner_lip_points(ring, falls[loop], float(upper[0]))
    return {}


def _inner_lip_points(ring: Float64, falls: Float64, middle: float) -> dict[str, Float64]:
    """Return points on a ring (N, 3) around a mouth. falls: (N,) of its vertices. middle: x of its middle."""
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


def _closed_loops(edges: Intp) -> list[Intp]:
    """Return closed loops of edges (E, 2), each as its vertices in order; edges that branch form none."""
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

"""The margins of an eye's lids: the loop of edges around the opening, as seen from the front."""

from __future__ import annotations

import numpy as np

from fba.arrays import Float64, Intp
from fba.face.authoring.surface.surface import Surface

REACH = 1.6
"""Distance from the eyeball's axis, in its radii, within which margins are sought."""
SEEN, HIDDEN = 0.02, 0.08
"""Depths behind the front of the eyeball, in its radii: a vertex is visible up to the first, surely hidden
beyond the second: eyeballs are not quite round, and some lids cut into them."""
LONGER = 1.1
"""Most length of a loop that is seen all around, by that of the shortest of which parts may be hidden."""
MOST_STARTS = 60
"""Most edges from which loops are sought."""


def find_eye_loop(surface: Surface, centre: Float64, radius: float) -> Intp:
    """(N,) vertices of the shortest loop of visible edges around an eye's axis, in order; empty without one.

    centre: (3,), radius: of the eyeball, in the unit of the surface. The face looks to +z. Lids are thick: of
    the loops around their back and their front edges, one that the eyeball does not hide is taken.
    """
    (seen, seen_length), (any_loop, length) = (
        _shortest_loop(surface, centre, radius, hidden) for hidden in (SEEN, HIDDEN)
    )
    return seen if seen_length < LONGER * length else any_loop


def _shortest_loop(surface: Surface, centre: Float64, radius: float, hidden: float) -> tuple[Intp, float]:
    """(vertices (N,) of the shortest loop around an eye's axis, its length; none and infinite without one).

    hidden: depth behind the front of the eyeball, in its radii, beyond which vertices do not count.
    """
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import dijkstra

    none = np.zeros(0, dtype=np.intp), np.inf
    arms = surface.vertices - centre
    across = np.hypot(arms[:, 0], arms[:, 1])
    front = np.sqrt(np.maximum(radius**2 - across**2, 0.0))
    visible = (across < REACH * radius) & (arms[:, 2] > front - hidden * radius)
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
    starts = starts[np.argsort(points[starts, 1], kind="stable")][:MOST_STARTS]
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
    """The vertices of a loop that are the middles of the lids and the corners of the eye.

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

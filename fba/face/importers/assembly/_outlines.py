"""Feature points on the openings and the outline of a head.

Margins of lids are a loop of edges around the eye, as seen from the front; lips, a loop of open edges of a
skin that ends there. Nose, lips and chin lie on the profile; crown, back and ears stand out.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping

import numpy as np

from fba.arrays import Bool, Float64, Intp
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
PROFILE_STEPS = 400
"""Number of heights at which the profile is sampled."""
FLAT_LIP = 0.48
"""Beyond this share of the height from the line of the lips to the tip of the nose, no lip is foremost."""
MIN_NOSE_DEPTH = 0.01
"""Least depth of the bottom of a nose behind the line from its tip to the lip, in distances of the pupils."""
MIN_CHIN_DISTANCE = 0.3
"""Distance of the chin from the lower lip at least, by that of the lips from the eyes; nearer is the lip."""


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


def lid_points_of_loop(points: Float64, loop: Intp, x: float) -> list[int]:
    """Return the vertices of a loop at the upper and lower lid and the left and right corner, or [].

    points: (N, 3) of the surface. x: of the pupil.
    """
    ring = points[loop]
    left, right = int(ring[:, 0].argmax()), int(ring[:, 0].argmin())
    first, last = sorted((left, right))
    inside = np.arange(first + 1, last)
    outside = np.concatenate([np.arange(last + 1, len(loop)), np.arange(first)])
    if not len(inside) or not len(outside):
        return []
    arcs = sorted((inside, outside), key=lambda arc: float(ring[arc, 1].mean()))
    lower, upper = (int(arc[np.abs(ring[arc, 0] - x).argmin()]) for arc in arcs)
    return [int(loop[row]) for row in (upper, lower, left, right)]


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


def profile_points(skin: Part, located: Mapping[str, Float64]) -> dict[str, Float64]:
    """Return 9.3, 9.15, 8.1, 8.2, 2.10, 2.1 on a skin's profile, and 11.4, 11.6, 10.3, 10.4 of the head.

    located: at least the pupils (3.5, 3.6) and the lips (2.2, 2.3). Points that do not show clearly are
    left out.
    """
    pupils = (located["3.5"] + located["3.6"]) / 2
    apart = float(located["3.5"][0] - located["3.6"][0])
    tall = float(pupils[1] - located["2.2"][1])
    result = _head(skin.vertices.astype(np.float64), pupils, apart)
    heights = np.linspace(located["2.3"][1] - 1.2 * tall, pupils[1], PROFILE_STEPS)
    front = _front(skin, float(pupils[0]), heights)
    if not np.isfinite(front).any():
        return result

    def point(index: int) -> Float64:
        return np.array([pupils[0], heights[index], front[index]])

    def foremost(low: float, high: float) -> int | None:
        inside = (heights > low) & (heights < high) & np.isfinite(front)
        return int(np.where(inside, front, -np.inf).argmax()) if inside.any() else None

    lip, tip = located["2.2"], foremost(located["2.2"][1] + 0.2 * tall, pupils[1] - 0.2 * tall)
    if tip is None:
        return result
    result["9.3"] = point(tip)
    upper = foremost(lip[1], float(lip[1] + 0.5 * (heights[tip] - lip[1])))
    if upper is not None:
        # drawn faces have hardly any lip: there the profile only rises towards the nose
        has_lip = bool(heights[upper] < lip[1] + FLAT_LIP * (heights[tip] - lip[1]))
        start = upper if has_lip else int(np.abs(heights - lip[1]).argmin())
        # the nose ends where the profile is furthest behind the line from its tip to the lip
        along = (heights - heights[start]) / (heights[tip] - heights[start])
        behind = front[start] + along * (front[tip] - front[start]) - front
        between = (np.arange(PROFILE_STEPS) > start) & (np.arange(PROFILE_STEPS) < tip) & np.isfinite(front)
        if between.any() and float(np.nanmax(behind[between])) > MIN_NOSE_DEPTH * apart:
            result |= {"8.1": point(upper)} if has_lip else {}
            result["9.15"] = point(int(np.where(between, behind, -np.inf).argmax()))
    chin = _hill(
        front,
        (heights > located["2.3"][1] - 0.8 * tall) & (heights < located["2.3"][1] - MIN_CHIN_DISTANCE * tall),
    )
    if chin is None:
        return result
    result["2.10"] = point(chin)
    dent = (heights > heights[chin]) & (heights < located["2.3"][1] - 0.02 * tall) & np.isfinite(front)
    if dent.any():
        # the lower lip ends between its foremost point and the dent above the chin
        low = int(np.where(dent, front, np.inf).argmin())
        lower = foremost(float(heights[low]), float(located["2.3"][1]))
        if lower is not None:
            result["8.2"] = point((low + 3 * lower) // 4)
    below = np.flatnonzero(
        np.isfinite(front) & (heights < heights[chin]) & (front > front[chin] - 0.3 * apart)
    )
    if len(below):
        result["2.1"] = point(int(below[0]))
    return result


def _front(skin: Part, x: float, heights: Float64) -> Float64:
    """Return the foremost z at each height where the skin cuts the plane at x; NaN where it does not."""
    vertices = skin.vertices.astype(np.float64)
    # a plane through vertices cuts twice or not at all; one beside them cuts once
    beside = x + 1e-5 * float(np.ptp(vertices[:, 0]))
    corners = vertices[skin.triangles]
    side = corners[:, :, 0] > beside
    corners = corners[side.any(axis=1) & ~side.all(axis=1)]
    ends: list[Float64] = []
    for a, b in itertools.pairwise((0, 1, 2, 0)):
        p, q = corners[:, a], corners[:, b]
        cuts = (p[:, 0] > beside) != (q[:, 0] > beside)
        share = np.where(cuts, (beside - p[:, 0]) / np.where(cuts, q[:, 0] - p[:, 0], 1.0), np.nan)
        ends.append(p[:, 1:] + share[:, None] * (q[:, 1:] - p[:, 1:]))
    three = np.stack(ends, axis=1)
    two = three[~np.isnan(three[:, :, 0])].reshape(-1, 2, 2)
    result = np.full(len(heights), np.nan)
    for start, end in two:
        low, high = sorted((start, end), key=lambda point: float(point[0]))
        inside = np.flatnonzero((heights >= low[0]) & (heights <= high[0]))
        rise = max(high[0] - low[0], 1e-12)
        depth = low[1] + (heights[inside] - low[0]) / rise * (high[1] - low[1])
        result[inside] = np.fmax(result[inside], depth)
    return result


def _hill(front: Float64, inside: Bool) -> int | None:
    """Return the index of the foremost local maximum of the profile within a stretch, or None."""
    around = np.stack([np.roll(front, shift) for shift in (-6, -3, -1, 1, 3, 6)])
    hills = inside & np.isfinite(front) & (front[None] >= np.nan_to_num(around, nan=-np.inf)).all(axis=0)
    return int(np.where(hills, front, -np.inf).argmax()) if hills.any() else None


def _head(vertices: Float64, pupils: Float64, apart: float) -> dict[str, Float64]:
    """Return crown and back of a whole head, and the ears where they stand out."""
    result: dict[str, Float64] = {}
    crown = vertices[int(vertices[:, 1].argmax())]
    if abs(crown[0] - pupils[0]) < 0.3 * apart and crown[1] > pupils[1] + apart:
        result["11.4"] = np.array([pupils[0], crown[1], crown[2]])
    level = np.abs(vertices[:, 1] - pupils[1] - 0.4 * apart) < 0.3 * apart
    if level.any():
        back = vertices[int(np.where(level, vertices[:, 2], np.inf).argmin())]
        if back[2] < pupils[2] - 1.8 * apart:
            result["11.6"] = np.array([pupils[0], back[1], back[2]])
    ears = (np.abs(vertices[:, 1] - pupils[1] + 0.2 * apart) < 0.6 * apart) & (
        vertices[:, 2] < pupils[2] - 0.9 * apart
    )
    temple = (np.abs(vertices[:, 1] - pupils[1] - apart) < 0.4 * apart) & (vertices[:, 2] < pupils[2])
    for name, sign in (("10.3", 1.0), ("10.4", -1.0)):
        out = (vertices[:, 0] - pupils[0]) * sign
        if ears.any() and temple.any():
            tip = int(np.where(ears, out, -np.inf).argmax())
            stands_out = ears & (out > out[temple].max())
            if out[tip] > out[temple].max() + 0.05 * apart:
                # What stands out most is the upper rim; the point is half way down.
                height = vertices[stands_out, 1]
                result[name] = np.array(
                    [vertices[tip, 0], (height.min() + height.max()) / 2, vertices[tip, 2]]
                )
    return result

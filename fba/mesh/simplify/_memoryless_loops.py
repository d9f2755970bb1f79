"""Compiled loops of `fba.mesh.simplify`: memoryless edge collapses that see a mesh in several poses.

Lindstrom and Turk, "Fast and Memory Efficient Polygonal Simplification" (1998), with the cost summed over
poses: each pose has the mesh's triangles at other positions. A vertex that comes to lie at rest at x lies in
each other pose at x plus the motion interpolated along the collapsed edge, as tables of shifts would move it.

Bounds: `_memoryless.py` makes every array for V vertices, W wedges and F triangles that it has checked; lists
of corners name corners of these triangles. No vertex with more than `MAX_RING` triangles is collapsed, and
scratch arrays have room for two such rings.
"""

from __future__ import annotations

from heapq import heappop, heappush
from typing import Any, NamedTuple

import numpy as np

from fba.arrays import Float64, Int32, Int64
from fba.compiled import compiled, inlined
from fba.mesh.simplify._balls import cut_depth, is_near

MAX_RING = 64
"""A vertex with more triangles than this takes no part in collapses."""
SURFACE_SHARE = 0.5
"""Lambda: the share of the surface's change in the cost; the rest is that of borders."""
SINE = float(np.sin(np.radians(1.0)))
COSINE = float(np.cos(np.radians(1.0)))
"""Of alpha, the least angle between a plane and those that determine a position already."""
MIN_TURN_COSINE = 0.2
"""No triangle may turn by more than the angle of this cosine, in any pose."""
MIN_COMPACTNESS = 0.1
"""No triangle becomes less compact than this, 1 for an equilateral one, while others can go."""
NEARLY = 1e-5
"""Share by which a way beside a line must be longer: positions are rounded when a line is looked for."""
MAX_CUT = 0.005
"""Depth to which triangles may cut a ball in a pose, as a share of its size."""
MAX_ON_LINE = 1 << 30
"""More vertices than a line has."""
FREE, ON_LINE, PINNED = 0, 1, 2
"""Vertices that may move; those on a border or seam, which only collapse along it; those that stay."""


class Surface(NamedTuple):
    """A mesh while it is simplified.

    places: float64 (V, K, 3), vertices in all poses, at rest first. triangles, wedges: int32 (F, 3), vertices
    and wedges of each corner; the first corner is -1 once the triangle is gone. first, follow: (V,) and
    (3 F,), the corners of each vertex as a linked list. kind: (V,). squares, normals, own: (V, K, 6), (V, 3)
    and (V,), around each vertex the summed squares n n' of the normals, their sum at rest, and their number.
    joined, changed: (V,), collapses done when another vertex joined each, or something around it changed.
    importance: (V,), factors of the cost. lines: (V,), a bit for each line through a vertex that is kept.
    ends: int32 (L, 2), the first and the last vertex of each line, -1 for a line that need not stay the
    shortest way between them. left, longest: int32 and float64 (L,), vertices left, and the first length.
    part, share: int32 (F,) and (P,), the part of each triangle, and how many each part has left. balls:
    float64 (B, 7 + N), what triangles must not cut in poses; see `_balls`.
    """

    places: Float64
    triangles: Int32
    wedges: Int32
    first: Int32
    follow: Int32
    kind: Int32
    squares: Float64
    normals: Float64
    own: Int32
    joined: Int64
    changed: Int64
    importance: Float64
    lines: Int64
    ends: Int32
    left: Int32
    longest: Float64
    part: Int32
    share: Int32
    balls: Float64


class History(NamedTuple):
    """Collapses in order, written for at most V.

    kept: (V,), the vertex that stays; place: (V, 3), where to; faces: (V,), triangles left. onto, step,
    wedge_onto, wedge_step: (V,) twice and (W,) twice, what each vertex or wedge joins, and in which collapse.
    """

    kept: Int32
    place: Float64
    faces: Int32
    onto: Int32
    step: Int32
    wedge_onto: Int32
    wedge_step: Int32


class Scratch(NamedTuple):
    """ring, near: int32, triangles and vertices around an edge. sums: (K, 13), of each pose: the quadratic as
    A (6), b (3), c, and the motion of one end relative to the other (3). total: (9,), A and b of their sum.
    planes, rows: (3, 4), normals and right sides, and (3, 3), directions in which a minimum is sought. place:
    (3,), relative to one end. squared: (1,), the sum of the squared normals of the ring. reach, steps:
    float64, infinite between uses, and int32 (V,), how far vertices are, by how many of a line."""

    ring: Int32
    near: Int32
    sums: Float64
    total: Float64
    planes: Float64
    rows: Float64
    place: Float64
    squared: Float64
    reach: Float64
    steps: Int32


@compiled
def link_corners(surface: Surface) -> None:
    """Write the lists of corners, and what is around each vertex."""
    for c in range(3 * len(surface.triangles) - 1, -1, -1):
        v = surface.triangles[c // 3, c % 3]
        surface.follow[c] = surface.first[v]
        surface.first[v] = c
    for v in range(len(surface.first)):
        _look_around(surface, v)


@inlined
def _normal(surface: Surface, t: int, k: int) -> tuple[float, float, float]:
    """Return the normal of a triangle in a pose, twice as long as the triangle is large."""
    places = surface.places
    p, q, r = surface.triangles[t, 0], surface.triangles[t, 1], surface.triangles[t, 2]
    ox, oy, oz = places[p, k, 0], places[p, k, 1], places[p, k, 2]
    ex, ey, ez = places[q, k, 0] - ox, places[q, k, 1] - oy, places[q, k, 2] - oz
    fx, fy, fz = places[r, k, 0] - ox, places[r, k, 1] - oy, places[r, k, 2] - oz
    return ey * fz - ez * fy, ez * fx - ex * fz, ex * fy - ey * fx


@inlined
def _add_square(sums: Float64, k: int, x: float, y: float, z: float, weight: float) -> None:
    """Add weight times the square n n' of a normal."""
    sums[k, 0] += weight * x * x
    sums[k, 1] += weight * x * y
    sums[k, 2] += weight * x * z
    sums[k, 3] += weight * y * y
    sums[k, 4] += weight * y * z
    sums[k, 5] += weight * z * z


@compiled
def _look_around(surface: Surface, v: int) -> None:
    """Write the normals around a vertex, their squares and their number."""
    squares, normals = surface.squares[v], surface.normals[v]
    squares[:] = 0.0
    normals[:] = 0.0
    surface.own[v] = 0
    c = surface.first[v]
    while c >= 0:
        if surface.triangles[c // 3, 0] >= 0:
            surface.own[v] += 1
            for k in range(len(squares)):
                x, y, z = _normal(surface, c // 3, k)
                _add_square(squares, k, x, y, z, 1.0)
                if k == 0:
                    normals[0] += x
                    normals[1] += y
                    normals[2] += z
        c = surface.follow[c]


@inlined
def _corner_of(triangles: Int32, t: int, v: int) -> int:
    """Return which corner of a triangle is v, -1 for none."""
    return 0 if triangles[t, 0] == v else (1 if triangles[t, 1] == v else (2 if triangles[t, 2] == v else -1))


@compiled
def _find_ring(surface: Surface, a: int, b: int, ring: Int32) -> int:
    """Write the triangles around a or b; return their number, or -1 where one has more than `MAX_RING`."""
    count = 0
    for v in (a, b):
        own = 0
        c = surface.first[v]
        while c >= 0:
            t = c // 3
            if surface.triangles[t, 0] >= 0:
                own += 1
                if own > MAX_RING:
                    return -1
                if v == a or _corner_of(surface.triangles, t, a) < 0:
                    ring[count] = t
                    count += 1
            c = surface.follow[c]
    return count


@compiled
def _is_line(surface: Surface, a: int, b: int) -> bool:
    """Return whether the edge from a to b belongs to a line, a border, or a seam whose sides both go on."""
    if surface.lines[a] & surface.lines[b]:
        return True
    triangles, wedges = surface.triangles, surface.wedges
    count, one, two, other_one, other_two = 0, -1, -1, -1, -1
    c = surface.first[a]
    while c >= 0:
        t = c // 3
        k = _corner_of(triangles, t, b)
        if triangles[t, 0] >= 0 and k >= 0:
            if count == 0:
                one, two = wedges[t, c % 3], wedges[t, k]
            else:
                other_one, other_two = wedges[t, c % 3], wedges[t, k]
            count += 1
        c = surface.follow[c]
    return count == 1 or (count == 2 and one != other_one and two != other_two)


@compiled
def _add_quadratic(sums: Float64, k: int, x: float, y: float, z: float, d: float, weight: float) -> None:
    """Add weight * ((x, y, z) . p - d)**2 to a quadratic."""
    sums[k, 0] += weight * x * x
    sums[k, 1] += weight * x * y
    sums[k, 2] += weight * x * z
    sums[k, 3] += weight * y * y
    sums[k, 4] += weight * y * z
    sums[k, 5] += weight * z * z
    sums[k, 6] += weight * d * x
    sums[k, 7] += weight * d * y
    sums[k, 8] += weight * d * z
    sums[k, 9] += weight * d * d


@compiled
def _add_line(surface: Surface, a: int, v: int, w: int, weight: float, sums: Float64) -> None:
    """Add the squared area between a border's edge from v to w and a position, in each pose."""
    places = surface.places
    for k in range(places.shape[1]):
        ux, uy, uz = (
            places[w, k, 0] - places[v, k, 0],
            places[w, k, 1] - places[v, k, 1],
            places[w, k, 2] - places[v, k, 2],
        )
        vx, vy, vz = (
            places[v, k, 0] - places[a, k, 0],
            places[v, k, 1] - places[a, k, 1],
            places[v, k, 2] - places[a, k, 2],
        )
        # p x u = v x u, one component after the other
        _add_quadratic(sums, k, 0.0, uz, -uy, vy * uz - vz * uy, weight)
        _add_quadratic(sums, k, -uz, 0.0, ux, vz * ux - vx * uz, weight)
        _add_quadratic(sums, k, uy, -ux, 0.0, vx * uy - vy * ux, weight)


@compiled
def _sum_changes(surface: Surface, a: int, b: int, scratch: Scratch) -> float:
    """Write the quadratics of an edge's cost, of positions relative to a, and the normal of the plane of
    equal volume, planes[0, :3]; return that plane's right side.

    Planes of triangles around a hold a, so that their quadratics about it are the squares of their normals;
    so do those around b about b. What both have in common counts once.
    """
    places, sums, normal = surface.places, scratch.sums, scratch.planes[0]
    scratch.planes[:] = 0.0
    for k in range(len(sums)):
        for i in range(6):
            sums[k, i] = surface.squares[b, k, i]
        for i in range(3):
            sums[k, 10 + i] = (places[b, k, i] - places[b, 0, i]) - (places[a, k, i] - places[a, 0, i])
    for i in range(3):
        normal[i] = surface.normals[b, i]
    c = surface.first[a]
    while c >= 0:
        if surface.triangles[c // 3, 0] >= 0 and _corner_of(surface.triangles, c // 3, b) >= 0:
            for k in range(len(sums)):
                x, y, z = _normal(surface, c // 3, k)
                _add_square(sums, k, x, y, z, -1.0)
                if k == 0:
                    normal[0] -= x
                    normal[1] -= y
                    normal[2] -= z
        c = surface.follow[c]
    volume = 0.0
    for i in range(3):
        volume += normal[i] * (places[b, 0, i] - places[a, 0, i])
        normal[i] += surface.normals[a, i]
    for k in range(len(sums)):
        x, y, z = (
            places[b, k, 0] - places[a, k, 0],
            places[b, k, 1] - places[a, k, 1],
            places[b, k, 2] - places[a, k, 2],
        )
        sums[k, 6] = sums[k, 0] * x + sums[k, 1] * y + sums[k, 2] * z
        sums[k, 7] = sums[k, 1] * x + sums[k, 3] * y + sums[k, 4] * z
        sums[k, 8] = sums[k, 2] * x + sums[k, 4] * y + sums[k, 5] * z
        sums[k, 9] = sums[k, 6] * x + sums[k, 7] * y + sums[k, 8] * z
        for i in range(6):
            sums[k, i] += surface.squares[a, k, i]
        if k == 0:
            scratch.squared[0] = sums[k, 0] + sums[k, 3] + sums[k, 5]
        for i in range(10):
            sums[k, i] *= SURFACE_SHARE / 36
    return volume


@compiled
def _add_lines(surface: Surface, a: int, b: int, count: int, weight: float, scratch: Scratch) -> None:
    """Add the changes of borders and seams around an edge to its cost."""
    for i in range(count):
        t = scratch.ring[i]
        for k in range(3):
            v, w = surface.triangles[t, k], surface.triangles[t, (k + 1) % 3]
            touches = v in (a, b) or w in (a, b)
            if touches and surface.kind[v] != FREE and surface.kind[w] != FREE and _is_line(surface, v, w):
                _add_line(surface, a, v, w, weight, scratch.sums)


@compiled
def _add_plane(planes: Float64, count: int, x: float, y: float, z: float, d: float) -> int:
    """Add the plane (x, y, z) . p = d to those that determine a position, unless it is nearly parallel to
    them; return their number."""
    squared = x * x + y * y + z * z
    if count == 0:
        fits = squared > 0.0
    elif count == 1:
        along = planes[0, 0] * x + planes[0, 1] * y + planes[0, 2] * z
        first = planes[0, 0] ** 2 + planes[0, 1] ** 2 + planes[0, 2] ** 2
        fits = along * along < first * squared * COSINE * COSINE
    else:
        cx, cy, cz = _cross(planes)
        triple = cx * x + cy * y + cz * z
        fits = triple * triple > (cx * cx + cy * cy + cz * cz) * squared * SINE * SINE
    if not fits:
        return count
    planes[count, 0], planes[count, 1], planes[count, 2], planes[count, 3] = x, y, z, d
    return count + 1


@compiled
def _cross(planes: Float64) -> tuple[float, float, float]:
    """Return the cross product of the normals of the first two planes."""
    return (
        planes[0, 1] * planes[1, 2] - planes[0, 2] * planes[1, 1],
        planes[0, 2] * planes[1, 0] - planes[0, 0] * planes[1, 2],
        planes[0, 0] * planes[1, 1] - planes[0, 1] * planes[1, 0],
    )


@compiled
def _add_minimum(count: int, scratch: Scratch) -> int:
    """Add planes through the constrained minimum of p.A.p / 2 - b.p, `total`; return their number."""
    planes, rows, s = scratch.planes, scratch.rows, scratch.total
    wanted = 3 - count
    if count == 0:
        rows[:] = 0.0
        rows[0, 0] = rows[1, 1] = rows[2, 2] = 1.0
    elif count == 1:
        least = 0
        for i in range(1, 3):
            if abs(planes[0, i]) < abs(planes[0, least]):
                least = i
        i, j = (least + 1) % 3, (least + 2) % 3
        rows[0, least], rows[0, i], rows[0, j] = 0.0, -planes[0, j], planes[0, i]
        for k in range(3):
            i, j = (k + 1) % 3, (k + 2) % 3
            rows[1, k] = planes[0, i] * rows[0, j] - planes[0, j] * rows[0, i]
    elif count == 2:
        rows[0, 0], rows[0, 1], rows[0, 2] = _cross(planes)
    for i in range(wanted):
        x, y, z = rows[i, 0], rows[i, 1], rows[i, 2]
        count = _add_plane(
            planes,
            count,
            x * s[0] + y * s[1] + z * s[2],
            x * s[1] + y * s[3] + z * s[4],
            x * s[2] + y * s[4] + z * s[5],
            x * s[6] + y * s[7] + z * s[8],
        )
    return count


@compiled
def _intersect(planes: Float64, place: Float64) -> bool:
    """Write the intersection of three planes; return whether it is finite."""
    cx, cy, cz = _cross(planes)
    whole = cx * planes[2, 0] + cy * planes[2, 1] + cz * planes[2, 2]
    if whole == 0.0:
        return False
    a, b = planes[0], planes[1]
    c = planes[2]
    fine = True
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        place[i] = (
            a[3] * (b[j] * c[k] - b[k] * c[j])
            + b[3] * (c[j] * a[k] - c[k] * a[j])
            + c[3] * (a[j] * b[k] - a[k] * b[j])
        ) / whole
        fine = fine and np.isfinite(place[i])
    return fine


@compiled
def _cost_at(sums: Float64, place: Float64, t: float) -> float:
    """Return the cost of a position relative to one end, with the motion at t along the edge."""
    cost = 0.0
    for k in range(len(sums)):
        x, y, z = place[0] + t * sums[k, 10], place[1] + t * sums[k, 11], place[2] + t * sums[k, 12]
        cost += sums[k, 0] * x * x + sums[k, 3] * y * y + sums[k, 5] * z * z
        cost += 2 * (sums[k, 1] * x * y + sums[k, 2] * x * z + sums[k, 4] * y * z)
        cost += sums[k, 9] - 2 * (sums[k, 6] * x + sums[k, 7] * y + sums[k, 8] * z)
    return max(cost, 0.0)


@compiled
def _cost_alone(surface: Surface, scratch: Scratch) -> float:
    """Return the cost of a triangle that touches no other, the only one in the ring, with which it goes as a
    whole. It counts as if it were as wide as it is long: a hair has little area, yet its lack is seen."""
    corners, squared = surface.triangles[scratch.ring[0]], 0.0
    for i in range(3):
        way = _distance(surface.places, corners[i], corners[(i + 1) % 3])
        squared = max(squared, way * way)
    scratch.squared[0] = squared * squared
    return float(surface.places.shape[1] * (1 - SURFACE_SHARE) / 2 * squared**3)


@compiled
def _find_place(surface: Surface, a: int, b: int, scratch: Scratch) -> tuple[float, float]:
    """Write where the edge from a to b is best collapsed to, relative to a; return the cost and where that
    is along the edge, 0 for a and 1 for b. The cost is -1 for an edge that must stay."""
    places, kind = surface.places, surface.kind
    if kind[a] == PINNED and kind[b] == PINNED:
        return -1.0, 0.0
    if kind[a] != FREE and kind[b] != FREE and not _is_line(surface, a, b):
        return -1.0, 0.0
    if surface.own[a] > MAX_RING or surface.own[b] > MAX_RING:
        return -1.0, 0.0
    ex, ey, ez = (
        places[b, 0, 0] - places[a, 0, 0],
        places[b, 0, 1] - places[a, 0, 1],
        places[b, 0, 2] - places[a, 0, 2],
    )
    squared = _square(ex, ey, ez)
    sums, place = scratch.sums, scratch.place
    if surface.own[a] == 1 and surface.own[b] == 1:
        _find_ring(surface, a, b, scratch.ring)
        place[:] = 0.0
        return _cost_alone(surface, scratch), 0.0
    volume = _sum_changes(surface, a, b, scratch)
    if kind[a] != FREE or kind[b] != FREE:  # one end stays
        count = _find_ring(surface, a, b, scratch.ring)
        _add_lines(surface, a, b, count, (1 - SURFACE_SHARE) * squared / 4, scratch)
        place[:] = 0.0
        at_a = _cost_at(sums, place, 0.0)
        place[0], place[1], place[2] = ex, ey, ez
        at_b = _cost_at(sums, place, 1.0)
        if kind[a] > kind[b] or (kind[a] == kind[b] and at_a <= at_b):
            place[:] = 0.0
            return at_a, 0.0
        return at_b, 1.0
    planes = scratch.planes
    found = _add_plane(planes, 0, planes[0, 0], planes[0, 1], planes[0, 2], volume)
    _add_poses(scratch)
    found = _add_minimum(found, scratch)
    if found < 3:
        count = _find_ring(surface, a, b, scratch.ring)
        _sum_neighbours(surface, a, b, count, scratch)
        found = _add_minimum(found, scratch)
    if found < 3 or not _intersect(planes, place):
        return -1.0, 0.0
    along = place[0] * ex + place[1] * ey + place[2] * ez
    t = min(max(along / squared, 0.0), 1.0) if squared > 0.0 else 0.5
    return _cost_at(sums, place, t), t


@compiled
def _add_poses(scratch: Scratch) -> None:
    """Write the sum of the quadratics of all poses, with the motion half way along the edge."""
    sums, total = scratch.sums, scratch.total
    total[:] = 0.0
    for k in range(len(sums)):
        for i in range(6):
            total[i] += sums[k, i]
        x, y, z = 0.5 * sums[k, 10], 0.5 * sums[k, 11], 0.5 * sums[k, 12]
        total[6] += sums[k, 6] - (sums[k, 0] * x + sums[k, 1] * y + sums[k, 2] * z)
        total[7] += sums[k, 7] - (sums[k, 1] * x + sums[k, 3] * y + sums[k, 4] * z)
        total[8] += sums[k, 8] - (sums[k, 2] * x + sums[k, 4] * y + sums[k, 5] * z)


@compiled
def _priority(surface: Surface, a: int, b: int, scratch: Scratch) -> tuple[float, float]:
    """Return the cost of an edge by which edges are ordered, and where along it the collapse goes.

    That is the cost over the area around the edge, so that a finely modelled region, whose triangles are
    small, is not the first to go, times the importance of its ends that may move. -1 for an edge that must
    stay.
    """
    cost, along = _find_place(surface, a, b, scratch)
    if cost > 0.0 and scratch.squared[0] > 0.0:
        one = surface.importance[b if surface.kind[a] == PINNED else a]
        other = surface.importance[a if surface.kind[b] == PINNED else b]
        cost *= 0.5 * (one + other) / np.sqrt(scratch.squared[0])
    return cost, along


@compiled
def _sum_neighbours(surface: Surface, a: int, b: int, count: int, scratch: Scratch) -> None:
    """Write the quadratic of the squared distances to the corners around an edge."""
    total = scratch.total
    total[:] = 0.0
    for i in range(count):
        for k in range(3):
            v = surface.triangles[scratch.ring[i], k]
            if v in (a, b):
                continue
            total[0] += 1.0
            total[3] += 1.0
            total[5] += 1.0
            for n in range(3):
                total[6 + n] += surface.places[v, 0, n] - surface.places[a, 0, n]


@compiled
def _add_neighbours(surface: Surface, v: int, near: Int32, count: int) -> int:
    """Append the neighbours of v that are not listed yet; return the number of all."""
    c = surface.first[v]
    while c >= 0:
        if surface.triangles[c // 3, 0] >= 0:
            for k in range(3):
                w = surface.triangles[c // 3, k]
                new = w != v
                for i in range(count):
                    new = new and near[i] != w
                if new:
                    near[count] = w
                    count += 1
        c = surface.follow[c]
    return count


@compiled
def _is_valid(surface: Surface, a: int, b: int, scratch: Scratch) -> bool:
    """Return whether the mesh stays a manifold of the same topology when the edge from a to b collapses."""
    near = scratch.near
    own = _add_neighbours(surface, a, near, 0)
    both = _add_neighbours(surface, b, near, own)
    # b is a neighbour of a, and a becomes one of b
    common = 0
    c = surface.first[b]
    seen = np.zeros(own, dtype=np.bool_)
    while c >= 0:
        if surface.triangles[c // 3, 0] >= 0:
            for k in range(3):
                w = surface.triangles[c // 3, k]
                for i in range(own):
                    if near[i] == w and w != b:
                        seen[i] = True
        c = surface.follow[c]
    for i in range(own):
        common += seen[i]
    faces, one = 0, -1
    c = surface.first[a]
    while c >= 0:
        t = c // 3
        if surface.triangles[t, 0] >= 0 and _corner_of(surface.triangles, t, b) >= 0:
            faces, one = faces + 1, t
            if _loses_corner(surface, a, b, t):
                return False
        c = surface.follow[c]
    if faces == 1 and both == 3:
        return _may_go(surface, one)
    border = _on_border(surface, a) or _on_border(surface, b)
    if _on_border(surface, a) and _on_border(surface, b) and faces != 1:
        return False
    return common == faces and 1 <= faces <= 2 and both > (3 if border else 4)


@compiled
def _loses_corner(surface: Surface, a: int, b: int, t: int) -> bool:
    """Return whether the corner of a triangle beside its edge from a to b stays, and is in no other one."""
    v, others = surface.triangles[t].sum() - a - b, 0
    c = surface.first[v]
    while c >= 0:
        others += surface.triangles[c // 3, 0] >= 0 and c // 3 != t
        c = surface.follow[c]
    return bool(surface.kind[v] == PINNED and others == 0)


@compiled
def _may_go(surface: Surface, t: int) -> bool:
    """Return whether a triangle that touches no other may go: not the last of its part, nor one with a vertex
    that stays, by itself or as one of a line."""
    free = surface.share[surface.part[t]] > 1
    for k in range(3):
        v = surface.triangles[t, k]
        free = free and surface.kind[v] != PINNED and surface.lines[v] == 0
    return bool(free)


@compiled
def _cuts_line(surface: Surface, a: int, b: int, scratch: Scratch) -> bool:
    """Return whether the shortest way between a line's ends would leave it when the edge from a to b
    collapses; only a way by the vertex that is left can be a new one."""
    places, place, lines = surface.places, scratch.place, surface.lines
    was, had = places[a, 0].copy(), lines[a]
    for i in range(3):
        places[a, 0, i] += place[i]
    lines[a] |= lines[b]
    cuts = False
    for line in range(len(surface.ends)):
        start: Any = np.int64(surface.ends[line, 0])
        end: Any = np.int64(surface.ends[line, 1])
        if start >= 0 and not cuts:
            by = _distance(places, start, a) + _distance(places, a, end)
            both = had & lines[b] & (np.int64(1) << line)
            wanted = surface.left[line] - (1 if both else 0)
            cuts = by <= surface.longest[line] and leaves_line(surface, line, a, b, wanted, scratch)
    places[a, 0], lines[a] = was, had
    return cuts


@compiled
def leaves_line(surface: Surface, line: int, a: int, b: int, wanted: int, scratch: Scratch) -> bool:
    """Return whether the shortest way between a line's ends is not along its vertices, `wanted` in number.

    b counts as a. Ways that are longer than the line has ever been are not followed (A*).
    """
    places, reach, steps = surface.places, scratch.reach, scratch.steps
    bit, most = np.int64(1) << line, surface.longest[line] * (1 + NEARLY)
    start: Any = np.int64(surface.ends[line, 0])
    end: Any = np.int64(surface.ends[line, 1])
    start, end = a if start == b else start, a if end == b else end
    reach[start], steps[start], steps[end] = 0.0, 1, 0
    touched = [start]
    heap = [(0.0, start)]
    while len(heap) > 0:
        way, v = heappop(heap)
        if v == end:
            break
        if way > reach[v]:
            continue
        for side in range(2 if v == a else 1):
            c = surface.first[v if side == 0 else b]
            while c >= 0:
                for k in range(1, 3):
                    w: Any = np.int64(surface.triangles[c // 3, (c % 3 + k) % 3])
                    w = a if w == b else w
                    if surface.triangles[c // 3, 0] >= 0 and w != v:
                        along = surface.lines[v] & surface.lines[w] & bit
                        step = _distance(places, v, w)
                        to_w = way + (step if along else step * (1 - NEARLY))
                        if to_w < reach[w] and to_w + _distance(places, w, end) <= most:
                            reach[w], steps[w] = to_w, steps[v] + 1 if along else -MAX_ON_LINE
                            touched.append(w)
                            heappush(heap, (to_w, w))
                c = surface.follow[c]
    for v in touched:
        reach[v] = np.inf
    return bool(steps[end] != wanted)


@inlined
def _distance(places: Float64, v: int, w: int) -> float:
    """Return the distance of two vertices at rest."""
    x, y, z = (
        places[v, 0, 0] - places[w, 0, 0],
        places[v, 0, 1] - places[w, 0, 1],
        places[v, 0, 2] - places[w, 0, 2],
    )
    return float(np.sqrt(_square(x, y, z)))


@compiled
def _on_border(surface: Surface, v: int) -> bool:
    """Return whether an edge of v belongs to one triangle only: then two corners around it occur once."""
    if surface.kind[v] == FREE:
        return False
    c = surface.first[v]
    while c >= 0:
        t = c // 3
        if surface.triangles[t, 0] >= 0:
            for k in range(1, 3):
                w = surface.triangles[t, (c % 3 + k) % 3]
                count = 0
                d = surface.first[v]
                while d >= 0:
                    if surface.triangles[d // 3, 0] >= 0 and _corner_of(surface.triangles, d // 3, w) >= 0:
                        count += 1
                    d = surface.follow[d]
                if count == 1:
                    return True
        c = surface.follow[c]
    return False


@compiled
def _turns_over(
    surface: Surface, a: int, b: int, t: float, count: int, least: float, scratch: Scratch
) -> bool:
    """Return whether a triangle would turn too far in a pose, lose its area, or become a sliver at rest."""
    places, place = surface.places, scratch.place
    for i in range(count):
        own = scratch.ring[i]
        at_a, at_b = _corner_of(surface.triangles, own, a), _corner_of(surface.triangles, own, b)
        if at_a >= 0 and at_b >= 0:
            continue
        at = max(at_a, at_b)
        v, p = surface.triangles[own, at], surface.triangles[own, (at + 1) % 3]
        q = surface.triangles[own, (at + 2) % 3]
        for k in range(places.shape[1]):
            ex, ey, ez = (
                places[q, k, 0] - places[p, k, 0],
                places[q, k, 1] - places[p, k, 1],
                places[q, k, 2] - places[p, k, 2],
            )
            ux, uy, uz = (
                places[v, k, 0] - places[p, k, 0],
                places[v, k, 1] - places[p, k, 1],
                places[v, k, 2] - places[p, k, 2],
            )
            wx = places[a, k, 0] + place[0] + t * scratch.sums[k, 10] - places[p, k, 0]
            wy = places[a, k, 1] + place[1] + t * scratch.sums[k, 11] - places[p, k, 1]
            wz = places[a, k, 2] + place[2] + t * scratch.sums[k, 12] - places[p, k, 2]
            ax, ay, az = ey * uz - ez * uy, ez * ux - ex * uz, ex * uy - ey * ux
            bx, by, bz = ey * wz - ez * wy, ez * wx - ex * wz, ex * wy - ey * wx
            before, after = ax * ax + ay * ay + az * az, bx * bx + by * by + bz * bz
            if before > 0.0 and ax * bx + ay * by + az * bz <= MIN_TURN_COSINE * np.sqrt(before * after):
                return True
            if k == 0:
                edge = ex * ex + ey * ey + ez * ez
                was = np.sqrt(before) / (edge + _square(ux, uy, uz) + _square(ux - ex, uy - ey, uz - ez))
                now = np.sqrt(after) / (edge + _square(wx, wy, wz) + _square(wx - ex, wy - ey, wz - ez))
                if now < was and now < least / (2 * np.sqrt(3.0)):
                    return True
    return False


@compiled
def _cuts_ball(surface: Surface, a: int, b: int, t: float, count: int, scratch: Scratch) -> bool:
    """Return whether a triangle would cut a ball in a pose, and deeper than those around the edge do."""
    for n in range(len(surface.balls)):
        if is_near(surface.balls, n, surface.places, a):
            ball = surface.balls[n]
            after = _deepest(surface, ball, a, b, t, count, scratch)
            if after > MAX_CUT and after > _deepest(surface, ball, -1, -1, t, count, scratch):
                return True
    return False


@compiled
def _deepest(
    surface: Surface, ball: Float64, a: int, b: int, t: float, count: int, scratch: Scratch
) -> float:
    """Return how deep the triangles of the ring cut a ball, in the worst pose, where the edge from a to b has
    collapsed; -1 twice for as they are."""
    places, corners, deepest = surface.places, np.empty((2, 3, 3)), 0.0
    for i in range(count):
        own = scratch.ring[i]
        if (
            a >= 0
            and _corner_of(surface.triangles, own, a) >= 0
            and _corner_of(surface.triangles, own, b) >= 0
        ):
            continue
        for k in range(places.shape[1]):
            for at in range(3):
                v = surface.triangles[own, at]
                for n in range(3):
                    if v in (a, b):
                        corners[min(k, 1), at, n] = (
                            places[a, k, n] + scratch.place[n] + t * scratch.sums[k, 10 + n]
                        )
                    else:
                        corners[min(k, 1), at, n] = places[v, k, n]
            if k > 0:
                deepest = max(deepest, cut_depth(ball, corners[0], corners[1]))
    return deepest


@inlined
def _square(x: float, y: float, z: float) -> float:
    """Return the squared length of a vector."""
    return x * x + y * y + z * z


@compiled
def collapse_edges(
    surface: Surface, history: History, done: int, faces: int, target: int, scratch: Scratch
) -> int:
    """Collapse the cheapest edges first until at most `target` triangles are left or none can go.

    done, faces: collapses in the history so far, and triangles left. Where only one more triangle may go, an
    edge of a border goes, if there is any. Return the number of collapses in the history.
    """
    triangles, joined, changed = surface.triangles, surface.joined, surface.changed
    refused = np.zeros(len(joined), dtype=np.bool_)
    before, least = -1, MIN_COMPACTNESS
    while faces > target and (before != done or least > 0.0):
        if before == done:
            least = 0.0  # slivers are better than more triangles than asked for
        before = done
        heap: list[tuple[float, Any, Any, Any]] = [(0.0, np.int64(0), np.int64(0), np.int64(0))]
        heap.pop()
        for t in range(len(triangles)):
            for k in range(3):
                a, b = triangles[t, k], triangles[t, (k + 1) % 3]
                if triangles[t, 0] >= 0 and (a < b or not _has_edge(surface, b, a)):
                    cost, _ = _priority(surface, a, b, scratch)
                    if cost >= 0.0:
                        heappush(heap, (cost, np.int64(a), np.int64(b), np.int64(done)))
        while len(heap) > 0 and faces > target:
            _, a, b, stamp = heappop(heap)
            if history.onto[a] != a or history.onto[b] != b or stamp < max(joined[a], joined[b]):
                continue  # the edge is gone, or is in the heap again
            cost, along = _priority(surface, a, b, scratch)
            if cost < 0.0:
                continue
            if stamp < max(changed[a], changed[b]):
                heappush(heap, (cost, a, b, np.int64(done)))
                continue
            count = _find_ring(surface, a, b, scratch.ring)
            lost = 0
            for i in range(count):
                t = scratch.ring[i]
                lost += _corner_of(triangles, t, a) >= 0 and _corner_of(triangles, t, b) >= 0
            if faces - lost < target:
                continue
            if not _may_collapse(surface, a, b, along, count, least, scratch):
                refused[a] = refused[b] = True
                continue
            kind, other = surface.kind[a], surface.kind[b]
            if other > kind or (other == kind and kind != FREE and along > 0.0):
                _collapse(surface, history, b, a, along, done, scratch)
                a = b
            else:
                _collapse(surface, history, a, b, along, done, scratch)
            faces -= lost
            history.faces[done] = faces
            done += 1
            around = _add_neighbours(surface, a, scratch.near, 0)
            joined[a] = changed[a] = done
            _look_around(surface, a)
            for i in range(around):
                changed[scratch.near[i]] = done
                _look_around(surface, scratch.near[i])
            for i in range(around):
                near: Any = np.int64(scratch.near[i])
                cost, _ = _priority(surface, a, near, scratch)
                if cost >= 0.0:
                    heappush(heap, (cost, a, near, np.int64(done)))
                c = surface.first[near] if refused[near] else np.int32(-1)
                refused[near] = False
                while c >= 0:  # what was in the way may be gone
                    next_one: Any = np.int64(triangles[c // 3, (c % 3 + 1) % 3])
                    if triangles[c // 3, 0] >= 0 and refused[next_one]:
                        cost, _ = _priority(surface, near, next_one, scratch)
                        if cost >= 0.0:
                            heappush(heap, (cost, near, next_one, np.int64(done)))
                    c = surface.follow[c]
    return done


@compiled
def _may_collapse(
    surface: Surface, a: int, b: int, along: float, count: int, least: float, scratch: Scratch
) -> bool:
    """Return whether an edge whose ring and place were found may collapse. least: compactness; 0 for the last
    resort, which lets triangles cut lines and balls."""
    if _turns_over(surface, a, b, along, count, least, scratch) or not _is_valid(surface, a, b, scratch):
        return False
    if least <= 0.0:
        return True
    return not (_cuts_line(surface, a, b, scratch) or _cuts_ball(surface, a, b, along, count, scratch))


@compiled
def _has_edge(surface: Surface, a: int, b: int) -> bool:
    """Return whether a triangle has an edge from a to b, in this direction."""
    c = surface.first[a]
    while c >= 0:
        t = c // 3
        if surface.triangles[t, 0] >= 0 and surface.triangles[t, (c % 3 + 1) % 3] == b:
            return True
        c = surface.follow[c]
    return False


@compiled
def _collapse(
    surface: Surface, history: History, keep: int, gone: int, along: float, step: int, scratch: Scratch
) -> None:
    """Collapse `gone` onto `keep` at the evaluated position, and write it to the history.

    The position in scratch is relative to the end that was evaluated as the first: along counts from it.
    """
    triangles, wedges, places = surface.triangles, surface.wedges, surface.places
    moves = surface.kind[keep] == FREE
    if moves:
        for k in range(places.shape[1]):
            for i in range(3):
                places[keep, k, i] += scratch.place[i] + along * scratch.sums[k, 10 + i]
    for i in range(3):
        history.place[step, i] = places[keep, 0, i]
    history.kept[step] = keep
    history.onto[gone] = keep
    history.step[gone] = step
    for line in range(len(surface.ends)):
        surface.left[line] -= (surface.lines[keep] & surface.lines[gone]) >> line & 1
        for i in range(2):
            if surface.ends[line, i] == gone:
                surface.ends[line, i] = keep
    surface.lines[keep] |= surface.lines[gone]
    last = -1
    c = surface.first[gone]
    while c >= 0:  # wedges on the two sides of the edge become one
        t = c // 3
        if triangles[t, 0] >= 0:
            k = _corner_of(triangles, t, keep)
            if k >= 0:
                old, new = wedges[t, c % 3], wedges[t, k]
                if history.wedge_onto[old] == old and old != new:
                    history.wedge_onto[old] = new
                    history.wedge_step[old] = step
        last = c
        c = surface.follow[c]
    c = surface.first[gone]
    while c >= 0:
        t, k = c // 3, c % 3
        if triangles[t, 0] >= 0:
            wedges[t, k] = history.wedge_onto[wedges[t, k]]
            if _corner_of(triangles, t, keep) >= 0:
                triangles[t, 0] = -1
                surface.share[surface.part[t]] -= 1
            else:
                triangles[t, k] = keep
        c = surface.follow[c]
    surface.follow[last] = surface.first[keep]
    surface.first[keep] = surface.first[gone]
    surface.first[gone] = -1
    _drop_dead(surface, keep)


@compiled
def _drop_dead(surface: Surface, v: int) -> None:
    """Take corners of triangles that are gone off the list of v."""
    last, c = -1, surface.first[v]
    while c >= 0:
        following = surface.follow[c]
        if surface.triangles[c // 3, 0] < 0:
            if last < 0:
                surface.first[v] = following
            else:
                surface.follow[last] = following
        else:
            last = c
        c = following

"""What a memoryless collapse costs, and where along the edge it goes: Lindstrom and Turk's, over poses.

Bounds: see `_memoryless_mesh.py`.
"""

from __future__ import annotations

import numpy as np

from fba.arrays import Float64
from fba.compiled import compiled
from fba.mesh.simplify._memoryless_mesh import (
    FREE,
    MAX_RING,
    PINNED,
    Scratch,
    Surface,
    add_square,
    corner_of,
    distance,
    find_normal,
    find_ring,
    is_line,
    square,
)

SURFACE_SHARE = 0.5
"""Lambda: the share of the surface's change in the cost; the rest is that of borders."""
SINE = float(np.sin(np.radians(1.0)))
COSINE = float(np.cos(np.radians(1.0)))
"""Of alpha, the least angle between a plane and those that determine a position already."""


@compiled
def _add_quadratic(sums: Float64, k: int, x: float, y: float, z: float, d: float, weight: float) -> None:
    """Add weight * ((x, y, z) . p - d)**2 to a quadratic."""
    add_square(sums, k, x, y, z, weight)
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
        if surface.triangles[c // 3, 0] >= 0 and corner_of(surface.triangles, c // 3, b) >= 0:
            for k in range(len(sums)):
                x, y, z = find_normal(surface, c // 3, k)
                add_square(sums, k, x, y, z, -1.0)
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
            if touches and surface.kind[v] != FREE and surface.kind[w] != FREE and is_line(surface, v, w):
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
        way = distance(surface.places, corners[i], corners[(i + 1) % 3])
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
    if kind[a] != FREE and kind[b] != FREE and not is_line(surface, a, b):
        return -1.0, 0.0
    if surface.own[a] > MAX_RING or surface.own[b] > MAX_RING:
        return -1.0, 0.0
    ex, ey, ez = (
        places[b, 0, 0] - places[a, 0, 0],
        places[b, 0, 1] - places[a, 0, 1],
        places[b, 0, 2] - places[a, 0, 2],
    )
    squared = square(ex, ey, ez)
    sums, place = scratch.sums, scratch.place
    if surface.own[a] == 1 and surface.own[b] == 1:
        find_ring(surface, a, b, scratch.ring)
        place[:] = 0.0
        return _cost_alone(surface, scratch), 0.0
    volume = _sum_changes(surface, a, b, scratch)
    if kind[a] != FREE or kind[b] != FREE:  # one end stays
        count = find_ring(surface, a, b, scratch.ring)
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
        count = find_ring(surface, a, b, scratch.ring)
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
def priority(surface: Surface, a: int, b: int, scratch: Scratch) -> tuple[float, float]:
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

"""Compiled loops of `fba.mesh.simplify`: edges are collapsed where that changes the surface least.

Garland and Heckbert's quadrics, "Simplifying Surfaces with Color and Texture using Quadric Error Metrics"
(1998), for points of any dimension. One end of each collapsed edge stays where it is, so the vertices that
remain are some of the original ones.

Bounds: `simplify_by_quadrics` checks that corners are vertices, of which there are V points, and makes every
array for V vertices and 3 F corners. `Fans` list the triangles as they are; those that collapse name goals,
which are corners of others. Poses have three coordinates each in points.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fba.arrays import Bool, Float64, Int32, Int64
from fba.compiled import compiled, inlined

BORDER_WEIGHT = 2.0
"""Weight of a border relative to the surface."""
MAX_TRIANGLES_AROUND = 64
"""A vertex with more triangles than this is never removed."""
MAX_TURN_COSINE = 0.3
"""No triangle may turn by more than the angle of this cosine."""
MIN_HEIGHT_SHARE = 0.05
"""Least height of a triangle, as a share of its longest side, unless it was thinner before."""


class Fans(NamedTuple):
    """The triangles around each vertex: those of v are owners[start[v] : start[v + 1]]; see `around`."""

    triangles: Int32
    start: Int64
    owners: Int32


class Quadrics(NamedTuple):
    """Each vertex's quadric x.a.x + 2 b.x + c, (V, N, N), (V, N) and (V,), and its weight w (V,)."""

    a: Float64
    b: Float64
    c: Float64
    w: Float64


class Fixed(NamedTuple):
    """What keeps vertices: border, locked, bool (V,), and the largest squared error."""

    border: Bool
    locked: Bool
    limit: float


@compiled
def around(triangles: Int32, count: int, start: Int64, owners: Int32) -> None:
    """Write the triangles of each vertex: those of v are owners[start[v] : start[v + 1]]."""
    start[:] = 0
    for t in range(len(triangles)):
        for k in range(3):
            start[triangles[t, k] + 1] += 1
    for v in range(count):
        start[v + 1] += start[v]
    free = start.copy()
    for t in range(len(triangles)):
        for k in range(3):
            v = triangles[t, k]
            owners[free[v]] = t
            free[v] += 1


@inlined
def _count_triangles(fans: Fans, a: int, b: int) -> int:
    """Return the number of triangles with an edge from a to b."""
    count = 0
    for o in range(fans.start[a], fans.start[a + 1]):
        other = fans.triangles[fans.owners[o]]
        if other[0] == b or other[1] == b or other[2] == b:
            count += 1
    return count


@compiled
def borders(fans: Fans, border: Bool) -> None:
    """Mark vertices with an edge that belongs to one triangle only."""
    triangles = fans.triangles
    for t in range(len(triangles)):
        for k in range(3):
            a, b = triangles[t, k], triangles[t, (k + 1) % 3]
            if _count_triangles(fans, a, b) == 1:
                border[a] = border[b] = True


@compiled
def _unit(vector: Float64) -> float:
    """Scale a vector to length 1 in place and return the length that it had."""
    squared = 0.0
    for i in range(len(vector)):
        squared += vector[i] * vector[i]
    length: float = np.sqrt(squared)
    if length > 1e-12:
        for i in range(len(vector)):
            vector[i] /= length
    return length


@compiled
def _add(points: Float64, p: int, e: Float64, f: Float64, weight: float, sums: Quadrics, v: int) -> None:
    """Add to the quadric of v the squared distance to the plane that e and f span at the point p."""
    n = len(e)
    a, b, c, _ = sums
    pe, pf, pp = 0.0, 0.0, 0.0
    for i in range(n):
        pe += points[p, i] * e[i]
        pf += points[p, i] * f[i]
        pp += points[p, i] * points[p, i]
    for i in range(n):
        for j in range(n):
            a[v, i, j] -= weight * (e[i] * e[j] + f[i] * f[j])
        a[v, i, i] += weight
        b[v, i] += weight * (pe * e[i] + pf * f[i] - points[p, i])
    c[v] += weight * (pp - pe * pe - pf * pf)


@compiled
def add_quadrics(points: Float64, fans: Fans, sums: Quadrics) -> None:
    """Add to each vertex's quadric the squared distances to planes of its triangles and to its borders."""
    triangles = fans.triangles
    n = points.shape[1]
    e, f = np.zeros(n), np.zeros(n)
    for t in range(len(triangles)):
        p, q, r = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        along = 0.0
        for i in range(n):
            e[i] = points[q, i] - points[p, i]
            f[i] = points[r, i] - points[p, i]
        length = _unit(e)
        for i in range(n):
            along += f[i] * e[i]
        for i in range(n):
            f[i] -= along * e[i]
        high = _unit(f)
        if not (length > 1e-12 and high > 1e-12):
            continue
        for k in range(3):
            _add(points, p, e, f, 0.5 * length * high, sums, triangles[t, k])
            sums.w[triangles[t, k]] += 0.5 * length * high
        f[:] = 0.0
        for k in range(3):
            one, two = triangles[t, k], triangles[t, (k + 1) % 3]
            if _count_triangles(fans, one, two) != 1:
                continue
            for i in range(n):
                e[i] = points[two, i] - points[one, i]
            length = _unit(e)
            if length > 1e-12:
                _add(points, one, e, f, BORDER_WEIGHT * length * length, sums, one)
                _add(points, one, e, f, BORDER_WEIGHT * length * length, sums, two)


@inlined
def _apart(points: Float64, a: int, b: int, i: int) -> tuple[float, float, float]:
    return (
        points[a, i] - points[b, i],
        points[a, i + 1] - points[b, i + 1],
        points[a, i + 2] - points[b, i + 2],
    )


@compiled
def _fits(points: Float64, poses: int, fans: Fans, u: int, v: int) -> bool:
    """Return whether no triangle around u turns over or becomes a splinter when u goes to v, in any pose."""
    for o in range(fans.start[u], fans.start[u + 1]):
        corners = fans.triangles[fans.owners[o]]
        if corners[0] == v or corners[1] == v or corners[2] == v:
            continue
        k = 0 if corners[0] == u else (1 if corners[1] == u else 2)
        x, y = corners[(k + 1) % 3], corners[(k + 2) % 3]
        for pose in range(poses):
            i = 3 * pose
            ex, ey, ez = _apart(points, y, x, i)
            ux, uy, uz = _apart(points, u, x, i)
            vx, vy, vz = _apart(points, v, x, i)
            ax, ay, az = ey * uz - ez * uy, ez * ux - ex * uz, ex * uy - ey * ux
            bx, by, bz = ey * vz - ez * vy, ez * vx - ex * vz, ex * vy - ey * vx
            before, after = ax * ax + ay * ay + az * az, bx * bx + by * by + bz * bz
            if ax * bx + ay * by + az * bz <= MAX_TURN_COSINE * np.sqrt(before * after):
                return False
            edge = ex * ex + ey * ey + ez * ez
            u_far = (ux - ex) ** 2 + (uy - ey) ** 2 + (uz - ez) ** 2
            v_far = (vx - ex) ** 2 + (vy - ey) ** 2 + (vz - ez) ** 2
            longest_before = max(edge, ux * ux + uy * uy + uz * uz, u_far)
            longest_after = max(edge, vx * vx + vy * vy + vz * vz, v_far)
            if np.sqrt(after) < MIN_HEIGHT_SHARE * longest_after and (
                after * longest_before * longest_before < before * longest_after * longest_after
            ):
                return False
    return True


@compiled
def _find_neighbours(fans: Fans, u: int, near: Int32, shared: Int32) -> int:
    """Write the neighbours of u, and how many triangles each shares with it; return their number."""
    count = 0
    for o in range(fans.start[u], fans.start[u + 1]):
        for k in range(3):
            v = fans.triangles[fans.owners[o], k]
            if v == u:
                continue
            place = 0
            while place < count and near[place] != v:
                place += 1
            if place < count:
                shared[place] += 1
            else:
                near[count], shared[count] = v, 1
                count += 1
    return count


@compiled
def _squared_error(points: Float64, sums: Quadrics, u: int, v: int) -> float:
    """Return the mean squared distance that u has moved from its planes when it goes to v."""
    x, n = points[v], points.shape[1]
    error = sums.c[u]
    for j in range(n):
        row = 2.0 * sums.b[u, j]
        for k in range(n):
            row += sums.a[u, j, k] * x[k]
        error += row * x[j]
    mean: float = error / max(sums.w[u], 1e-30)
    return mean


@compiled
def candidates(
    points: Float64, poses: int, fans: Fans, fixed: Fixed, sums: Quadrics, goal: Int32, cost: Float64
) -> int:
    """Write the neighbour that each vertex is best collapsed onto, or -1, and the squared error; return how
    many vertices have one.

    Bounds: at most MAX_TRIANGLES_AROUND triangles with two corners each besides the vertex are near it.
    """
    near = np.empty(2 * MAX_TRIANGLES_AROUND, dtype=np.int32)
    shared = np.empty(2 * MAX_TRIANGLES_AROUND, dtype=np.int32)
    count_with_goal = 0
    for u in range(len(points)):
        goal[u] = -1
        around_u = fans.start[u + 1] - fans.start[u]
        if fixed.locked[u] or around_u == 0 or around_u > MAX_TRIANGLES_AROUND:
            continue
        count = _find_neighbours(fans, u, near, shared)
        best = fixed.limit
        for i in range(count):
            v = near[i]
            if shared[i] > 2 or (fixed.border[u] and (shared[i] != 1 or not fixed.border[v])):
                continue
            error = _squared_error(points, sums, u, v)
            if not error < best:
                continue
            joint = 0  # common neighbours of the ends: more than triangles at the edge make it non-manifold
            for k in range(count):
                if near[k] != v and _count_triangles(fans, v, near[k]) > 0:
                    joint += 1
            if joint != shared[i] or not _fits(points, poses, fans, u, v):
                continue
            best = error
            goal[u] = v
        if goal[u] >= 0:
            cost[u] = best
            count_with_goal += 1
    return count_with_goal


@compiled
def collapse(order: Int64, goal: Int32, fans: Fans, touched: Bool, onto: Int32, sums: Quadrics) -> int:
    """Collapse vertices onto their goals in this order, none next to another; return how many.

    Triangles that lose their area keep two equal corners. onto: (V,), written: what each vertex collapsed to.
    """
    triangles, start, owners = fans
    a, b, c, w = sums
    touched[:] = False
    done = 0
    for u in order:
        v = goal[u]
        free = not touched[v]
        for o in range(start[u], start[u + 1]):
            for k in range(3):
                free = free and not touched[triangles[owners[o], k]]
        if not free:
            continue
        for o in range(start[u], start[u + 1]):
            for k in range(3):
                touched[triangles[owners[o], k]] = True
        for o in range(start[u], start[u + 1]):
            for k in range(3):
                if triangles[owners[o], k] == u:
                    triangles[owners[o], k] = v
        for i in range(a.shape[1]):
            for j in range(a.shape[1]):
                a[v, i, j] += a[u, i, j]
            b[v, i] += b[u, i]
        c[v] += c[u]
        w[v] += w[u]
        onto[u] = v
        done += 1
    return done

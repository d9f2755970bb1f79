"""A mesh while memoryless collapses simplify it: what they read and write, and who is around whom.

Bounds: `_memoryless.py` makes every array for V vertices, W wedges and F triangles that it has checked; lists
of corners name corners of these triangles. No vertex with more than `MAX_RING` triangles is collapsed, and
scratch arrays have room for two such rings.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fba.arrays import Float64, Int32, Int64
from fba.compiled import compiled, inlined

MAX_RING = 64
"""A vertex with more triangles than this takes no part in collapses."""
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
        look_around(surface, v)


@inlined
def find_normal(surface: Surface, t: int, k: int) -> tuple[float, float, float]:
    """Return the normal of a triangle in a pose, twice as long as the triangle is large."""
    places = surface.places
    p, q, r = surface.triangles[t, 0], surface.triangles[t, 1], surface.triangles[t, 2]
    ox, oy, oz = places[p, k, 0], places[p, k, 1], places[p, k, 2]
    ex, ey, ez = places[q, k, 0] - ox, places[q, k, 1] - oy, places[q, k, 2] - oz
    fx, fy, fz = places[r, k, 0] - ox, places[r, k, 1] - oy, places[r, k, 2] - oz
    return ey * fz - ez * fy, ez * fx - ex * fz, ex * fy - ey * fx


@inlined
def add_square(sums: Float64, k: int, x: float, y: float, z: float, weight: float) -> None:
    """Add weight times the square n n' of a normal."""
    sums[k, 0] += weight * x * x
    sums[k, 1] += weight * x * y
    sums[k, 2] += weight * x * z
    sums[k, 3] += weight * y * y
    sums[k, 4] += weight * y * z
    sums[k, 5] += weight * z * z


@compiled
def look_around(surface: Surface, v: int) -> None:
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
                x, y, z = find_normal(surface, c // 3, k)
                add_square(squares, k, x, y, z, 1.0)
                if k == 0:
                    normals[0] += x
                    normals[1] += y
                    normals[2] += z
        c = surface.follow[c]


@inlined
def corner_of(triangles: Int32, t: int, v: int) -> int:
    """Return which corner of a triangle is v, -1 for none."""
    return 0 if triangles[t, 0] == v else (1 if triangles[t, 1] == v else (2 if triangles[t, 2] == v else -1))


@compiled
def find_ring(surface: Surface, a: int, b: int, ring: Int32) -> int:
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
                if v == a or corner_of(surface.triangles, t, a) < 0:
                    ring[count] = t
                    count += 1
            c = surface.follow[c]
    return count


@compiled
def is_line(surface: Surface, a: int, b: int) -> bool:
    """Return whether the edge from a to b belongs to a line, a border, or a seam whose sides both go on."""
    if surface.lines[a] & surface.lines[b]:
        return True
    triangles, wedges = surface.triangles, surface.wedges
    count, one, two, other_one, other_two = 0, -1, -1, -1, -1
    c = surface.first[a]
    while c >= 0:
        t = c // 3
        k = corner_of(triangles, t, b)
        if triangles[t, 0] >= 0 and k >= 0:
            if count == 0:
                one, two = wedges[t, c % 3], wedges[t, k]
            else:
                other_one, other_two = wedges[t, c % 3], wedges[t, k]
            count += 1
        c = surface.follow[c]
    return count == 1 or (count == 2 and one != other_one and two != other_two)


@compiled
def add_neighbours(surface: Surface, v: int, near: Int32, count: int) -> int:
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
def has_edge(surface: Surface, a: int, b: int) -> bool:
    """Return whether a triangle has an edge from a to b, in this direction."""
    c = surface.first[a]
    while c >= 0:
        t = c // 3
        if surface.triangles[t, 0] >= 0 and surface.triangles[t, (c % 3 + 1) % 3] == b:
            return True
        c = surface.follow[c]
    return False


@inlined
def square(x: float, y: float, z: float) -> float:
    """Return the squared length of a vector."""
    return x * x + y * y + z * z


@inlined
def distance(places: Float64, v: int, w: int) -> float:
    """Return the distance of two vertices at rest."""
    x, y, z = (
        places[v, 0, 0] - places[w, 0, 0],
        places[v, 0, 1] - places[w, 0, 1],
        places[v, 0, 2] - places[w, 0, 2],
    )
    return float(np.sqrt(square(x, y, z)))

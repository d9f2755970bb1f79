"""Which edges memoryless collapses may not take: rules of surface, shape, lines and balls.

Bounds: see `_memoryless_mesh.py`.
"""

from __future__ import annotations

from heapq import heappop, heappush
from typing import Any

import numpy as np

from fba.arrays import Float64
from fba.compiled import compiled
from fba.mesh.simplify._balls import cut_depth, is_near
from fba.mesh.simplify._memoryless_mesh import (
    FREE,
    PINNED,
    Scratch,
    Surface,
    add_neighbours,
    corner_of,
    distance,
    square,
)

MIN_TURN_COSINE = 0.2
"""No triangle may turn by more than the angle of this cosine, in any pose."""
NEARLY = 1e-5
"""Share by which a way beside a line must be longer: positions are rounded when a line is looked for."""
MAX_CUT = 0.005
"""Depth to which triangles may cut a ball in a pose, as a share of its size."""
MAX_ON_LINE = 1 << 30
"""More vertices than a line has."""


@compiled
def _is_valid(surface: Surface, a: int, b: int, scratch: Scratch) -> bool:
    """Return whether the mesh stays a manifold of the same topology when the edge from a to b collapses."""
    near = scratch.near
    own = add_neighbours(surface, a, near, 0)
    both = add_neighbours(surface, b, near, own)
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
        if surface.triangles[t, 0] >= 0 and corner_of(surface.triangles, t, b) >= 0:
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
            by = distance(places, start, a) + distance(places, a, end)
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
                        step = distance(places, v, w)
                        to_w = way + (step if along else step * (1 - NEARLY))
                        if to_w < reach[w] and to_w + distance(places, w, end) <= most:
                            reach[w], steps[w] = to_w, steps[v] + 1 if along else -MAX_ON_LINE
                            touched.append(w)
                            heappush(heap, (to_w, w))
                c = surface.follow[c]
    for v in touched:
        reach[v] = np.inf
    return bool(steps[end] != wanted)


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
                    if surface.triangles[d // 3, 0] >= 0 and corner_of(surface.triangles, d // 3, w) >= 0:
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
        at_a, at_b = corner_of(surface.triangles, own, a), corner_of(surface.triangles, own, b)
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
                was = np.sqrt(before) / (edge + square(ux, uy, uz) + square(ux - ex, uy - ey, uz - ez))
                now = np.sqrt(after) / (edge + square(wx, wy, wz) + square(wx - ex, wy - ey, wz - ez))
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
        if a >= 0 and corner_of(surface.triangles, own, a) >= 0 and corner_of(surface.triangles, own, b) >= 0:
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


@compiled
def may_collapse(
    surface: Surface, a: int, b: int, along: float, count: int, least: float, scratch: Scratch
) -> bool:
    """Return whether an edge whose ring and place were found may collapse. least: compactness; 0 for the last
    resort, which lets triangles cut lines and balls."""
    if _turns_over(surface, a, b, along, count, least, scratch) or not _is_valid(surface, a, b, scratch):
        return False
    if least <= 0.0:
        return True
    return not (_cuts_line(surface, a, b, scratch) or _cuts_ball(surface, a, b, along, count, scratch))

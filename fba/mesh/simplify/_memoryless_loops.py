"""Compiled loops of `fba.mesh.simplify`: memoryless edge collapses that see a mesh in several poses.

Lindstrom and Turk, "Fast and Memory Efficient Polygonal Simplification" (1998), with the cost summed over
poses: each pose has the mesh's triangles at other positions. A vertex that comes to lie at rest at x lies in
each other pose at x plus the motion interpolated along the collapsed edge, as tables of shifts would move it.

Bounds: see `_memoryless_mesh.py`.
"""

from __future__ import annotations

from heapq import heappop, heappush
from typing import Any

import numpy as np

from fba.compiled import compiled
from fba.mesh.simplify._memoryless_costs import priority
from fba.mesh.simplify._memoryless_mesh import (
    FREE,
    History,
    Scratch,
    Surface,
    add_neighbours,
    corner_of,
    find_ring,
    has_edge,
    look_around,
)
from fba.mesh.simplify._memoryless_rules import may_collapse

MIN_COMPACTNESS = 0.1
"""No triangle becomes less compact than this, 1 for an equilateral one, while others can go."""


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
                if triangles[t, 0] >= 0 and (a < b or not has_edge(surface, b, a)):
                    cost, _ = priority(surface, a, b, scratch)
                    if cost >= 0.0:
                        heappush(heap, (cost, np.int64(a), np.int64(b), np.int64(done)))
        while len(heap) > 0 and faces > target:
            _, a, b, stamp = heappop(heap)
            if history.onto[a] != a or history.onto[b] != b or stamp < max(joined[a], joined[b]):
                continue  # the edge is gone, or is in the heap again
            cost, along = priority(surface, a, b, scratch)
            if cost < 0.0:
                continue
            if stamp < max(changed[a], changed[b]):
                heappush(heap, (cost, a, b, np.int64(done)))
                continue
            count = find_ring(surface, a, b, scratch.ring)
            lost = 0
            for i in range(count):
                t = scratch.ring[i]
                lost += corner_of(triangles, t, a) >= 0 and corner_of(triangles, t, b) >= 0
            if faces - lost < target:
                continue
            if not may_collapse(surface, a, b, along, count, least, scratch):
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
            around = add_neighbours(surface, a, scratch.near, 0)
            joined[a] = changed[a] = done
            look_around(surface, a)
            for i in range(around):
                changed[scratch.near[i]] = done
                look_around(surface, scratch.near[i])
            for i in range(around):
                near: Any = np.int64(scratch.near[i])
                cost, _ = priority(surface, a, near, scratch)
                if cost >= 0.0:
                    heappush(heap, (cost, a, near, np.int64(done)))
                c = surface.first[near] if refused[near] else np.int32(-1)
                refused[near] = False
                while c >= 0:  # what was in the way may be gone
                    next_one: Any = np.int64(triangles[c // 3, (c % 3 + 1) % 3])
                    if triangles[c // 3, 0] >= 0 and refused[next_one]:
                        cost, _ = priority(surface, near, next_one, scratch)
                        if cost >= 0.0:
                            heappush(heap, (cost, near, next_one, np.int64(done)))
                    c = surface.follow[c]
    return done


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
            k = corner_of(triangles, t, keep)
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
            if corner_of(triangles, t, keep) >= 0:
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

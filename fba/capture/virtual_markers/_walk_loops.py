"""Compiled loops of the walk over a mesh from the centre of a virtual marker."""

from __future__ import annotations

import numpy as np

from fba.arrays import Float64, Int64
from fba.compiled import compiled


@compiled
def list_triangles(triangles: Int64, starts: Int64, listed: Int64) -> None:
    """List the triangles of each vertex, in their order.

    triangles: (F, 3). starts: (V + 1,), zeros, becomes where each vertex begins in `listed`: (3 F,).

    Bounds: `WalkedMesh` checks that corners are below V; `listed` has a place for each of them.
    """
    count = len(starts) - 1
    for triangle in range(len(triangles)):
        for corner in range(3):
            starts[triangles[triangle, corner] + 1] += 1
    for vertex in range(count):
        starts[vertex + 1] += starts[vertex]
    filled = starts[:count].copy()
    for triangle in range(len(triangles)):
        for corner in range(3):
            vertex = triangles[triangle, corner]
            listed[filled[vertex]] = triangle
            filled[vertex] += 1


@compiled
def walk_from(
    centre: int,
    radius: float,
    depth: float,
    number: int,
    vertices: Float64,
    triangles: Int64,
    starts: Int64,
    listed: Int64,
    tested: Int64,
    found: Int64,
    away: Float64,
    levels: Int64,
) -> int:
    """Walk from a centre over the triangles as long as vertices are inside its cylinder; return how many are.

    number: differs in each call with the same `tested`, (V,), which notes the vertices met. found, away,
    levels: (V,), the vertices inside in the order in which they are met, their distances from the centre, and
    the steps to them, 1 for the centre itself.

    Bounds: the centre and corners are below V, as `WalkedMesh` checks. A vertex is found once, as it is
    tested first: no more than V are.
    """
    x, y, z = vertices[centre, 0], vertices[centre, 1], vertices[centre, 2]
    tested[centre] = number
    found[0], away[0], levels[0] = centre, 0.0, 1
    count, visited = 1, 0
    while visited < count:
        vertex = found[visited]
        level = levels[visited] + 1
        visited += 1
        for entry in range(starts[vertex], starts[vertex + 1]):
            triangle = listed[entry]
            for corner in range(3):
                other = triangles[triangle, corner]
                if tested[other] == number:
                    continue
                tested[other] = number
                right, up = vertices[other, 0] - x, vertices[other, 1] - y
                front = vertices[other, 2] - z
                beside = right * right + up * up
                if beside < radius * radius and abs(front) <= depth:
                    found[count] = other
                    away[count] = np.sqrt(beside + front * front)
                    levels[count] = level
                    count += 1
    return count

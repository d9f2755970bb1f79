"""The vertices that a virtual marker moves: a walk over the mesh from its centre, within a cylinder."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fba.arrays import Bool, Float64, Int64, Integer, Intp
from fba.compiled import compiled
from fba.errors import ModelError

MAX_SHARES = 30_000_000
"""Largest total number of vertices that virtual markers move; each takes 16 bytes."""


@dataclass(frozen=True, eq=False)
class Influence:
    """The vertices that a virtual marker moves.

    vertices: intp (K,), the centre first, in the order of the walk. distances: float64 (K,) from the centre,
    in the unit of the mesh. levels: intp (K,), 1 for the centre, 2 for its neighbours, and so on. radius: of
    the cylinder. given: float64 (K,), shares that do not follow from the distance; None if they do.
    """

    vertices: Intp
    distances: Float64
    levels: Intp
    radius: float
    given: Float64 | None = None

    @property
    def shares(self) -> Float64:
        """float64 (K,): the share of the marker's displacement by which each moves, 1 at the centre.

        It is 0 at the edge, and at the ends of a cylinder that is longer than wide.
        """
        if self.given is not None:
            return self.given
        return np.maximum(1.0 - self.distances / self.radius, 0.0)

    def select(self, kept: Bool) -> Influence:
        """Return the influence without the vertices that are not kept (K,)."""
        given = None if self.given is None else self.given[kept]
        return Influence(self.vertices[kept], self.distances[kept], self.levels[kept], self.radius, given)


class WalkedMesh:
    """A mesh that is prepared for walks. vertices: float64 (V, 3). triangles: (F, 3).

    Raises ModelError for triangles of vertices that it does not have.
    """

    def __init__(self, vertices: Float64, triangles: Integer) -> None:
        self.vertices = np.ascontiguousarray(vertices, dtype=np.float64)
        self.triangles: Int64 = np.ascontiguousarray(triangles, dtype=np.int64)
        count = len(self.vertices)
        if self.triangles.size and not 0 <= self.triangles.min() <= self.triangles.max() < count:
            raise ModelError(
                f"triangles name vertices that there are not: the mesh has {count}, counted from 0"
            )

    def walk(self, centres: Sequence[tuple[int, float, float]]) -> list[Influence]:
        """Return the influence of each (centre vertex, radius, depth).

        A vertex is inside if it is nearer than `radius` to the centre in x and y, and at most `depth` before
        or behind it in z. The walk goes from the centre to all other corners of its triangles, and on from
        those that are inside. So an upper lip does not move the lower lip, however near it is. Time is linear
        in the visited vertices. Raises ModelError for a centre that is no vertex, sizes that are not positive
        numbers, and influences that would not fit into memory.
        """
        count = len(self.vertices)
        starts, listed = self._listed
        tested = np.full(count, -1, dtype=np.int64)
        found, away, levels = np.empty(count, np.int64), np.empty(count), np.empty(count, np.int64)
        result = []
        total = 0
        for number, (centre, radius, depth) in enumerate(centres):
            if not 0 <= centre < count:
                raise ModelError(f"there is no vertex {centre}: the mesh has {count}, counted from 0")
            if not (0 < radius < np.inf and 0 < depth < np.inf):
                raise ModelError(f"radius and depth must be positive numbers, not {radius:g} and {depth:g}")
            size = _walk_from(
                centre, float(radius), float(depth), number, self.vertices, self.triangles, starts, listed,
                tested, found, away, levels,
            )  # fmt: skip
            total += size
            if total > MAX_SHARES:
                raise ModelError(
                    f"the first {number + 1} virtual markers move {total} vertices together, more than "
                    f"{MAX_SHARES}; give them smaller radii"
                )
            inside = found[:size].astype(np.intp)
            result.append(Influence(inside, away[:size].copy(), levels[:size].astype(np.intp), float(radius)))
        return result

    @cached_property
    def _listed(self) -> tuple[Int64, Int64]:
        starts = np.zeros(len(self.vertices) + 1, dtype=np.int64)
        listed = np.empty(self.triangles.size, dtype=np.int64)
        _list_triangles(self.triangles, starts, listed)
        return starts, listed


def find_influence(
    vertices: Float64, triangles: Integer, centre: int, radius: float, depth: float | None = None
) -> Influence:
    """Return the vertices that a virtual marker moves.

    vertices: float64 (V, 3), in one unit with radius and depth, z to the front. triangles: (F, 3). centre: a
    vertex. depth: half the length of the cylinder; None for the radius. Errors as of `WalkedMesh.walk`.
    """
    return WalkedMesh(vertices, triangles).walk([(centre, radius, radius if depth is None else depth)])[0]


def give_to_nearest(influences: Sequence[Influence]) -> list[Influence]:
    """Return influences without common vertices: each vertex stays with the nearest centre, or the first."""
    if not influences:
        return []
    vertices = np.concatenate([each.vertices for each in influences])
    distances = np.concatenate([each.distances for each in influences])
    owner = np.repeat(np.arange(len(influences)), [len(each.vertices) for each in influences])
    order = np.lexsort((owner, distances, vertices))
    first = np.ones(len(order), dtype=bool)
    first[1:] = vertices[order][1:] != vertices[order][:-1]
    kept = np.zeros(len(order), dtype=bool)
    kept[order[first]] = True
    ends = np.cumsum([len(each.vertices) for each in influences])[:-1]
    return [each.select(mine) for each, mine in zip(influences, np.split(kept, ends), strict=True)]


@compiled
def _list_triangles(triangles: Int64, starts: Int64, listed: Int64) -> None:
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
def _walk_from(
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

    number: differs in each call with the same `tested`, (V,), which notes the visited vertices. found, away,
    levels: (V,), the vertices inside in the order of the walk, their distances from the centre, and the steps
    to them, 1 for the centre.

    Bounds: the centre and corners are below V, as `WalkedMesh` checks. Each vertex is tested, and found, at
    most once, so no more than V are.
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

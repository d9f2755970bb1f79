"""Meshes as tuples, and operations on their polygons: tubes, mirror images, edges, averages."""

from __future__ import annotations

import numpy as np

from fba.arrays import Float64, Int64

Mesh = tuple[Float64, Int64, Float64]
"""Vertices (V, 3), metres; triangles (F, 3); colours (V, 4), linear light, the fourth how glossy."""


def join(meshes: list[Mesh]) -> Mesh:
    """Return several meshes as one."""
    vertices, triangles, colours = zip(*meshes, strict=True)
    starts = np.cumsum([0, *(len(part) for part in vertices)])[:-1]
    numbered = [part + start for part, start in zip(triangles, starts, strict=True)]
    return np.concatenate(vertices), np.concatenate(numbered), np.concatenate(colours)


def mirror(mesh: Mesh) -> Mesh:
    """Return the mirror image of a mesh on the other side of the face."""
    vertices, triangles, colours = mesh
    return vertices * (-1.0, 1.0, 1.0), triangles[:, ::-1].copy(), colours


def tube(rings: int, around: int) -> Int64:
    """Return triangles between successive rings of `around` vertices each."""
    grid = np.arange(rings * around).reshape(rings, around)
    after = np.roll(grid, -1, axis=1)
    return np.stack([grid[:-1], grid[1:], after[1:], grid[:-1], after[1:], after[:-1]], axis=-1).reshape(
        -1, 3
    )


def sides(polygons: Int64) -> Int64:
    """Return (F * K, 2) the sides of polygons (F, K), in their direction."""
    return np.stack([polygons, np.roll(polygons, -1, axis=1)], axis=-1).reshape(-1, 2)


def unique_edges(polygons: Int64) -> Int64:
    """Return (E, 2) each edge of polygons (F, K) once, smaller vertex first; doubled corners have no edge."""
    pairs = sides(polygons)
    return np.unique(np.sort(pairs[pairs[:, 0] != pairs[:, 1]], axis=1), axis=0)


def open_edges(polygons: Int64) -> Int64:
    """Return (E, 2) edges of one polygon only, in its direction."""
    pairs = sides(polygons)
    _, inverse, counts = np.unique(np.sort(pairs, axis=1), axis=0, return_inverse=True, return_counts=True)
    return pairs[counts[inverse.ravel()] == 1]


def average_with_neighbours(rows: Float64, edges: Int64) -> Float64:
    """Return rows (V, N) averaged with those at the other ends of edges (E, 2)."""
    total, count = rows.copy(), np.ones((len(rows), 1))
    for a, b in (edges.T, edges[:, ::-1].T):
        np.add.at(total, a, rows[b])
        np.add.at(count, a, 1)
    return total / count


def blade_triangles(segments: int) -> Int64:
    """Return triangles of a strip that ends in a point: pairs of vertices along it, one at its tip."""
    triangles = []
    for k in range(segments - 1):
        a, b, c, d = 2 * k, 2 * k + 1, 2 * k + 2, 2 * k + 3
        triangles += [[a, b, d], [a, d, c]]
    last = 2 * (segments - 1)
    return np.array([*triangles, [last, last + 1, last + 2]])

"""Normals that follow a moving surface, each computed from the positions of four neighbours of its vertex.

To rotate a normal with its vertex would be wrong where a crease opens or a joint stretches the skin, as
between thumb and hand: neighbouring vertices rotate differently there.
"""

from __future__ import annotations

import numpy as np

from fba.arrays import Array, Float32, Float64, Int32, Int64, Integer
from fba.cache import load_or_make, make_key

FLATTEST = 0.05
"""Smallest sine of the angle between the two lines across a vertex that still define a normal."""
CACHED_VERTICES = 4000
"""Number of vertices from which results for a mesh are cached on disk."""
CACHE_VERSION = 1
"""Version of cached results; increment when results change."""


def normal_rings(vertices: Float32, normals: Float32, triangles: Integer) -> tuple[Int32, Float32]:
    """Return four neighbours of each vertex, int32 (V, 4), and coefficients x, y, z, float32 (V, 3).

    With t = v[0] - v[2] and u = v[1] - v[3] of the neighbours v, the normal is x t + y u + z (t x u): that of
    the mesh as modelled, and rotated as the mesh is. The neighbours are -1 where they define no normal.
    """
    count = len(vertices)
    if count < CACHED_VERTICES or not len(triangles):
        return _find_rings(vertices, normals, triangles)

    def make() -> list[Array]:
        return list(_find_rings(vertices, normals, triangles))

    key = make_key("rings", CACHE_VERSION, vertices, normals, triangles)
    neighbours, coefficients = load_or_make(key, ((count, 4), (count, 3)), make, [np.int32, np.float32])
    if neighbours.min() < -1 or neighbours.max() >= count:
        neighbours, coefficients = make()
    return neighbours, coefficients


def _find_rings(vertices: Float32, normals: Float32, triangles: Integer) -> tuple[Int32, Float32]:
    """Return what `normal_rings` documents, without the disk cache."""
    count = len(vertices)
    neighbours = np.full((count, 4), -1, dtype=np.int32)
    coefficients = np.zeros((count, 3), dtype=np.float32)
    if not len(triangles):
        return neighbours, coefficients
    # Coinciding vertices count as one: seams between colours are not edges of the surface.
    _, first, same = np.unique(vertices, axis=0, return_index=True, return_inverse=True)
    same = same.ravel()
    centre, other = _neighbours(same[triangles])
    positions, axes = vertices[first].astype(np.float64), normals[first].astype(np.float64)
    edges = positions[other] - positions[centre]
    starts = np.flatnonzero(np.diff(centre, prepend=-1))
    owners = centre[starts]
    angles = _angles_about_normals(edges, axes[centre], starts)
    table = np.full((len(first), 4), -1, dtype=np.int64)
    for slot in range(4):
        table[owners, slot] = _nearest_to_angle(angles, slot * np.pi / 2, other, centre, starts)
    four = first[np.where(table < 0, np.arange(len(first))[:, None], table)][same]
    t = (vertices[four[:, 0]] - vertices[four[:, 2]]).astype(np.float64)
    u = (vertices[four[:, 1]] - vertices[four[:, 3]]).astype(np.float64)
    across = np.cross(t, u)
    length = np.linalg.norm(across, axis=1)
    sine = length / np.maximum(np.linalg.norm(t, axis=1) * np.linalg.norm(u, axis=1), 1e-30)
    defined = sine > FLATTEST
    frame = np.stack([t, u, across], axis=2)[defined]
    solved = np.linalg.solve(frame, normals[defined].astype(np.float64)[..., None])[..., 0]
    neighbours[defined] = four[defined]
    coefficients[defined] = solved
    return neighbours, coefficients


def _neighbours(triangles: Int64) -> tuple[Int64, Int64]:
    """Return the first and the second vertex of each edge, in both directions, sorted by the first."""
    sides = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=-1).reshape(-1, 2)
    sides = sides[sides[:, 0] != sides[:, 1]]
    count = int(triangles.max()) + 1  # a pair as one number: rows take ten times as long to sort
    first, second = np.concatenate([sides, sides[:, ::-1]]).astype(np.int64).T
    pairs = np.unique(first * count + second)
    return pairs // count, pairs % count


def _angles_about_normals(edges: Float64, axes: Float64, starts: Int64) -> Float64:
    """Return the angle of each edge about its vertex's normal, from the vertex's first edge, 0 to 2 pi."""
    sizes = np.diff(np.append(starts, len(edges)))
    reference = np.repeat(edges[starts], sizes, axis=0)
    aside = np.cross(axes, reference)
    flat = np.cross(aside, axes)
    angle = np.arctan2((edges * aside).sum(axis=1), (edges * flat).sum(axis=1))
    return np.asarray(np.mod(angle, 2 * np.pi))


def _nearest_to_angle(angles: Float64, wanted: float, other: Int64, centre: Int64, starts: Int64) -> Int64:
    """Return each vertex's neighbour nearest to an angle; the vertex itself if none is within 60 degrees."""
    distance = np.abs(np.mod(angles - wanted + np.pi, 2 * np.pi) - np.pi)
    order = np.lexsort((distance, centre))
    best = order[starts]
    return np.where(distance[best] < np.pi / 3, other[best], centre[best])

"""Normals that follow a moving surface, each from the positions of four neighbours of its vertex.

Rotating a normal with its vertex is wrong where a crease opens or a joint stretches the skin, as between
thumb and hand, because neighbours are rotated differently there.
"""

from __future__ import annotations

import numpy as np

from fba.arrays import Array, Float32, Float64, Int32, Int64, Integer
from fba.cache import load_or_make, make_key

FLATTEST = 0.05
"""Smallest sine between the two lines across a vertex that still defines a normal."""
LARGE = 4000
"""Results for meshes of this many vertices or more are cached on disk."""
CACHE_VERSION = 1
"""Version of cached results; increment when results change."""


def normal_rings(vertices: Float32, normals: Float32, triangles: Integer) -> tuple[Int32, Float32]:
    """Return (four neighbours of each vertex (V, 4), -1 where these give no normal; coefficients (V, 3)).

    With t = v[0] - v[2] and u = v[1] - v[3] of the neighbours, x t + y u + z (t x u) is the normal of the
    mesh as modelled, for the coefficients x, y, z, and stays so under any rotation of the mesh.
    """
    count = len(vertices)
    if count < LARGE or not len(triangles):
        return _find_rings(vertices, normals, triangles)

    def make() -> list[Array]:
        return list(_find_rings(vertices, normals, triangles))

    key = make_key("rings", CACHE_VERSION, vertices, normals, triangles)
    around, numbers = load_or_make(key, ((count, 4), (count, 3)), make, [np.int32, np.float32])
    if around.min() < -1 or around.max() >= count:
        around, numbers = make()
    return around, numbers


def _find_rings(vertices: Float32, normals: Float32, triangles: Integer) -> tuple[Int32, Float32]:
    count = len(vertices)
    around = np.full((count, 4), -1, dtype=np.int32)
    numbers = np.zeros((count, 3), dtype=np.float32)
    if not len(triangles):
        return around, numbers
    # Coinciding vertices are merged: seams between colours are not edges of the surface.
    _, first, same = np.unique(vertices, axis=0, return_index=True, return_inverse=True)
    same = same.ravel()
    centre, other = _neighbours(same[triangles])
    places, upright = vertices[first].astype(np.float64), normals[first].astype(np.float64)
    ways = places[other] - places[centre]
    starts = np.flatnonzero(np.diff(centre, prepend=-1))
    owner = centre[starts]
    turn = _angles_about_normals(ways, upright[centre], starts)
    table = np.full((len(first), 4), -1, dtype=np.int64)
    for slot in range(4):
        table[owner, slot] = _nearest_to_angle(turn, slot * np.pi / 2, other, centre, starts)
    four = first[np.where(table < 0, np.arange(len(first))[:, None], table)][same]
    t = (vertices[four[:, 0]] - vertices[four[:, 2]]).astype(np.float64)
    u = (vertices[four[:, 1]] - vertices[four[:, 3]]).astype(np.float64)
    across = np.cross(t, u)
    length = np.linalg.norm(across, axis=1)
    sine = length / np.maximum(np.linalg.norm(t, axis=1) * np.linalg.norm(u, axis=1), 1e-30)
    useful = sine > FLATTEST
    frame = np.stack([t, u, across], axis=2)[useful]
    solved = np.linalg.solve(frame, normals[useful].astype(np.float64)[..., None])[..., 0]
    around[useful] = four[useful]
    numbers[useful] = solved
    return around, numbers


def _neighbours(triangles: Int64) -> tuple[Int64, Int64]:
    """Return (first, second) of all pairs of joined vertices, in both directions, sorted by the first."""
    sides = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=-1).reshape(-1, 2)
    sides = sides[sides[:, 0] != sides[:, 1]]
    count = int(triangles.max()) + 1  # pairs as one number: rows take ten times as long to sort
    first, second = np.concatenate([sides, sides[:, ::-1]]).astype(np.int64).T
    pairs = np.unique(first * count + second)
    return pairs // count, pairs % count


def _angles_about_normals(ways: Float64, upright: Float64, starts: Int64) -> Float64:
    """Return angle of each edge about its vertex's normal, from the vertex's first edge, 0 to 2 pi."""
    sizes = np.diff(np.append(starts, len(ways)))
    reference = np.repeat(ways[starts], sizes, axis=0)
    aside = np.cross(upright, reference)
    flat = np.cross(aside, upright)
    angle = np.arctan2((ways * aside).sum(axis=1), (ways * flat).sum(axis=1))
    turn: Float64 = np.mod(angle, 2 * np.pi)
    return turn


def _nearest_to_angle(turn: Float64, wanted: float, other: Int64, centre: Int64, starts: Int64) -> Int64:
    """Return each vertex's neighbour nearest to an angle; the vertex itself if none is within 60 degrees."""
    off = np.abs(np.mod(turn - wanted + np.pi, 2 * np.pi) - np.pi)
    order = np.lexsort((off, centre))
    best = order[starts]
    return np.where(off[best] < np.pi / 3, other[best], centre[best])

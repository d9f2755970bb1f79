"""Normals that follow a moving surface: each from two ways across it between neighbours of its vertex.

Turning a normal as its vertex is turned is wrong where a crease opens or a joint stretches the skin, as
between thumb and hand: there neighbours are turned otherwise. Four of them tell.
"""

from __future__ import annotations

import numpy as np

from fba.arrays import Array, Float32, Float64, Int32, Int64, Integer
from fba.cache import kept, key_of

FLATTEST = 0.05
"""Sine between both ways across, below which they say nothing about the surface."""
LARGE = 4000
"""What meshes of so many vertices and more give is kept on disk."""
MAKING = 1
"""Counts up with every change of what is found: what was kept before is then made anew."""


def normal_rings(vertices: Float32, normals: Float32, triangles: Integer) -> tuple[Int32, Float32]:
    """Four neighbours of each vertex, (V, 4), -1 where none give a normal, and coefficients (V, 3).

    With t = v[0] - v[2] and u = v[1] - v[3] of the neighbours, x t + y u + z (t x u) is the normal of the
    mesh as modelled, for the three numbers x, y, z, and the same again after any rotation of the whole.
    """
    count = len(vertices)
    if count < LARGE or not len(triangles):
        return _rings(vertices, normals, triangles)

    def make() -> list[Array]:
        return list(_rings(vertices, normals, triangles))

    key = key_of("rings", MAKING, vertices, normals, triangles)
    around, numbers = kept(key, ((count, 4), (count, 3)), make, [np.int32, np.float32])
    if around.min() < -1 or around.max() >= count:
        around, numbers = make()
    return around, numbers


def _rings(vertices: Float32, normals: Float32, triangles: Integer) -> tuple[Int32, Float32]:
    count = len(vertices)
    around = np.full((count, 4), -1, dtype=np.int32)
    numbers = np.zeros((count, 3), dtype=np.float32)
    if not len(triangles):
        return around, numbers
    # Vertices in one place are one: seams between colours are no edges of the surface.
    _, first, same = np.unique(vertices, axis=0, return_index=True, return_inverse=True)
    same = same.ravel()
    centre, other = _neighbours(same[triangles])
    places, upright = vertices[first].astype(np.float64), normals[first].astype(np.float64)
    ways = places[other] - places[centre]
    starts = np.flatnonzero(np.diff(centre, prepend=-1))
    owner = centre[starts]
    turn = _turns(ways, upright[centre], starts)
    table = np.full((len(first), 4), -1, dtype=np.int64)
    for slot in range(4):
        table[owner, slot] = _nearest(turn, slot * np.pi / 2, other, centre, starts)
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
    """All pairs of joined vertices, both ways round, by the first."""
    sides = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=-1).reshape(-1, 2)
    sides = sides[sides[:, 0] != sides[:, 1]]
    count = int(triangles.max()) + 1  # as one number: rows take ten times as long to sort
    first, second = np.concatenate([sides, sides[:, ::-1]]).astype(np.int64).T
    pairs = np.unique(first * count + second)
    return pairs // count, pairs % count


def _turns(ways: Float64, upright: Float64, starts: Int64) -> Float64:
    """The angle of each way about its vertex's normal, from the first of that vertex, 0 to 2 pi."""
    sizes = np.diff(np.append(starts, len(ways)))
    reference = np.repeat(ways[starts], sizes, axis=0)
    aside = np.cross(upright, reference)
    flat = np.cross(aside, upright)
    angle = np.arctan2((ways * aside).sum(axis=1), (ways * flat).sum(axis=1))
    turn: Float64 = np.mod(angle, 2 * np.pi)
    return turn


def _nearest(turn: Float64, wanted: float, other: Int64, centre: Int64, starts: Int64) -> Int64:
    """For each vertex the neighbour nearest to an angle; the vertex itself if none is within 60 degrees."""
    off = np.abs(np.mod(turn - wanted + np.pi, 2 * np.pi) - np.pi)
    order = np.lexsort((off, centre))
    best = order[starts]
    return np.where(off[best] < np.pi / 3, other[best], centre[best])

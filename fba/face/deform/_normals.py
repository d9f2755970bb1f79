"""Triangles and vertices that share a normal, prepared for the compiled loops."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fba.arrays import Bool, Float32, Float64, Int32, Int64, Integer, Intp, UInt32
from fba.face.model import FaceModel

SEAM_COSINE = 0.7
"""Coincident vertices share a normal where their neutral normals differ by less than about 45 degrees. Along
the seam of a texture they differ a little where each side was shaded by itself."""
SEAM_MOTION = 0.01
"""They also share it only where FAPs move them equally but for this share: lips touch, but move apart."""
SURFACES_MAX = 16
"""Surfaces that may meet at one point; a mesh with more there is damaged."""


class Surface(NamedTuple):
    """Triangles whose normals change, and the sums that they add to.

    A sum belongs to one vertex, or to several along a seam. First come the sums that some FaceDefMesh
    changes, those of part p from changing_start[p] to changing_start[p + 1], then those that keep their
    neutral normal, from still_start[p] to still_start[p + 1]. The last sum of all is not used: corners add
    to it whose own sum does not change. The triangles of part p begin at triangles_start[p].
    """

    triangles: UInt32
    """(F, 3) vertices."""
    corners: UInt32
    """(F, 3) the sums that they add to."""
    triangles_start: Int64
    """(P + 1,)"""
    changing_start: Int64
    """(P + 1,)"""
    still_start: Int64
    """(P + 1,)"""
    sum_of: UInt32
    """(V,) the sum that a vertex takes its normal from."""
    neutral: Float32
    """(3, C + 1) unit normals of the neutral face. A row a coordinate, here and in the next two, lets a loop
    take eight at a time."""
    sums: Float32
    """(3, C + 1) scratch."""
    units: Float32
    """(3, C + 1) scratch: rotated and normalised."""


def build_surface(model: FaceModel, moved_rows: Integer) -> Surface:
    """Return the `Surface` of a model. moved_rows: the vertices that some FaceDefMesh moves, in any order."""
    moved = np.zeros(len(model.vertices), dtype=bool)
    moved[moved_rows] = True
    group = _group_seams(model)
    triangles = model.triangles
    corners = group[triangles]
    count = int(group.max()) + 1 if len(group) else 0
    summed = _sum_normals(model.vertices.astype(np.float64), triangles, corners, count)
    length = np.linalg.norm(summed, axis=1, keepdims=True)
    shaded = length[group, 0] > 0
    unit = summed / np.where(length > 0, length, 1)
    neutral = np.where(shaded[:, None], unit[group], model.normals).astype(np.float32)

    changing = np.zeros(count, dtype=bool)
    changing[corners[moved[triangles].any(axis=1)]] = True
    needed = changing[corners].any(axis=1)
    part_of_group = np.zeros(count, dtype=np.int64)
    part_of_group[group] = np.repeat(np.arange(len(model.parts)), [len(p.vertices) for p in model.parts])
    # Groups are numbered by their first vertex, and so in the order of the parts.
    order = np.argsort(~changing, kind="stable")
    sum_of_group = np.empty(count, dtype=np.int64)
    sum_of_group[order] = np.arange(count)
    by_sum = np.zeros((3, count + 1), dtype=np.float32)
    by_sum[:, sum_of_group[group]] = neutral.T
    used = np.where(changing[corners], sum_of_group[corners], count)[needed]
    parts = np.arange(len(model.parts) + 1)
    part_of_sum = part_of_group[order]
    changing_count = int(changing.sum())
    return Surface(
        triangles=triangles[needed].astype(np.uint32),
        corners=used.astype(np.uint32),
        triangles_start=np.searchsorted(part_of_group[corners[needed][:, 0]], parts).astype(np.int64),
        changing_start=np.searchsorted(part_of_sum[:changing_count], parts).astype(np.int64),
        still_start=changing_count + np.searchsorted(part_of_sum[changing_count:], parts).astype(np.int64),
        sum_of=sum_of_group[group].astype(np.uint32),
        neutral=by_sum,
        sums=np.zeros_like(by_sum),
        units=np.zeros_like(by_sum),
    )


def restrict_surface(surface: Surface, rows: UInt32) -> Surface:
    """Return what the normals of these vertices (N,) alone need; other vertices take the last sum."""
    last = surface.neutral.shape[1] - 1
    wanted = np.zeros(last + 1, dtype=bool)
    wanted[surface.sum_of[rows]] = True
    wanted[last] = True
    before = np.concatenate([[0], np.cumsum(wanted)])  # how many are wanted before each
    number = np.where(wanted, before[:-1], before[-1] - 1)
    needed = (wanted & (np.arange(last + 1) < last))[surface.corners].any(axis=1)
    by_sum = np.ascontiguousarray(surface.neutral[:, wanted])
    return Surface(
        triangles=surface.triangles[needed],
        corners=number[surface.corners[needed]].astype(np.uint32),
        triangles_start=np.concatenate([[0], np.cumsum(needed)])[surface.triangles_start].astype(np.int64),
        changing_start=before[surface.changing_start].astype(np.int64),
        still_start=before[surface.still_start].astype(np.int64),
        sum_of=number[surface.sum_of].astype(np.uint32),
        neutral=by_sum,
        sums=np.zeros_like(by_sum),
        units=np.zeros_like(by_sum),
    )


def _sum_normals(vertices: Float64, triangles: Int32, corners: Int64, count: int) -> Float64:
    """Return (count, 3) sums of the normals of triangles, twice their areas long, over corners (F, 3)."""
    a, b, c = (vertices[triangles[:, corner]] for corner in range(3))
    across = np.cross(b - a, c - a)
    summed = np.empty((count, 3))
    for axis in range(3):
        summed[:, axis] = np.bincount(corners.ravel(), np.repeat(across[:, axis], 3), minlength=count)
    return summed


def _group_seams(model: FaceModel) -> Int64:
    """Return (V,) number of each vertex's group: those that are one point of one smooth surface share it."""
    part = np.repeat(np.arange(len(model.parts)), [len(p.vertices) for p in model.parts])
    vertices = model.vertices + np.float32(0)  # -0 is 0
    order = np.lexsort((*vertices.T, part))
    same = (vertices[order][1:] == vertices[order][:-1]).all(axis=1) & (part[order][1:] == part[order][:-1])
    leader = np.arange(len(vertices))
    if same.any():
        position = np.concatenate([[0], np.cumsum(~same)])  # equal for coincident vertices in `order`
        rest = np.flatnonzero(np.bincount(position)[position] > 1)
        test_motions = [_test_motion(model, sign) for sign in (1.0, -1.0)]
        for _ in range(SURFACES_MAX):
            # The first vertex left at each position leads those that agree with it. It has the lowest
            # number there, as lexsort is stable.
            left = position[rest]
            first = np.concatenate([[True], left[1:] != left[:-1]])
            leaders = order[rest[first]][np.cumsum(first) - 1]
            agree = _agree(model.normals, test_motions, order[rest], leaders)
            leader[order[rest[agree]]] = leaders[agree]
            rest = rest[~agree]
            if not len(rest):
                break
    return np.asarray(np.unique(leader, return_inverse=True)[1], dtype=np.int64)


def _agree(normals: Float32, motions: list[Float64], one: Intp, other: Intp) -> Bool:
    """Return whether each pair of coincident vertices has nearly the same normal and moves equally."""
    agree = np.einsum("ij,ij->i", normals[one], normals[other]) > SEAM_COSINE
    for motion in motions:
        apart = np.abs(motion[one] - motion[other]).max(axis=1, initial=0)
        agree &= apart <= SEAM_MOTION * np.abs(motion[one]).max(axis=1, initial=0)
    return np.asarray(agree | (one == other))


def _test_motion(model: FaceModel, sign: float) -> Float64:
    """Return (V, 3) shifts of the vertices when every FAP has a value of its own, of one sign."""
    moved = np.zeros(model.vertices.shape)
    for table in model.tables:
        value = sign * (200.0 + 37.0 * (table.fap * 29 % 67))
        for mesh in table.meshes:
            shift = mesh.shift(value) * model.fapu.of_fap(table.fap)
            moved[model.starts[mesh.part] + mesh.vertices] += shift
    return moved

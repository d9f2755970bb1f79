"""Which triangles and vertices share a normal, prepared for the compiled loops."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fba.arrays import Bool, Float32, Float64, Int32, Int64, Intp, UInt32
from fba.face.model import FaceModel
from fba.parameters import faps

SEAM_COSINE = 0.7
"""Coincident vertices share a normal where their neutral ones differ by less than about 45 degrees: along
the seam of a texture they may well differ by some, where each side was shaded for itself."""
SEAM_MOTION = 0.01
"""... and where what the FAPs do to them differs by less than this share. Lips that touch move apart."""


HEADS_MAX = 16
"""Different surfaces that may meet in one place; a mesh with more there is damaged."""


class Surface(NamedTuple):
    """Triangles whose normals change, and where their sums go.

    A sum belongs to one vertex, or to several along a seam. Sums come in two rows of parts: those that
    change with some FaceDefMesh, part p's from changing_start[p] to changing_start[p + 1], then those
    that keep their neutral normal, from still_start[p] to still_start[p + 1]. The last of all is for the
    corners of triangles that belong to such. Part p's triangles lie from triangles_start[p] on.
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
    """(3, C + 1) unit normals of the neutral face. Coordinates apart, as in the next two: a loop over
    them takes eight at a time."""
    sums: Float32
    """(3, C + 1) scratch."""
    units: Float32
    """(3, C + 1) scratch: turned, and made unit vectors."""


def surface(model: FaceModel, moved: Bool) -> Surface:
    """moved: (V,), the vertices that some FaceDefMesh moves."""
    group = _seams(model)
    triangles = model.triangles
    corners = group[triangles]
    count = int(group.max()) + 1 if len(group) else 0
    summed = _sums(model.vertices.astype(np.float64), triangles, corners, count)
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
    place = np.empty(count, dtype=np.int64)
    place[order] = np.arange(count)
    by_sum = np.zeros((3, count + 1), dtype=np.float32)
    by_sum[:, place[group]] = neutral.T
    used = np.where(changing[corners], place[corners], count)[needed]
    parts = np.arange(len(model.parts) + 1)
    part_of_sum = part_of_group[order]
    changing_count = int(changing.sum())
    return Surface(
        triangles=triangles[needed].astype(np.uint32),
        corners=used.astype(np.uint32),
        triangles_start=np.searchsorted(part_of_group[corners[needed][:, 0]], parts).astype(np.int64),
        changing_start=np.searchsorted(part_of_sum[:changing_count], parts).astype(np.int64),
        still_start=changing_count + np.searchsorted(part_of_sum[changing_count:], parts).astype(np.int64),
        sum_of=place[group].astype(np.uint32),
        neutral=by_sum,
        sums=np.zeros_like(by_sum),
        units=np.zeros_like(by_sum),
    )


def _sums(
    vertices: Float64,
    triangles: Int32,
    corners: Int64,
    count: int,
) -> Float64:
    a, b, c = (vertices[triangles[:, corner]] for corner in range(3))
    across = np.cross(b - a, c - a)
    summed = np.empty((count, 3))
    for axis in range(3):
        summed[:, axis] = np.bincount(corners.ravel(), np.repeat(across[:, axis], 3), minlength=count)
    return summed


def _seams(model: FaceModel) -> Int64:
    """(V,): a number for each vertex, the same for those that are one point of one smooth surface."""
    part = np.repeat(np.arange(len(model.parts)), [len(p.vertices) for p in model.parts])
    vertices = model.vertices + np.float32(0)  # -0 is 0
    order = np.lexsort((*vertices.T, part))
    same = (vertices[order][1:] == vertices[order][:-1]).all(axis=1) & (part[order][1:] == part[order][:-1])
    leader = np.arange(len(vertices))
    if same.any():
        place = np.concatenate([[0], np.cumsum(~same)])  # of each vertex in `order`
        rest = np.flatnonzero(np.bincount(place)[place] > 1)
        alike = _Alike(model)
        for _ in range(HEADS_MAX):
            # The first vertex left in each place leads those that are like it. Within a place, `order`
            # keeps the vertices' own: lexsort is stable.
            left = place[rest]
            first = np.concatenate([[True], left[1:] != left[:-1]])
            heads = order[rest[first]][np.cumsum(first) - 1]
            agree = alike(order[rest], heads)
            leader[order[rest[agree]]] = heads[agree]
            rest = rest[~agree]
            if not len(rest):
                break
    return np.asarray(np.unique(leader, return_inverse=True)[1], dtype=np.int64)


class _Alike:
    """Whether pairs of coincident vertices have the same normal and are moved alike."""

    def __init__(self, model: FaceModel) -> None:
        self._normals = model.normals
        self._probes = [_probe(model, sign) for sign in (1.0, -1.0)]

    def __call__(self, one: Intp, other: Intp) -> Bool:
        normals = self._normals
        agree = np.einsum("ij,ij->i", normals[one], normals[other]) > SEAM_COSINE
        for probe in self._probes:
            apart = np.abs(probe[one] - probe[other]).max(axis=1, initial=0)
            agree &= apart <= SEAM_MOTION * np.abs(probe[one]).max(axis=1, initial=0)
        return np.asarray(agree | (one == other))


def _probe(model: FaceModel, sign: float) -> Float64:
    """(V, 3) how the vertices move when all FAPs have some value, no two the same."""
    moved = np.zeros(model.vertices.shape)
    for table in model.tables:
        value = sign * (200.0 + 37.0 * (table.fap * 29 % 67))
        for mesh in table.meshes:
            shift = mesh.shift(value) * model.fapu[faps()[table.fap - 1].unit]
            moved[model.starts[mesh.part] + mesh.vertices] += shift
    return moved

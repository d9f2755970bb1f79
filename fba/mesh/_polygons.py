"""Polygons as mesh files hold them, and the triangles they are cut into."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.arrays import Bool, Float32, Float64, Int32, Int64


@dataclass(frozen=True, eq=False)
class Polygons:
    """The polygons of a mesh file.

    vertices: float64 (V, 3), in the file's own units. texcoords: float64 (VT, 2), origin at the
    picture's top left, or None. starts: int32 (F + 1,), where each polygon begins in `corners`, the
    indices of its vertices, and `corner_texcoords`, the indices of their texture coordinates, -1 for
    none. group: int32 (F,), index into `groups`, the (group or object name, material name) of each.
    colours: float32 (V, 4) or None.
    """

    vertices: Float64
    starts: Int32
    corners: Int32
    corner_texcoords: Int32
    group: Int32
    groups: tuple[tuple[str, str], ...]
    texcoords: Float64 | None = None
    colours: Float32 | None = None

    def __len__(self) -> int:
        return len(self.starts) - 1

    def in_groups(self, *names: str) -> Bool:
        """Return bool (F,): the polygons in groups or objects of these names, whatever their material."""
        wanted = [index for index, (group, _) in enumerate(self.groups) if group in names]
        return np.isin(self.group, wanted)

    def used(self, faces: Bool) -> Int32:
        """Return vertices of some polygons, in ascending order."""
        return np.unique(self.corners[np.repeat(faces, np.diff(self.starts))]).astype(np.int32)


@dataclass(frozen=True, eq=False)
class Triangles:
    """Polygons cut into triangles (fans from their first corner).

    corners: int32 (N, 3), vertices. texcoords: int32 (N, 3), -1 for none. polygon: int32 (N,), where
    each comes from.
    """

    corners: Int32
    texcoords: Int32
    polygon: Int32


def triangulate(polygons: Polygons, faces: Bool) -> Triangles:
    """Return the chosen polygons cut into triangles; those of fewer than three corners are dropped."""
    sizes = np.diff(polygons.starts)
    rows = np.flatnonzero(faces & (sizes >= 3))
    counts = sizes[rows] - 2
    polygon = np.repeat(rows, counts)
    # the place of each triangle in its fan: 0, 1, ... for every polygon anew
    position = np.arange(len(polygon)) - np.repeat(np.cumsum(counts) - counts, counts)
    first = polygons.starts[polygon]
    corner_rows = np.stack([first, first + position + 1, first + position + 2], axis=1)
    return Triangles(
        polygons.corners[corner_rows], polygons.corner_texcoords[corner_rows], polygon.astype(np.int32)
    )


def strip_triangles(starts: Int64, corners: Int64) -> Int64:
    """Return the corners (3 T,) of the triangles in strips, which lists of vertices give.

    starts: (S + 1,), where each list begins and the last ends. corners: (C,), vertices; -1 ends a strip
    within a list, and the next one begins. Every second triangle of a strip is turned, so that all face the
    same way; those with two corners in one vertex, which join strips, are left out.
    """
    places = np.arange(len(corners))
    begins = np.zeros(len(corners) + 1, dtype=np.int64)
    begins[starts] = starts
    begins[:-1] = np.where(corners == -1, places + 1, begins[:-1])
    begin = np.maximum.accumulate(begins[:-1])  # of the strip that each corner belongs to
    third = np.flatnonzero((corners != -1) & (places - begin >= 2))
    triangles = np.stack([corners[third - 2], corners[third - 1], corners[third]], axis=1)
    turned = (third - begin[third]) % 2 == 1
    triangles[turned] = triangles[turned][:, [1, 0, 2]]
    first, second, last = triangles.T
    kept = (first != second) & (second != last) & (first != last)
    return np.asarray(triangles[kept].reshape(-1))

"""Polygons as mesh files hold them, and parts of a face made from them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fba.errors import ModelError
from fba.face.model import Material, Part
from fba.face.normals import vertex_normals

Float32 = npt.NDArray[np.float32]
Float64 = npt.NDArray[np.float64]
Int32 = npt.NDArray[np.int32]
Bool = npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Polygons:
    """What an OBJ or PLY file holds.

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

    def used(self, faces: Bool) -> Int32:
        """Vertices of some polygons, rising."""
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
    """The chosen polygons as triangles; those of fewer than three corners vanish."""
    sizes = np.diff(polygons.starts)
    chosen = np.flatnonzero(faces & (sizes >= 3))
    counts = sizes[chosen] - 2
    polygon = np.repeat(chosen, counts)
    # the place of each triangle in its fan: 0, 1, ... for every polygon anew
    place = np.arange(len(polygon)) - np.repeat(np.cumsum(counts) - counts, counts)
    first = polygons.starts[polygon]
    at = np.stack([first, first + place + 1, first + place + 2], axis=1)
    return Triangles(polygons.corners[at], polygons.corner_texcoords[at], polygon.astype(np.int32))


@dataclass(frozen=True, eq=False)
class Source:
    """A part, and where its vertices come from: int32 (V,), vertex of the file by vertex of the part."""

    part: Part
    origin: Int32


def make_part(
    polygons: Polygons,
    faces: Bool,
    name: str,
    kind: str,
    *,
    scale: float = 1.0,
    material: Material | None = None,
) -> Source:
    """One part of some polygons; vertices with several texture coordinates are split.

    Splitting keeps position and normal, so that seams do not show. scale: metres per unit of the file.
    Raises ModelError where no triangle is left.
    """
    cut = triangulate(polygons, faces)
    if not len(cut.corners):
        raise ModelError(f"part {name!r} has no triangles")
    corners = cut.corners.reshape(-1).astype(np.int64)
    coords = cut.texcoords.reshape(-1).astype(np.int64)
    textured = polygons.texcoords is not None and bool((coords >= 0).any())
    key = (corners << 32) | (coords + 1 if textured else 0)
    unique, triangles = np.unique(key, return_inverse=True)
    origin = (unique >> 32).astype(np.int32)
    vertices = polygons.vertices[origin] * scale
    # normals of the unsplit mesh
    _, first = np.unique(origin, return_inverse=True)
    whole = np.unique(origin)
    place = np.searchsorted(whole, cut.corners).astype(np.int32)
    normals = vertex_normals((polygons.vertices[whole] * scale).astype(np.float32), place)[first]
    texcoords = None
    if textured and polygons.texcoords is not None:
        coord = (unique & 0xFFFFFFFF) - 1
        texcoords = np.where(coord[:, None] >= 0, polygons.texcoords[np.maximum(coord, 0)], 0.0)
    part = Part(
        name,
        kind,
        vertices.astype(np.float32),
        triangles.reshape(-1, 3).astype(np.int32),
        normals.astype(np.float32),
        None if texcoords is None else texcoords.astype(np.float32),
        None if polygons.colours is None else polygons.colours[origin],
        material or Material(),
    )
    return Source(part, origin)

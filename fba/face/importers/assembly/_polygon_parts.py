"""Pieces of a mesh file, made of its polygons; connected components of a mesh."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from fba.arrays import Bool, Float32, Int32, Integer, Intp
from fba.errors import ModelError
from fba.face.model import Material, Part
from fba.mesh import Polygons, triangulate, vertex_normals


@dataclass(frozen=True, eq=False)
class Piece:
    """A piece of a mesh file, not yet a part.

    part: name and geometry; its kind does not count before `assemble`. material: the material's name in
    the file. origin: int32 (V,), its vertices' numbers in the file, -1 where they have none. morphs:
    float32 (V, 3) displacements by the name of a shape.
    """

    part: Part
    material: str = ""
    origin: Int32 = field(default_factory=lambda: np.zeros(0, dtype=np.int32))
    morphs: Mapping[str, Float32] = field(default_factory=dict)


def make_piece(
    polygons: Polygons,
    faces: Bool,
    name: str,
    kind: str = "other",
    *,
    scale: float = 1.0,
    material: Material | None = None,
) -> Piece:
    """Return one piece of some polygons (mask (F,)); vertices with several texture coordinates are split.

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
    # normals of the mesh before splitting
    unsplit, first = np.unique(origin, return_inverse=True)
    joined = np.searchsorted(unsplit, cut.corners).astype(np.int32)
    normals = vertex_normals((polygons.vertices[unsplit] * scale).astype(np.float32), joined)[first]
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
    return Piece(part, origin=origin)


def polygon_components(polygons: Polygons) -> tuple[Intp, Intp]:
    """Return the connected component of each vertex, (V,), and of each polygon, (F,), by lowest vertex
    number."""
    sizes = np.diff(polygons.starts)
    first = np.repeat(polygons.corners[polygons.starts[:-1]], sizes)
    label = _connected(first, polygons.corners, len(polygons.vertices))
    return label, label[polygons.corners[polygons.starts[:-1]]]


def vertex_components(triangles: Int32, count: int, vertices: Float32) -> Intp:
    """Return (count,) connected component of each vertex; vertices at one position (texture seams) count as
    one."""
    _, same = np.unique(vertices, axis=0, return_inverse=True)
    position = same.reshape(-1)
    a, b, c = position[triangles].T if len(triangles) else (position[:0],) * 3
    label = _connected(np.concatenate([a, b]), np.concatenate([b, c]), int(position.max()) + 1)
    return np.asarray(label[position], dtype=np.intp)


def _connected(a: Integer, b: Integer, count: int) -> Intp:
    """Return (count,) component of each vertex, for edges between vertices a (E,) and b (E,)."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    links = (np.ones(len(a), dtype=np.int8), (a, b))
    labels: Intp = connected_components(coo_array(links, shape=(count, count)), directed=False)[1]
    return labels

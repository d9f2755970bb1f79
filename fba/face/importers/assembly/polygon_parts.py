"""Parts of a face from the polygons of a mesh file, and the connected components of a mesh."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.arrays import Bool, Float32, Int32, Integer, Intp
from fba.errors import ModelError
from fba.face.model import Material, Part
from fba.mesh.meshes import vertex_normals
from fba.mesh.polygons import Polygons, triangulate


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


def polygon_components(polygons: Polygons) -> list[Bool]:
    """Masks, bool (F,), of the polygons of each connected component, ordered by lowest vertex number."""
    sizes = np.diff(polygons.starts)
    first = np.repeat(polygons.corners[polygons.starts[:-1]], sizes)
    label = _connected(first, polygons.corners, len(polygons.vertices))
    of_face = label[polygons.corners[polygons.starts[:-1]]]
    return [of_face == shell for shell in np.unique(of_face)]


def vertex_components(triangles: Int32, count: int, vertices: Float32) -> Intp:
    """(count,) connected component of each vertex; vertices at one position (texture seams) count as one."""
    _, same = np.unique(vertices, axis=0, return_inverse=True)
    place = same.reshape(-1)
    a, b, c = place[triangles].T if len(triangles) else (place[:0],) * 3
    label = _connected(np.concatenate([a, b]), np.concatenate([b, c]), int(place.max()) + 1)
    return np.asarray(label[place], dtype=np.intp)


def _connected(a: Integer, b: Integer, count: int) -> Intp:
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    links = (np.ones(len(a), dtype=np.int8), (a, b))
    labels: Intp = connected_components(coo_array(links, shape=(count, count)), directed=False)[1]
    return labels

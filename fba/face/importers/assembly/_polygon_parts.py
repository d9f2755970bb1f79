"""Pieces of a mesh file, made of its polygons; connected components of a mesh; default materials.

Parts without colours get these: skin, teeth, tongue, eyes with an iris.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from fba.arrays import Bool, Float32, Float64, Int32, Intp
from fba.errors import ModelError
from fba.face.eyeball import LID_POINTS, PUPIL_POINT, sphere
from fba.face.model import Material, Part
from fba.mesh import Polygons, connected, triangulate, vertex_normals
from fba.parameters import point_rows

LOOKS = {
    "skin": Material("skin", (0.71, 0.47, 0.36), 0.55),
    "mouth": Material("mouth", (0.35, 0.10, 0.09), 0.4),
    "teeth": Material("teeth", (0.83, 0.80, 0.72), 0.25),
    "tongue": Material("tongue", (0.55, 0.16, 0.15), 0.4),
    "brow": Material("brow", (0.06, 0.04, 0.03), 0.8),
    "lash": Material("lashes", (0.02, 0.015, 0.01), 0.8),
    "hair": Material("hair", (0.06, 0.04, 0.03), 0.6),
    "eye": Material("eye", (0.80, 0.78, 0.75), 0.1),
}
"""Materials by kind of part."""
WHITE = (0.80, 0.78, 0.75)
IRIS = (0.16, 0.09, 0.05)
PUPIL = (0.004, 0.004, 0.004)
MAX_GREY_DIFFERENCE = 0.03
"""Light colours whose channels differ by less are programs' defaults, and are replaced."""


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
    """Return the connected component of each vertex, (V,), and polygon, (F,), by lowest vertex."""
    sizes = np.diff(polygons.starts)
    first = np.repeat(polygons.corners[polygons.starts[:-1]], sizes)
    label = connected(np.stack([first, polygons.corners], axis=1), len(polygons.vertices))
    return label, label[polygons.corners[polygons.starts[:-1]]]


def vertex_components(triangles: Int32, vertices: Float32) -> Intp:
    """Return (V,) connected component of each vertex; those at one position (seams) count as one."""
    _, same = np.unique(vertices, axis=0, return_inverse=True)
    position = same.reshape(-1)
    corners = position[triangles]
    label = connected(np.concatenate([corners[:, :2], corners[:, 1:]]), int(position.max()) + 1)
    return np.asarray(label[position], dtype=np.intp)


def apply_default_materials(pieces: Sequence[Piece], points: Float64) -> list[Piece]:
    """Return the pieces with default materials where they lack looks. points: (84, 3), for irises."""
    result = []
    for piece in pieces:
        part = piece.part
        if part.material.texture is None and part.colours is None and _is_grey(part.material):
            material = LOOKS.get(part.kind, part.material)
            part = replace(part, material=material)
            if part.kind == "eye":
                part = _with_iris(part, points)
        result.append(replace(piece, part=part))
    return result


def _is_grey(material: Material) -> bool:
    return max(material.colour) - min(material.colour) < MAX_GREY_DIFFERENCE and min(material.colour) > 0.5


def _with_iris(part: Part, points: Float64) -> Part:
    """Return the eye with a neutral iris: as wide as the lids are apart, its pupil a third of it."""
    side = "left" if "left" in part.name else "right"
    pupil = points[point_rows()[PUPIL_POINT[side]]]
    upper, lower = (float(points[point_rows()[name], 1]) for name in LID_POINTS[side])
    wide = upper - lower
    ball = sphere(part)
    if ball is None or not np.isfinite(pupil).all() or not wide > 0:
        return part
    arm = pupil - ball[0]
    way = arm / max(float(np.linalg.norm(arm)), 1e-9)
    away = part.vertices - ball[0]
    along = away @ way
    off = np.linalg.norm(away - np.outer(along, way), axis=1)
    colours = np.tile(np.array([*WHITE, 0.9], dtype=np.float32), (len(part.vertices), 1))
    front = along > 0
    colours[front & (off < wide / 2), :3] = IRIS
    colours[front & (off < wide / 6), :3] = PUPIL
    return replace(part, colours=colours)

"""glTF heads of other makers: surfaces, materials, and morph targets as shapes."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from fba.arrays import Float32
from fba.errors import FormatError, ModelError
from fba.face.feature_points import names
from fba.face.importers.assembly.model import finish_import, turn_upright
from fba.face.importers.assembly.pieces import Piece, assemble
from fba.face.importers.points.points_file import GivenPoints, given_points
from fba.face.model import FaceModel, Material, Part
from fba.mesh.text_files import MAX_VERTICES

EXTENSION = "FBA_face"
POINT_FILES = (".points.csv", ".points.json", ".fdp")


def import_gltf(
    path: str | os.PathLike[str],
    *,
    points: object = None,
    unit: float | None = None,
    up: str = "y",
    kinds: Mapping[str, str] | None = None,
    name: str | None = None,
) -> FaceModel:
    """A face from a .glb or .gltf head; one that `FaceModel.save` wrote is simply loaded.

    Morph targets named as ARKit's blendshapes, or as FAPs, give tables; feature points that are not
    given are found by them. Raises ModelError as `import_model`.
    """
    pieces, has_extension = gltf_pieces(path)
    if has_extension and points is None:
        return FaceModel.load(path)
    given = given_points(points) if points is not None else _points_beside(Path(path))
    if given is None:
        from fba.face.importers.assembly.landmarks import find_points

        upright, _ = turn_upright(pieces, np.full((len(names()), 3), np.nan), up)
        found = find_points(assemble(upright, kinds), os.fspath(path))
        return finish_import(
            upright, found, {}, path=path, unit=unit, kinds=kinds, name=name,
            notes={"feature points": "found by the shapes of the head, not given"},
        )  # fmt: skip
    places = given.points.copy()
    everything = np.concatenate([piece.part.vertices for piece in pieces])
    for row, point in enumerate(names()):
        vertex = given.vertices.get(point)
        if vertex is not None:
            if vertex >= len(everything):
                raise ModelError(
                    f"{path}: feature point {point} is vertex {vertex}, but there are {len(everything)}"
                )
            places[row] = everything[vertex]
    return finish_import(pieces, places, given.vertices, path=path, unit=unit, up=up, kinds=kinds, name=name)


def gltf_pieces(path: str | os.PathLike[str]) -> tuple[list[Piece], bool]:
    """Every surface of a glTF file as a piece, vertices counted through them; and whether it is a face
    model of this project."""
    from fba.gltf import read_gltf, surfaces

    try:
        gltf = read_gltf(path)
    except FormatError as error:
        raise ModelError(str(error)) from error
    extensions = gltf.document.get("extensions")
    own = extensions is not None and extensions.get(EXTENSION) is not None
    pieces: list[Piece] = []
    start = 0
    taken: set[str] = set()
    for surface in surfaces(gltf):
        count = len(surface.positions)
        if start + count > MAX_VERTICES:
            raise ModelError(f"{path}: more than {MAX_VERTICES} vertices; reduce the mesh to its head")
        material = Material()
        if surface.material is not None:
            r, g, b, _ = surface.material.colour
            material = Material(
                surface.material.name, (r, g, b), surface.material.roughness, surface.material.texture
            )
        name = _unused_name(surface.name, taken)
        part = Part(
            name,
            "other",
            surface.positions,
            surface.triangles,
            surface.normals,
            surface.texcoords,
            None if surface.colours is None else _with_gloss(surface.colours, material),
            material
            if surface.texcoords is not None
            else Material(material.name, material.colour, material.roughness),
        )
        origin = np.arange(start, start + count, dtype=np.int32)
        pieces.append(Piece(part, material.name, origin, dict(surface.morphs)))
        start += count
    if not pieces:
        raise ModelError(f"{path}: its scene shows no triangles")
    return pieces, own


def _unused_name(name: str, taken: set[str]) -> str:
    chosen, count = name or "mesh", 1
    while chosen in taken or chosen == "head":
        count += 1
        chosen = f"{name or 'mesh'} {count}"
    taken.add(chosen)
    return chosen


def _with_gloss(colours: Float32, material: Material) -> Float32:
    """Vertex colours times the material's; the fourth, opacity in glTF, is gloss here."""
    result = colours.copy()
    result[:, :3] *= np.array(material.colour, dtype=np.float32)
    result[:, 3] = 1.0 - material.roughness
    return result


def _points_beside(path: Path) -> GivenPoints | None:
    for end in POINT_FILES:
        candidate = path.with_name(path.stem + end)
        if candidate.is_file():
            return given_points(candidate)
    return None

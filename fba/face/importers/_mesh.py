"""Imports OBJ, PLY and WFM meshes with feature points from another file, and FDP files with their mesh."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from fba.arrays import Float64
from fba.errors import ModelError, Remedy, warn
from fba.face.feature_points import names
from fba.face.importers.assembly._pieces import part_names
from fba.face.importers.assembly._polygon_parts import Piece, make_piece
from fba.face.importers.assembly.model import ImportOptions, finish_import
from fba.face.importers.points.fdp import NEUTRAL, Fdp, read_fdp, repair_sides, xface_points
from fba.face.importers.points.points_file import GivenPoints, given_points, points_beside
from fba.face.model import FaceModel, Material
from fba.mesh import Pictures, Polygons, read_mtl, read_obj, read_ply, read_vrml, read_wfm
from fba.parameters import point_rows
from fba.text_files import read_lines

READERS: Mapping[str, Callable[[str | os.PathLike[str]], Polygons]] = {
    "obj": read_obj,
    "ply": read_ply,
    "wfm": read_wfm,
}
MAX_PIECES = 1000
"""Number of groups and materials with polygons, at most; a model has no more parts."""
MAX_LIBRARIES = 100
"""Number of files of materials that a mesh may name."""
MIN_PAIRS = 8
"""Number of points with both a position and a vertex from which the unit of a file of points shows."""
POINT_FILES = (".points.csv", ".points.json", ".fdp", ".csv", ".json")
"""Endings of files beside a mesh in which its feature points are sought."""
BINDS = {
    "LeftEye": "eye",
    "RightEye": "eye",
    "LowerTeeth": "teeth",
    "UpperTeeth": "teeth",
    "Tongue": "tongue",
    "Hair": "hair",
}
"""Kinds of parts by Xface's words for what a submesh is."""


def import_mesh(options: ImportOptions, form: str, points: object = None) -> FaceModel:
    """Return a face from a mesh file of the form "obj", "ply" or "wfm". points: as `import_model`."""
    path = Path(options.path)
    polygons = READERS[form](path)
    given = given_points(points) if points is not None else points_beside(path, POINT_FILES)
    if given is None:
        raise ModelError(
            f"{path}: a mesh needs its feature points; put them beside it as "
            f"{path.stem}.points.csv with lines 'name,x,y,z' or 'name,vertex' (vertices count from 0), for "
            "instance '9.3,297' for the tip of the nose; fba model points lets you place them by hand"
        ).with_remedies(Remedy("points", "or name their file with {}", "FILE"))
    pieces = polygon_pieces(polygons, read_materials(path) if form == "obj" else {}, path)
    positions, vertices = _point_positions(polygons, given, os.fspath(path))
    return finish_import(pieces, positions, vertices, options)


def polygon_pieces(
    polygons: Polygons, materials: Mapping[str, Material], path: str | os.PathLike[str] = "the mesh"
) -> list[Piece]:
    """Return a piece for each group and material of a mesh file (at `path`) that has triangles."""
    pieces = []
    names_of_parts = part_names()
    solid = np.bincount(polygons.group, np.diff(polygons.starts) >= 3, len(polygons.groups)) > 0
    if np.count_nonzero(solid) > MAX_PIECES:
        raise ModelError(
            f"{path}: {np.count_nonzero(solid)} groups and materials have polygons; at most {MAX_PIECES} "
            "are read: join some, or export the head alone"
        )
    for index in np.flatnonzero(solid).tolist():
        group, material = polygons.groups[index]
        faces = polygons.group == index
        name = names_of_parts(group or material or "mesh")
        own = materials.get(material, Material(material or "plain"))
        pieces.append(replace(make_piece(polygons, faces, name, material=own), material=material))
    return pieces


def _point_positions(polygons: Polygons, given: GivenPoints, path: str) -> tuple[Float64, dict[str, int]]:
    """Return the positions (84, 3) of the points in the mesh's unit, and their vertices.

    Vertices decide, as positions may be in another unit; an FbaWarning names points where both disagree.
    Points on the wrong side of the face are corrected.
    """
    positions = given.points.copy()
    vertices = dict(given.vertices)
    for name, vertex in given.vertices.items():
        if vertex < len(polygons.vertices):
            positions[point_rows()[name]] = polygons.vertices[vertex]
        elif np.isfinite(positions[point_rows()[name]]).all():
            del vertices[name]
        else:
            raise ModelError(
                f"{path}: feature point {name} is vertex {vertex}, but the mesh has {len(polygons.vertices)}"
            )
    positions, swaps, mirrored = repair_sides(_in_unit_of_mesh(given.points, positions, list(vertices), path))
    for a, b in swaps:
        swapped = {b: vertices.pop(a, None), a: vertices.pop(b, None)}
        vertices |= {name: vertex for name, vertex in swapped.items() if vertex is not None}
    for name in mirrored:
        vertices.pop(name, None)
    if swaps or mirrored:
        warn(
            f"{path}: feature points on the wrong side of the face corrected: "
            f"{', '.join([*mirrored, *(f'{a} with {b}' for a, b in swaps)][:8])}",
            stacklevel=4,
        )
    return positions, vertices


def _in_unit_of_mesh(given: Float64, positions: Float64, bound: list[str], path: str) -> Float64:
    """Return the positions (84, 3), points without a vertex converted to the mesh's unit and origin.

    given: as the file of points says. positions: those of the `bound` points taken from their vertices. Warns
    of given positions that do not agree with their vertices.
    """
    rows = [point_rows()[name] for name in bound if np.isfinite(given[point_rows()[name]]).all()]
    if len(rows) < MIN_PAIRS:
        return positions
    a, b = given[rows], positions[rows]
    # medians: a few that disagree do not pull at the unit
    centres = np.median(a, axis=0), np.median(b, axis=0)
    a, b = a - centres[0], b - centres[1]
    far = np.linalg.norm(a, axis=1)
    spread = far > 0.3 * far.max()
    if not spread.any() or not far.max() > 0:
        return positions
    ratio = float(np.median(np.linalg.norm(b[spread], axis=1) / far[spread]))
    away = np.linalg.norm(a * ratio - b, axis=1) > 0.05 * np.ptp(b, axis=0).max()
    wrong = [names()[row] for row, bad in zip(rows, away, strict=True) if bad]
    if wrong:
        warn(
            f"{path}: {len(wrong)} of {len(rows)} feature points are not where their vertices are "
            f"({', '.join(wrong[:8])}{', ...' if len(wrong) > 8 else ''}); the vertices are used",
            stacklevel=5,
        )
    rest = [row for row, name in enumerate(names()) if name not in bound]
    positions[rest] = (positions[rest] - centres[0]) * ratio + centres[1]
    return positions


def read_materials(path: str | os.PathLike[str]) -> dict[str, Material]:
    """Return the materials of the .mtl files that an OBJ file names, by name."""
    libraries: dict[str, None] = {}
    for line, text in read_lines(path):
        if text.startswith("mtllib"):
            libraries[text[6:].strip()] = None
            if len(libraries) > MAX_LIBRARIES:
                raise ModelError(f"{path}:{line}: names more than {MAX_LIBRARIES} files of materials")
    materials: dict[str, Material] = {}
    pictures = Pictures()
    for library in libraries:
        materials |= read_mtl(path, library, pictures)
    return materials


def import_fdp(options: ImportOptions) -> FaceModel:
    """Return a face from an FDP file and its mesh (.wfm, .obj, .ply, Xface's .wrl); ModelError without."""
    fdp = read_fdp(options.path)
    if fdp.format == "xface":
        return _import_xface(fdp, options)
    path = Path(options.path)
    for form in ("wfm", "obj", "ply"):
        mesh = path.with_suffix(f".{form}")
        if mesh.is_file():
            given = GivenPoints(fdp.points, {point: vertex for point, (_, vertex) in fdp.vertices.items()})
            return import_mesh(replace(options, path=mesh), form, given)
    raise ModelError(
        f"{path}: an FDP file says where feature points are, but contains no mesh; put {path.stem}.wfm, .obj "
        "or .ply beside it, or fit an existing head to its points: fba model fit"
    )


def _import_xface(fdp: Fdp, options: ImportOptions) -> FaceModel:
    """Return the neutral mesh of an Xface face, with new tables.

    The file's own regions and weights do not follow the standard: a point moves by a tenth to a third of what
    its FAP says.
    """
    points = xface_points(fdp)
    neutral = [mesh for mesh in fdp.meshes if mesh.alias == NEUTRAL]
    if not neutral:
        raise ModelError(f"{fdp.path}: no mesh is called {NEUTRAL!r}, the neutral face")
    file = Path(fdp.path).parent / Path(neutral[0].file).name
    bind = neutral[0].bind
    pieces, kinds = [], dict(options.kinds or {})
    numbers: dict[str, int] = {}
    start = 0
    for number, shape in enumerate(read_vrml(file)):
        label = f"{file.name}_{number}"
        if len(shape):
            piece = make_piece(shape, np.ones(len(shape), dtype=np.bool_), label)
            pieces.append(replace(piece, origin=piece.origin + np.int32(start)))
            kinds.setdefault(label, BINDS.get(bind.get(label, ""), "skin"))
        for point, (submesh, vertex) in fdp.vertices.items():
            if submesh == label:
                numbers[point] = start + vertex
        start += len(shape.vertices)
    numbers = {
        point: vertex for point, vertex in numbers.items() if np.isfinite(points[point_rows()[point]]).all()
    }
    return finish_import(pieces, points, numbers, replace(options, path=file, kinds=kinds))

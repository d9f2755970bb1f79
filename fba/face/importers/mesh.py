"""OBJ, PLY and WFM meshes with the feature points that lie in another file, as faces."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from fba.arrays import Float64
from fba.errors import FbaWarning, ModelError, Remedy
from fba.face.feature_points import names, row_of
from fba.face.importers.assembly.model import finish_import
from fba.face.importers.assembly.pieces import Piece
from fba.face.importers.assembly.polygon_parts import make_part
from fba.face.importers.points.fdp_data import repair_sides
from fba.face.importers.points.points_file import GivenPoints, given_points
from fba.face.model import FaceModel, Material
from fba.mesh.mtl import read_mtl
from fba.mesh.obj import read_obj
from fba.mesh.ply import read_ply
from fba.mesh.polygons import Polygons
from fba.mesh.text_files import read_lines
from fba.mesh.wfm import read_wfm

READERS: Mapping[str, Callable[[str | os.PathLike[str]], Polygons]] = {
    "obj": read_obj,
    "ply": read_ply,
    "wfm": read_wfm,
}
FEWEST_PAIRS = 8
"""So many positions with vertices show the unit of a file of points."""
POINT_FILES = (".points.csv", ".points.json", ".fdp", ".csv", ".json")
"""Ends of the names of files beside a mesh in which its feature points are looked for."""


def import_mesh(
    path: str | os.PathLike[str],
    form: str,
    *,
    points: object = None,
    unit: float | None = None,
    up: str = "y",
    kinds: Mapping[str, str] | None = None,
    name: str | None = None,
) -> FaceModel:
    """A face from a mesh file without motion; form: "obj", "ply" or "wfm"; the rest as `import_model`."""
    polygons = READERS[form](path)
    given = given_points(points) if points is not None else _points_beside(path)
    pieces = polygon_pieces(polygons, _materials(path) if form == "obj" else {})
    places, vertices = _point_positions(polygons, given, os.fspath(path))
    return finish_import(pieces, places, vertices, path=path, unit=unit, up=up, kinds=kinds, name=name)


def polygon_pieces(polygons: Polygons, materials: Mapping[str, Material]) -> list[Piece]:
    """A piece for each group and material of a mesh file; those without triangles are left out."""
    pieces = []
    taken: set[str] = set()
    for index, (group, material) in enumerate(polygons.groups):
        faces = polygons.group == index
        if not (np.diff(polygons.starts)[faces] >= 3).any():
            continue
        name, count = group or material or "mesh", 1
        while name in taken or name == "head":
            count += 1
            name = f"{group or material or 'mesh'} {count}"
        taken.add(name)
        source = make_part(
            polygons, faces, name, "other", material=materials.get(material, Material(material or "plain"))
        )
        pieces.append(Piece(source.part, material, source.origin))
    return pieces


def _points_beside(path: str | os.PathLike[str]) -> GivenPoints:
    """Feature points from a file of the same name beside the mesh."""
    place = Path(path)
    for end in POINT_FILES:
        candidate = place.with_name(place.stem + end)
        if candidate.is_file():
            return given_points(candidate)
    raise ModelError(
        f"{place}: a mesh needs its feature points; put them beside it as "
        f"{place.stem}.points.csv with lines 'name,x,y,z' or 'name,vertex' (vertices count from 0), for "
        "instance '9.3,297' for the tip of the nose"
    ).with_remedies(Remedy("points", "or name their file with {}", "FILE"))


def _point_positions(polygons: Polygons, given: GivenPoints, path: str) -> tuple[Float64, dict[str, int]]:
    """Positions (84, 3) of the points in the mesh's unit, and their vertices.

    A vertex says more than a position, which may be of another unit; an FbaWarning names those that
    disagree. Points of the wrong side are put right.
    """
    places = given.points.copy()
    vertices = dict(given.vertices)
    for name, vertex in given.vertices.items():
        if vertex < len(polygons.vertices):
            places[row_of()[name]] = polygons.vertices[vertex]
        elif np.isfinite(places[row_of()[name]]).all():
            del vertices[name]
        else:
            raise ModelError(
                f"{path}: feature point {name} is vertex {vertex}, but the mesh has {len(polygons.vertices)}"
            )
    places, swaps, mirrored = repair_sides(_brought(given.points, places, list(vertices), path))
    for a, b in swaps:
        found = {b: vertices.pop(a, None), a: vertices.pop(b, None)}
        vertices |= {name: vertex for name, vertex in found.items() if vertex is not None}
    for name in mirrored:
        vertices.pop(name, None)
    if swaps or mirrored:
        warnings.warn(
            f"{path}: feature points of the wrong side of the face put right: "
            f"{', '.join([*mirrored, *(f'{a} with {b}' for a, b in swaps)][:8])}",
            FbaWarning,
            stacklevel=4,
        )
    return places, vertices


def _brought(said: Float64, placed: Float64, chosen: list[str], path: str) -> Float64:
    """Positions of points without a vertex, converted to the unit and origin of those with one.

    Warns of positions that do not agree with their vertices.
    """
    rows = [row_of()[name] for name in chosen if np.isfinite(said[row_of()[name]]).all()]
    if len(rows) < FEWEST_PAIRS:
        return placed
    a, b = said[rows], placed[rows]
    # medians: a few that disagree do not pull at the unit
    centres = np.median(a, axis=0), np.median(b, axis=0)
    a, b = a - centres[0], b - centres[1]
    far = np.linalg.norm(a, axis=1)
    spread = far > 0.3 * far.max()
    if not spread.any() or not far.max() > 0:
        return placed
    ratio = float(np.median(np.linalg.norm(b[spread], axis=1) / far[spread]))
    away = np.linalg.norm(a * ratio - b, axis=1) > 0.05 * np.ptp(b, axis=0).max()
    names_ = [names()[row] for row, bad in zip(rows, away, strict=True) if bad]
    if names_:
        warnings.warn(
            f"{path}: {len(names_)} of {len(rows)} feature points do not lie where their vertices are "
            f"({', '.join(names_[:8])}{', ...' if len(names_) > 8 else ''}); the vertices are taken",
            FbaWarning,
            stacklevel=5,
        )
    rest = [row for row in range(len(placed)) if names()[row] not in chosen]
    placed[rest] = (placed[rest] - centres[0]) * ratio + centres[1]
    return placed


def _materials(path: str | os.PathLike[str]) -> dict[str, Material]:
    found: dict[str, Material] = {}
    for line, text in read_lines(path):
        if text.startswith("mtllib") and line < 10000:
            found |= read_mtl(path, text[6:].strip())
    return found

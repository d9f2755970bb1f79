"""Xface's FDP files (XML): mesh files, and which vertices follow which FAP around which point."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from fba.arrays import Float64
from fba.errors import ModelError
from fba.face.feature_points import names, row_of
from fba.face.importers.points._fdp_data import Fdp, Influence, XfaceMesh, repair_sides_with_warning
from fba.mesh import read_vrml
from fba.parameters import FAP_COUNT, FIRST_LOW_LEVEL_FAP
from fba.text_files import find_beside, parse_integer, parse_number, read_bytes

DISTANCES = ("ENS0", "ES0", "IRISD0", "MNS0", "MW0")
NEUTRAL = "Rest"
"""Alias of the mesh file that shows the neutral face."""


def read_xface(path: str) -> Fdp:
    """Return an Xface file; positions are NaN until `xface_points` looks them up. ModelError for damage."""
    data = read_bytes(path)
    if b"<!DOCTYPE" in data or b"<!ENTITY" in data:
        raise ModelError(f"{path}: declares a DOCTYPE or entities, which Xface files do not need")
    try:
        root = ElementTree.fromstring(data)
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise ModelError(f"{path}: is not well-formed XML: {error}") from error
    if root.tag != "xfdp":
        raise ModelError(f"{path}: the outermost element of an Xface file is <xfdp>, not <{root.tag[:40]}>")
    units = {} if (fapu := root.find("head/fapu")) is None else fapu.attrib
    distances = {
        name: parse_number(units[name], path, f"{name} of <fapu>") for name in DISTANCES if name in units
    }
    meshes = []
    for entity in root.findall("source/entity"):
        mesh = entity.find("mesh")
        if mesh is not None and mesh.get("file"):
            bind = {b.get("submesh", ""): b.get("item", "") for b in entity.findall("bind")}
            meshes.append(
                XfaceMesh(entity.get("alias", ""), entity.get("category", ""), mesh.get("file", ""), bind)
            )
    vertices: dict[str, tuple[str, int]] = {}
    influences: list[Influence] = []
    for number, element in enumerate(root.iter("fdp"), start=1):
        where = f"{path}: <fdp> number {number}"
        name, mesh_name = element.get("name", ""), element.get("affects", "")
        if name not in row_of():
            raise ModelError(f"{where}: there is no feature point {name[:40]!r}")
        index = parse_integer(element.get("index", ""), where, "index, the vertex of the point,")
        inside = tuple(  # one for all influences
            parse_integer(token, where, "an index of a vertex")
            for block in element.findall("indices")
            for token in (block.text or "").split()
        )
        if min([index, *inside]) < 0:
            raise ModelError(f"{where}: vertex {min([index, *inside])} is negative")
        # the first one is the point itself; others attach other meshes to it (teeth to the chin)
        vertices.setdefault(name, (mesh_name, index))
        for influence in element.findall("influence"):
            # these files count FAPs from 0
            fap = parse_integer(influence.get("fap", ""), where, "fap of <influence>") + 1
            if not FIRST_LOW_LEVEL_FAP <= fap <= FAP_COUNT:
                raise ModelError(f"{where}: fap {fap - 1} of <influence> does not exist (counted from 0)")
            weight = parse_number(influence.get("weight", ""), where, "weight of <influence>")
            shape = influence.get("type", "")
            influences.append(Influence(fap, shape, weight, mesh_name, index, inside))
    if not vertices:
        raise ModelError(f"{path}: there is no <fdp> in it")
    points = np.full((len(names()), 3), np.nan)
    return Fdp(path, "xface", points, vertices, distances, tuple(meshes), tuple(influences))


def xface_submeshes(fdp: Fdp) -> dict[str, tuple[Path, int]]:
    """Return the mesh file and index in it of each submesh ("alice.wrl_3": the fourth shape of alice.wrl).

    Raises ModelError that says which mesh files are missing.
    """
    submeshes: dict[str, tuple[Path, int]] = {}
    missing: set[str] = set()
    for submesh in sorted({mesh for mesh, _ in fdp.vertices.values()} | {i.mesh for i in fdp.influences}):
        file, _, index = submesh.rpartition("_")
        if not file or not index.isascii() or not index.isdigit() or len(index) > 6:
            raise ModelError(f"{fdp.path}: {submesh[:40]!r} is not named FILE_NUMBER, as a submesh is")
        mesh = find_beside(fdp.path, file)
        if mesh is None:
            missing.add(file)
        else:
            submeshes[submesh] = (mesh, int(index))
    if missing:
        raise ModelError(
            f"{fdp.path}: needs {', '.join(sorted(missing))}, whose vertices it names, beside it; "
            "without the mesh it holds no positions"
        )
    return submeshes


def xface_points(fdp: Fdp) -> Float64:
    """Return the positions (84, 3) of the points of an Xface file, from its mesh files, in their unit."""
    submeshes = xface_submeshes(fdp)
    files = {path: read_vrml(path) for path in {path for path, _ in submeshes.values()}}
    points = np.full((len(names()), 3), np.nan)
    for name, (submesh, vertex) in fdp.vertices.items():
        path, index = submeshes[submesh]
        shapes = files[path]
        if index >= len(shapes) or vertex >= len(shapes[index].vertices):
            raise ModelError(
                f"{fdp.path}: feature point {name} is vertex {vertex} of shape {index} of {path.name}, "
                "which does not exist; is it the mesh this file was made for?"
            )
        points[row_of()[name]] = shapes[index].vertices[vertex]
    return repair_sides_with_warning(points, fdp.path, stacklevel=4)

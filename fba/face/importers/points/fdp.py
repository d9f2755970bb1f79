"""FDP files: the positions of the feature points of a face, as text or as the XML of Xface.

A text FDP file has a line `<group.index> x y z <mesh.vertex>` a point, as docs/formats.md says; an Xface file
names vertices of mesh files, and for each FAP the vertices around a point that follow it. Points on the wrong
side of the face are repaired.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from fba.arrays import Float64
from fba.errors import ModelError, warn
from fba.face.feature_points import MIRRORED, names
from fba.mesh import read_vrml
from fba.parameters import FAP_COUNT, FIRST_LOW_LEVEL_FAP, point_rows
from fba.text_files import find_beside, parse_integer, parse_number, read_bytes, read_words

DISTANCES = ("ENS0", "ES0", "IRISD0", "MNS0", "MW0")
NEUTRAL = "Rest"
"""Alias of the mesh file that shows the neutral face."""


@dataclass(frozen=True, slots=True)
class Influence:
    """Vertices of an Xface mesh that follow a FAP, less with distance from the point.

    fap: its number. shape: the file's name for the falloff. weight: at the point itself. mesh: the
    submesh; point: the vertex in it; vertices: those that follow.
    """

    fap: int
    shape: str
    weight: float
    mesh: str
    point: int
    vertices: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class XfaceMesh:
    """A mesh file that an Xface file names. alias, category: what it shows ("Rest", "Expression").

    bind: what its submeshes are, by the file's word ("LeftEye", "UpperTeeth", "Hair").
    """

    alias: str
    category: str
    file: str
    bind: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Fdp:
    """The content of an FDP file.

    path: the file. format: "text" or "xface". points: float64 (84, 3), in the file's own unit, NaN where
    it gives none. vertices: the mesh (as the file names it) and the vertex of a point, by its name.
    distances: the face's distances ENS0, ES0, IRISD0, MNS0, MW0 as Xface files give them. meshes,
    influences: of Xface files.
    """

    path: str
    format: str
    points: Float64
    vertices: Mapping[str, tuple[str, int]]
    distances: Mapping[str, float] = field(default_factory=dict)
    meshes: tuple[XfaceMesh, ...] = ()
    influences: tuple[Influence, ...] = ()


def repair_sides_with_warning(points: Float64, path: str, *, stacklevel: int = 2) -> Float64:
    """Return the points (84, 3), sides repaired by `repair_sides`; an FbaWarning names the changes."""
    right, swaps, mirrored = repair_sides(points)
    changed = [f"{a} and {b} have changed places" for a, b in swaps]
    changed += [f"{name} is on the other side" for name in mirrored]
    if changed:
        warn(
            f"{path}: corrected (+x is the subject's left): {'; '.join(changed[:6])}"
            + (f"; and {len(changed) - 6} more" if len(changed) > 6 else ""),
            stacklevel=stacklevel + 1,
        )
    return right


def repair_sides(points: Float64) -> tuple[Float64, list[tuple[str, str]], list[str]]:
    """Return points (84, 3) on their sides of the face, pairs that were swapped, and points mirrored.

    Unchanged where most pairs do not lie left and right in x: then the axes are not the standard's.
    """
    points = points.copy()
    row = point_rows()
    midline = points[[row[name] for name in ("2.1", "2.2", "2.3", "2.10", "8.1", "8.2", "9.3", "9.15")], 0]
    middle = float(np.nanmedian(midline)) if np.isfinite(midline).any() else 0.0
    swaps: list[tuple[str, str]] = []
    mirrored: list[str] = []
    pairs = points[[(row[left], row[right]) for left, right in MIRRORED.items()], 0] - middle
    apart = np.sign(pairs[:, 0]) * np.sign(pairs[:, 1])
    if (apart == -1).sum() < (apart >= 0).sum():
        return points, swaps, mirrored

    def swap(a: str, b: str) -> None:
        points[[row[a], row[b]]] = points[[row[b], row[a]]]
        swaps.append((a, b))

    for left, right in MIRRORED.items():
        x, y = points[row[left], 0] - middle, points[row[right], 0] - middle
        if x < 0 < y:
            swap(left, right)
            continue
        for name, wrong in ((left, x < 0), (right, y > 0)):
            if wrong:
                points[row[name], 0] = 2 * middle - points[row[name], 0]
                mirrored.append(name)
    for inner, outer in (("3.8", "3.12"), ("3.7", "3.11")):
        # of both corners of an eye, the first one is further to the left
        if points[row[inner], 0] < points[row[outer], 0]:
            swap(inner, outer)
    return points, swaps, mirrored


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
        if name not in point_rows():
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
        points[point_rows()[name]] = shapes[index].vertices[vertex]
    return repair_sides_with_warning(points, fdp.path, stacklevel=4)


def read_fdp_points(path: str | os.PathLike[str]) -> Float64:
    """Return the feature points of an FDP file: float64 (84, 3), in the file's unit, NaN for those not in it.

    A point on the wrong side of the face, or eye corners that are swapped, are corrected with an
    FbaWarning. An Xface file names vertices of mesh files; the points are looked up there. Raises
    ModelError where the file is damaged or its mesh files are missing.
    """
    fdp = read_fdp(path)
    if fdp.format == "xface":
        return xface_points(fdp)
    return fdp.points


def read_fdp(path: str | os.PathLike[str]) -> Fdp:
    """Return the content of an FDP file, points repaired as by `read_fdp_points`. ModelError for damage."""
    name = os.fspath(path)
    if read_bytes(name)[:4096].lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"<"):
        return read_xface(name)
    return _load_text(name)


def _load_text(path: str) -> Fdp:
    points = np.full((len(names()), 3), np.nan)
    vertices: dict[str, tuple[str, int]] = {}
    unknown: list[str] = []
    header = False
    for where, tokens in read_words(path):
        if not header:
            if len(tokens) < 2 or not tokens[0].startswith("1."):
                raise ModelError(
                    f"{where}: an FDP file begins with '1.0 NAME', not {' '.join(tokens)[:40]!r}"
                )
            header = True
        elif tokens[0] in ("NUL", "NLL"):
            continue  # the number of points of the inner lips, for another player
        elif len(tokens) not in (4, 5):
            raise ModelError(
                f"{where}: a feature point is 'GROUP.INDEX x y z MESH.VERTEX', not {' '.join(tokens)[:60]!r}"
            )
        elif tokens[0] not in point_rows():
            unknown.append(tokens[0])
        else:
            point = tokens[0]
            if np.isfinite(points[point_rows()[point]]).any():
                raise ModelError(f"{where}: feature point {point} is listed twice")
            points[point_rows()[point]] = [
                parse_number(token, where, "a coordinate") for token in tokens[1:4]
            ]
            if len(tokens) == 5:
                mesh, _, vertex = tokens[4].partition(".")
                index = parse_integer(vertex, where, "the vertex in MESH.VERTEX")
                if index >= 0:
                    vertices[point] = (mesh, index)
    if not np.isfinite(points).any():
        raise ModelError(f"{path}: contains no feature points")
    if unknown:
        warn(
            f"{path}: left out {', '.join(unknown[:5])}: the standard has no such feature point", stacklevel=4
        )
    return Fdp(path, "text", repair_sides_with_warning(points, path, stacklevel=4), vertices)

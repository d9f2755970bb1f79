"""FDP files as faces: with the mesh that lies beside them."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from fba.errors import ModelError
from fba.face.feature_points import names, row_of
from fba.face.importers.assembly.model import finish_import
from fba.face.importers.assembly.pieces import Piece
from fba.face.importers.assembly.polygon_parts import make_part
from fba.face.importers.mesh import READERS, import_mesh
from fba.face.importers.points.fdp import load_fdp
from fba.face.importers.points.fdp_data import Fdp
from fba.face.importers.points.points_file import GivenPoints
from fba.face.importers.points.xface import NEUTRAL, xface_points
from fba.face.model import FaceModel
from fba.mesh.vrml import read_vrml

BINDS = {
    "LeftEye": "eye",
    "RightEye": "eye",
    "LowerTeeth": "teeth",
    "UpperTeeth": "teeth",
    "Tongue": "tongue",
    "Hair": "hair",
}
"""Xface's words for what a submesh is -> kinds of parts."""


def import_fdp(
    path: str | os.PathLike[str],
    *,
    unit: float | None = None,
    up: str = "y",
    kinds: Mapping[str, str] | None = None,
    name: str | None = None,
) -> FaceModel:
    """A face from an FDP file and its mesh: a .wfm, .obj or .ply of the same name, or Xface's .wrl files.

    Raises ModelError where the mesh is missing.
    """
    fdp = load_fdp(path)
    if fdp.format == "xface":
        return _xface(fdp, unit=unit, up=up, kinds=kinds, name=name)
    place = Path(path)
    for form in ("wfm", "obj", "ply"):
        mesh = place.with_suffix(f".{form}")
        if form in READERS and mesh.is_file():
            given = GivenPoints(fdp.points, {point: vertex for point, (_, vertex) in fdp.vertices.items()})
            return import_mesh(mesh, form, points=given, unit=unit, up=up, kinds=kinds, name=name)
    raise ModelError(
        f"{place}: an FDP file says where feature points are, but brings no mesh; put {place.stem}.wfm, .obj "
        "or .ply beside it, or fit a head that is there to its points: fba model fit"
    )


def _xface(
    fdp: Fdp, *, unit: float | None, up: str, kinds: Mapping[str, str] | None, name: str | None
) -> FaceModel:
    """The neutral mesh of an Xface face. Its regions and weights are for the eye, not to the standard's
    measure (a point follows its FAP by a tenth to a third), so tables are made anew."""
    points = xface_points(fdp)
    neutral = [mesh for mesh in fdp.meshes if mesh.alias == NEUTRAL]
    if not neutral:
        raise ModelError(f"{fdp.path}: no mesh is called {NEUTRAL!r}, the neutral face")
    file = Path(fdp.path).parent / Path(neutral[0].file).name
    bind = dict(neutral[0].bind)
    pieces, chosen = [], dict(kinds or {})
    numbers: dict[str, int] = {}
    start = 0
    for place, shape in enumerate(read_vrml(file)):
        label = f"{file.name}_{place}"
        if len(shape):
            source = make_part(shape, np.ones(len(shape), dtype=np.bool_), label, "other")
            pieces.append(Piece(source.part, "", source.origin + np.int32(start)))
            chosen.setdefault(label, BINDS.get(bind.get(label, ""), "skin"))
        for point, (submesh, vertex) in fdp.vertices.items():
            if submesh == label:
                numbers[point] = start + vertex
        start += len(shape.vertices)
    known = [n for n, p in zip(names(), points, strict=True) if np.isfinite(p).all()]
    numbers = {point: number for point, number in numbers.items() if point in known and point in row_of()}
    return finish_import(
        pieces, points, numbers, path=file, unit=unit, up=up, kinds=chosen, name=name or Path(fdp.path).stem
    )

"""Imports FDP files with the mesh that lies beside them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from fba.errors import ModelError
from fba.face.feature_points import row_of
from fba.face.importers._mesh import import_mesh
from fba.face.importers.assembly._polygon_parts import make_piece
from fba.face.importers.assembly.model import ImportOptions, finish_import
from fba.face.importers.points._fdp_data import Fdp
from fba.face.importers.points.fdp import read_fdp
from fba.face.importers.points.points_file import GivenPoints
from fba.face.importers.points.xface import NEUTRAL, xface_points
from fba.face.model import FaceModel
from fba.mesh import read_vrml

BINDS = {
    "LeftEye": "eye",
    "RightEye": "eye",
    "LowerTeeth": "teeth",
    "UpperTeeth": "teeth",
    "Tongue": "tongue",
    "Hair": "hair",
}
"""Kinds of parts by Xface's words for what a submesh is."""


def import_fdp(options: ImportOptions) -> FaceModel:
    """Return a face from an FDP file and its mesh: a .wfm, .obj or .ply of the same name, or Xface's .wrl
    files.

    Raises ModelError where the mesh is missing.
    """
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
        point: vertex for point, vertex in numbers.items() if np.isfinite(points[row_of()[point]]).all()
    }
    return finish_import(pieces, points, numbers, replace(options, path=file, kinds=kinds))

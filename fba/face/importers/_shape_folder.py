"""Imports a folder of OBJ meshes: a neutral face, and one file for each of its shapes, `jawOpen.obj`."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np

from fba.arrays import Float32
from fba.errors import ModelError
from fba.face.importers._mesh import polygon_pieces, read_materials
from fba.face.importers._shaped import import_shaped, match_sides
from fba.face.importers.assembly._polygon_parts import Piece
from fba.face.importers.assembly.model import ImportOptions
from fba.face.model import FaceModel
from fba.mesh import read_obj

NEUTRAL = re.compile("neutral|basis", re.IGNORECASE)
"""Part of the name of the file that holds the neutral face."""
MAX_FILES = 1000
"""Number of meshes in a folder, at most."""


def neutral_file(folder: Path) -> Path | None:
    """Return the mesh of a folder that is its neutral face, if there is one; ModelError for several."""
    found = [path for path in _meshes(folder) if NEUTRAL.search(path.stem)]
    if len(found) > 1:
        known = ", ".join(path.name for path in found)
        raise ModelError(f"{folder}: one file must be the neutral face, but these are named so: {known}")
    return found[0] if found else None


def _meshes(folder: Path) -> list[Path]:
    return sorted(path for path in folder.iterdir() if path.suffix.lower() == ".obj")


def import_shape_folder(options: ImportOptions, points: object = None) -> FaceModel:
    """Return a face from a folder of OBJ files, one the neutral face, the others its shapes.

    Files are named as their shapes, see `import_shaped`, and have the vertices of the neutral face in the
    same order. points: as `import_model`. Raises ModelError as `import_model`.
    """
    folder = Path(options.path)
    neutral = neutral_file(folder) if folder.is_dir() else None
    if neutral is None:
        raise ModelError(f"{folder}: is no folder with an .obj file that has 'neutral' in its name")
    pieces = match_sides(_read_pieces(neutral, [path for path in _meshes(folder) if path != neutral]))
    return import_shaped(pieces, replace(options, path=neutral), points)


def _read_pieces(neutral: Path, files: list[Path]) -> list[Piece]:
    """Return the pieces of a neutral face with the shapes that some files hold."""
    if len(files) > MAX_FILES:
        raise ModelError(f"{neutral.parent}: has {len(files)} meshes; at most {MAX_FILES} are read")
    polygons = read_obj(neutral)
    pieces = polygon_pieces(polygons, read_materials(neutral), neutral)
    shapes: dict[str, Float32] = {}
    for file in files:
        vertices = read_obj(file).vertices
        if vertices.shape != polygons.vertices.shape:
            raise ModelError(
                f"{file}: has {len(vertices)} vertices, but {neutral.name} {len(polygons.vertices)}; shapes "
                "must be exported with the vertices of the neutral face in the same order, and other meshes "
                "be kept elsewhere"
            )
        shapes[file.stem] = (vertices - polygons.vertices).astype(np.float32)
    return [
        replace(piece, morphs={name: shift[piece.origin] for name, shift in shapes.items()})
        for piece in pieces
    ]

"""Imports heads with shapes: of both sides or of each, with feature points given or found by the shapes.

The pieces are those of a glTF file, or of a folder of OBJ meshes: a neutral face, and a file for each shape.
"""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from fba.arrays import Float32, Float64
from fba.errors import ModelError
from fba.face.feature_points import names
from fba.face.importers._mesh import polygon_pieces, read_materials
from fba.face.importers.assembly._pieces import assemble
from fba.face.importers.assembly._polygon_parts import Piece
from fba.face.importers.assembly._repair import repair_tables
from fba.face.importers.assembly._symmetry import (
    MIRRORED_LIDS,
    MIRRORED_POINTS,
    MIRRORED_TABLES,
    asymmetry,
    mirror_faulty_lids,
    mirror_tables,
    stand_upright,
)
from fba.face.importers.assembly.model import ImportOptions, finish_import, turn_upright
from fba.face.importers.points.points_file import given_points, points_beside
from fba.face.model import FaceModel
from fba.face.shape_names import arkit_names, arkit_of, canonical_names
from fba.mesh import read_obj
from fba.parameters import point_rows
from fba.sampling import smoothstep

POINT_FILES = (".points.csv", ".points.json", ".fdp")
"""Endings of files beside a head with shapes in which its feature points are sought."""
BOTH_SIDES = {
    "eyesclosed": "eyeBlink", "eyeblink": "eyeBlink", "eyesblink": "eyeBlink", "blink": "eyeBlink",
    "vrcblink": "eyeBlink", "fcleyeclose": "eyeBlink", "mouthsmile": "mouthSmile", "smile": "mouthSmile",
}  # fmt: skip
"""ARKit's names, without the side, of shapes of both sides (in small letters only)."""
MOVED_SHARE = 0.2
"""Share of a shape's largest motion above which a vertex shows where the shape is."""
BLEND_WIDTH = 0.1
"""Width over which one side goes over into the other, as a share of the width of what moves."""


HALF = re.compile(r"[ _.-]?(?:L|R|[Ll]eft|[Rr]ight)$")
"""The end of the name of a shape of one side."""
NEUTRAL = re.compile("neutral|basis", re.IGNORECASE)
"""Part of the name of the file that holds the neutral face."""
MAX_FILES = 1000
"""Number of meshes in a folder, at most."""


def import_shaped(pieces: list[Piece], options: ImportOptions, points: object = None) -> FaceModel:
    """Return a face from pieces with shapes. points: as `import_model`, else from a file beside the source.

    Shapes named as ARKit's blendshapes, or as FAPs, give tables; feature points that are not given are
    located by them.
    """
    path = options.path
    given = given_points(points) if points is not None else points_beside(Path(path), POINT_FILES)
    if given is None:
        return _import_without_points(pieces, options)
    numbers = np.concatenate([piece.origin for piece in pieces])
    vertices = np.full((int(numbers.max()) + 1, 3), np.nan)
    vertices[numbers] = np.concatenate([piece.part.vertices for piece in pieces])
    positions = given.points.copy()
    for name, vertex in given.vertices.items():
        if vertex >= len(vertices) or np.isnan(vertices[vertex, 0]):
            raise ModelError(f"{path}: feature point {name} is vertex {vertex}, which no triangle has")
        positions[point_rows()[name]] = vertices[vertex]
    return finish_import(pieces, positions, given.vertices, options)


def _import_without_points(pieces: list[Piece], options: ImportOptions) -> FaceModel:
    """Return a face from pieces whose feature points must be located."""
    upright, points, uneven, notes = locate(pieces, options)
    model = finish_import(upright, points, {}, replace(options, up="y"), notes, given=False)
    if uneven >= MIRRORED_TABLES:
        return model
    # the mirror image of a sound motion may fold a triangle that has none on the other side
    note = ("symmetry", "both sides differ a little for {}: left as they are")
    mirrored = repair_tables(mirror_tables(model, lids=uneven < MIRRORED_LIDS), model, note=note)
    return mirrored if uneven < MIRRORED_LIDS else mirror_faulty_lids(mirrored)


def locate(pieces: list[Piece], options: ImportOptions) -> tuple[list[Piece], Float64, float, dict[str, str]]:
    """Return (pieces stood upright, feature points (84, 3), asymmetry, notes); errors as `find_points`."""
    from fba.face.importers.assembly._landmarks import find_eyes, find_points

    path = os.fspath(options.path)
    upright, _ = turn_upright(pieces, np.full((len(names()), 3), np.nan), options.up)
    assembled = assemble(upright, options.kinds)
    eyes = find_eyes(assembled, path)
    notes = {"feature points": "found by the shapes of the head, not given"}
    upright, angle = stand_upright(upright, eyes["left"].centre, eyes["right"].centre, assembled)
    if angle:
        notes["position"] = f"turned by {np.degrees(angle):.1f} degrees, so that both sides are level"
        assembled = assemble(upright, options.kinds)
        eyes = find_eyes(assembled, path)
    uneven = asymmetry(assembled, eyes["left"].centre, eyes["right"].centre)
    points = find_points(assembled, path, symmetric=uneven < MIRRORED_POINTS, exactly=uneven < MIRRORED_LIDS)
    return upright, points, uneven, notes


def match_sides(pieces: Sequence[Piece]) -> list[Piece]:
    """Return the pieces with shapes of one side and of both, as ARKit has them, made of those of the file."""
    return _join_sides(_split_sides(pieces))


def _split_sides(pieces: Sequence[Piece]) -> list[Piece]:
    """Return the pieces, with shapes of both sides also cut into shapes of each side that the file lacks."""
    result = list(pieces)
    known = canonical_names(sorted({name for piece in pieces for name in piece.morphs}))
    for name in sorted({name for piece in pieces for name in piece.morphs}):
        shape = BOTH_SIDES.get(re.sub("[^a-z]", "", re.split(r"[.:|/]", name)[-1].lower()))
        shape = shape or BOTH_SIDES.get(re.sub("[^a-z]", "", name.lower()))
        sides = (f"{shape}Left", f"{shape}Right")
        if shape is None or any(side in known for side in sides):
            continue
        ends = _ends(result, name)
        if ends is None:
            continue
        known |= dict.fromkeys(sides, name)
        middle, width = sum(ends) / 2, BLEND_WIDTH * (ends[1] - ends[0])
        for k, piece in enumerate(result):
            if name in piece.morphs:
                x = piece.part.vertices[:, 0].astype(np.float64)
                left = smoothstep((x - middle) / max(width, 1e-12) + 0.5)[:, None].astype(np.float32)
                morph = piece.morphs[name]
                both = {sides[0]: morph * left, sides[1]: morph * (1 - left)}
                result[k] = replace(piece, morphs={**piece.morphs, **both})
    return result


def _ends(pieces: Sequence[Piece], name: str) -> tuple[float, float] | None:
    """Return the least and the largest x of what a shape moves; None where it moves nothing."""
    moving = [
        (piece.part.vertices, np.linalg.norm(piece.morphs[name], axis=1))
        for piece in pieces
        if name in piece.morphs
    ]
    most = max((float(size.max(initial=0.0)) for _, size in moving), default=0.0)
    if not most > 0:
        return None
    x = np.concatenate([vertices[size > MOVED_SHARE * most, 0] for vertices, size in moving])
    return float(x.min()), float(x.max())


def _join_sides(pieces: Sequence[Piece]) -> list[Piece]:
    """Return the pieces, with shapes of each side added up to those that ARKit has for both only.

    "cheekPuff_L" and "cheekPuff_R" are together "cheekPuff".
    """
    result = list(pieces)
    written = sorted({name for piece in pieces for name in piece.morphs})
    known = canonical_names(written)
    for shape in arkit_names():
        halves = [name for name in written if HALF.search(name) and arkit_of(HALF.sub("", name)) == shape]
        if shape in known or HALF.search(shape) or len(halves) != len(("left", "right")):
            continue
        for k, piece in enumerate(result):
            moving = [piece.morphs[name] for name in halves if name in piece.morphs]
            if moving:
                result[k] = replace(piece, morphs={**piece.morphs, shape: np.sum(moving, axis=0)})
    return result


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

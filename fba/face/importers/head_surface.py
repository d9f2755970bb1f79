"""The surface of a head as in its file, with the feature points given or located so far.

For placing the others by hand: vertices keep the numbers, unit and axes of the file.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from fba.arrays import Float64, Int32
from fba.choices import UpAxis
from fba.errors import ModelError, OptionError
from fba.face.authoring.surface.binding import bind_points, face_size, separate_lips
from fba.face.authoring.surface.landmarks import weld_skin
from fba.face.feature_points import names
from fba.face.importers import sniff
from fba.face.importers._gltf import gltf_pieces
from fba.face.importers._mesh import POINT_FILES, READERS, polygon_pieces, read_materials
from fba.face.importers._shaped import POINT_FILES as SHAPED_POINT_FILES
from fba.face.importers._shaped import locate
from fba.face.importers.assembly._landmarks import find_eye_points
from fba.face.importers.assembly._pieces import DROPPED, assemble, check_kinds, kind_of
from fba.face.importers.assembly._polygon_parts import Piece
from fba.face.importers.assembly.model import AXES, ImportOptions, turn_upright
from fba.face.importers.points.points_file import GivenPoints, given_points, points_beside
from fba.face.model import FaceModel, Part
from fba.limits import DEFAULT_LIMITS, Limits

OTHERS = {
    "makehuman": "MakeHuman's base mesh has its feature points: import it as it is",
    "shapes": "the points of a face with shapes are found by these; give its neutral mesh to place others",
    "fdp": "an FDP file has its own feature points; give its mesh (.obj, .ply, .wfm) to place others",
}
"""Kinds of files whose points need no placing, and why."""


@dataclass(frozen=True, eq=False)
class HeadSurface:
    """A head without tables.

    path: of its file. parts: its surfaces, in the file's unit and axes. vertices: float64 (N, 3), the file's
    own. triangles: int32 (F, 3), of all parts, in the file's vertex numbers. part_of: int32 (F,), the number
    of each triangle's part. given: the points known so far. origin: how these were found in words, "" if
    none was given. up: the file's vertical axis.
    """

    path: str
    parts: tuple[Part, ...]
    vertices: Float64
    triangles: Int32
    part_of: Int32
    given: GivenPoints = field(default_factory=lambda: GivenPoints(np.full((len(names()), 3), np.nan)))
    origin: str = ""
    up: UpAxis = "y"

    @property
    def upright(self) -> Float64:
        """(3, 3) rotation from the file's axes to +x left, +y up, +z forward."""
        return np.array(AXES[self.up], dtype=np.float64)


def read_head_surface(
    path: str | os.PathLike[str],
    *,
    kind: str | None = None,
    points: object = None,
    up: UpAxis = "y",
    kinds: Mapping[str, str] | None = None,
    limits: Limits = DEFAULT_LIMITS,
) -> HeadSurface:
    """Return the surface of a head, with its points as `import_model` would get them, as far as it would.

    Arguments as of `import_model`. Transparent shells in front of the eyes, and parts without triangles, are
    left out. Raises ModelError for a file that is damaged, unknown, or needs no points; OptionError for an
    unknown axis.
    """
    if up not in AXES:
        raise OptionError(f"up must be one of {', '.join(AXES)}, not {up!r}")
    given_kinds = check_kinds(kinds)
    form = sniff(path) if kind is None else kind
    name = os.fspath(path)
    if form in OTHERS:
        raise ModelError(f"{name}: {OTHERS[form]}")
    own: FaceModel | None = None
    beside: tuple[str, ...]
    if form == "gltf":
        pieces, has_extension = gltf_pieces(path, limits)
        vertices = np.concatenate([piece.part.vertices for piece in pieces]).astype(np.float64)
        beside = SHAPED_POINT_FILES
        own = FaceModel.load(path, limits=limits) if has_extension else None
    else:
        polygons = READERS[form](path)
        pieces = polygon_pieces(polygons, read_materials(path) if form == "obj" else {}, path)
        vertices, beside = polygons.vertices.astype(np.float64), POINT_FILES
    given = given_points(points) if points is not None else None
    origin = "given" if given is not None else ""
    if given is None and own is not None:
        given, origin = GivenPoints(own.points), "of the model"
    if given is None:
        given = points_beside(Path(path), beside)
        origin = f"from the file beside {Path(path).name}" if given is not None else ""
    if given is None:
        given, origin = _find(pieces, ImportOptions(path, "head", None, up, kinds, limits))
    elif not given.vertices:  # vertices say which lip is meant
        turned, positions = turn_upright(pieces, given.points, up)
        given = _in_file(pieces, turned, assemble(turned, kinds), positions)
    _check_numbers(given, len(vertices), name)
    shown = [
        piece for piece in pieces if len(piece.part.triangles) and kind_of(piece, given_kinds) != DROPPED
    ]
    if not shown:
        raise ModelError(f"{name}: contains no triangles; export the head as a mesh")
    return HeadSurface(
        name,
        tuple(piece.part for piece in shown),
        vertices,
        np.concatenate([piece.origin[piece.part.triangles] for piece in shown]).astype(np.int32),
        np.repeat(np.arange(len(shown)), [len(piece.part.triangles) for piece in shown]).astype(np.int32),
        given,
        origin,
        up,
    )


def _check_numbers(given: GivenPoints, count: int, path: str) -> None:
    for name, vertex in given.vertices.items():
        if vertex >= count:
            raise ModelError(f"{path}: feature point {name} is vertex {vertex}, but the mesh has {count}")


def _find(pieces: Sequence[Piece], options: ImportOptions) -> tuple[GivenPoints, str]:
    """Return (the points that the importer finds by itself, how): all of them, those of the eyes, or none."""
    path = os.fspath(options.path)
    try:
        upright, points, _, _ = locate(list(pieces), options)
    except ModelError:
        upright, _ = turn_upright(pieces, np.full((len(names()), 3), np.nan), options.up)
        assembled = assemble(upright, options.kinds)
        eyes = find_eye_points(assembled, path)
        found = bool(np.isfinite(eyes).any())
        return _in_file(pieces, upright, assembled, eyes), "found by the eyeballs" if found else ""
    return _in_file(pieces, upright, assemble(upright, options.kinds), points), "found by the shapes"


def _in_file(
    pieces: Sequence[Piece], upright: Sequence[Piece], assembled: Sequence[Piece], points: Float64
) -> GivenPoints:
    """Return points (84, 3) of upright pieces as the file's vertices, those on none as positions in its axes.

    assembled: the upright pieces as parts of a face.
    """
    if np.isfinite(points).all(axis=1).sum() < 2:
        return GivenPoints(np.full((len(names()), 3), np.nan))
    parts = [piece.part for piece in assembled]
    binding = bind_points(parts, points, None)
    binding = separate_lips(weld_skin(parts, binding.bound), parts, points, binding, face_size(points))
    numbers = np.concatenate([piece.origin for piece in assembled])
    vertices = {
        name: int(numbers[vertex])
        for name, vertex in zip(names(), binding.bound.tolist(), strict=True)
        if vertex >= 0 and numbers[vertex] >= 0
    }
    # the rotation back into the axes of the file
    before = np.concatenate([piece.part.vertices for piece in pieces]).astype(np.float64)
    after = np.concatenate([piece.part.vertices for piece in upright]).astype(np.float64)
    back, *_ = np.linalg.lstsq(np.column_stack([after, np.ones(len(after))]), before, rcond=None)
    positions = np.full((len(names()), 3), np.nan)
    for row, name in enumerate(names()):
        if name not in vertices and np.isfinite(points[row]).all():
            positions[row] = np.append(points[row], 1.0) @ back
    return GivenPoints(positions, vertices)

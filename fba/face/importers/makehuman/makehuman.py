"""MakeHuman's base mesh: the head and neck of it, with eyes, teeth, tongue, lashes and feature points.

Users give a copy of their own (the files are CC0). `makehuman.csv` says which vertices of the base
mesh "hm08" are the feature points, `makehuman_cuts.csv` where head and neck end, where the sockets behind
the eyeballs are cut off and where the inside of the mouth begins. The base mesh is in decimetres, +x the
subject's left, +y up, +z forward.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np

from fba.arrays import Bool, Float32, Float64, Int32
from fba.errors import ModelError, Remedy
from fba.face.importers.assembly._pieces import shift_piece
from fba.face.importers.assembly._polygon_parts import LOOKS, Piece, make_piece, polygon_components
from fba.face.importers.assembly.model import bind_by_number
from fba.face.model import FaceModel, Material, Part
from fba.mesh import Polygons, connected, read_obj
from fba.parameters import point_rows
from fba.text_files import find_beside, packaged_rows, parse_integer, parse_number, read_bytes, read_words

METRES = 0.1
"""Metres per unit of the base mesh."""
VERTICES = 19158
"""Number of vertices of the base mesh hm08."""
CROWN = 881
"""A vertex of the head."""
PALATE = 656
"""A vertex of the inside of the mouth."""
EYES_FILE = "high-poly.mhclo"
"""The eyes that are used if they lie beside the base mesh; otherwise its helper eyes are."""

HELPERS = (
    ("upper teeth", "teeth", ("helper-upper-teeth",)),
    ("lower teeth", "teeth", ("helper-lower-teeth",)),
    ("tongue", "tongue", ("helper-tongue",)),
    ("left lashes", "lash", ("helper-l-eyelashes-1", "helper-l-eyelashes-2")),
    ("right lashes", "lash", ("helper-r-eyelashes-1", "helper-r-eyelashes-2")),
)
"""Name, kind, groups of the base mesh."""


@dataclass(frozen=True, eq=False)
class MakeHumanHead:
    """The head of a base mesh, before it gets tables.

    folder: of the base mesh. base: all of it, in decimetres. pieces: their origins are vertices of the base
    mesh (-1 for eyes fitted from a file of their own). points: float64 (84, 3), metres; bound: int32 (84,),
    vertices counted through the pieces.
    """

    folder: Path
    base: Polygons
    pieces: tuple[Piece, ...]
    points: Float64
    bound: Int32

    @property
    def parts(self) -> tuple[Part, ...]:
        """The parts alone."""
        return tuple(piece.part for piece in self.pieces)


def read_makehuman(path: str | os.PathLike[str]) -> MakeHumanHead:
    """Return the head of a MakeHuman base mesh, its origin between the pupils.

    path: its `base.obj`, or the folder that holds it. Raises ModelError where the file is missing, damaged,
    or not the base mesh hm08.
    """
    file = base_file(path)
    base = read_obj(file)
    missing = [
        name for name in ("body", *(g for h in HELPERS for g in h[2])) if not base.in_groups(name).any()
    ]
    if len(base.vertices) != VERTICES or missing:
        raise ModelError(
            f"{file}: this is not MakeHuman's base mesh hm08: {len(base.vertices)} vertices instead of "
            f"{VERTICES}" + (f", no group {missing[0]!r}" if missing else "")
        ).with_remedies(Remedy("kind", "import another OBJ file with {} and its feature points", "'obj'"))
    pieces = [_skin(base), *_eyes(file, base)]
    for name, kind, groups in HELPERS:
        faces = base.in_groups(*groups)
        pieces.append(make_piece(base, faces, name, kind, scale=METRES, material=LOOKS[kind]))
    points, bound = _feature_points(base, pieces)
    pupils = points[[point_rows()["3.5"], point_rows()["3.6"]]]
    shift = -pupils.mean(axis=0)
    pieces = [shift_piece(piece, 1.0, shift) for piece in pieces]
    points = points + shift
    # float32 as the vertices are, so that bound points stand exactly on them
    everything = np.concatenate([piece.part.vertices for piece in pieces])
    points[bound >= 0] = everything[bound[bound >= 0]]
    return MakeHumanHead(file.parent, base, tuple(pieces), points, bound)


def base_file(path: str | os.PathLike[str]) -> Path:
    """Return the base mesh in a folder, or the file itself; ModelError if it is missing."""
    path = Path(path)
    for name in ("base.obj", "3dobjs/base.obj", "data/3dobjs/base.obj"):
        if (path / name).is_file():
            return path / name
    if path.is_dir():
        raise ModelError(
            f"{path}: this folder holds neither MakeHuman's base.obj nor a face as OBJ files, one with "
            "'neutral' in its name and one for each shape, such as jawOpen.obj"
        )
    return path


@cache
def _rows(name: str, key: str) -> dict[str, tuple[int, ...]]:
    rows = packaged_rows(__package__, name)
    return {row[key]: tuple(map(int, row["vertices"].split())) for row in rows}


def _head(base: Polygons) -> tuple[Bool, Bool]:
    """Return masks (F,) of the body's faces: those of the head, and of these the inside of the mouth.

    The head is what can be reached from the crown, the mouth what can be reached from the palate, without
    crossing a loop of `makehuman_cuts.csv`.
    """
    body = np.flatnonzero(base.in_groups("body"))
    starts, sizes = base.starts[body], np.diff(base.starts)[body]
    face = np.repeat(np.arange(len(body)), sizes)
    corner = np.arange(len(face)) - np.repeat(np.cumsum(sizes) - sizes, sizes)
    first = base.corners[starts[face] + corner].astype(np.int64)
    second = base.corners[starts[face] + (corner + 1) % sizes[face]].astype(np.int64)
    edge = np.minimum(first, second) << 32 | np.maximum(first, second)
    walls = []
    for loop in _rows("makehuman_cuts.csv", "loop").values():
        a = np.array(loop, dtype=np.int64)
        b = np.roll(a, -1)
        walls.append(np.minimum(a, b) << 32 | np.maximum(a, b))
    open_edges = ~np.isin(edge, np.concatenate(walls))
    edge, of_edge = edge[open_edges], face[open_edges]
    order = np.argsort(edge, kind="stable")
    edge, of_edge = edge[order], of_edge[order]
    shared = np.flatnonzero(edge[1:] == edge[:-1])
    label = connected(np.stack([of_edge[shared], of_edge[shared + 1]], axis=1), len(body))
    masks = []
    for start in (CROWN, PALATE):
        around = face[first == start]
        if not len(around):
            raise ModelError(f"the base mesh has no faces around vertex {start} of its head; is it damaged?")
        mask = np.zeros(len(base), dtype=np.bool_)
        mask[body[label == label[around[0]]]] = True
        masks.append(mask)
    return masks[0] | masks[1], masks[1]


def _skin(base: Polygons) -> Piece:
    """Return the skin, darker and redder inside the mouth."""
    head, mouth = _head(base)
    colours = np.tile(np.array([*LOOKS["skin"].colour, 0.4], dtype=np.float32), (len(base.vertices), 1))
    colours[base.used(mouth)] = (*LOOKS["mouth"].colour, 0.6)
    painted = replace(base, colours=colours)
    return make_piece(painted, head, "skin", "skin", scale=METRES, material=LOOKS["skin"])


def _eyes(file: Path, base: Polygons) -> list[Piece]:
    """Return left and right eyeball: the fitted eyes, else those of the base mesh."""
    clothes = find_beside(file, EYES_FILE)
    if clothes is None:
        sides = (("left eye", "helper-l-eye"), ("right eye", "helper-r-eye"))
        return [
            make_piece(base, base.in_groups(g), n, "eye", scale=METRES, material=LOOKS["eye"])
            for n, g in sides
        ]
    return eye_pieces(clothes, base.vertices)


def eye_pieces(clothes: Path, base: Float64) -> list[Piece]:
    """Return left and right eyeball of the eyes in an .mhclo file, fitted to a base mesh (V, 3)."""
    eyes = fit_clothes(clothes, base)
    picture = find_beside(clothes, "brown_eye.png")
    material = (
        Material("eye", (1.0, 1.0, 1.0), 0.1, read_bytes(picture)) if picture is not None else LOOKS["eye"]
    )
    pieces = []
    for name, side in (("left eye", 1.0), ("right eye", -1.0)):
        piece = make_piece(eyes, _eyeball(eyes, side), name, "eye", scale=METRES, material=material)
        pieces.append(replace(piece, origin=np.full(len(piece.origin), -1, dtype=np.int32)))
    return pieces


def _eyeball(eyes: Polygons, side: float) -> Bool:
    """Return the faces of an eyeball without the transparent cornea before it, which is a mesh by itself."""
    of_vertex, of_face = polygon_components(eyes)
    used = np.unique(eyes.corners)
    component, vertices = of_vertex[used], eyes.vertices[used]
    count = int(of_vertex.max(initial=0)) + 1
    across = np.bincount(component, vertices[:, 0] * side, count)
    front = np.full(count, -np.inf)
    np.maximum.at(front, component, vertices[:, 2])
    front[~(across > 0)] = np.inf
    best = int(front.argmin())
    if not np.isfinite(front[best]):
        raise ModelError(f"{EYES_FILE}: there is no {'left' if side > 0 else 'right'} eye in it")
    return np.asarray(of_face == best)


def _feature_points(base: Polygons, pieces: list[Piece]) -> tuple[Float64, Int32]:
    """Return (points (84, 3) in metres, origin as in the base mesh; vertices (84,) they are bound to)."""
    points = np.full((len(point_rows()), 3), np.nan)
    rows = _rows("makehuman.csv", "point")
    for name, vertices in rows.items():
        points[point_rows()[name]] = base.vertices[list(vertices)].mean(axis=0) * METRES
    single = {name: vertices[0] for name, vertices in rows.items() if len(vertices) == 1}
    bound = bind_by_number(pieces, single)
    start = 0
    for piece in pieces:
        part = piece.part
        if part.kind == "eye":
            row = point_rows()["3.5" if "left" in part.name else "3.6"]
            front = _front(part.vertices)
            points[row], bound[row] = part.vertices[front], start + front
        start += len(part.vertices)
    return points, bound


def _front(vertices: Float32) -> int:
    """Return the foremost vertex of an eyeball: of its front half, the one nearest to its axis."""
    middle = (vertices.min(axis=0) + vertices.max(axis=0)) / 2
    away = np.hypot(vertices[:, 0] - middle[0], vertices[:, 1] - middle[1])
    away[vertices[:, 2] < middle[2]] = np.inf
    return int(away.argmin())


def import_makehuman(path: str | os.PathLike[str], *, name: str = "MakeHuman") -> FaceModel:
    """Return the head of MakeHuman's base mesh with tables; ModelError as `read_makehuman`."""
    from fba.face.authoring import author

    head = read_makehuman(path)
    notes = {
        "source": "MakeHuman base mesh hm08, head and neck",
        "licence": "CC0, as stated in the file",
        "origin": "shifted between the pupils",
    }
    return author(head.parts, head.points, bound=head.bound, name=name, notes=notes)


def fit_clothes(path: Path, base: Float64) -> Polygons:
    """Return the mesh of an .mhclo file, placed on a base mesh (V, 3), in the base mesh's units.

    Each line after `verts` is either one vertex of the base, or three vertices, their weights and an
    offset; offsets are scaled by distances on the base mesh (`x_scale a b d`: |a - b| / d along x, and
    so on). Raises ModelError where the file or its OBJ file is missing or damaged.
    """
    scale = np.ones(3)
    mesh = None
    rows: list[Float64] = []
    reading = False
    for where, tokens in read_words(path):
        if tokens[0] == "obj_file" and len(tokens) > 1:
            mesh = find_beside(path, tokens[1])
        elif tokens[0] in ("x_scale", "y_scale", "z_scale") and len(tokens) == 4:
            axis = "xyz".index(tokens[0][0])
            ends = [_vertex(token, base, where) for token in tokens[1:3]]
            rest = parse_number(tokens[3], where, "a distance")
            if rest <= 0:
                raise ModelError(f"{where}: the distance of {tokens[0]} must be positive, not {tokens[3]}")
            scale[axis] = abs(base[ends[0], axis] - base[ends[1], axis]) / rest
        elif tokens[0] == "verts":
            reading = True
        elif reading and tokens[0][0].isdigit():
            rows.append(_position(tokens, base, scale, where))
        else:
            reading = False
    if mesh is None:
        raise ModelError(f"{path}: the mesh that its line 'obj_file' names is not in its folder")
    polygons = read_obj(mesh)
    if len(rows) != len(polygons.vertices):
        raise ModelError(
            f"{path}: gives positions for {len(rows)} vertices, but {mesh.name} has {len(polygons.vertices)}"
        )
    return replace(polygons, vertices=np.array(rows, dtype=np.float64))


def _vertex(token: str, base: Float64, where: str) -> int:
    index = parse_integer(token, where, "a vertex of the base mesh")
    if not 0 <= index < len(base):
        raise ModelError(f"{where}: vertex {index} of the base mesh does not exist; it has {len(base)}")
    return index


def _position(tokens: list[str], base: Float64, scale: Float64, where: str) -> Float64:
    """Return (3,) position of the vertex of one line."""
    if len(tokens) == 1:
        return np.asarray(base[_vertex(tokens[0], base, where)])
    if len(tokens) < 6:
        raise ModelError(f"{where}: one vertex, or three and their weights, are needed, not {len(tokens)}")
    corners = [_vertex(token, base, where) for token in tokens[:3]]
    weights = [parse_number(token, where, "a weight") for token in tokens[3:6]]
    offset = [parse_number(token, where, "an offset") for token in tokens[6:9]] or [0.0, 0.0, 0.0]
    if len(offset) != 3:
        raise ModelError(f"{where}: an offset has three numbers, not {len(offset)}")
    return np.asarray(weights @ base[corners] + np.array(offset) * scale, dtype=np.float64)

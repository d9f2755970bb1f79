"""The last step of every importer: metres, axes, origin, parts of their kinds, and tables."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from fba.arrays import Bool, Float64, Int32
from fba.choices import UpAxis
from fba.errors import ModelError, OptionError
from fba.face.feature_points import FREE_POINTS, names
from fba.face.importers.assembly._definitions import define_by_shapes
from fba.face.importers.assembly._pieces import assemble, shift_piece, turn_pieces
from fba.face.importers.assembly._polygon_parts import Piece, apply_default_materials
from fba.face.importers.assembly._repair import drop_false_pupils, repair_tables
from fba.face.importers.assembly._symmetry import stand_upright_by_points
from fba.face.importers.assembly._teeth_clearance import clear_teeth
from fba.face.model import FaceModel
from fba.limits import DEFAULT_LIMITS, Limits
from fba.parameters import point_rows

ADULT_PUPIL_DISTANCE = 0.062
"""Metres between the pupils of an adult."""
PUPIL_DISTANCES = (0.04, 0.08)
"""Limits of the distance between the pupils of a real head, metres."""
UNIT_SIZES = {"metres": 1.0, "decimetres": 0.1, "centimetres": 0.01, "millimetres": 0.001, "inches": 0.0254}
HEAD_RADIUS = 2.5
"""Distance from the middle of the head within which skin is that of the head, in distances of the pupils."""
AXES = {"y": ((1, 0, 0), (0, 1, 0), (0, 0, 1)), "z": ((1, 0, 0), (0, 0, 1), (0, -1, 0))}
"""Rotations to +x left, +y up, +z forward, by the vertical axis of a file; faces with z up look to -y."""
EYE_ROWS = [point_rows()[name] for name in ("3.5", "3.6", "3.1", "3.2", "3.7", "3.11", "3.8", "3.12")]


@dataclass(frozen=True)
class ImportOptions:
    """What a user says about a file. path: of the file; the others as in `import_model`."""

    path: str | os.PathLike[str]
    name: str
    unit: float | None = None
    up: UpAxis = "y"
    kinds: Mapping[str, str] | None = None
    limits: Limits = DEFAULT_LIMITS


def turn_upright(pieces: Sequence[Piece], points: Float64, up: UpAxis) -> tuple[list[Piece], Float64]:
    """Return the pieces and points of a file whose vertical axis is "y" or "z", with y up."""
    if up not in AXES:
        raise OptionError(f"up must be one of {', '.join(AXES)}, not {up!r}")
    if up == "y":
        return list(pieces), points
    matrix = np.array(AXES[up], dtype=np.float64)
    return turn_pieces(pieces, matrix), points @ matrix.T


def finish_import(
    pieces: Sequence[Piece],
    points: Float64,
    vertices: Mapping[str, int],
    options: ImportOptions,
    notes: Mapping[str, str] | None = None,
    *,
    given: bool = True,
) -> FaceModel:
    """Return a face from the pieces of a file and its feature points (84, 3), both in the file's unit.

    vertices: numbers of the vertices in the file that points stand on. given: the points were given, not
    found, and tell whether the head is turned aside or tilted. The face is converted to
    metres, with its origin between the pupils. Pieces with shapes get tables measured from them.
    """
    if not pieces:
        raise ModelError(f"{os.fspath(options.path)}: contains no triangles; export the head as a mesh")
    pieces, points = turn_upright(pieces, points, options.up)
    all_notes = {"source": Path(options.path).name, **(notes or {})}
    if given:
        pieces, points, angle = stand_upright_by_points(pieces, points)
        if angle:
            all_notes["position"] = f"turned by {np.degrees(angle):.1f} degrees, so that both sides are level"
    size, how = metres_per_unit(points, options.unit)
    pupils = points[[point_rows()["3.5"], point_rows()["3.6"]]]
    middle = float(np.nanmean(pupils[:, 0])) if np.isfinite(pupils[:, 0]).any() else None
    origin = pupils.mean(axis=0) if np.isfinite(pupils).all() else np.zeros(3)
    parts = [
        shift_piece(piece, size, -origin * size) for piece in assemble(pieces, options.kinds, middle=middle)
    ]
    # a point in the middle of the head, behind the pupils or the lids
    eyes = np.nanmean((points[EYE_ROWS] - origin) * size, axis=0)
    apart = pupil_distance(points) * size
    parts, turned = turn_outward(parts, eyes - (0.0, 0.0, 1.5 * apart), HEAD_RADIUS * apart)
    points = (points - origin) * size
    parts = apply_default_materials(parts, points)
    bound = bind_by_number(parts, vertices)
    everything = np.concatenate([piece.part.vertices for piece in parts]).astype(np.float64)
    points[bound >= 0] = everything[bound[bound >= 0]]
    all_notes["unit"] = how
    if turned:
        all_notes["triangles"] = f"{turned} turned to face outwards"
    return author_pieces(parts, points, bound, name=options.name, notes=all_notes)


def author_pieces(
    pieces: Sequence[Piece], points: Float64, bound: Int32, *, name: str, notes: Mapping[str, str]
) -> FaceModel:
    """Return the face of finished pieces, its tables made from their shapes, if any, else from the mesh."""
    parts = tuple(piece.part for piece in pieces)
    # without any vertex, `author` binds points to the nearest, and separates upper and lower lip
    known = bound if (bound >= 0).any() else None
    from fba.face.authoring import author

    face = author(parts, points, bound=known, name=name, notes=notes)
    shapes = sorted({shape for piece in pieces for shape in piece.morphs})
    if not shapes:
        return clear_teeth(drop_false_pupils(face))
    from fba.face.authoring._shapes.morphs import add_shapes

    morphs = {
        shape: {piece.part.name: piece.morphs[shape] for piece in pieces if shape in piece.morphs}
        for shape in shapes
    }
    made = add_shapes(face, morphs)
    repaired = drop_false_pupils(made if made is face else repair_tables(made, face))
    return define_by_shapes(clear_teeth(repaired), morphs)


def bind_by_number(pieces: Sequence[Piece], vertices: Mapping[str, int]) -> Int32:
    """Return int32 (84,): vertex of each point through the pieces, of its number in the file; else -1."""
    bound = np.full(len(names()), -1, dtype=np.int32)
    first: dict[int, int] = {}
    start = 0
    for piece in pieces:
        if len(piece.origin):
            numbers, where = np.unique(piece.origin, return_index=True)
            for number, vertex in zip(numbers.tolist(), where.tolist(), strict=True):
                first.setdefault(number, start + vertex)
        start += len(piece.part.vertices)
    for name, vertex in vertices.items():
        if name not in FREE_POINTS and vertex in first:
            bound[point_rows()[name]] = first[vertex]
    return bound


def metres_per_unit(points: Float64, unit: float | None = None) -> tuple[float, str]:
    """Return metres per unit of the mesh, and in words how they were determined.

    points: (84, 3). unit: given by the user, used unchanged. Otherwise the unit with which the pupils
    (3.5, 3.6; without them the eyes) stand as far apart as on a real head; where none does, as with
    Candide, the mesh is scaled to an adult's 62 mm. ModelError where that is unknown or `unit` not positive.
    """
    if unit is not None:
        if not (np.isfinite(unit) and unit > 0):
            raise ModelError(f"metres per unit must be positive, not {unit!r}")
        return float(unit), f"1 unit is {unit:g} m, as given"
    apart = pupil_distance(points)
    for name, size in UNIT_SIZES.items():
        if PUPIL_DISTANCES[0] <= apart * size <= PUPIL_DISTANCES[1]:
            return size, f"in {name}: the pupils are {apart * size * 1000:.1f} mm apart"
    return (
        ADULT_PUPIL_DISTANCE / apart,
        f"of no known unit: scaled so that the pupils are {ADULT_PUPIL_DISTANCE * 1000:.0f} mm apart",
    )


def pupil_distance(points: Float64) -> float:
    """Return the distance of the pupils, or of the middles of the eyes; ModelError where unknown."""
    row = point_rows()
    for left, right in ((("3.5",), ("3.6",)), (("3.7", "3.11"), ("3.8", "3.12")), (("3.1",), ("3.2",))):
        ends = [points[[row[name] for name in names]].mean(axis=0) for names in (left, right)]
        apart = float(np.linalg.norm(ends[0] - ends[1]))
        if np.isfinite(apart) and apart > 0:
            return apart
    raise ModelError("the pupils (feature points 3.5 and 3.6) are missing: without them a face has no units")


def turn_outward(pieces: Sequence[Piece], centre: Float64, reach: float = np.inf) -> tuple[list[Piece], int]:
    """Return pieces with the skin facing away from the centre of the head, and the count of turned triangles.

    reach: distance from the centre within which skin is that of the head; hands and feet of avatars, which
    may have its material, face anywhere as seen from there. Within the skin, triangles that run against their
    neighbours are turned first. When the skin was inside out the other pieces are taken to be so too.
    """
    masks = [np.zeros(len(piece.part.triangles), dtype=np.bool_) for piece in pieces]
    all_inside_out = False
    for number, part in enumerate(piece.part for piece in pieces):
        if part.kind == "skin":
            wrong = _opposing(part.triangles)
            triangles = _flip(part.triangles, wrong)
            vertices = part.vertices.astype(np.float64)
            near = np.linalg.norm(vertices[triangles].mean(axis=1) - centre, axis=1) < reach
            inside_out = float(_facing(vertices, triangles[near], centre).sum()) < 0
            all_inside_out |= inside_out
            masks[number] = wrong ^ inside_out
    if all_inside_out:
        masks = [m if p.part.kind == "skin" else ~m for p, m in zip(pieces, masks, strict=True)]
    turned = [_turn_triangles(p, m) if m.any() else p for p, m in zip(pieces, masks, strict=True)]
    return turned, int(sum(mask.sum() for mask in masks))


def _turn_triangles(piece: Piece, wrong: Bool) -> Piece:
    # normals of the file belong to the wrong sides: they are computed again
    part = replace(piece.part, triangles=_flip(piece.part.triangles, wrong), normals=None)
    return replace(piece, part=part)


def _flip(triangles: Int32, wrong: Bool) -> Int32:
    """Return triangles (F, 3), those of a mask (F,) turned over."""
    return np.where(wrong[:, None], triangles[:, ::-1], triangles)


def _facing(vertices: Float64, triangles: Int32, centre: Float64) -> Float64:
    """Return (F,) positive for triangles that face away from a centre, in proportion to their areas."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    return np.asarray(np.einsum("ij,ij->i", np.cross(b - a, c - a), (a + b + c) / 3 - centre))


def _opposing(triangles: Int32) -> Bool:
    """Return bool (F,): triangles to turn so that neighbours agree, at most half of each connected piece."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import breadth_first_order, connected_components

    count = len(triangles)
    ends = triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2).astype(np.int64)
    face = np.repeat(np.arange(count), 3)
    forward = ends[:, 0] < ends[:, 1]
    key = np.minimum(ends[:, 0], ends[:, 1]) << 32 | np.maximum(ends[:, 0], ends[:, 1])
    order = np.argsort(key, kind="stable")
    key, face, forward = key[order], face[order], forward[order]
    first = np.flatnonzero(key[1:] == key[:-1])
    # an edge of three or more triangles does not define sides
    crowded = np.zeros(len(key) + 1, dtype=np.bool_)
    triple = np.flatnonzero(key[2:] == key[:-2])
    crowded[triple] = crowded[triple + 1] = True
    first = first[~crowded[first]]
    if not len(first):
        return np.zeros(count, dtype=np.bool_)
    a, b = face[first], face[first + 1]
    clash = forward[first] == forward[first + 1]
    if not clash.any():
        return np.zeros(count, dtype=np.bool_)
    graph = coo_array((np.ones(len(a), dtype=np.int8), (a, b)), shape=(count, count)).tocsr()
    _, label = connected_components(graph, directed=False)
    sizes = np.bincount(label)
    doubtful = np.zeros(len(sizes), dtype=np.bool_)
    doubtful[label[a[clash]]] = True
    # one more triangle, a neighbour of the first of each doubtful piece, so that one walk reaches them all
    starts = np.unique(label, return_index=True)[1][doubtful]
    a_all, b_all = np.append(a, np.full(len(starts), count)), np.append(b, starts)
    size = count + 1
    graph = coo_array((np.ones(len(a_all), dtype=np.int8), (a_all, b_all)), shape=(size, size)).tocsr()
    walk, before = breadth_first_order(graph, count, directed=False)
    clashes = {(int(x), int(y)) for x, y in zip(a[clash], b[clash], strict=True)}
    wrong = np.zeros(count, dtype=np.bool_)
    for here in walk[1:].tolist():
        there = int(before[here])
        if there < count:
            wrong[here] = wrong[there] ^ ((there, here) in clashes or (here, there) in clashes)
    most = doubtful & (np.bincount(label, wrong, len(sizes)) > sizes / 2)
    wrong ^= most[label]
    return wrong

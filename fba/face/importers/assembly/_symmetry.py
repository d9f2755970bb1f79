"""Symmetric heads: stood upright, feature points mirrored, and FAPs of both sides made mirror images."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from fba.arrays import Float64, Intp
from fba.face._tables import FaceDefMesh, FaceDefTables
from fba.face.checks._fap_checks import count_errors
from fba.face.checks._posing import Poser
from fba.face.feature_points import MATES, MIRRORED
from fba.face.importers.assembly._pieces import turn_pieces
from fba.face.importers.assembly._polygon_parts import Piece
from fba.face.model import FaceModel
from fba.parameters import faps, point_rows
from fba.rotations import between

MIRRORED_POINTS = 0.02
"""Points are mirrored below this asymmetry: the 98th percentile of the vertices' distances from the mirror
image, by the distance of the eyes."""
MIRRORED_TABLES = 0.006
"""Below this asymmetry, tables are mirrored, too, except those of the lids."""
MIRRORED_LIDS = 0.003
"""Below this asymmetry, the tables of the lids are mirrored, too."""
LID_PAIRS = ((19, 20), (21, 22))
"""FAPs of the lids, left and right: their rows of vertices are the first that differ."""
MAX_REMAINING_SHARE = 0.5
"""A head is turned if this share of the distances from the mirror image remains at most."""
ANGLES = np.radians((0.2, 15.0))
"""Angles between the plane of symmetry and the upright one within which a head is turned."""
POINT_ANGLES = np.radians((2.0, 40.0))
"""The same for points that are given, which are no more exact than a hand."""
MIN_PAIRS = 4
"""Number of pairs of points, left and right, from which they tell how a head is turned."""
FACE_RADIUS = 1.6
"""Distance from the middle of the eyes, in those of the eyes, within which vertices belong to the face."""
NEIGHBOUR_WEIGHT = 0.1
"""Weight of the vector to the neighbours, beside the position, when mirror images are sought."""
CENTRAL_FAPS = (3, 4, 5, 14, 16, 17, 18, 51, 52, 63)
"""FAPs that move both sides alike."""


def stand_upright(
    pieces: Sequence[Piece], left: Float64, right: Float64, assembled: Sequence[Piece]
) -> tuple[list[Piece], float]:
    """Return (pieces turned so that a symmetric head's plane of symmetry is upright, the angle in radians).

    left, right: (3,) centres of the eyes. assembled: the same pieces as parts of a face. The angle is 0 where
    nothing was turned.
    """
    vertices = _face(assembled, left, right)
    normal = (left - right) / np.linalg.norm(left - right)
    angle = float(np.arccos(np.clip(normal[0], -1.0, 1.0)))
    if not ANGLES[0] < angle < ANGLES[1] or len(vertices) < 4:
        return list(pieces), 0.0
    middle = (left + right) / 2
    before, after = (
        float(np.median(_mirror_distances(vertices, middle, axis))) for axis in (np.eye(3)[0], normal)
    )
    if after > MAX_REMAINING_SHARE * before or after > MIRRORED_POINTS * float(np.linalg.norm(left - right)):
        return list(pieces), 0.0
    return turn_pieces(pieces, between(normal, np.eye(3)[0]), middle), angle


def stand_upright_by_points(pieces: Sequence[Piece], points: Float64) -> tuple[list[Piece], Float64, float]:
    """Return pieces and feature points (84, 3) turned so that both sides are level, and the angle, radians.

    The angle is 0 where nothing was turned: where points of both sides say nothing, or not the same.
    """
    row = point_rows()
    pairs = np.array([(points[row[left]], points[row[right]]) for left, right in MIRRORED.items()])
    pairs = pairs[np.isfinite(pairs).all(axis=(1, 2))]
    ways = pairs[:, 0] - pairs[:, 1] if len(pairs) else np.zeros((0, 3))
    wide = np.linalg.norm(ways, axis=1)
    if len(pairs) < MIN_PAIRS or not wide.max() > 0:
        return list(pieces), points, 0.0
    normal = ways.sum(axis=0) / np.linalg.norm(ways.sum(axis=0))
    angle = float(np.arccos(np.clip(normal[0], -1.0, 1.0)))
    before, after = (
        float(np.linalg.norm(ways - wide[:, None] * axis, axis=1).sum()) for axis in (np.eye(3)[0], normal)
    )
    if not POINT_ANGLES[0] < angle < POINT_ANGLES[1] or after > MAX_REMAINING_SHARE * before:
        return list(pieces), points, 0.0
    turn, middle = between(normal, np.eye(3)[0]), pairs.mean(axis=(0, 1))
    return turn_pieces(pieces, turn, middle), (points - middle) @ turn.T + middle, angle


def asymmetry(pieces: Sequence[Piece], left: Float64, right: Float64) -> float:
    """Return the 98th percentile of the skin's distances from its mirror image, by that of the eyes (3,)."""
    vertices = _face(pieces, left, right)
    if len(vertices) < 4:
        return np.inf
    away = _mirror_distances(vertices, (left + right) / 2, np.eye(3)[0])
    return float(np.percentile(away, 98)) / float(np.linalg.norm(left - right))


def mirror_points(points: dict[str, Float64], middle: float, own: Collection[str] = ()) -> dict[str, Float64]:
    """Return the located points; the left ones give those of the right side, and the midline is centred.

    middle: the x of the plane of symmetry. own: points of the right side that stay where they were located.
    """
    result = dict(points)
    for name, position in points.items():
        if name in MIRRORED and MIRRORED[name] not in own:
            result[MIRRORED[name]] = position * (-1.0, 1.0, 1.0) + (2 * middle, 0.0, 0.0)
        elif name not in MATES:
            result[name] = np.array([middle, *position[1:]])
        elif MATES[name] not in points:  # only the right one was found
            result[MATES[name]] = position * (-1.0, 1.0, 1.0) + (2 * middle, 0.0, 0.0)
    return result


def mirror_tables(model: FaceModel, *, lids: bool = True) -> FaceModel:
    """Return the model with the tables of each pair of FAPs mirror images, and those of the middle symmetric.

    The side is kept on which FAPs reach further. The face must be symmetric. lids: those of the lids, too.
    """
    other = _counterparts(model)
    pairs = [(fap.number, fap.left_right_mate) for fap in faps() if fap.left_right_mate is not None]
    if not lids:
        pairs = [pair for pair in pairs if pair not in LID_PAIRS and pair[::-1] not in LID_PAIRS]
    reach = [
        sum(
            _reach(model.table_of[pair[side]])
            for pair in pairs
            if pair[0] < pair[1] and pair[side] in model.table_of
        )
        for side in (0, 1)
    ]
    kept = int(reach[1] > reach[0])
    made = dict(model.table_of)
    lost = dict(model.lost)
    for fap in CENTRAL_FAPS:
        if fap in made:
            made[fap] = _average(model, made[fap], _mirrored(model, made[fap], fap, other))
    for pair in pairs:
        here, there = pair[kept], pair[1 - kept]
        if pair[0] < pair[1] and here in made and made[here].meshes and not made[here].transforms:
            made[there] = _mirrored(model, made[here], there, other)
            lost.pop(there, None)
    return model.with_tables(tuple(made[fap] for fap in sorted(made)), lost)


def mirror_faulty_lids(model: FaceModel) -> FaceModel:
    """Return the model, faulty lids of one eye replaced by mirror images of the other's if that helps."""
    poser = Poser(model)
    errors = [count_errors(poser, [pair[side] for pair in LID_PAIRS]) for side in (0, 1)]
    if errors[0] == errors[1]:
        return model
    bad = int(errors[1] > errors[0])
    other = _counterparts(model)
    tables = dict(model.table_of)
    for pair in LID_PAIRS:
        if pair[1 - bad] in tables and pair[bad] in tables:
            tables[pair[bad]] = _mirrored(model, tables[pair[1 - bad]], pair[bad], other)
    mirrored = model.with_tables(tuple(tables.values()), model.lost)
    found = count_errors(Poser(mirrored, like=poser), [pair[bad] for pair in LID_PAIRS])
    return mirrored if found < errors[bad] else model


def _face(pieces: Sequence[Piece], left: Float64, right: Float64) -> Float64:
    """Return (N, 3) vertices of the skin around the eyes."""
    skin = [piece.part.vertices for piece in pieces if piece.part.kind == "skin"]
    if not skin:
        return np.zeros((0, 3))
    vertices = np.concatenate(skin).astype(np.float64)
    reach = FACE_RADIUS * float(np.linalg.norm(left - right))
    return np.asarray(vertices[np.linalg.norm(vertices - (left + right) / 2, axis=1) < reach])


def _mirror_distances(vertices: Float64, middle: Float64, normal: Float64) -> Float64:
    """Return (N,) distances of mirrored vertices from the nearest."""
    from scipy.spatial import cKDTree

    mirrored = vertices - 2 * ((vertices - middle) @ normal)[:, None] * normal
    return np.asarray(cKDTree(vertices).query(mirrored)[0])


def _counterparts(model: FaceModel) -> Intp:
    """Return (V,) for each vertex that of the same kind of part nearest to its mirror image."""
    from scipy.spatial import cKDTree

    pupils = model.points[[point_rows()["3.5"], point_rows()["3.6"]], 0]
    middle = float(pupils.mean()) if np.isfinite(pupils).all() else 0.0
    # vertices of touching lips coincide: the vector to their neighbours tells the lips apart
    arms = NEIGHBOUR_WEIGHT * _neighbour_arms(model)
    vertices = np.hstack([model.vertices.astype(np.float64) - (middle, 0.0, 0.0), arms])
    mirrored = vertices * (-1.0, 1.0, 1.0, -1.0, 1.0, 1.0)
    kinds = np.concatenate([[part.kind] * len(part.vertices) for part in model.parts])
    result = np.zeros(len(vertices), dtype=np.intp)
    for kind in np.unique(kinds):
        own = np.flatnonzero(kinds == kind)
        result[own] = own[cKDTree(vertices[own]).query(mirrored[own])[1]]
    bound = {name: int(model.bound[row]) for name, row in point_rows().items()}
    for left, right in MIRRORED.items():
        if bound[left] >= 0 and bound[right] >= 0:
            result[bound[left]], result[bound[right]] = bound[right], bound[left]
    return result


def _neighbour_arms(model: FaceModel) -> Float64:
    """Return (V, 3) from each vertex to the middle of its triangles."""
    arms = []
    for part in model.parts:
        vertices = part.vertices.astype(np.float64)
        sums, counts = np.zeros_like(vertices), np.zeros(len(vertices))
        corners = part.triangles.ravel()
        np.add.at(sums, corners, np.repeat(vertices[part.triangles].mean(axis=1), 3, axis=0))
        np.add.at(counts, corners, 1)
        arms.append(np.where(counts[:, None] > 0, sums / np.maximum(counts, 1)[:, None] - vertices, 0.0))
    return np.concatenate(arms)


def _fields(model: FaceModel, table: FaceDefTables) -> dict[tuple[int, ...], Float64]:
    """Return the displacements (V, K - 1, 3) of all vertices, by the borders of the table's meshes."""
    fields: dict[tuple[int, ...], Float64] = {}
    for mesh in table.meshes:
        key = tuple(mesh.borders.tolist())
        field = fields.setdefault(key, np.zeros((len(model.vertices), len(key) - 1, 3)))
        field[model.starts[mesh.part] + mesh.vertices] = mesh.displacements
    return fields


def _table(model: FaceModel, fap: int, fields: dict[tuple[int, ...], Float64]) -> FaceDefTables:
    meshes = []
    for borders, field in fields.items():
        for part in model.parts:
            start = model.starts[part.name]
            own = field[start : start + len(part.vertices)]
            moving = np.flatnonzero(np.abs(own).max(axis=(1, 2), initial=0.0) > 0)
            if len(moving):
                meshes.append(
                    FaceDefMesh(
                        part.name,
                        np.array(borders, dtype=np.int32),
                        moving.astype(np.int32),
                        own[moving].astype(np.float32),
                    )
                )
    return FaceDefTables(fap, tuple(meshes), ())


def _mirrored(model: FaceModel, table: FaceDefTables, fap: int, other: Intp) -> FaceDefTables:
    """Return the tables of a FAP as the mirror image of those of another."""
    fields = {borders: field[other] * (-1.0, 1.0, 1.0) for borders, field in _fields(model, table).items()}
    return _table(model, fap, fields)


def _average(model: FaceModel, table: FaceDefTables, mirrored: FaceDefTables) -> FaceDefTables:
    if table.transforms:
        return table
    fields, others = _fields(model, table), _fields(model, mirrored)
    return _table(model, table.fap, {borders: (fields[borders] + others[borders]) / 2 for borders in fields})


def _reach(table: FaceDefTables) -> float:
    """Return how far a FAP moves its vertices at both ends of its range, summed over all."""
    total = 0.0
    for mesh in table.meshes:
        widths = np.diff(mesh.borders.astype(np.float64))
        zero = int(np.flatnonzero(mesh.borders == 0)[0])
        for side in (slice(0, zero), slice(zero, None)):
            moved = (mesh.displacements[:, side] * widths[side, None]).sum(axis=1)
            total += float(np.linalg.norm(moved, axis=1).sum())
    return total

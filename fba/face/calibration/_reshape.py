"""Carries a face over to other positions of its vertices."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from fba.arrays import Bool, Float64, Int32, Intp
from fba.errors import ModelError
from fba.face._tables import FaceDefMesh, FaceDefTables, interval_lengths
from fba.face.calibration._carry import carry_tables, surface_stretches
from fba.face.calibration._eyes import FittedEye
from fba.face.calibration._shape import Shape, fit_size, rebuild_part
from fba.face.checks._fap_checks import TURNING
from fba.face.eyeball import eyeballs
from fba.face.model import DetailLevel, FaceModel, Part, shape_key
from fba.parameters import faps

LEAST_AREA = 0.1
"""Share of its area that a triangle keeps, seen along its neutral normal, where FAPs are at their limits."""
MAX_ROUNDS = 150
"""Rounds in which the motion of triangles that turn over is smoothed."""
SPREAD = 3
"""Edges by which motion may spread while it is smoothed."""
ROUNDS = 8
"""Rounds of averaging with neighbours."""


def reshape(model: FaceModel, vertices: Float64, points: Float64) -> FaceModel:
    """Return the same face with other vertices: its FaceDefTables and levels of detail are carried over.

    vertices: float64 (V, 3), metres, of all parts; eyeballs may be moved and scaled, not bent. points:
    (84, 3) feature points; those at vertices are taken from there. ModelError for arrays of other shapes.
    """
    if vertices.shape != model.vertices.shape or points.shape != model.points.shape:
        raise ModelError(
            f"{len(model.vertices)} vertices and {len(model.points)} points are needed, each with x, y, z, "
            f"not arrays of {vertices.shape} and {points.shape}"
        )
    parts = tuple(rebuild_part(part, vertices[_rows(model, part.name)]) for part in model.parts)
    at_vertices = model.bound >= 0
    placed = points.copy()
    placed[at_vertices] = np.concatenate([part.vertices for part in parts])[model.bound[at_vertices]]
    bare = replace(model, parts=parts, points=placed, tables=(), levels=())
    shape = Shape({}, placed, _eyes(model, vertices), _rotations(model, vertices))
    carried = carry_tables(model, parts, placed, bare.fapu, shape)
    welded = {part.name: _weld(bare, part) for part in bare.of_kind("skin")}
    tables = tuple(_unfold(bare, table, welded) for table in carried)
    levels = tuple(_reshape_level(level, model, bare, vertices) for level in model.levels)
    return replace(bare, tables=tables, levels=levels)


def _rows(model: FaceModel, name: str) -> slice:
    start = model.starts[name]
    return slice(start, start + len(model.part(name).vertices))


def _eyes(model: FaceModel, vertices: Float64) -> dict[str, FittedEye]:
    """Return the eyeballs by side, moved and scaled as their vertices."""
    eyes = {}
    for side, eye in eyeballs(model).items():
        moved = fit_size(model.part(eye.part).vertices, vertices[_rows(model, eye.part)])
        angle = float(np.arcsin(min(model.fapu.IRISD * 512 / eye.radius, 0.9)))
        eyes[side] = FittedEye(
            eye, moved.apply(eye.centre[None])[0], eye.radius * float(moved.scale), angle, angle
        )
    return eyes


def _rotations(model: FaceModel, vertices: Float64) -> Mapping[str, Float64]:
    """Return (V, 3, 3), how the surface turns at each vertex, of the parts that are not rigid, by name."""
    rotations = {}
    for part in model.parts:
        if part.kind not in ("eye", "teeth", "tongue"):
            even = _even_out(surface_stretches(part, vertices[_rows(model, part.name)]), part.triangles)
            left, _, right = np.linalg.svd(even)
            left[:, :, 2] *= np.sign(np.linalg.det(left @ right))[:, None]
            rotations[part.name] = left @ right
    return rotations


def _even_out(stretches: Float64, triangles: Int32) -> Float64:
    """Return stretches (V, 3, 3) averaged over the surface around: single ones of slivers are noise."""
    from scipy.sparse import coo_array, eye_array

    pairs = triangles[:, [0, 1, 1, 2, 2, 0, 1, 0, 2, 1, 0, 2]].reshape(-1, 2)
    count = len(stretches)
    beside = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(count, count)).tocsr()
    beside = beside + eye_array(count)
    share = 1.0 / np.asarray(beside.sum(axis=1)).ravel()
    rows = stretches.reshape(count, 9)
    for _ in range(ROUNDS):
        rows = (beside @ rows) * share[:, None]
    return rows.reshape(-1, 3, 3)


@dataclass(frozen=True, eq=False)
class _Welded:
    """The skin without its seams.

    places (P, 3), metres. corners (F, 3) of triangles. fixed: points that keep their motion. point: (V,) the
    point of each vertex. first: (P,) a vertex of each point.
    """

    places: Float64
    corners: Int32
    fixed: Int32
    point: Int32
    first: Intp


def _weld(model: FaceModel, part: Part) -> _Welded:
    """Return the skin with one point where vertices coincide and face one way: lips that touch stay two."""
    keys = np.column_stack([part.vertices, np.rint(np.asarray(part.normals))])
    _, first, inverse = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    point = inverse.ravel().astype(np.int32)
    bound = model.bound - model.starts[part.name]
    fixed = np.unique(point[bound[(bound >= 0) & (bound < len(part.vertices))]])
    return _Welded(part.vertices[first].astype(np.float64), point[part.triangles], fixed, point, first)


def _unfold(model: FaceModel, table: FaceDefTables, welded: Mapping[str, _Welded]) -> FaceDefTables:
    """Return a table of the model whose skin does not fold at the limits of the FAP."""
    if table.fap in TURNING:
        return table
    meshes = []
    for mesh in table.meshes:
        skin = welded.get(mesh.part)
        if skin is not None:
            moves = np.zeros((len(skin.point), *mesh.displacements.shape[1:]))
            moves[mesh.vertices] = mesh.displacements
            even = moves[skin.first]
            limits = _interval_limits(model, table.fap, mesh)
            _unfold_motion(even, limits, skin.places, skin.corners, skin.fixed)
            moving = np.asarray(even.any(axis=(1, 2)))
            moved = np.flatnonzero(moving[skin.point]).astype(np.int32)
            even = even[skin.point[moved]].astype(np.float32)
            meshes.append(FaceDefMesh(mesh.part, mesh.borders, moved, even))
        else:
            meshes.append(mesh)
    return replace(table, meshes=tuple(meshes))


def _reshape_level(level: DetailLevel, model: FaceModel, now: FaceModel, vertices: Float64) -> DetailLevel:
    """Return a level of the reshaped face: each vertex moves as those that it stands for, on average."""
    count = np.bincount(level.parents, minlength=len(level.model.vertices))
    moves = vertices - model.vertices
    total = np.stack([np.bincount(level.parents, moves[:, k], len(count)) for k in range(3)], axis=1)
    moved = level.model.vertices + total / np.maximum(count, 1)[:, None]
    parts = tuple(rebuild_part(part, moved[_rows(level.model, part.name)]) for part in level.model.parts)
    points, bound = now.points.copy(), level.model.bound
    points[bound >= 0] = np.concatenate([part.vertices for part in parts])[bound[bound >= 0]]
    coarse = replace(level.model, parts=parts, points=points)
    return DetailLevel(coarse, level.parents, level.error, shape_key(now.parts))


def _interval_limits(model: FaceModel, fap: int, mesh: FaceDefMesh) -> Float64:
    """Return (L, K - 1): how far a FAP goes along each interval at the ends of its range, times FAPU."""
    entry = faps()[fap - 1]
    ends = [limit * entry.step for limit in entry.i_limits or () if limit]
    lengths = [interval_lengths(mesh.borders, float(value)) for value in ends]
    return np.array(lengths, dtype=np.float64).reshape(-1, len(mesh.borders) - 1) * model.fapu.of_fap(fap)


def _unfold_motion(moves: Float64, limits: Float64, places: Float64, corners: Int32, fixed: Int32) -> None:
    """Even out motions (P, K - 1, 3), in place, that turn triangles over at a FAP's limits (L, K - 1).

    places: (P, 3), at rest. corners: (F, 3). fixed: points whose motion stays. What is left folded after
    `MAX_ROUNDS` stays so.
    """
    moving: Bool = np.abs(moves).max(axis=(1, 2), initial=0.0) > 0
    for _ in range(SPREAD):
        moving[corners[moving[corners].any(axis=1)]] = True
    used, near = np.unique(corners[moving[corners].any(axis=1)], return_inverse=True)
    corners = near.reshape(-1, 3).astype(np.int32)
    own, places, pinned = moves[used], places[used], np.isin(used, fixed)
    before = _normals(places, corners)
    square = (before**2).sum(axis=1)
    for _ in range(MAX_ROUNDS):
        over = np.zeros(len(corners), dtype=bool)
        for limit in limits:
            after = _normals(places + np.einsum("k,pkd->pd", limit, own), corners)
            over |= (before * after).sum(axis=1) < LEAST_AREA * square
        if not over.any():
            break
        # each triangle that turns over moves more like one piece
        sums, counts = np.zeros_like(own), np.zeros(len(places))
        means = own[corners[over]].mean(axis=1)
        for k in range(3):
            np.add.at(sums, corners[over, k], means)
            np.add.at(counts, corners[over, k], 1.0)
        chosen = (counts > 0) & ~pinned
        own[chosen] += 0.7 * (sums[chosen] / counts[chosen, None, None] - own[chosen])
    moves[used] = own


def _normals(places: Float64, corners: Int32) -> Float64:
    a, b, c = (places[corners[:, k]] for k in range(3))
    return np.cross(b - a, c - a)

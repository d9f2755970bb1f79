"""Faces with fewer triangles that FAPs still move: simplified with all that they carry.

The mesh is simplified by `fba.mesh.simplify` in several poses of the face, so that the lips, the lids and all
else that moves keep more vertices. Feature points stay where they are. The tables of FAPs are then fitted
anew, by least squares, so that the simplified face moves as nearly as it can like the full one.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fba.arrays import Bool, Float32, Float64, Int32
from fba.errors import ModelError
from fba.face._tables import FaceDefMesh, FaceDefTables, interval_lengths
from fba.face.authoring.surface.landmarks import find_landmarks, weld_skin
from fba.face.deform._deformer import Deformer
from fba.face.eyeball import PUPIL_FAP
from fba.face.model import DetailLevel, FaceModel, shape_key
from fba.mesh.simplify import (
    Level,
    Simplification,
    carry_parts,
    part_looks,
    part_starts,
    place_on_level,
    simplify,
)
from fba.parameters import FAP_COUNT, faps

POSES: tuple[dict[int, int], ...] = (
    {},
    {3: 1000},
    {19: 1024, 20: 1024, 31: 300, 32: 300, 35: 200, 36: 200, 12: 300, 13: 300, 59: 300, 60: 300, 6: 200,
     7: 200, 53: 200, 54: 200},
    {4: 300, 8: 300, 9: 300, 5: -300, 10: -300, 11: -300, 6: -200, 7: -200, 53: -200, 54: -200, 19: -300,
     20: -300, 33: 300, 34: 300},
    {16: 500, 17: 500, 6: -150, 7: -150, 4: 200, 5: 200, 41: 200, 42: 200, 3: 300},
)  # fmt: skip
"""FAP values of the poses in which the face is simplified: at rest, the jaw open, the lids closed with a
broad grin, the lips apart with wide eyes, and the lips pushed forward with raised cheeks."""
BROAD_FAPS = (3, 14, 15, 16, 17)
"""FAPs that move half the face: what they move is not important for that alone."""
TURNING_FAPS = (3, 19, 20, 21, 22, 47)
"""FAPs that rotate what they move: jaw, lids and the rolled tongue. A triangle may face another way then."""
IMPORTANCE = 300.0
"""Importance of what a FAP moves most, lips and lids, compared to what none moves."""
LID_FAPS = (19, 20, 21, 22)
LID_MARGINS = tuple(f"{side} {lid} lid" for side in ("left", "right") for lid in ("upper", "lower"))
MARGIN_SHARE = 0.5
"""The vertices of the margins of the lids stay while at least this share of the triangles is left."""
LID_SHARE = 4.0
"""Factor of the motion of lids, which must pass close to the eyeball."""
EYE_SHARE = 0.5
"""Share of that motion for which eyeballs count."""
LASH_SHARE = 0.2
"""The same for lashes: a hair has little area, yet its lack is seen."""
TEETH_SHARE = 0.5
"""The same for teeth, which stand out against the dark behind them."""
SMOOTHING = 0.3
"""Weight of the interpolated motion of a vertex compared to that of each vertex that it stands for."""
LEAST_AREA = 0.1
"""Share of its area that a triangle keeps, seen along its neutral normal, where FAPs are at their limits."""
MAX_ROUNDS = 150
"""Rounds in which the motion of triangles that turn over is smoothed."""
SPREAD = 3
"""Edges by which motion may spread while it is smoothed."""
RIM_VERTICES = 16
"""Vertices of a pupil's rim that stay."""
LEAST_MOTION = 1e-3
"""Motions below this share of the largest of a FAP are left out of its table."""
LEVEL_RATIO = 0.32
"""Triangles of a level of detail by those of the next finer one: the source's 680 of 2141."""
LEAST_PER_PART = 50
"""Triangles of a level of detail by its parts, below which parts lose their shape."""
PERCENT = 99
"""Percentage of the vertices to which an error refers."""


@dataclass(frozen=True, eq=False)
class FaceSimplification:
    """A face and the collapses that simplify it; see `simplify_face`."""

    model: FaceModel
    mesh: Simplification
    poses: Float64
    """(K, V, 3), the face in `POSES`, without the head's turn."""
    _kept: Bool

    def within(self, error: float) -> Level:
        """Return the coarsest mesh of which 99 % of the vertices are off by at most this error (m), at rest
        and in all poses; the full one where none is."""
        low, high = 0, len(self.mesh.faces)  # of collapses
        while low < high:
            middle = (low + high + 1) // 2
            if self.error(self.mesh.after(middle)) <= error:
                low = middle
            else:
                high = middle - 1
        return self.mesh.after(low)

    def error(self, level: Level) -> float:
        """Return the distance (m) within which 99 % of the full face's vertices are of a level, in the worst
        pose."""
        return max(self._errors(level, lambda away: float(np.percentile(away, PERCENT))))

    def _errors(self, level: Level, sum_up: Callable[[Float64], float]) -> list[float]:
        """Return, for each pose, a number for the distances (V,) of the full face's vertices from a level."""
        rows, weights = place_on_level(self.mesh.positions, level)
        errors = []
        for pose in self.poses:
            moved = level.positions + level.carry(pose - self.poses[0])
            off = np.einsum("nk,nkd->nd", weights, moved[rows]) - pose
            errors.append(sum_up(np.linalg.norm(off, axis=1)))
        return errors

    def build(self, level: Level, *, tables: bool = True) -> DetailLevel:
        """Return the face of a level of the mesh, with all that it carries. tables: whether with those."""
        model = self.model
        parts = tuple(replace(part, **arrays) for part, _, arrays in carry_parts(model, level))
        bound = np.where((model.bound >= 0) & self._used[model.bound], level.parents[model.bound], -1)
        face = replace(
            model,
            parts=parts,
            bound=bound.astype(np.int32),
            tables=_fit_tables(model, level, self._pinned, self.mesh.positions) if tables else (),
            levels=(),
        )
        return DetailLevel(
            face, level.parents, max(self._errors(level, _root_mean_square)), shape_key(model.parts)
        )

    @cached_property
    def _used(self) -> Bool:
        used = np.zeros(len(self.model.vertices), dtype=bool)
        used[self.model.triangles] = True
        return used

    @cached_property
    def _pinned(self) -> Int32:
        """Vertices that stay, which move exactly as they do on the full face."""
        return np.flatnonzero(self._kept & self._used).astype(np.int32)


def simplify_face(model: FaceModel, faces: int | Sequence[int]) -> FaceSimplification:
    """Return the simplification of a face down to a number of triangles, or through several, falling.

    `build(mesh.level(faces))` returns the face of any level between, with its parts, seams, textures,
    colours, normals, feature points and tables. ModelError for a part without triangles, and for fewer
    triangles than parts.
    """
    for part in model.parts:
        if not len(part.triangles):
            raise ModelError(f"part {part.name!r} has no triangles; leave it out before simplifying")
    fewest = min([faces] if isinstance(faces, int) else faces)
    if fewest < len(model.parts):
        raise ModelError(
            f"{fewest} triangles are too few for a face of {len(model.parts)} parts: each keeps one at least"
        )
    deformer = Deformer(model)
    poses = np.stack([deformer.local(_values(pose)) for pose in POSES]).astype(np.float64)
    kept = _find_pinned(model, margins=fewest >= MARGIN_SHARE * len(model.triangles))
    mesh = simplify(
        poses,
        model.triangles,
        faces,
        pinned=kept,
        looks=part_looks(model),
        importance=_importance(model),
    )
    return FaceSimplification(model, mesh, poses, kept)


def level_sizes(model: FaceModel, count: int) -> list[int]:
    """Return the triangles of up to `count` levels, each with `LEVEL_RATIO` of those of the one before.

    After the first, levels with fewer than `LEAST_PER_PART` triangles a part are left out.
    """
    total, least = len(model.triangles), LEAST_PER_PART * len(model.parts)
    first, *others = (round(total * LEVEL_RATIO**number) for number in range(1, count + 1))
    return [max(first, len(model.parts)), *(faces for faces in others if faces >= least)]


def _root_mean_square(away: Float64) -> float:
    return float(np.sqrt((away**2).mean()))


def _values(pose: dict[int, int]) -> Float32:
    values = np.zeros(FAP_COUNT, dtype=np.float32)
    for number, value in pose.items():
        values[number - 1] = value
    return values


def _find_pinned(model: FaceModel, *, margins: bool) -> Bool:
    """Return (V,): vertices of feature points, and some around each pupil, which give its size. margins:
    whether also those of the margins of the lids."""
    pinned = np.zeros(len(model.vertices), dtype=bool)
    pinned[model.bound[model.bound >= 0]] = True
    eyes = {part.name for part in model.of_kind("eye")}
    if margins:
        marks = find_landmarks(weld_skin(model.parts, model.bound), model.points, model.bound)
        for name in LID_MARGINS:
            margin = np.isin(marks.surface.number, marks.contour(name))
            pinned[marks.surface.pool[margin]] = True
    for fap in PUPIL_FAP.values():
        for mesh in model.table_of[fap].meshes if fap in model.table_of else ():
            size = np.linalg.norm(mesh.displacements, axis=2).max(axis=1, initial=0.0)
            rim = mesh.vertices[size > 0.95 * size.max(initial=0.0)] + model.starts[mesh.part]
            if mesh.part in eyes and len(rim):
                off = model.vertices[rim].astype(np.float64) - model.vertices[rim].mean(axis=0)
                around = np.argsort(np.arctan2(off[:, 1], off[:, 0]))
                pinned[rim[around[:: -(-len(rim) // RIM_VERTICES)]]] = True
    return pinned


def _importance(model: FaceModel) -> Float64:
    """Return (V,): factors of the cost, by how much of a FAP's motion reaches each vertex of the skin."""
    share = np.zeros(len(model.vertices))
    skins = {part.name for part in model.of_kind("skin")}
    for table in model.tables:
        for mesh in table.meshes:
            if table.fap in BROAD_FAPS or mesh.part not in skins or not len(mesh.vertices):
                continue
            moved = np.linalg.norm(mesh.displacements.astype(np.float64), axis=2).max(axis=1)
            rows = mesh.vertices + model.starts[mesh.part]
            most = max(float(moved.max()), 1e-30) / (LID_SHARE if table.fap in LID_FAPS else 1.0)
            share[rows] = np.maximum(share[rows], moved / most)
    for kind, counts in (("eye", EYE_SHARE), ("lash", LASH_SHARE), ("teeth", TEETH_SHARE)):
        for part in model.of_kind(kind):
            start = model.starts[part.name]
            share[start : start + len(part.vertices)] = counts
    return 1.0 + IMPORTANCE * share**2


def _fit_tables(
    model: FaceModel, level: Level, pinned: Int32, positions: Float64
) -> tuple[FaceDefTables, ...]:
    """Return the tables with which a level moves most like the full face, by least squares.

    Each vertex of the full face should be where the level's triangle carries it; those of feature points are
    moved exactly. A little of the interpolated motion makes up for vertices that stand for few.
    """
    from scipy.sparse import coo_array, eye_array
    from scipy.sparse.linalg import splu

    starts = part_starts(model, level)
    point = np.unique(level.points, return_inverse=True)[1].astype(np.int32)
    count, total = int(point.max()) + 1, len(positions)
    placed, weights = place_on_level(positions, level)
    across = np.repeat(np.arange(total), 3)
    spread = coo_array((weights.ravel(), (across, point[placed].ravel())), shape=(total, count)).tocsr()
    first = np.unique(point, return_index=True)[1]  # one side of each seam
    places = level.positions[first]
    down = np.repeat(np.arange(count), 3)
    carried = coo_array(
        (level.weights[first].ravel(), (down, level.rows[first].ravel())), shape=(count, total)
    ).tocsr()
    fixed = point[level.parents[pinned]]
    free = np.setdiff1d(np.arange(count), fixed)
    normal = (spread.T @ spread + SMOOTHING * eye_array(count)).tocsr()
    solver = splu(normal[free][:, free].tocsc()) if len(free) else None
    corners = point[level.triangles]
    tables = []
    for table in model.tables:
        meshes = []
        for mesh in table.meshes:
            intervals = len(mesh.borders) - 1
            moves = np.zeros((total, 3 * intervals))
            moves[mesh.vertices + model.starts[mesh.part]] = mesh.displacements.reshape(-1, 3 * intervals)
            near = carried @ moves
            fitted = np.zeros_like(near)
            fitted[fixed] = moves[pinned]
            if solver is not None:
                right = spread.T @ moves + SMOOTHING * near
                fitted[free] = solver.solve(right[free] - normal[free][:, fixed] @ fitted[fixed])
            fitted[~near.any(axis=1)] = 0.0  # what the full face does not move there
            part = [one.name for one in model.parts].index(mesh.part)
            rows = slice(starts[part], starts[part + 1])
            own = np.isin(level.triangles[:, 0], np.arange(rows.start, rows.stop))
            fitted = fitted.reshape(count, intervals, 3)
            size = np.abs(fitted).max(axis=(1, 2), initial=0.0)
            fitted[size <= LEAST_MOTION * size.max(initial=0.0)] = 0.0
            if table.fap not in TURNING_FAPS:
                unfold_motion(fitted, interval_limits(model, table.fap, mesh), places, corners[own], fixed)
            here = fitted[point[rows]]
            moved = np.flatnonzero(here.any(axis=(1, 2))).astype(np.int32)
            meshes.append(FaceDefMesh(mesh.part, mesh.borders, moved, here[moved]))
        tables.append(replace(table, meshes=tuple(meshes)))
    return tuple(tables)


def interval_limits(model: FaceModel, fap: int, mesh: FaceDefMesh) -> Float64:
    """Return (L, K - 1): how far a FAP goes along each interval at the ends of its range, times FAPU."""
    entry = faps()[fap - 1]
    ends = [limit * entry.step for limit in entry.i_limits or () if limit]
    lengths = [interval_lengths(mesh.borders, float(value)) for value in ends]
    return np.array(lengths, dtype=np.float64).reshape(-1, len(mesh.borders) - 1) * model.fapu.of_fap(fap)


def unfold_motion(moves: Float64, limits: Float64, places: Float64, corners: Int32, fixed: Int32) -> None:
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

"""The tables of simplified faces: fitted to the full face's by least squares, then made sound.

A motion that turns triangles over is stretched evenly around them, and stops where that does not help. Lids
pass in front of the eyeball with the middles of their triangles too.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from fba.arrays import Bool, Float64, Int32, Intp
from fba.face._tables import FaceDefMesh, FaceDefTables, interval_lengths
from fba.face.authoring.regions._eye_opening import ANGLES, LIDS, Profile, measure_profile
from fba.face.authoring.regions._eyes import find_eyes
from fba.face.authoring.surface._fold_limits import Limiter
from fba.face.authoring.surface._motion import (
    UNMOVED_DISTANCE,
    Motion,
    build_tables,
    fap_limits,
    split_by_part,
    unfold,
)
from fba.face.authoring.surface._motion_limits import stop_motion
from fba.face.authoring.surface.landmarks import CONTOURS, Landmarks, find_landmarks, weld_skin
from fba.face.authoring.surface.surface import Surface, vertices_of_kinds
from fba.face.checks._combined_rules import CLOSED, MAX_LID_GAP, SIDES, SPLITS, lid_gap
from fba.face.checks._fap_checks import (
    CORNER_RADIUS,
    EYE_CORNERS,
    HAIR,
    MAX_TURNED_SHARE,
    TURNING,
    region_table,
)
from fba.face.checks._posing import Poser
from fba.face.model import FaceModel, Part
from fba.mesh.simplify import Level, part_starts, place_on_level
from fba.parameters import faps, point_rows

LINES = ("left upper lid", "left lower lid", "right upper lid", "right lower lid", "upper inner lip",
         "lower inner lip")  # fmt: skip
"""Contours that stay lines of the mesh: what meets there must meet on coarse faces too."""
SMOOTHING = 0.3
"""Weight of the interpolated motion of a vertex compared to that of each vertex that it stands for."""
LEAST_MOTION = 1e-3
"""Motions below this share of the largest of a FAP are left out of its table."""
OUTSIDE_RADII = 0.97
"""Triangles whose corners at rest are this far out, in radii of the eyeball, may not cut it."""
LIFTS = 30
"""Rounds in which lids are lifted off the eyeball: lifting one triangle tilts its neighbours."""
MOST_LIFT = 1.0
"""Largest lift, as a share of the eyeball's radius."""
SAMPLES = np.array([(0.5, 0.5, 0), (0, 0.5, 0.5), (0.5, 0, 0.5), (1 / 3, 1 / 3, 1 / 3), *np.eye(3)])
"""Places on a triangle that are kept out of the eyeball, as weights of its corners."""


def _landmarks(model: FaceModel) -> Landmarks:
    return find_landmarks(weld_skin(model.parts, model.bound), model.points, model.bound)


def find_lines(model: FaceModel) -> Int32:
    """Return (V,): a bit for each piece of `LINES`, between feature points, that a vertex is on."""
    marks = _landmarks(model)
    lines, bit = np.zeros(len(model.vertices), dtype=np.int32), 0
    for name in LINES:
        walk = marks.contour(name)
        points = np.flatnonzero(np.isin(walk, marks.vertices_of(CONTOURS[name])))
        for start, end in pairwise(points):
            piece = walk[start : end + 1]
            lines[marks.surface.pool[np.isin(marks.surface.number, piece)]] |= 1 << bit
            bit += 1
    return lines


def find_balls(model: FaceModel) -> Float64:
    """Return (B, 7 + R): eyeballs, which lids must not cut, as `fba.mesh.simplify.simplify` takes them."""
    rows = [np.zeros((0, 7 + len(ANGLES)))]
    for eye in find_eyes(_landmarks(model), model.parts).values():
        if eye.measured and not eye.flat:
            profile = measure_profile(eye, model.parts, 0.0)
            rows.append(np.concatenate([eye.centre, eye.gaze, [profile.size], profile.straight])[None])
    return np.concatenate(rows)


def fit_tables(
    model: FaceModel,
    face: FaceModel,
    level: Level,
    still: Int32,
    positions: Float64,
    *,
    carried: bool = False,
) -> tuple[FaceDefTables, ...]:
    """Return the tables with which a level moves most like the full face.

    model: the full face. face: that of the level, without tables. still: vertices of the full one that are
    still at their places; they move exactly as before, unless that turns a triangle over. positions: (N, 3),
    of the full one. carried: whether each vertex moves as its place on the full face instead.
    """
    fit = _Fit(model, level, still, positions)
    easing = _Easing(face, fit)
    tables = []
    for table in model.tables:
        unit = face.fapu.of_fap(table.fap)
        meshes = [
            easing.ease(table.fap, mesh, fit.motion(mesh, model.starts[mesh.part], carried), unit)
            for mesh in table.meshes
        ]
        tables.append(replace(table, meshes=tuple(mesh for mesh in meshes if mesh is not None)))
    return tuple(tables)


def close_lids(face: FaceModel) -> tuple[FaceDefTables, ...]:
    """Return the tables of a face, those of upper lids with margins that end on those of the lower lids where
    a gap is left.

    Their other vertices stay as they are: this is for gaps of a few percent of the iris.
    """
    poser, tables = Poser(face), dict(face.table_of)
    surface, values = poser.marks.surface, np.array([0, *sorted(SPLITS)])
    place = np.full(len(face.vertices), len(surface))  # of what is no skin
    place[surface.pool] = surface.number
    for side, (upper, lower) in SIDES.items():
        if not {upper, lower} <= tables.keys():
            continue
        margin = poser.marks.contour(f"{side} upper lid")
        ways = np.zeros((len(values), len(surface) + 1, 3))
        for way, split in zip(ways[1:], values[1:], strict=True):
            if lid_gap(poser, side, split) <= MAX_LID_GAP:
                continue
            moved = poser.pose({upper: split, lower: CLOSED - split})
            line, other = (poser.contour(f"{side} {lid} lid", moved) for lid in ("upper", "lower"))
            other = other[np.argsort(other[:, 0], kind="stable")]
            for axis in (1, 2):
                way[margin, axis] = np.interp(line[:, 0], other[:, 0], other[:, axis]) - line[:, axis]
        ways /= face.fapu.of_fap(upper)
        meshes = (
            _add_shifts(mesh, values, ways[:, place[mesh.vertices + face.starts[mesh.part]]])
            for mesh in tables[upper].meshes
        )
        tables[upper] = replace(tables[upper], meshes=tuple(meshes))
    return tuple(tables.values())


def _add_shifts(mesh: FaceDefMesh, values: Intp, shifts: Float64) -> FaceDefMesh:
    """Return the mesh of a table with shifts (K, N, 3), in FAPU, added at values (K,), and evenly between."""
    borders = np.union1d(mesh.borders, values)
    interval = np.searchsorted(mesh.borders, borders[:-1], side="right") - 1
    shares = [np.interp(borders, values, row) for row in np.eye(len(values))]
    more = np.einsum("kb,knd->nbd", np.diff(shares) / np.diff(borders), shifts)
    moves = mesh.displacements[:, np.clip(interval, 0, len(mesh.borders) - 2)] + more
    return FaceDefMesh(mesh.part, borders.astype(np.int32), mesh.vertices, moves.astype(np.float32))


class _Fit:
    """Motions of a level's points by least squares: each vertex of the full face should be where the level's
    triangle carries it. A little of the interpolated motion makes up for points that stand for few.

    point: (M,), the point of each vertex of the level, of P. places: (P, 3). fixed: points whose motion is
    that of `still`. starts: the first vertex of each part.
    """

    def __init__(self, model: FaceModel, level: Level, still: Int32, positions: Float64) -> None:
        from scipy.sparse import coo_array, eye_array
        from scipy.sparse.linalg import splu

        self.starts = part_starts(model, level)
        self.point = np.unique(level.points, return_inverse=True)[1].astype(np.intp)
        count, self._total = int(self.point.max()) + 1, len(positions)
        placed, weights = place_on_level(positions, level)
        across = np.repeat(np.arange(self._total), 3)
        where = (across, self.point[placed].ravel())
        self._spread = coo_array((weights.ravel(), where), shape=(self._total, count)).tocsr()
        first = np.unique(self.point, return_index=True)[1]  # one side of each seam
        self.places = level.positions[first]
        down = np.repeat(np.arange(count), 3)
        beside = (down, level.rows[first].ravel())
        self._carried = coo_array((level.weights[first].ravel(), beside), shape=(count, self._total)).tocsc()
        self._still, self.fixed = still, self.point[level.parents[still]]
        self._free = np.setdiff1d(np.arange(count), self.fixed)
        normal = (self._spread.T @ self._spread + SMOOTHING * eye_array(count)).tocsr()
        self._beside = normal[self._free][:, self.fixed]
        self._solver = splu(normal[self._free][:, self._free].tocsc()) if len(self._free) else None

    def motion(self, mesh: FaceDefMesh, start: int, carried: bool) -> Float64:
        """Return (P, K - 1, 3) the displacements of a mesh whose part begins at the full face's `start`.

        carried: whether they are the interpolated ones.
        """
        intervals, moved = len(mesh.borders) - 1, mesh.vertices + start
        moves = mesh.displacements.reshape(-1, 3 * intervals).astype(np.float64)
        near = self._carried[:, moved] @ moves
        fitted = near.copy() if carried else np.zeros_like(near)
        row = np.full(self._total, len(moved))  # of what does not move
        row[moved] = np.arange(len(moved))
        fitted[self.fixed] = np.vstack([moves, np.zeros_like(moves[:1])])[row[self._still]]
        if self._solver is not None and not carried:
            right = self._spread[moved].T @ moves + SMOOTHING * near
            fitted[self._free] = self._solver.solve(right[self._free] - self._beside @ fitted[self.fixed])
        fitted[~near.any(axis=1)] = 0.0  # what the full face does not move there
        fitted = fitted.reshape(-1, intervals, 3)
        size = np.abs(fitted).max(axis=(1, 2), initial=0.0)
        fitted[size <= LEAST_MOTION * size.max(initial=0.0)] = 0.0
        return np.asarray(fitted)


class _Easing:
    """Makes motions of a simplified face sound."""

    def __init__(self, face: FaceModel, fit: _Fit) -> None:
        self._face, self._fit = face, fit
        self._parts: dict[str, tuple[Surface, Limiter]] = {}

    def ease(self, fap: int, mesh: FaceDefMesh, moves: Float64, unit: float) -> FaceDefMesh | None:
        """Return the mesh of a FAP's table with sound motions like those (P, K - 1, 3) given, None for none.

        mesh: of the full face. unit: metres a step.
        """
        part = self._face.part(mesh.part)
        if part.kind != "eye":
            moves[self._outside(fap)] = 0.0
        if fap not in LIDS or part.kind != "skin":
            eased = None if part.kind in HAIR else self._unfolded(fap, part, mesh.borders, moves, unit)
        else:
            eased = self._lids(fap, part, mesh.borders, moves, unit)
        if eased is None:  # sound as it is
            row = [one.name for one in self._face.parts].index(part.name)
            here = moves[self._fit.point[self._fit.starts[row] : self._fit.starts[row + 1]]]
            moved = np.flatnonzero(here.any(axis=(1, 2))).astype(np.int32)
            return FaceDefMesh(part.name, mesh.borders, moved, here[moved].astype(np.float32))
        surface, _ = self._of(part)
        made = build_tables(fap, unit, split_by_part(surface, eased)).meshes
        return made[0] if made else None

    def _outside(self, fap: int) -> Bool:
        """Return (P,) mask of the points outside the region of a FAP."""
        names, reach = region_table().get(fap, ((), np.inf))
        points = self._face.points[[point_rows()[name] for name in names]]
        points = points[np.isfinite(points).all(axis=1)]
        if not len(points):
            return np.zeros(len(self._fit.places), dtype=bool)
        away = np.linalg.norm(self._fit.places[:, None] - points, axis=2).min(axis=1)
        return np.asarray(away > reach * self._face.fapu.ES * 1024)

    def _of(self, part: Part) -> tuple[Surface, Limiter]:
        """Return the triangles of a part, of the level's points, and what limits their motions."""
        if part.name not in self._parts:
            row = [one.name for one in self._face.parts].index(part.name)
            own = np.arange(self._fit.starts[row], self._fit.starts[row + 1])
            number = self._fit.point[own]
            triangles = number[part.triangles]
            surface = Surface(self._fit.places, triangles, own, number, {part.name: number})
            self._parts[part.name] = (surface, Limiter.from_mesh(surface.vertices, triangles))
        return self._parts[part.name]

    def _motion(self, fap: int, borders: Int32, moves: Float64, unit: float) -> Motion:
        """Return displacements (P, K - 1, 3) as shifts over the range of a FAP."""
        low, high = fap_limits(fap)
        values = np.unique(np.clip([low, 0.0, high, *borders[1:-1]], low, high))
        ways = np.array([interval_lengths(borders, float(value)) for value in values], dtype=np.float64)
        moving = np.flatnonzero(moves.any(axis=(1, 2)))
        return Motion(values, moving, unit * np.einsum("ki,pid->kpd", ways, moves[moving]))

    def _unfolded(self, fap: int, part: Part, borders: Int32, moves: Float64, unit: float) -> Motion | None:
        """Return the motion without folds; None if it has none."""
        surface, limiter = self._of(part)
        motion, turning = self._motion(fap, borders, moves, unit), fap in TURNING
        if (_folded_shares(limiter, motion, turning) <= _most_folded(turning)).all():
            return None
        motion = _stop(limiter, self._unfold(surface, limiter, motion, fap), turning)
        return _go_on(motion, borders, moves, unit)

    def _unfold(self, surface: Surface, limiter: Limiter, motion: Motion, fap: int) -> Motion:
        """Return the motion with folds stretched evenly, where need be even where it should not change."""
        turning, outside = fap in TURNING, self._outside(fap)
        held = [surface.mask(points) | outside for points in (self._fit.fixed, self._own_points(fap))]
        shifts = np.stack([limiter.spread(motion.vertices, step) for step in motion.shifts])
        folded, zero = _folded_shares(limiter, motion, turning), int(np.flatnonzero(motion.values == 0)[0])
        for side in (range(zero + 1, len(shifts)), range(zero - 1, -1, -1)):
            for k in side:
                step = shifts[k]
                for pinned in held:
                    if folded[k] > 0.0:
                        shifts[k], folded[k] = _unfold_one(surface, limiter, step, pinned, turning)
                if folded[k] > _most_folded(turning):
                    break  # the motion will stop there
        vertices = np.flatnonzero(shifts.any(axis=(0, 2)))
        return Motion(motion.values, vertices, shifts[:, vertices])

    def _own_points(self, fap: int) -> Intp:
        """Return the points whose motion must be right: the FAP's own, its mate's, those of lines."""
        mate = faps()[fap - 1].left_right_mate
        names = {name for each in (fap, mate) if each for name in faps()[each - 1].feature_points}
        bound = self._face.bound[[point_rows()[name] for name in sorted(names)]]
        return np.unique(np.concatenate([self._fit.point[bound[bound >= 0]], self._on_lines, self._on_eyes]))

    @cached_property
    def _on_lines(self) -> Intp:
        return np.unique(self._fit.point[find_lines(self._face) > 0])

    @cached_property
    def _on_eyes(self) -> Intp:
        """Fixed points of eyeballs, which give the size of pupils."""
        eyes = vertices_of_kinds(self._face.parts, ["eye"])
        return np.intersect1d(self._fit.point[eyes], self._fit.fixed)

    def _lids(self, fap: int, part: Part, borders: Int32, moves: Float64, unit: float) -> Motion | None:
        """Return the motion of a lid, in front of the eyeball and without folds but at the eye's corners."""
        surface, limiter = self._of(part)
        side = LIDS[fap][0]
        eye = find_eyes(self._marks, self._face.parts)[side]
        limiter = limiter.without(self._corners(side))
        motion = self._motion(fap, borders, moves, unit)
        pinned = surface.mask(self._on_lines) | self._outside(fap)
        left, before = len(motion.values), len(motion.values) + 1  # values at which triangles are folded
        while 0 < left < before:
            motion = self._unfold(surface, limiter, motion, fap)
            if eye.measured and not eye.flat:
                motion = lift_off(measure_profile(eye, self._face.parts, 0.0), surface, motion, pinned)
            shares = _folded_shares(limiter, _moving(motion), True)
            left, before = int((shares > MAX_TURNED_SHARE).sum()), left
        motion = _moving(motion)
        if left:
            motion = _stop(limiter, motion, True)
        return _go_on(motion, borders, moves, unit)

    @cached_property
    def _marks(self) -> Landmarks:
        return _landmarks(self._face)

    def _corners(self, side: str) -> Intp:
        """Return the points about an eye's corners, where skin folds."""
        names = EYE_CORNERS[:2] if side == "left" else EYE_CORNERS[2:]
        ends = np.array([self._marks.point(name) for name in names])
        away = np.linalg.norm(self._fit.places[:, None] - ends, axis=2).min(axis=1)
        return np.flatnonzero(away < CORNER_RADIUS * np.linalg.norm(ends[0] - ends[1]))


def _moving(motion: Motion) -> Motion:
    """Return the motion without the vertices that tables leave out."""
    moved = np.abs(motion.shifts).max(axis=(0, 2), initial=0.0) > UNMOVED_DISTANCE
    return Motion(motion.values, motion.vertices[moved], motion.shifts[:, moved])


def _go_on(motion: Motion, borders: Int32, moves: Float64, unit: float) -> Motion:
    """Return the motion with that of displacements (P, K - 1, 3) beyond the limits of a FAP, which streams
    exceed although they should not."""
    low, high = motion.values[[0, -1]]
    below, above = borders[borders < low][1:], borders[borders > high][:-1]
    values = np.concatenate([below, motion.values, above])
    shifts = [*motion.shifts[:1].repeat(len(below), axis=0), *motion.shifts]
    shifts += [*motion.shifts[-1:].repeat(len(above), axis=0)]
    for k, value in enumerate(values):
        end = float(np.clip(value, low, high))
        way = interval_lengths(borders, float(value)) - interval_lengths(borders, end)
        shifts[k] = shifts[k] + unit * np.einsum("i,pid->pd", way, moves[motion.vertices])
    return Motion(values, motion.vertices, np.array(shifts))


def _unfold_one(
    surface: Surface, limiter: Limiter, shift: Float64, pinned: Bool, turning: bool
) -> tuple[Float64, float]:
    """Return the shifts (N, 3) of one value unfolded, and the share of folds left: what moves then is judged,
    as by the checks."""
    moved = np.flatnonzero(shift.any(axis=1))
    step = np.stack([0 * shift[moved], shift[moved]])
    alone = unfold(surface, limiter, Motion(np.array([0.0, 1.0]), moved, step), pinned, turning)
    return limiter.spread(alone.vertices, alone.shifts[1]), float(_folded_shares(limiter, alone, turning)[1])


def _most_folded(turning: bool) -> float:
    """Return the share of the moving area that the checks allow to fold."""
    return MAX_TURNED_SHARE if turning else 0.0


def _folded_shares(limiter: Limiter, motion: Motion, turning: bool) -> Float64:
    """Return (K,): the share of the area of what moves at each value that is folded."""
    shares, before = np.zeros(len(motion.values)), np.zeros(0, dtype=bool)
    for k, step in enumerate(motion.shifts):
        moved = step.any(axis=1)
        if not np.array_equal(moved, before):  # mostly, all values move the same vertices
            patch, before = limiter.patch(motion.vertices[moved]), moved
        fine = patch.soundness(limiter.spread(motion.vertices, step), turning=turning)
        if not fine.all():
            shares[k] = patch.areas[~fine].sum() / patch.areas.sum()
    return shares


def _stop(limiter: Limiter, motion: Motion, turning: bool) -> Motion:
    """Return the motion, stopped where more folds than the checks allow."""

    def is_sound(shifts: Float64) -> bool:
        once = Motion(np.zeros(1), motion.vertices, shifts[None])
        return bool(_folded_shares(limiter, once, turning)[0] <= _most_folded(turning))

    return stop_motion(motion, is_sound)


def lift_off(profile: Profile, surface: Surface, motion: Motion, pinned: Bool) -> Motion:
    """Return the motion of a lid, lifted off the eyeball where its triangles would cut deeper than before.

    pinned: (N,) mask of vertices whose shifts must not change, as those of margins, which meet others.
    """
    before = surface.vertices
    moved = surface.mask(motion.vertices)
    outside = profile.is_outside(before, OUTSIDE_RADII)
    triangles = surface.triangles
    triangles = triangles[moved[triangles].any(axis=1) & outside[triangles].all(axis=1)]
    free = ~pinned[triangles]
    moves = np.einsum("sk,fk->fs", SAMPLES, free) > 0  # samples that a corner can lift
    was = np.maximum(_depth(profile, before[triangles]), 0.0)
    shifts = np.zeros((len(motion.values), *before.shape))
    shifts[:, motion.vertices] = motion.shifts
    for k in np.flatnonzero(motion.values > 0):
        lifted = np.zeros(len(before))
        outward = before + shifts[k] - profile.centre
        outward /= np.maximum(np.linalg.norm(outward, axis=1, keepdims=True), 1e-30)
        for _ in range(LIFTS):
            now = (before + shifts[k] + lifted[:, None] * outward)[triangles]
            deep = _depth(profile, now) - was
            deep[np.einsum("sk,fk->fs", SAMPLES, now[:, :, 2]) < profile.centre[2]] = 0.0
            push = np.where(moves, deep, 0.0).max(axis=1, initial=0.0)
            if not push.any():
                break
            more = np.zeros(len(before))
            np.maximum.at(more, triangles[free], np.repeat(push[:, None], 3, axis=1)[free])
            lifted = np.minimum(lifted + more, MOST_LIFT * profile.size)
        shifts[k] += lifted[:, None] * outward
    vertices = np.flatnonzero(shifts.any(axis=(0, 2)))
    return Motion(motion.values, vertices, shifts[:, vertices])


def _depth(profile: Profile, corners: Float64) -> Float64:
    """Return (F, S) metres below the eyeball's surface of the samples of triangles (F, 3, 3)."""
    places = np.einsum("sk,fkd->fsd", SAMPLES, corners).reshape(-1, 3)
    depth = profile.radius(places, around=False) - np.linalg.norm(places - profile.centre, axis=1)
    return np.asarray(depth.reshape(len(corners), len(SAMPLES)))

"""Mixes shapes for one FAP: solved at the feature points, corrected there, limited where triangles fold."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fba.arrays import Bool, Float64, Intp
from fba.face._tables import FaceDefTables
from fba.face.authoring._shapes._shapes import Shapes
from fba.face.authoring.surface._fold_limits import Limiter
from fba.face.authoring.surface._motion import Motion, build_tables, ease_field, fap_limits, split_by_part
from fba.face.authoring.surface._motion_limits import EASE, MODERATE_VALUE, coupled_motions, linear_motion
from fba.face.authoring.surface.binding import SURFACE_KINDS
from fba.face.authoring.surface.surface import Surface
from fba.face.model import FaceModel
from fba.face.points import DIRECTIONS
from fba.parameters import faps, point_rows
from fba.sampling import smoothstep

MOVING_WEIGHT = 3.0
"""Weight of the points that are to move, along the motion."""
REST_WEIGHT = 1.0
"""Weight of the other points."""
ACROSS_WEIGHT = 0.5
"""Weight of the points that are to move, across the motion."""
RIDGE = 0.1
"""Regularisation: a shape at weight 1 costs as much as 10 % of the motion at another point."""
TOTAL = 0.3
"""Regularisation: a sum of the weights of 1 costs 30 % of it, so that few shapes are mixed."""
LEAST_REACH = 0.9
"""Share of what the mesh's own tables move a point, below which shapes that fold earlier are not used."""
REACHED = 2 / 3
"""Share of a typical value at which that is measured."""
MOST_DETAIL = 1.5
"""Shapes may add to what the mesh's own tables move at most this many times the motion of these."""
MOST_WEIGHT = 1.25
"""A shape is used up to this weight for a typical value of the FAP."""
MIN_MEAN_SHARE = 0.45
"""Share of their target by which shapes must move a group's points on average."""
MIN_SHARE = 0.25
"""Share of its target by which shapes must move each point of a group."""
FULL_WEIGHT = 0.15
"""Weight of the mesh's own tables from which shapes are used in full; they fade out below."""
GROUPS = (
    (31, 33, 35), (32, 34, 36), (37,), (38,), (39,), (40,), (41,), (42,),
    (51, 55, 56), (52, 57, 58), (53,), (54,), (59,), (60,), (61,), (62,), (63,), (64,),
)  # fmt: skip
"""FAPs that sculptors move together: a shape raises a whole brow, a whole lip. Inner lips follow from
the mesh, as shapes always move both contours."""
REGIONS = {
    "brow": (*range(31, 39),),
    "cheek": (*range(39, 43),),
    "mouth": (*range(4, 14), 16, 17, *range(51, 61)),
    "nose": (*range(61, 65),),
}
"""FAPs that move the same area of skin, by the word with which ARKit's names of its shapes begin."""


@dataclass(frozen=True, eq=False)
class Mixer:
    """Mixes shapes for the FAPs of a face that `author` has made."""

    base: FaceModel
    shapes: Shapes

    @cached_property
    def points(self) -> dict[str, int]:
        """The P feature points of the skin that FAPs move linearly, and the FAP that gives their weights."""
        points: dict[str, int] = {}
        for fap in (fap for region in REGIONS.values() for fap in region):
            names = faps()[fap - 1].feature_points
            if len(names) == 1 and fap in self.base.table_of and self.base.bound[point_rows()[names[0]]] >= 0:
                points.setdefault(names[0], fap)
        return points

    @cached_property
    def vertices(self) -> Intp:
        """(P,) vertices of the points."""
        return np.array([self.base.bound[point_rows()[name]] for name in self.points], dtype=np.intp)

    @cached_property
    def weights(self) -> Float64:
        """(V, P) share of each point's motion that each vertex makes when the point's own table moves it."""
        columns = [self.weight(fap) for fap in self.points.values()]
        return np.stack(columns, axis=1) if columns else np.zeros((len(self.base.vertices), 0))

    @cached_property
    def moves(self) -> Float64:
        """(H, P, 3) displacement of each point by each half of a shape, metres."""
        return self.shapes.displacements_at(self.vertices)

    def step(self, fap: int) -> Float64:
        """Return (3,) displacement, metres, of the point of a FAP by one unit of its value."""
        entry = faps()[fap - 1]
        return np.asarray(np.array(DIRECTIONS[entry.positive]) * self.base.fapu[entry.unit])

    def weight(self, fap: int) -> Float64:
        """Return (V,) share of the motion of its point that each vertex makes for small values of a FAP."""
        field = first_steps(self.base, fap, 1.0)
        entry = faps()[fap - 1]
        return np.asarray(field @ np.array(DIRECTIONS[entry.positive]) / self.base.fapu[entry.unit])

    def tables(self, group: tuple[int, ...]) -> tuple[dict[int, FaceDefTables], set[str]]:
        """Return a group's tables made from shapes, and the names of these; empty without fitting shapes."""
        group = tuple(fap for fap in group if fap in self.base.table_of)
        group = tuple(fap for fap in group if faps()[fap - 1].feature_points[0] in self.points)
        details: dict[float, Float64] = {}
        used: set[str] = set()
        for sign in (-1.0, 1.0) if group else ():
            solved = self._solve_weights(group, sign)
            if solved is not None:
                step = self._correct_at_points(group, self.shapes.mix(solved))
                together = self._points_moved_together(group).values()
                plain = np.sum([first_steps(self.base, fap, sign) for fap in together], axis=0)
                if _largest(step - plain) > MOST_DETAIL * _largest(plain):
                    continue  # shapes that nearly cancel each other at the points
                details[sign] = step - plain
                halves = zip(self.shapes.halves, solved, strict=True)
                used |= {half.shape for half, weight in halves if weight * self._value(group[0]) > 0.02}
        made: dict[int, FaceDefTables] = {}
        if not details:
            return made, used
        # details are divided among the FAPs, so that they show once when all of the group move
        holds = {fap: np.abs(self.weight(fap)) for fap in group}
        total = np.sum(list(holds.values()), axis=0)
        shown = smoothstep(total / FULL_WEIGHT)
        for fap in group:
            share = (holds[fap] / np.where(total > 1e-6, total, 1.0) * shown)[:, None]
            down, up = (
                first_steps(self.base, fap, sign) + (share * details[sign] if sign in details else 0.0)
                for sign in (-1.0, 1.0)
            )
            mate = faps()[fap - 1].lip_mate
            if mate is None or mate not in self.base.table_of:
                table = fold_limited_tables(self.shapes, fap, down, up)
                made |= {fap: table} if table is not None else {}
            else:
                inner = (first_steps(self.base, mate, -1.0), first_steps(self.base, mate, 1.0))
                made |= self._coupled_tables(mate, fap, inner, (down, up))
        for fap, value in ((fap, sign * REACHED * self._value(fap)) for fap in group for sign in details):
            before, now = (self._shift(tables, fap, value) for tables in (self.base.table_of, made))
            if np.linalg.norm(now) < LEAST_REACH * np.linalg.norm(before):
                return {}, set()
        return made, used

    def _coupled_tables(
        self, inner_fap: int, outer_fap: int, inner: tuple[Float64, Float64], outer: tuple[Float64, Float64]
    ) -> dict[int, FaceDefTables]:
        """Return tables of a lip's FAPs, limited at folds, from (V, 3) metres a step below and above 0."""
        surface = self.shapes.surface
        limiter = Limiter.from_mesh(surface.vertices, surface.triangles)
        pinned = _pinned(surface, self.base)
        eased = []
        for side, end in enumerate(fap_limits(inner_fap)):
            joint = surface.of_all(inner[side]) + surface.of_all(outer[side])
            around = ease_field(surface, limiter, joint, [_goal(end)] if end else [], pinned)
            eased.append(surface.of_all(outer[side]) + around - joint)
        skin = (surface.of_all(inner[0]), surface.of_all(inner[1]))
        pair = coupled_motions(limiter, skin, (eased[0], eased[1]), inner_fap)
        made: dict[int, FaceDefTables] = {}
        for fap, motion, (down, up) in zip((inner_fap, outer_fap), pair, (inner, outer), strict=True):
            share = np.array([_progress(motion, value) for value in motion.values])
            table = _tables(self.base, surface, fap, motion, share, down, up)
            made |= {fap: table} if table is not None else {}
        return made

    def _shift(self, tables: Mapping[int, FaceDefTables], fap: int, value: float) -> Float64:
        """Return (3,) shift, in FAPU, of a FAP's point by its value and that of its lip mate."""
        entry = faps()[fap - 1]
        vertex = self.base.bound[point_rows()[entry.feature_points[0]]]
        total = np.zeros(3)
        both = {fap, entry.lip_mate or fap} & tables.keys()
        for mesh in (mesh for each in both for mesh in tables[each].meshes):
            total += mesh.shift(value)[mesh.vertices + self.base.starts[mesh.part] == vertex].sum(axis=0)
        return total

    def _points_moved_together(self, group: tuple[int, ...]) -> dict[str, int]:
        """Return the points that shapes move together and their FAPs: a group's and its inner lip mates'."""
        points = {faps()[fap - 1].feature_points[0]: fap for fap in group}
        for fap in group:
            mate = faps()[fap - 1].lip_mate
            if mate is not None and mate in self.base.table_of:
                name = faps()[mate - 1].feature_points[0]
                if name in self.points:
                    points[name] = mate
        return points

    def _value(self, fap: int) -> float:
        from fba.face.gltf.morphs import morph_values

        return float(morph_values()[fap])

    def _steps(self, group: tuple[int, ...]) -> Float64:
        """Return (P, 3) shift of each point by one step of all FAPs of a group and of their inner mates."""
        wanted = np.zeros((len(self.points), 3))
        names = list(self.points)
        for name, fap in self._points_moved_together(group).items():
            wanted[names.index(name)] = self.step(fap)
        return wanted

    def _solve_weights(self, group: tuple[int, ...], sign: float) -> Float64 | None:
        """Return (H,) weights of the halves that bring the points of a group one step in its direction."""
        from scipy.optimize import lsq_linear

        value = self._value(group[0])
        target = self._steps(group) * sign * value
        length = np.linalg.norm(target, axis=1)
        own = length > 0
        weight = np.full(target.shape, REST_WEIGHT)
        weight[own] = np.where(np.abs(target[own]) > 0, MOVING_WEIGHT, ACROSS_WEIGHT)
        weight /= length.max()
        word = next(word for word, region in REGIONS.items() if group[0] in region)
        fitting = np.flatnonzero([half.shape.startswith(word) for half in self.shapes.halves])
        if not len(fitting):
            return None
        system = (self.moves[fitting] * weight).reshape(len(fitting), -1).T
        solution = np.zeros(len(self.shapes.halves))
        solution[fitting] = lsq_linear(
            np.concatenate([system, RIDGE * np.eye(len(fitting)), TOTAL * np.ones((1, len(fitting)))]),
            np.concatenate([(target * weight).reshape(-1), np.zeros(len(fitting) + 1)]),
            bounds=(0.0, MOST_WEIGHT),
        ).x
        solution[solution < 1e-3] = 0.0
        moved = np.einsum("h,hpk->pk", solution, self.moves)
        outer = [list(self.points).index(faps()[fap - 1].feature_points[0]) for fap in group]
        shares = (moved[outer] * target[outer]).sum(axis=1) / length[outer] ** 2
        if shares.mean() < MIN_MEAN_SHARE or shares.min() < MIN_SHARE:
            return None
        return np.asarray(solution / (shares.mean() * value) * sign)

    def _correct_at_points(self, group: tuple[int, ...], step: Float64) -> Float64:
        """Return (V, 3) a group's step, faded out outside its region and corrected to be exact at points."""
        region = next(region for region in REGIONS.values() if group[0] in region)
        inside = [number for number, owner in enumerate(self.points.values()) if owner in region]
        step = step * smoothstep(np.abs(self.weights[:, inside]).max(axis=1) / FULL_WEIGHT)[:, None]
        rest, *_ = np.linalg.lstsq(
            self.weights[self.vertices], self._steps(group) - step[self.vertices], rcond=1e-6
        )
        return np.asarray(step + self.weights @ rest)

    def replacement_tables(self, fap: int, shapes: list[str]) -> FaceDefTables | None:
        """Return the tables of a FAP for which the mesh alone gives none, linear along shapes, or None."""
        entry = faps()[fap - 1]
        name = entry.feature_points[0]
        vertex = int(self.base.bound[point_rows()[name]])
        if vertex < 0 or entry.positive not in DIRECTIONS:
            return None
        field = np.sum([self.shapes.displacements(shape) for shape in shapes], axis=0)
        along = float(field[vertex] @ np.array(DIRECTIONS[entry.positive]))
        if not along > 0:
            return None
        step = field * self.base.fapu[entry.unit] / along
        return fold_limited_tables(self.shapes, fap, step, step)


def _largest(field: Float64) -> float:
    """Return the length of the largest of some displacements (V, 3)."""
    return float(np.linalg.norm(field, axis=1).max())


def first_steps(model: FaceModel, fap: int, sign: float) -> Float64:
    """Return (V, 3) metres a step: displacements by a FAP next to 0, above (sign 1) or below (-1) it."""
    unit = model.fapu.of_fap(fap)
    field = np.zeros((len(model.vertices), 3))
    for mesh in model.table_of[fap].meshes:
        zero = int(np.flatnonzero(mesh.borders == 0)[0])
        column = min(max(zero - (sign < 0), 0), len(mesh.borders) - 2)
        field[model.starts[mesh.part] + mesh.vertices] = mesh.displacements[:, column] * unit
    return field


def fold_limited_tables(shapes: Shapes, fap: int, down: Float64, up: Float64) -> FaceDefTables | None:
    """Return the tables of a FAP, limited where the skin would fold; None where nothing moves.

    down, up: (V, 3), metres a step below and above 0.
    """
    model, surface = shapes.model, shapes.surface
    pinned = _pinned(surface, model)
    low, high = fap_limits(fap)
    below, above = (
        _one_way(surface, surface.of_all(field), end, pinned) for field, end in ((down, low), (up, high))
    )
    values = np.array([*below.values[below.values < 0], 0.0, *above.values[above.values > 0]])
    moving = np.union1d(below.vertices, above.vertices)
    shifts = np.zeros((len(values), len(surface), 3))
    share = np.zeros(len(values))
    for k, value in enumerate(values):
        side = below if value < 0 else above
        shifts[k, side.vertices] = side.shifts_at(value)
        share[k] = _progress(side, value)
    return _tables(model, surface, fap, Motion(values, moving, shifts[:, moving]), share, down, up)


def _tables(
    model: FaceModel, surface: Surface, fap: int, motion: Motion, share: Float64, down: Float64, up: Float64
) -> FaceDefTables | None:
    """Return the tables of a motion of the skin, which teeth, brows and lashes follow; None without motion.

    share: (K,) steps that the skin has gone at each value of the motion. down, up: (V, 3), metres a step.
    """
    motions = split_by_part(surface, motion)
    for part in model.parts:
        if part.kind in SURFACE_KINDS:
            continue
        own = slice(model.starts[part.name], model.starts[part.name] + len(part.vertices))
        moved = np.flatnonzero(np.abs(down[own]).max(axis=1) + np.abs(up[own]).max(axis=1) > 0)
        if len(moved):
            steps = np.where((share < 0)[:, None, None], down[own][moved], up[own][moved])
            motions[part.name] = Motion(motion.values, moved, steps * share[:, None, None])
    made = build_tables(fap, model.fapu.of_fap(fap), motions)
    return made if made.meshes else None


def _pinned(surface: Surface, model: FaceModel) -> Bool:
    """Return (N,) mask of the vertices of the surface that feature points stand on."""
    bound = surface.find(model.bound)
    return surface.mask(bound[bound >= 0])


def _goal(end: float) -> float:
    """Return the value that a motion with an end of its range there should reach."""
    return float(np.sign(end)) * min(MODERATE_VALUE / EASE[0], abs(end))


def _one_way(surface: Surface, field: Float64, end: float, pinned: Bool) -> Motion:
    """Return the linear motion from 0 to one end, limited where triangles would fold. field: (N, 3)."""
    limiter = Limiter.from_mesh(surface.vertices, surface.triangles)
    if not field.any() or not end:
        return Motion(np.array(sorted((0.0, end or 1.0))), np.zeros(0, dtype=np.intp), np.zeros((2, 0, 3)))
    eased = ease_field(surface, limiter, field, [_goal(end)], pinned)
    vertices = np.flatnonzero(eased.any(axis=1))
    return linear_motion(limiter, vertices, eased[vertices], min(end, 0.0), max(end, 0.0))


def _progress(side: Motion, value: float) -> float:
    """Return the number of unlimited steps to which a motion at a value corresponds."""
    first = side.values[side.values * value > 0]
    if not value or not side.shifts.size or not len(first):
        return float(value)
    near = float(first[np.abs(first).argmin()])
    step = side.shifts_at(near) / near
    return float((side.shifts_at(value) * step).sum() / max(float((step**2).sum()), 1e-30))

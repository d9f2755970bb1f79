"""Shapes mixed for one FAP: solved at the feature points, put right there, kept from folding."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fba.face.authoring.extremes import Limiter
from fba.face.authoring.motion import Motion, by_part, limits, tables
from fba.face.authoring.relax import eased_field
from fba.face.authoring.saturation import EASE, MODERATE, straight
from fba.face.authoring.shapes import Shapes
from fba.face.authoring.surface import Surface
from fba.face.feature_points import row_of
from fba.face.model import FaceModel
from fba.face.points import DIRECTIONS
from fba.face.tables import FaceDefTables
from fba.parameters import faps

Float64 = npt.NDArray[np.float64]
Bool = npt.NDArray[np.bool_]

OWN, ELSEWHERE, ACROSS = 3.0, 1.0, 0.5
"""Weights of the FAP's own point, of the other points, and of the own point's other directions."""
RIDGE = 0.05
"""Holds weights small: a metre of error at a point counts as much as this weight at the own point's way."""
MOST_WEIGHT = 1.25
"""A shape is used up to this weight for a typical value of the FAP."""
LEAST_SHARE = 0.4
"""Shapes that bring a point less than this share of the way do not serve its FAP."""
FULL_WEIGHT = 0.15
"""From this weight of the mesh's own tables on, shapes show in full; they fade out below."""
REGIONS = (
    (*range(31, 39),),
    (*range(39, 43),),
    (*range(4, 14), 16, 17, *range(51, 61)),
    (*range(61, 65),),
)
"""FAPs that move the same stretch of skin."""
SKIN_KINDS = ("skin", "mouth")


class Mixer:
    """Mixes shapes for the FAPs of a face that `author` has made."""

    def __init__(self, base: FaceModel, shapes: Shapes) -> None:
        self.base, self.shapes = base, shapes
        self.unit = {fap.number: base.fapu[fap.unit] for fap in faps() if fap.unit}
        self.points = self._points()
        vertices = np.array([base.bound[row_of()[name]] for name in self.points], dtype=np.intp)
        self.vertices = vertices
        self.at = shapes.at(vertices)
        self.weights = np.stack([self._weight(fap) for fap in self.points.values()], axis=1)
        # how far each point follows when another one is moved by its own table
        self.coupling = self.weights[vertices]

    def _points(self) -> dict[str, int]:
        """Feature points of the skin that a FAP moves straight, and the FAP whose table shows their hold."""
        found: dict[str, int] = {}
        for region in REGIONS:
            for fap in region:
                names = faps()[fap - 1].feature_points
                if len(names) == 1 and fap in self.base.table_of and self.base.bound[row_of()[names[0]]] >= 0:
                    found.setdefault(names[0], fap)
        return found

    def _weight(self, fap: int) -> Float64:
        """(V,): how much of the way of its point each vertex goes when a FAP is small."""
        field = first_steps(self.base, fap)
        way = np.array(DIRECTIONS[faps()[fap - 1].positive])
        return np.asarray(field @ way / self.unit[fap])

    def table(self, fap: int) -> tuple[FaceDefTables, set[str]] | None:
        """Tables of a FAP from shapes, and the shapes; None where they do not reach."""
        name = faps()[fap - 1].feature_points[0]
        if name not in self.points:
            return None
        steps: list[Float64 | None] = []
        used: set[str] = set()
        for sign in (-1.0, 1.0):
            solved = self._solved(fap, sign)
            if solved is None:
                steps.append(None)
                continue
            weights, value = solved
            steps.append(self._put_right(fap, self.shapes.mixed(weights) / value))
            used |= {h.shape for h, w in zip(self.shapes.halves, weights, strict=True) if w > 0.02}
        if all(step is None for step in steps):
            return None
        own = first_steps(self.base, fap)
        down, up = (own if step is None else step for step in steps)
        made = guarded_tables(self.base, fap, down, up)
        return None if made is None else (made, used)

    def _solved(self, fap: int, sign: float) -> tuple[Float64, float] | None:
        """Weights of the halves that bring the point of a FAP furthest, and for which value."""
        from scipy.optimize import lsq_linear

        from fba.face.gltf.morphs import morph_values

        entry = faps()[fap - 1]
        value = sign * morph_values()[fap]
        way = np.array(DIRECTIONS[entry.positive]) * value * self.unit[fap]
        length = float(np.linalg.norm(way))
        own = [list(self.points).index(name) for name in self._together(fap)]
        target = np.zeros((len(self.points), 3))
        target[own] = way
        weight = np.full((len(self.points), 3), ELSEWHERE)
        weight[own] = np.where(np.abs(way) > 0, OWN, ACROSS)
        system = (self.at * weight).reshape(len(self.shapes.halves), -1).T / length
        ridge = RIDGE * np.eye(len(self.shapes.halves))
        solution = lsq_linear(
            np.concatenate([system, ridge]),
            np.concatenate([(target * weight).reshape(-1) / length, np.zeros(len(ridge))]),
            bounds=(0.0, MOST_WEIGHT),
        ).x
        solution[solution < 1e-3] = 0.0
        moved = np.einsum("h,hpk->pk", solution, self.at)
        share = float(moved[own[0]] @ way) / length**2
        if share < LEAST_SHARE:
            return None
        return solution / share, value

    def _together(self, fap: int) -> list[str]:
        """The point of a FAP, and that of the inner lip which shapes move along with the outer one."""
        entry = faps()[fap - 1]
        names = [entry.feature_points[0]]
        if entry.lip_mate:
            mate = faps()[entry.lip_mate - 1].feature_points[0]
            names += [mate] if mate in self.points else []
        return names

    def _put_right(self, fap: int, step: Float64) -> Float64:
        """(V, 3) for one step of a FAP: faded out of its region, and exact at all feature points."""
        region = next(region for region in REGIONS if fap in region)
        inside = [number for number, owner in enumerate(self.points.values()) if owner in region]
        hold = np.clip(np.abs(self.weights[:, inside]).max(axis=1) / FULL_WEIGHT, 0.0, 1.0)
        step = step * (hold * hold * (3 - 2 * hold))[:, None]
        wanted = np.zeros((len(self.points), 3))
        entry = faps()[fap - 1]
        own = list(self.points).index(entry.feature_points[0])
        wanted[own] = np.array(DIRECTIONS[entry.positive]) * self.unit[fap]
        rest, *_ = np.linalg.lstsq(self.coupling, wanted - step[self.vertices], rcond=1e-6)
        return np.asarray(step + self.weights @ rest)

    def standing_in(self, fap: int, shapes: list[str]) -> FaceDefTables | None:
        """A FAP that the mesh alone cannot serve, straight along shapes, in one direction."""
        entry = faps()[fap - 1]
        name = entry.feature_points[0]
        vertex = int(self.base.bound[row_of()[name]])
        if vertex < 0 or entry.positive not in DIRECTIONS:
            return None
        field = np.sum([self.shapes.whole(shape) for shape in shapes], axis=0)
        way = np.array(DIRECTIONS[entry.positive])
        along = float(field[vertex] @ way)
        if not along > 0:
            return None
        step = field * self.unit[fap] / along
        return guarded_tables(self.base, fap, step, step)


def first_steps(model: FaceModel, fap: int) -> Float64:
    """(V, 3) metres: what the first step of a FAP above 0 does to all vertices of a model."""
    entry = faps()[fap - 1]
    unit = model.fapu[entry.unit]
    field = np.zeros((len(model.vertices), 3))
    for mesh in model.table_of[fap].meshes:
        above = int(np.flatnonzero(mesh.borders == 0)[0])
        column = min(above, len(mesh.borders) - 2)
        field[model.starts[mesh.part] + mesh.vertices] = mesh.displacements[:, column] * unit
    return field


def guarded_tables(model: FaceModel, fap: int, down: Float64, up: Float64) -> FaceDefTables | None:
    """Tables of a FAP that moves vertices by `down` (V, 3) a step below 0 and by `up` above, metres, up
    to where the skin would fold; None where nothing moves."""
    skins = [part for part in model.parts if part.kind in SKIN_KINDS]
    surface = Surface(skins)
    pool = np.concatenate(
        [np.arange(model.starts[part.name], model.starts[part.name] + len(part.vertices)) for part in skins]
    )
    pinned = np.zeros(len(surface), dtype=bool)
    place = np.full(len(model.vertices), -1)
    place[pool] = surface.number
    held = model.bound[model.bound >= 0]
    pinned[place[held][place[held] >= 0]] = True
    low, high = limits(fap)
    below = _side(surface, surface_field(surface, down[pool]), low, pinned)
    above = _side(surface, surface_field(surface, up[pool]), high, pinned)
    values = np.array([*below.values[below.values < 0], 0.0, *above.values[above.values > 0]])
    moving = np.union1d(below.vertices, above.vertices)
    shifts = np.zeros((len(values), len(surface), 3))
    # what the skin is held back by, teeth, brows and lashes are held back by too
    share = np.zeros(len(values))
    for k, value in enumerate(values):
        side = below if value < 0 else above
        shifts[k, side.vertices] = side.at(value)
        share[k] = _progress(side, value)
    motions = by_part(surface, Motion(values, moving, shifts[:, moving]))
    for part in model.parts:
        if part.kind in SKIN_KINDS:
            continue
        own = slice(model.starts[part.name], model.starts[part.name] + len(part.vertices))
        which = np.flatnonzero(np.abs(down[own]).max(axis=1) + np.abs(up[own]).max(axis=1) > 0)
        if len(which):
            steps = np.where((share < 0)[:, None, None], down[own][which], up[own][which])
            motions[part.name] = Motion(values, which, steps * share[:, None, None])
    made = tables(fap, model.fapu[faps()[fap - 1].unit], motions)
    return made if made.meshes else None


def surface_field(surface: Surface, moves: Float64) -> Float64:
    """(N, 3) on the welded surface of displacements of the parts that it was made of."""
    field = np.zeros((len(surface), 3))
    field[surface.number] = moves
    return field


def _side(surface: Surface, field: Float64, end: float, pinned: Bool) -> Motion:
    """A straight motion from 0 to one end, held back where triangles would fold."""
    limiter = Limiter(surface.vertices, surface.triangles)
    if not field.any() or not end:
        return Motion(np.array(sorted((0.0, end or 1.0))), np.zeros(0, dtype=np.intp), np.zeros((2, 0, 3)))
    goal = float(np.sign(end)) * min(MODERATE / EASE[0], abs(end))
    eased = eased_field(surface, limiter, field, [goal], pinned)
    vertices = np.flatnonzero(eased.any(axis=1))
    return straight(limiter, vertices, eased[vertices], min(end, 0.0), max(end, 0.0))


def _progress(side: Motion, value: float) -> float:
    """How many unhindered steps a straight motion has gone at a value."""
    first = side.values[side.values != 0]
    if not value or not side.shifts.size or not len(first):
        return float(value)
    near = float(first[np.abs(first).argmin()])
    step = side.at(near) / near
    return float((side.at(value) * step).sum() / max(float((step**2).sum()), 1e-30))

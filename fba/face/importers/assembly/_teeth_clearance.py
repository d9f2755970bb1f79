"""Keeps skin that the corners of the mouth take along in front of the teeth.

FAPs 6, 7, 53 and 54 move the corners sideways. On a straight way to a pucker, skin passes through the rows of
teeth, which bend back beside the mouth: it has to slide over them, as that of people does.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fba.arrays import Float64
from fba.face._tables import FaceDefMesh, FaceDefTables
from fba.face.authoring.surface._motion import UNMOVED_DISTANCE
from fba.face.authoring.surface.landmarks import weld_skin
from fba.face.authoring.surface.surface import Surface
from fba.face.checks._fap_checks import count_errors
from fba.face.checks._posing import Poser
from fba.face.model import FaceModel
from fba.parameters import faps
from fba.sampling import smoothstep

STRETCH = (6, 7, 53, 54)
"""FAPs of the corners of the mouth, inner and outer."""
KNOTS = (-20.0, -80.0, -140.0, -200.0, -260.0, -320.0)
"""Values at which the clearance is measured. Up to the first one, the corners move straight."""
CELL_SIZE = 0.0005
"""Metres: spacing of the picture of the teeth's depth."""
MAX_CELLS = 1 << 20
CLOSED_GAP = 0.002
"""Metres up to which gaps between teeth are closed; their arch is smoothed by half of it."""
CLEARANCE = 0.0008
"""Metres of skin that stay in front of the arch; skin that is nearer at rest keeps its distance."""
MAX_DEPTH_BEHIND = 0.004
"""Metres: skin further behind the arch at rest is that of the mouth's inside, and stays as it is."""
SAMPLE_SHARES = ((1.0, 0.0, 0.0), (0.5, 0.5, 0.0), (0.0, 0.5, 0.5), (0.5, 0.0, 0.5), (1 / 3, 1 / 3, 1 / 3))
"""Shares of the corners of a triangle at which it has to clear the teeth."""
BRIDGING_PASSES = 3
"""Passes, as what is between vertices needs more than they do."""
TRIALS = ((0.7, 1.0), (0.45, 1.0), (0.3, 1.0), (0.7, 0.7), (0.45, 0.7), (0.45, 0.4))
"""Slope at which the forward motion falls off around the teeth, and share of the motion that is made: the
first pair that turns nothing over is taken."""
NEED_SQUARE = 0.001
"""Metres, side of a square; of the needs in it, the largest counts."""
FULL_SHARE = 0.15
"""Share of the largest motion above which skin comes forward in full."""
MIN_OVERLAP = 2e-4
"""Metres below which skin may get into the teeth without being pushed."""


@dataclass(frozen=True, eq=False)
class Arch:
    """How far forward teeth reach. depth: (rows, columns), metres, as far back as possible beside them.

    corner: (2,) x and y of the first cell, metres.
    """

    corner: Float64
    cell: float
    depth: Float64

    def depth_at(self, points: Float64) -> Float64:
        """Return (N,) z of the teeth at the x and y of points (N, 3); far back or -inf beside them."""
        from scipy.ndimage import map_coordinates

        cells = ((points[:, :2] - self.corner) / self.cell - 0.5).T[::-1]
        found = map_coordinates(self.depth, cells, order=1, mode="nearest")
        beside = (cells < 0) | (cells > np.array(self.depth.shape)[:, None] - 1)
        return np.where(beside.any(axis=0), -np.inf, found)


def clear_teeth(model: FaceModel) -> FaceModel:
    """Return the model, whose skin slides over the teeth where the corners of the mouth move inwards.

    Where that would turn triangles over, more of the skin around moves, or the motion is shorter.
    """
    arch = _measure_arch(model)
    stretch = [fap for fap in STRETCH if fap in model.table_of]
    if arch is None or not stretch:
        return model
    surface = weld_skin(model.parts, model.bound)
    poser = Poser(model)
    motions = [_shifts(poser, surface, stretch, value) for value in KNOTS[1:]]
    before = count_errors(poser, stretch)
    for slope, share in TRIALS:
        pushes = [share * _push(surface, arch, motion, slope) for motion in motions]
        if max(float(push.max()) for push in pushes) < MIN_OVERLAP:
            return model
        cleared = _with_pushes(model, surface, poser, stretch, pushes)
        if count_errors(Poser(cleared, like=poser), stretch) <= before:
            return cleared
    return model.with_notes({"teeth": "they come through the skin beside a narrow mouth"})


def _with_pushes(
    model: FaceModel, surface: Surface, poser: Poser, stretch: list[int], pushes: list[Float64]
) -> FaceModel:
    """Return the model whose skin comes forward by (N,) metres at each of the `KNOTS` but the first."""
    tables = [
        _with_push(model, table, _divide(poser, surface, stretch, fap, pushes), surface)
        if fap in stretch
        else table
        for fap, table in model.table_of.items()
    ]
    return model.with_tables(tuple(tables), model.lost)


def _measure_arch(model: FaceModel) -> Arch | None:
    """Return the arch of all rows of teeth, seen from the front; None without teeth."""
    from scipy.ndimage import gaussian_filter, grey_closing

    rows = [part for part in model.parts if part.kind == "teeth" and len(part.triangles)]
    if not rows:
        return None
    corners = np.concatenate([part.vertices.astype(np.float64)[part.triangles] for part in rows])
    low, high = corners.min(axis=(0, 1))[:2] - 3 * CLOSED_GAP, corners.max(axis=(0, 1))[:2] + 3 * CLOSED_GAP
    cell = max(CELL_SIZE, float(np.sqrt(np.prod(high - low) / MAX_CELLS)))
    size = np.ceil((high - low) / cell).astype(np.intp) + 1
    depth = np.full((size[1], size[0]), -np.inf)
    longest = float(np.linalg.norm(np.ptp(corners[:, :, :2], axis=1), axis=1).max())
    steps = int(np.clip(np.ceil(longest / cell), 1, 40))
    for i in range(steps + 1):
        for j in range(steps + 1 - i):
            shares = np.array([i, j, steps - i - j]) / steps
            points = np.einsum("k,fkc->fc", shares, corners)
            columns, lines = np.floor((points[:, :2] - low) / cell).astype(np.intp).T
            np.maximum.at(depth, (lines, columns), points[:, 2])
    floor = float(corners[:, :, 2].min())
    filled = np.where(np.isfinite(depth), depth, floor)
    wide = 2 * round(CLOSED_GAP / cell) + 1
    closed = grey_closing(filled, size=(wide, wide))
    smooth = gaussian_filter(closed, CLOSED_GAP / 2 / cell, mode="nearest")
    return Arch(low, cell, np.maximum(closed, smooth))


def _shifts(poser: Poser, surface: Surface, stretch: list[int], value: float) -> Float64:
    """Return (N, 3) displacements of the surface by some FAPs at one value."""
    return surface.of_all(poser.shift(dict.fromkeys(stretch, value)))


def _push(surface: Surface, arch: Arch, shifts: Float64, slope: float) -> Float64:
    """Return (N,) metres by which the surface, moved by some shifts (N, 3), has to come forward.

    Lips keep their thickness: what lies one behind the other comes forward alike, and around it, ever less:
    by `slope` metres for each metre.
    """
    way = np.linalg.norm(shifts, axis=1)
    share = smoothstep(way / max(FULL_SHARE * float(way.max()), 1e-9))
    triangles = surface.triangles[(share[surface.triangles] > 0).any(axis=1)]
    push = np.zeros(len(surface))
    needs = np.zeros((0, 3))
    for _ in range(BRIDGING_PASSES):
        moved = surface.vertices + shifts + push[:, None] * (0.0, 0.0, 1.0)
        for shares in SAMPLE_SHARES:
            mix = np.array(shares)
            rest = np.einsum("k,fkc->fc", mix, surface.vertices[triangles])
            points = np.einsum("k,fkc->fc", mix, moved[triangles])
            gap = rest[:, 2] - arch.depth_at(rest)
            short = arch.depth_at(points) + np.minimum(gap, CLEARANCE) - points[:, 2]
            wanted = np.flatnonzero(np.isfinite(short) & (short > 0) & (gap > -MAX_DEPTH_BEHIND))
            total = short[wanted] + push[triangles[wanted]] @ mix
            needs = _thin(np.concatenate([needs, np.c_[rest[wanted, :2], total]]))
        moving = np.flatnonzero(share > 0)
        push[moving] = _envelope(surface.vertices[moving, :2], needs, slope) * share[moving]
    return push


def _thin(needs: Float64) -> Float64:
    """Return the largest of the needs, rows x, y, metres, of each square of 1 mm."""
    order = np.argsort(-needs[:, 2], kind="stable")
    cells = np.floor(needs[order, :2] / NEED_SQUARE).astype(np.intp)
    _, first = np.unique(cells, axis=0, return_index=True)
    return np.asarray(needs[order[first]])


def _envelope(points: Float64, needs: Float64, slope: float) -> Float64:
    """Return (N,) the largest need, rows x, y, metres, less `slope` of its distance, at points (N, 2)."""
    result = np.zeros(len(points))
    for x, y, need in needs:
        away = np.hypot(points[:, 0] - x, points[:, 1] - y)
        np.maximum(result, need - slope * away, out=result)
    return result


def _divide(
    poser: Poser, surface: Surface, stretch: list[int], fap: int, pushes: list[Float64]
) -> dict[float, Float64]:
    """Return (N,) metres that one FAP brings the surface forward by value: that of its side, half of it each.

    By half, and not by its share in the sideways motion: an inner contour that came forward alone would turn
    the skin between it and the outer one over.
    """
    ways = {each: np.linalg.norm(_shifts(poser, surface, [each], KNOTS[0]), axis=1) for each in stretch}
    total = np.sum(list(ways.values()), axis=0)
    side = [each for each in stretch if each in (fap, faps()[fap - 1].lip_mate)]
    share = np.sum([ways[each] for each in side], axis=0) / np.where(total > 0, total, 1.0) / len(side)
    still = np.zeros(len(surface))
    pushed = {value: push * share for value, push in zip(KNOTS[1:], pushes, strict=True)}
    return {0.0: still, KNOTS[0]: still, **pushed}


def _with_push(
    model: FaceModel, table: FaceDefTables, push: Mapping[float, Float64], surface: Surface
) -> FaceDefTables:
    """Return the table of a FAP with a forward motion of the surface, (N,) metres by value."""
    unit = model.fapu.of_fap(table.fap)
    meshes = {mesh.part: mesh for mesh in table.meshes}
    for part, number in surface.members.items():
        if part in meshes:
            own = {value: way[number] for value, way in push.items()}
            meshes[part] = _add_forward(meshes[part], own, unit)
    return FaceDefTables(table.fap, tuple(meshes.values()), table.transforms)


def _add_forward(mesh: FaceDefMesh, push: Mapping[float, Float64], unit: float) -> FaceDefMesh:
    """Return a mesh's motion plus one along z, (V,) metres of each vertex by value, constant beyond."""
    values = np.array(sorted(push))
    pushed = np.flatnonzero(np.max([push[value] for value in values], axis=0) > UNMOVED_DISTANCE)
    vertices = np.union1d(mesh.vertices, pushed).astype(np.int32)
    ways = np.stack([push[value] for value in values])[:, vertices]
    inside = values[(values > mesh.borders[0]) & (values < mesh.borders[-1])].astype(np.int64)
    borders = np.union1d(mesh.borders.astype(np.int64), inside)
    # outermost intervals go on beyond their border: without a further one there, so would the push
    ends = [int(values[0]) - 1] if borders[0] > values[0] else []
    borders = np.union1d(borders, [*ends, *(values[values < borders[0]].astype(np.int64))])
    within = np.clip(np.searchsorted(mesh.borders, borders[:-1], side="right") - 1, 0, len(mesh.borders) - 2)
    moves = np.zeros((len(vertices), len(borders) - 1, 3))
    moves[np.searchsorted(vertices, mesh.vertices)] = mesh.displacements[:, within]
    at_borders = np.stack([_interpolate(values, ways, float(value)) for value in borders])
    slopes = np.diff(at_borders, axis=0) / np.diff(borders)[:, None] / unit
    moves[:, :, 2] += slopes.T
    return FaceDefMesh(mesh.part, borders.astype(np.int32), vertices, moves.astype(np.float32))


def _interpolate(values: Float64, ways: Float64, value: float) -> Float64:
    """Return (V,) ways (K, V) at rising values (K,), linear between them and constant beyond."""
    x = float(np.clip(value, values[0], values[-1]))
    k = int(np.clip(np.searchsorted(values, x) - 1, 0, len(values) - 2))
    share = (x - values[k]) / (values[k + 1] - values[k])
    return np.asarray(ways[k] * (1 - share) + ways[k + 1] * share)

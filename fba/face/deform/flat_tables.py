"""The FaceDefTables of a face as flat arrays, in the order in which the compiled loops read them."""

from __future__ import annotations

from operator import itemgetter
from typing import Any, NamedTuple

import numpy as np

from fba.arrays import Array, Bool, Float32, Float64, Int64, Intp, UInt32
from fba.errors import ModelError
from fba.face._tables import HEAD, FaceDefMesh
from fba.face.deform._normals import Surface
from fba.face.model import FaceModel
from fba.parameters import faps

VALUE_MAX = 2**31 - 1
"""FAPs beyond this are refused: no stream carries more than 32 bits."""
KIND_ORDER = ("translation", "rotation", "scale")
"""The order in which the transforms of a part are nested, outermost first, as in a Transform node."""
HEAD_PITCH = 48
HEAD_ROLL = 50


class Shifts(NamedTuple):
    """All FaceDefMesh of a face. A `track` is one of them, cut into intervals.

    Interval s of track m, first[m] <= s < first[m + 1], is for values up to upper[s]. It moves the vertices
    in rows start[s] to start[s + 1] of `rows` by slopes x (value - anchor[s]), plus, unless base[s] is -1,
    by `bases` from row base[s] on: the shifts at the value anchor[s], the border nearer to 0.
    """

    column: Int64
    """(M,) FAP - 1."""
    part: Int64
    """(M,) the part that moves."""
    first: Int64
    """(M + 1,) first interval."""
    upper: Float64
    """(S,) value at the interval's upper end; the last one of a track is infinite."""
    anchor: Float64
    """(S,) value at the end that is nearer to 0."""
    start: Int64
    """(S + 1,) first row."""
    base: Int64
    """(S,) first row in `bases`, -1 for none."""
    rows: UInt32
    """(N,) vertices of the whole face, ascending within an interval; unsigned saves a check."""
    slopes: Array
    """(N, 3) metres per step."""
    bases: Array
    """(B, 3) metres."""
    amount: Array
    """(1,) scratch: rounds a value to the tables' dtype."""


class Transforms(NamedTuple):
    """All FaceDefTransform of a face, those of a part together, outermost first; the head's come last."""

    start: Int64
    """(P + 2,) first transform of each part, then of the head."""
    column: Int64
    """(K,) FAP - 1."""
    kind: Int64
    """(K,) index in `KIND_ORDER`."""
    amount: Float64
    """(K, 3) for one step: metres, radians about each axis, or growth."""
    centre: Float64
    """(K, 3) metres."""


class MovingMesh(NamedTuple):
    """A model's vertices and what moves them, for the compiled loops."""

    rest: Float32
    """(V, 3) neutral vertices."""
    part_start: Int64
    """(P + 1,) first vertex of each part, and the number of all."""
    rows: UInt32
    """(N,) the vertices that are moved, ascending."""
    rows_start: Int64
    """(P + 1,) the first row of each part, and the number of all."""
    shifts: Shifts
    surface: Surface


class FlatModel(NamedTuple):
    """A model's tables as flat arrays."""

    mesh: MovingMesh
    transforms: Transforms
    point_shifts: Shifts
    """The shifts of feature points that are bound to vertices."""
    owner: Int64
    """(84,) part whose transforms move each feature point, -1 for the head alone."""


Members = list[tuple[Intp, Intp]]
"""For each part: indices of vertices within the part, and the rows of the array in which they move."""


def all_vertices(model: FaceModel) -> Members:
    """Return every vertex of every part, in order."""
    sizes = [np.arange(len(part.vertices)) for part in model.parts]
    return [(own, own + model.starts[part.name]) for part, own in zip(model.parts, sizes, strict=True)]


def bound_points(model: FaceModel) -> Members:
    """Return the vertices that feature points are bound to; the rows are those of the points."""
    members = []
    for part in model.parts:
        own = model.bound - model.starts[part.name]
        rows = np.flatnonzero((model.bound >= 0) & (own >= 0) & (own < len(part.vertices)))
        members.append((own[rows].astype(np.intp), rows))
    return members


def flatten_shifts(model: FaceModel, members: Members, dtype: type[np.floating[Any]]) -> Shifts:
    """Return all FaceDefMesh for vertices, in metres, without zeros. ModelError where one is too large."""
    number = {part.name: k for k, part in enumerate(model.parts)}
    tracks: list[tuple[int, int, int]] = []  # column, part, first interval
    intervals: list[tuple[float, float, int, int]] = []  # upper end, anchor, first row, first row in `bases`
    capacity = _count_rows(model, members, number)
    rows = np.empty(capacity, dtype=np.uint32)
    slopes, bases = np.empty((capacity, 3), dtype=dtype), np.empty((capacity, 3), dtype=dtype)
    count = base_count = 0
    for table in model.tables:
        unit = model.fapu.of_fap(table.fap)
        for mesh in table.meshes:
            own = number[mesh.part]
            tracks.append((table.fap - 1, own, len(intervals)))
            for limit, from_value, moving, per_step, at_anchor in _cut_intervals(
                mesh, *members[own], len(model.parts[own].vertices), unit
            ):
                _check(per_step, at_anchor, dtype, f"FaceDefTables of FAP {table.fap}, part {mesh.part!r}")
                shifted = at_anchor.any()
                intervals.append((limit, from_value, count, base_count if shifted else -1))
                stop = count + len(moving)
                rows[count:stop], slopes[count:stop] = moving, per_step
                count = stop
                if shifted:
                    bases[base_count : base_count + len(at_anchor)] = at_anchor
                    base_count += len(at_anchor)
    return Shifts(
        column=np.array([column for column, _, _ in tracks], dtype=np.int64),
        part=np.array([part for _, part, _ in tracks], dtype=np.int64),
        first=np.array([*(first for _, _, first in tracks), len(intervals)], dtype=np.int64),
        upper=np.array([upper for upper, _, _, _ in intervals], dtype=np.float64),
        anchor=np.array([anchor for _, anchor, _, _ in intervals], dtype=np.float64),
        start=np.array([*(start for _, _, start, _ in intervals), count], dtype=np.int64),
        base=np.array([base for _, _, _, base in intervals], dtype=np.int64),
        rows=rows[:count],
        slopes=slopes[:count],
        bases=bases[:base_count],
        amount=np.zeros(1, dtype=dtype),
    )


def _count_rows(model: FaceModel, members: Members, number: dict[str, int]) -> int:
    """Return the number of rows of the tables, displacements of zero included."""
    count = 0
    for table in model.tables:
        for mesh in table.meshes:
            own = number[mesh.part]
            moved = np.zeros(len(model.parts[own].vertices), dtype=bool)
            moved[mesh.vertices] = True
            count += int(moved[members[own][0]].sum()) * (len(mesh.borders) - 1)
    return count


_Interval = tuple[float, float, Intp, Float64, Float64]


def _cut_intervals(mesh: FaceDefMesh, own: Intp, rows: Intp, size: int, unit: float) -> list[_Interval]:
    """Return (upper end, anchor, rows, metres per step, metres at the anchor) of each interval."""
    index = np.full(size, -1)  # of a vertex in the FaceDefMesh
    index[mesh.vertices] = np.arange(len(mesh.vertices))
    listed = index[own]
    moves, rows = mesh.displacements[listed[listed >= 0]], rows[listed >= 0]
    borders = [float(border) for border in mesh.borders]
    zero = borders.index(0.0)
    cuts: list[_Interval] = []
    for steps in (range(zero, len(borders) - 1), range(zero - 1, -1, -1)):  # up from 0, and down from it
        shift = np.zeros((len(rows), 3))
        for j in steps:
            anchor, end = (borders[j], borders[j + 1]) if j >= zero else (borders[j + 1], borders[j])
            per_step = moves[:, j].astype(np.float64) * unit
            moving = _moves(per_step) | _moves(shift)
            limit = borders[j + 1] if j + 2 < len(borders) else np.inf
            cuts.append(
                (limit, anchor, rows[moving], per_step.compress(moving, 0), shift.compress(moving, 0))
            )
            shift += per_step * (end - anchor)
    cuts.sort(key=lambda cut: cut[0])
    return cuts


def _moves(shifts: Float64) -> Bool:
    """Return (N,) whether any of three components is not 0; several times faster than any(axis=1)."""
    nonzero = shifts != 0
    return np.asarray(nonzero[:, 0] | nonzero[:, 1] | nonzero[:, 2])


def _check(per_step: Float64, at_anchor: Float64, dtype: type[np.floating[Any]], where: str) -> None:
    most = float(np.abs(per_step).max(initial=0)) * 2 * VALUE_MAX + float(np.abs(at_anchor).max(initial=0))
    if not most * len(faps()) < float(np.finfo(dtype).max):
        raise ModelError(f"{where}: displacements of up to {np.abs(per_step).max():g} m a step are too large")


def flatten_transforms(model: FaceModel) -> Transforms:
    """Return the transforms of each part, nested as `Deformer` says. ModelError where one is too large."""
    names = [*(part.name for part in model.parts), HEAD]
    entries: list[list[tuple[tuple[int, float], int, list[float], tuple[float, ...]]]] = [[] for _ in names]
    for table in model.tables:
        unit = model.fapu.of_fap(table.fap)
        # yaw 49, roll 50, pitch 48: the order of the joints of the spine that the head stands on
        outward = HEAD_ROLL + 0.5 if table.fap == HEAD_PITCH else float(table.fap)
        for transform in table.transforms:
            kind = KIND_ORDER.index(transform.kind)
            amount = [unit * step for step in transform.amount]
            if not max(map(abs, amount)) * VALUE_MAX < 1e30:
                raise ModelError(
                    f"FaceDefTables of FAP {table.fap}, {transform.kind} of {transform.part!r}: "
                    f"{max(map(abs, amount)):g} a step is too large"
                )
            part = names.index(transform.part)
            entries[part].append(((kind, outward), table.fap - 1, amount, transform.centre))
    flat = [entry for own in entries for entry in sorted(own, key=itemgetter(0))]
    return Transforms(
        start=np.cumsum([0, *map(len, entries)], dtype=np.int64),
        column=np.array([entry[1] for entry in flat], dtype=np.int64),
        kind=np.array([entry[0][0] for entry in flat], dtype=np.int64),
        amount=np.array([entry[2] for entry in flat], dtype=np.float64).reshape(-1, 3),
        centre=np.array([entry[3] for entry in flat], dtype=np.float64).reshape(-1, 3),
    )

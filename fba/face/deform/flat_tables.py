"""The FaceDefTables of a whole face as flat arrays, in the order in which the compiled loops read them."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from fba.arrays import Array, Bool, Float64, Int64, Intp, UInt32
from fba.errors import ModelError
from fba.face.model import FaceModel
from fba.face.tables import HEAD, FaceDefMesh
from fba.parameters import faps

VALUE_MAX = 2**31 - 1
"""FAPs beyond this are refused: no stream carries more than 32 bits."""
KIND_ORDER = ("translation", "rotation", "scale")
"""How the transforms of one part are nested, outermost first, as in a Transform node."""
HEAD_PITCH, HEAD_ROLL = 48, 50


class Shifts(NamedTuple):
    """All FaceDefMesh of a face. One `track` is one of them, cut into intervals.

    Interval s of track m, first[m] <= s < first[m + 1], holds for values up to upper[s]. There the rows
    [start[s], start[s + 1]) of `rows` move by slopes x (value - anchor[s]), plus, unless base[s] is -1,
    by `bases` from row base[s] on: where they are when the value is anchor[s], the border nearer to 0.
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
    """(N,) vertices of the whole face, rising within an interval. Unsigned: no check for negative ones."""
    slopes: Array
    """(N, 3) metres per step."""
    bases: Array
    """(B, 3) metres."""
    amount: Array
    """(1,) scratch: brings a value to the tables' own precision."""


class Transforms(NamedTuple):
    """All FaceDefTransform of a face, those of a part together, outermost first; the head's come last."""

    start: Int64
    """(P + 2,) first transform of each part, then of the head."""
    column: Int64
    """(K,) FAP - 1."""
    kind: Int64
    """(K,) place in `KIND_ORDER`."""
    amount: Float64
    """(K, 3) for one step: metres, radians about each axis, or growth."""
    centre: Float64
    """(K, 3) metres."""


Members = list[tuple[Intp, Intp]]
"""For each part: the vertices of interest, in the part's own count, and the rows that they are moved in."""


def all_vertices(model: FaceModel) -> Members:
    """Every vertex of every part, in order."""
    sizes = [np.arange(len(part.vertices)) for part in model.parts]
    return [(own, own + model.starts[part.name]) for part, own in zip(model.parts, sizes, strict=True)]


def bound_points(model: FaceModel) -> Members:
    """The vertices that feature points stand on; the points are the rows."""
    members = []
    for part in model.parts:
        own = model.bound - model.starts[part.name]
        rows = np.flatnonzero((model.bound >= 0) & (own >= 0) & (own < len(part.vertices)))
        members.append((own[rows].astype(np.intp), rows))
    return members


def flat_shifts(model: FaceModel, members: Members, dtype: type[np.floating[Any]]) -> Shifts:
    """What FaceDefMesh does to the given vertices, in metres, zero displacements left out.

    Raises ModelError where a displacement is too large for numbers of that precision.
    """
    number = {part.name: place for place, part in enumerate(model.parts)}
    column, part, first, upper, anchor, base, start = ([] for _ in range(7))  # type: ignore[var-annotated]
    most = _most_rows(model, members, number)
    rows = np.empty(most, dtype=np.uint32)
    slopes, bases = np.empty((most, 3), dtype=dtype), np.empty((most, 3), dtype=dtype)
    count = base_count = 0
    for table in model.tables:
        unit = model.fapu[faps()[table.fap - 1].unit]
        for mesh in table.meshes:
            place = number[mesh.part]
            cuts = _intervals(mesh, *members[place], len(model.parts[place].vertices), unit)
            column.append(table.fap - 1)
            part.append(place)
            first.append(len(upper))
            for limit, from_value, moving, per_step, at_anchor in cuts:
                _check(per_step, at_anchor, dtype, f"FaceDefTables of FAP {table.fap}, part {mesh.part!r}")
                upper.append(limit)
                anchor.append(from_value)
                start.append(count)
                stop = count + len(moving)
                rows[count:stop], slopes[count:stop] = moving, per_step
                count = stop
                held = at_anchor.any()
                base.append(base_count if held else -1)
                if held:
                    bases[base_count : base_count + len(at_anchor)] = at_anchor
                    base_count += len(at_anchor)
    return Shifts(
        column=np.array(column, dtype=np.int64),
        part=np.array(part, dtype=np.int64),
        first=np.array([*first, len(upper)], dtype=np.int64),
        upper=np.array(upper, dtype=np.float64),
        anchor=np.array(anchor, dtype=np.float64),
        start=np.array([*start, count], dtype=np.int64),
        base=np.array(base, dtype=np.int64),
        rows=rows[:count],
        slopes=slopes[:count],
        bases=bases[:base_count],
        amount=np.zeros(1, dtype=dtype),
    )


def _most_rows(model: FaceModel, members: Members, number: dict[str, int]) -> int:
    """How many rows the tables have, with those of displacements that are zero."""
    most = 0
    for table in model.tables:
        for mesh in table.meshes:
            place = number[mesh.part]
            moved = np.zeros(len(model.parts[place].vertices), dtype=bool)
            moved[mesh.vertices] = True
            most += int(moved[members[place][0]].sum()) * (len(mesh.borders) - 1)
    return most


_Interval = tuple[float, float, Intp, Float64, Float64]


def _intervals(mesh: FaceDefMesh, own: Intp, rows: Intp, size: int, unit: float) -> list[_Interval]:
    """(upper end, anchor, rows, metres per step, metres at the anchor) of each interval."""
    place = np.full(size, -1)
    place[mesh.vertices] = np.arange(len(mesh.vertices))
    found = place[own]
    moves, rows = mesh.displacements[found[found >= 0]], rows[found >= 0]
    borders = [float(border) for border in mesh.borders]
    zero = borders.index(0.0)
    cuts: list[_Interval] = []
    for steps in (range(zero, len(borders) - 1), range(zero - 1, -1, -1)):  # up from 0, and down from it
        shape = np.zeros((len(rows), 3))
        for j in steps:
            anchor, end = (borders[j], borders[j + 1]) if j >= zero else (borders[j + 1], borders[j])
            per_step = moves[:, j].astype(np.float64) * unit
            moving = _moves(per_step) | _moves(shape)
            limit = borders[j + 1] if j + 2 < len(borders) else np.inf
            cuts.append(
                (limit, anchor, rows[moving], per_step.compress(moving, 0), shape.compress(moving, 0))
            )
            shape += per_step * (end - anchor)
    cuts.sort(key=lambda cut: cut[0])
    return cuts


def _moves(shifts: Float64) -> Bool:
    """(N,) whether any of three components is not 0; any(axis=1) takes several times as long."""
    nonzero = shifts != 0
    moves: Bool = nonzero[:, 0] | nonzero[:, 1] | nonzero[:, 2]
    return moves


def _check(
    per_step: Float64,
    at_anchor: Float64,
    dtype: type[np.floating[Any]],
    where: str,
) -> None:
    most = float(np.abs(per_step).max(initial=0)) * 2 * VALUE_MAX + float(np.abs(at_anchor).max(initial=0))
    if not most * len(faps()) < float(np.finfo(dtype).max):
        raise ModelError(f"{where}: displacements of up to {np.abs(per_step).max():g} m a step are too large")


def flat_transforms(model: FaceModel) -> Transforms:
    """The transforms of each part, nested as `Deformer` documents. ModelError where one is too large."""
    names = [*(part.name for part in model.parts), HEAD]
    found: list[list[tuple[tuple[int, float], int, list[float], tuple[float, ...]]]] = [[] for _ in names]
    for table in model.tables:
        unit = model.fapu[faps()[table.fap - 1].unit]
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
            place = names.index(transform.part)
            found[place].append(((kind, outward), table.fap - 1, amount, transform.centre))
    for of_part in found:
        of_part.sort(key=lambda entry: entry[0])
    flat = [entry for of_part in found for entry in of_part]
    return Transforms(
        start=np.cumsum([0, *map(len, found)], dtype=np.int64),
        column=np.array([entry[1] for entry in flat], dtype=np.int64),
        kind=np.array([entry[0][0] for entry in flat], dtype=np.int64),
        amount=np.array([entry[2] for entry in flat], dtype=np.float64).reshape(-1, 3),
        centre=np.array([entry[3] for entry in flat], dtype=np.float64).reshape(-1, 3),
    )

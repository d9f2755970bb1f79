"""Simplification by memoryless edge collapses over several poses, with its history.

Lindstrom and Turk, "Fast and Memory Efficient Polygonal Simplification" (1998): each collapse preserves the
volume and changes the surface least since the last one; no quadrics are kept. Here the cost is that of the
mesh in all its poses, so that what moves keeps its vertices. Borders and seams keep their course.

Parts of models are joined to one mesh: `carry_parts` says where they end and what they carry along.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from fba.arrays import Bool, Float32, Float64, Floating, Int32, Int64, Integer
from fba.errors import ModelError
from fba.mesh import Meshes

WELD = 1e-7
"""Vertices within this share of the mesh's size are one vertex, if they are in every pose."""
FARTHEST = 1e20
"""Largest coordinate: products of more than ten lengths are to be finite."""


@dataclass(frozen=True, eq=False)
class Level:
    """A mesh of fewer triangles, and where its vertices come from.

    positions: float64 (M, 3), at rest. triangles: int32 (F, 3). parents: int32 (N,), the vertex of this level
    that stands for each vertex of the full mesh. points: int32 (M,), equal for vertices along a seam that are
    one. rows, weights: int32 and float64 (M, 3), vertices of the full mesh that each is interpolated from.
    gone: bool (N,), vertices of which nothing is left, as of a hair that went as a whole; their parents are
    the nearest vertices of the part.
    """

    positions: Float64
    triangles: Int32
    parents: Int32
    points: Int32
    rows: Int32
    weights: Float64
    gone: Bool

    def carry(self, values: Floating) -> Float64:
        """Return values (M, ...) at this level's vertices of those (N, ...) at the full mesh's."""
        weights = self.weights.reshape(self.weights.shape + (1,) * (values.ndim - 1))
        return np.asarray((weights * values[self.rows]).sum(axis=1))


@dataclass(frozen=True, eq=False)
class Simplification:
    """A mesh and the collapses that simplify it: every level between the full mesh and the last one.

    positions: float64 (N, 3), at rest. triangles: int32 (F, 3). faces: int32 (C,), the number of triangles
    left by each collapse. The others are those of the collapses: see `_memoryless_mesh.History`.
    """

    positions: Float64
    triangles: Int32
    faces: Int32
    _points: Int32
    _wedges: Int32
    _parts: Int32
    _kept: Int32
    _place: Float64
    _forest: tuple[Int32, Int32]
    _wedge_forest: tuple[Int32, Int32]

    def level(self, faces: int) -> Level:
        """Return the finest level with at most this number of triangles; the last one where none is so small.

        Within the history, nothing is computed again: levels may be had in any order.
        """
        return self.after(int(np.searchsorted(-self.faces, -faces)) + 1 if faces < len(self._full) else 0)

    def after(self, collapses: int) -> Level:
        """Return the mesh after this number of collapses."""
        count = min(max(collapses, 0), len(self.faces))
        place = np.empty((int(self._points.max(initial=-1)) + 1, 3))
        place[self._points] = self.positions
        place[self._kept[:count]] = self._place[:count]  # the last one of each stays
        root = _roots(*self._forest, count)[self._points]
        wedge = _roots(*self._wedge_forest, count)[self._wedges]
        corners = root[self._full]
        a, b, c = corners.T
        left = wedge[self._full[(a != b) & (b != c) & (c != a)]]
        used, corner = np.unique(left, return_inverse=True)
        home = np.zeros(len(self._wedge_forest[0]), dtype=np.int32)  # the vertex that each wedge is at
        home[wedge] = root
        points: Int32 = home[used]
        number = np.full(len(home), -1, dtype=np.int32)
        number[used] = np.arange(len(used))
        # a side of a seam that has no triangle left: any other vertex at its place stands for it
        beside = np.full(len(place), -1, dtype=np.int32)
        beside[points] = number[used]
        parents = np.where(number[wedge] >= 0, number[wedge], beside[root]).astype(np.int32)
        positions = place[points]
        gone = parents < 0
        self._adopt(parents, positions)
        triangles = np.ascontiguousarray(corner.reshape(-1, 3), dtype=np.int32)
        rows, weights = self._sources(positions, parents)
        return Level(positions, triangles, parents, points, rows, weights, gone)

    def _adopt(self, parents: Int32, positions: Float64) -> None:
        """Write the parents of vertices that have none, -1: the nearest of the vertices, (M, 3), that stand
        for others of their part."""
        from scipy.spatial import cKDTree

        lost = parents < 0
        for part in np.unique(self._parts[lost]):
            own = self._parts == part
            left = np.unique(parents[own & ~lost])
            left = left if len(left) else np.arange(len(positions))
            if len(left):
                near = cKDTree(positions[left]).query(self.positions[own & lost])[1]
                parents[own & lost] = left[near]
        parents[parents < 0] = 0  # no triangle is left

    @cached_property
    def _full(self) -> Int32:
        """The full mesh's triangles with three different corners."""
        a, b, c = self._points[self.triangles].T
        return np.ascontiguousarray(self.triangles[(a != b) & (b != c) & (c != a)])

    def _sources(self, positions: Float64, parents: Int32) -> tuple[Int32, Float64]:
        """Return rows and weights of the nearest points on the triangles that vertices stand for."""
        return place_on_full(positions, self.positions, self._full, parents)


def simplify(
    poses: Floating,
    triangles: Integer,
    faces: int | Sequence[int],
    *,
    looks: Floating | None = None,
    importance: Floating | None = None,
    lines: Integer | None = None,
    balls: Floating | None = None,
) -> Simplification:
    """Return the simplification of a mesh down to a number of triangles, or through several, falling.

    poses: (K, N, 3), the vertices in K poses, the first at rest. triangles: (F, 3). looks: (N, A), number of
    the part, texture coordinates and colours: vertices of one position and different looks are a seam, which
    stays closed; without, or with equal ones, they are one vertex. A triangle that touches no other, such as
    a hair, may go, but not the last one of its part. importance: (N,), factors of the cost around each
    vertex, 1 by default, infinite for one that stays where it is. lines: (N,), a bit for each line through a
    vertex, such as a lid's margin: neighbours of one line collapse along it only. balls: (B, 7 + R), what
    triangles must not cut in the poses, such as eyeballs: centre (3), gaze (3), size, and R >= 2 radii at
    equal steps of the angle from the gaze, 0 to 180 degrees.

    An edge's cost is the source's (half the squared volumes that the collapse sweeps, half the squared areas
    along borders and seams times the squared length of the edge), summed over the poses, over the area around
    the edge. Feature points and other pinned vertices stay, borders and seams collapse along themselves only,
    onto one of their own vertices; all others move to where the volume at rest stays the same.

    Edges of more than two triangles stay. Where nothing can be collapsed, more triangles than asked for are
    left. ModelError for shapes that do not agree, numbers not finite or beyond `FARTHEST`, and triangles that
    name other vertices.
    """
    from fba.mesh.simplify import _memoryless_loops as loops
    from fba.mesh.simplify import _memoryless_mesh as state

    places, corners = _check(poses, triangles)
    points, wedges, parts = _number_vertices(places, looks)
    total, number = (int(numbers.max(initial=-1)) + 1 for numbers in (points, wedges))
    whole = points[corners]
    proper = (whole[:, 0] != whole[:, 1]) & (whole[:, 1] != whole[:, 2]) & (whole[:, 2] != whole[:, 0])
    whole, sides = np.ascontiguousarray(whole[proper]), np.ascontiguousarray(wedges[corners[proper]])
    part = parts[corners[proper, 0]]
    kind = _kinds(whole, sides, total)
    weight, through = _hold(kind, points, importance, lines)
    welded = np.empty((total, len(places), 3))
    welded[points] = places.transpose(1, 0, 2)
    surface = state.Surface(
        welded, whole, sides, np.full(total, -1, np.int32), np.full(3 * len(whole), -1, np.int32),
        kind, np.zeros((total, len(places), 6)), np.zeros((total, 3)), np.zeros(total, np.int32),
        np.zeros(total, np.int64), np.zeros(total, np.int64), weight, through,
        *_measure_lines(welded[:, 0], whole, through),
        part, np.bincount(part, minlength=1).astype(np.int32), _check_balls(balls),
    )  # fmt: skip
    history, scratch = _allocate(total, number, len(places))
    done = 0
    if total:
        _link(surface, scratch)
        for target in [faces] if isinstance(faces, int) else faces:
            left = int(history.faces[done - 1]) if done else len(whole)
            done = loops.collapse_edges(surface, history, done, left, max(int(target), 1), scratch)
    return Simplification(
        places[0], corners, history.faces[:done].copy(), points, wedges, parts, history.kept[:done].copy(),
        history.place[:done].copy(), (history.onto, history.step), (history.wedge_onto, history.wedge_step),
    )  # fmt: skip


def _number_vertices(places: Float64, looks: Floating | None) -> tuple[Int32, Int32, Int32]:
    """Return (N,) three times: numbers of points, of wedges, points of one look, and of parts.

    places: (K, N, 3). looks: as `simplify` takes them.
    """
    count = places.shape[1]
    size = max(float(np.ptp(places[0], axis=0).max()) if count else 0.0, 1e-30)
    flat = np.ascontiguousarray(places.transpose(1, 0, 2).reshape(count, 3 * len(places)))
    points = _number_rows(np.round(flat / (size * WELD)))
    given = np.zeros((count, 0)) if looks is None else np.asarray(looks, dtype=np.float64)
    if given.ndim != 2 or len(given) != count:
        raise ModelError(f"looks must have {count} rows, one for each vertex, not the shape {given.shape}")
    wedges = _number_rows(np.concatenate([points[:, None], given], axis=1))
    return points, wedges, _number_rows(given[:, :1]) if given.shape[1] else np.zeros(count, np.int32)


def _hold(
    kind: Int32, points: Int32, importance: Floating | None, lines: Integer | None
) -> tuple[Float64, Int64]:
    """Return (V,) twice: factors of the cost, and a bit for each line; write the kind of what they hold.

    kind: (V,), by borders and seams. points: (N,). importance, lines: as `simplify` takes them.
    """
    from fba.mesh.simplify import _memoryless_mesh as state

    weight, through = np.ones(len(kind)), np.zeros(len(kind), np.int64)
    if importance is not None:
        factors = np.asarray(importance, dtype=np.float64)
        if factors.shape != points.shape or not (factors >= 0).all():
            raise ModelError(
                f"importance must be {len(points)} numbers that are not negative, one for each vertex"
            )
        weight[points] = factors
        kind[points[np.isinf(factors)]] = state.PINNED
        weight[np.isinf(weight)] = 1.0
    if lines is not None:
        bits = np.asarray(lines)
        if bits.shape != points.shape or bits.dtype.kind not in "iu" or (bits.astype(np.int64) < 0).any():
            raise ModelError(
                f"lines must be {len(points)} whole numbers from 0 to 2**63 - 1, one for each vertex"
            )
        np.bitwise_or.at(through, points, bits.astype(np.int64))
        kind[(through > 0) & (kind == state.ON_LINE)] = state.PINNED  # where a line meets a border
        kind[(through > 0) & (kind == state.FREE)] = state.ON_LINE
    return weight, through


def _allocate(vertices: int, wedges: int, poses: int) -> tuple[Any, Any]:
    """Return the history and the scratch arrays of `_memoryless_mesh` for these numbers."""
    from fba.mesh.simplify import _memoryless_mesh as state

    history = state.History(
        np.zeros(vertices, np.int32), np.zeros((vertices, 3)), np.zeros(vertices, np.int32),
        np.arange(vertices, dtype=np.int32), np.full(vertices, vertices, np.int32),
        np.arange(wedges, dtype=np.int32), np.full(wedges, vertices, np.int32),
    )  # fmt: skip
    scratch = state.Scratch(
        np.empty(2 * state.MAX_RING, np.int32), np.empty(4 * state.MAX_RING + 4, np.int32),
        np.empty((poses, 13)), np.empty(9), np.empty((3, 4)), np.empty((3, 3)), np.empty(3), np.empty(1),
        np.full(vertices, np.inf), np.zeros(vertices, np.int32),
    )  # fmt: skip
    return history, scratch


def _link(surface: Any, scratch: Any) -> None:
    """Link the corners of a surface, and leave out lines that leave their way before anything collapses."""
    from fba.mesh.simplify import _memoryless_mesh as state
    from fba.mesh.simplify import _memoryless_rules as rules

    state.link_corners(surface)
    for line, (start, left) in enumerate(zip(surface.ends[:, 0], surface.left, strict=True)):
        if start >= 0 and rules.leaves_line(surface, line, start, start, left, scratch):
            surface.ends[line] = -1


def place_on_level(positions: Floating, level: Level) -> tuple[Int32, Float64]:
    """Return where each vertex (N, 3) of the full mesh lies on a level: int32 (N, 3), vertices of the level,
    and float64 (N, 3), their weights, 0 for what is gone. Only triangles around the vertex that stands for it
    count."""
    corners = level.positions[level.triangles]
    rows, weights = _nearest(positions, corners, level.triangles, level.parents, level.triangles)
    weights[level.gone] = 0.0
    return rows, weights


def place_on_full(
    positions: Floating, vertices: Floating, triangles: Int32, parents: Int32
) -> tuple[Int32, Float64]:
    """Return where each vertex (M, 3) of a level lies on the full mesh: int32 (M, 3), vertices of the full
    mesh, and float64 (M, 3), their weights. Only triangles with a corner that it stands for count.

    vertices: (N, 3), and triangles: (F, 3), of the full mesh. parents: (N,), vertices of the level.
    """
    own = np.arange(len(positions), dtype=np.int32)
    return _nearest(positions, np.asarray(vertices)[triangles], parents[triangles], own, triangles)


def _nearest(
    positions: Floating, corners: Floating, owners: Int32, own: Integer, names: Int32
) -> tuple[Int32, Float64]:
    """Return the nearest point to each of positions (N, 3) on triangles (F, 3, 3): names (N, 3) and weights.

    owners: (F, 3), which lists each triangle is in, once for each corner. own: (N,), the list of each
    position. names: (F, 3), what the corners are called. ModelError where there is no triangle.
    """
    flat = owners.ravel()
    count = max(int(flat.max(initial=-1)), int(own.max(initial=-1))) + 1
    if not len(corners) or min(int(flat.min()), int(own.min(initial=0))) < 0:
        raise ModelError("no triangle is left around a vertex of the mesh")
    first, second, third = owners.T
    again = np.stack([first < 0, second == first, (third == first) | (third == second)], axis=1)
    flat = np.where(again.ravel(), count, flat)  # a triangle is tried once for a list that it is in twice
    lists = np.argsort(flat, kind="stable") // 3  # the triangles of one list after the other
    counts = np.bincount(flat, minlength=count)
    lengths, starts = counts[own], (np.cumsum(counts) - counts)[own]
    triangle, weights = np.zeros(len(positions), dtype=np.intp), np.zeros((len(positions), 3))
    weights[:, 0] = 1.0  # of the first triangle, for what has none
    point = np.repeat(np.arange(len(positions)), lengths)
    first = np.cumsum(lengths) - lengths
    tried = lists[np.arange(len(point)) + np.repeat(starts - first, lengths)]
    shares, squared = _on_triangles(np.asarray(positions)[point], np.asarray(corners)[tried])
    order = np.lexsort((squared, point))
    found = lengths > 0
    best = order[first[found]]
    triangle[found], weights[found] = tried[best], shares[best]
    return names[triangle], weights


def _on_triangles(points: Floating, corners: Floating) -> tuple[Float64, Float64]:
    """Return where each of points (N, 3) is nearest on its triangle (N, 3, 3): weights of the corners (N, 3),
    and squared distances (N,). Ericson, "Real-Time Collision Detection" (2005), section 5.1.5."""
    a, p = corners[:, 0].astype(np.float64), points.astype(np.float64)
    ab, ac, ap = corners[:, 1] - a, corners[:, 2] - a, p - a
    d1, d2, bb, bc, cc = (
        np.einsum("ij,ij->i", one, other) for one, other in ((ab, ap), (ac, ap), (ab, ab), (ab, ac), (ac, ac))
    )
    d3, d4, d5, d6 = d1 - bb, d2 - bc, d1 - bc, d2 - cc
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    zero, one, across = np.zeros_like(d1), np.ones_like(d1), (d4 - d3) + (d5 - d6)
    with np.errstate(divide="ignore", invalid="ignore"):
        along_ab, along_ac, along_bc, whole = d1 / (d1 - d3), d2 / (d2 - d6), (d4 - d3) / across, va + vb + vc
        cases = (  # the nearest point is a corner, on an edge, or inside
            ((d1 <= 0) & (d2 <= 0), zero, zero),
            ((d3 >= 0) & (d4 <= d3), one, zero),
            ((vc <= 0) & (d1 >= 0) & (d3 <= 0), along_ab, zero),
            ((d6 >= 0) & (d5 <= d6), zero, one),
            ((vb <= 0) & (d2 >= 0) & (d6 <= 0), zero, along_ac),
            ((va <= 0) & (d4 >= d3) & (d5 >= d6), 1 - along_bc, along_bc),
            (whole > 0, vb / whole, vc / whole),
        )
        v, w = (np.select([case[0] for case in cases], [case[k] for case in cases]) for k in (1, 2))
    shares = np.nan_to_num(np.stack([1 - v - w, v, w], axis=1))
    off = np.einsum("nk,nkd->nd", shares, corners) - p
    return shares, np.einsum("ij,ij->i", off, off)


def _check(poses: Floating, triangles: Integer) -> tuple[Float64, Int32]:
    places, corners = np.array(poses, dtype=np.float64), np.asarray(triangles)
    if places.ndim != 3 or places.shape[2] != 3 or not len(places):
        raise ModelError(f"poses must have shape (K, N, 3), at least one, not {places.shape}")
    if not np.isfinite(places).all():
        raise ModelError("a vertex has a position that is not finite")
    if np.abs(places).max(initial=0.0) > FARTHEST:
        pose, number, _ = (int(at) for at in np.argwhere(np.abs(places) > FARTHEST)[0])
        raise ModelError(
            f"vertex {number} is at {places[pose, number].tolist()} in pose {pose}, beyond {FARTHEST:g}; "
            "give positions in metres"
        )
    if corners.ndim != 2 or corners.shape[1] != 3 or corners.dtype.kind not in "iu":
        raise ModelError(f"triangles must be whole numbers, (F, 3), not {corners.dtype} {corners.shape}")
    if corners.size and not 0 <= corners.min() <= corners.max() < places.shape[1]:
        raise ModelError(f"triangles name vertices beyond the {places.shape[1]} that exist")
    return places, np.ascontiguousarray(corners, dtype=np.int32)


def _check_balls(balls: Floating | None) -> Float64:
    rows = np.zeros((0, 9)) if balls is None else np.array(balls, dtype=np.float64, ndmin=2)
    if rows.ndim != 2 or rows.shape[1] < 9:
        raise ModelError(
            "balls must be rows of 9 numbers or more, a centre, a gaze, a size and at least two radii, "
            f"not an array of shape {rows.shape}"
        )
    for number, row in enumerate(rows):
        is_unit = abs(math.hypot(*row[3:6]) - 1.0) < 1e-6
        if not (np.isfinite(row).all() and is_unit and row[6] > 0 and (row[7:] >= 0).all()):
            raise ModelError(
                f"ball {number} is {row.tolist()}; its numbers must be finite, its gaze of length 1, its "
                "size above 0, and no radius below 0"
            )
    return np.ascontiguousarray(rows)


def _number_rows(rows: Float64) -> Int32:
    """Return (N,): equal numbers for equal rows (N, A), rising with the first row of each."""
    packed = np.ascontiguousarray(rows + 0.0)  # no negative zeros
    view = packed.view(np.dtype((np.void, packed.dtype.itemsize * packed.shape[1]))).ravel()
    _, first, number = np.unique(view, return_index=True, return_inverse=True)
    rank = np.empty(len(first), dtype=np.int32)
    rank[np.argsort(first)] = np.arange(len(first))
    return rank[number]


def _kinds(triangles: Int32, wedges: Int32, count: int) -> Int32:
    """Return int32 (V,): which vertices may move, by the borders and seams that they lie on."""
    from fba.mesh.simplify import _memoryless_mesh as state

    ends = triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2).astype(np.int64)
    sides = wedges[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    turned = ends[:, 0] > ends[:, 1]
    ends[turned], sides[turned] = ends[turned, ::-1], sides[turned, ::-1]
    _, edge, times = np.unique(ends[:, 0] * count + ends[:, 1], return_inverse=True, return_counts=True)
    order = np.argsort(edge, kind="stable")
    first = np.cumsum(times) - times
    one, other = order[first], order[first + times - 1]
    line = (times == 1) | (sides[one] != sides[other]).any(axis=1)
    lines = np.bincount(ends[one[line]].ravel(), minlength=count)
    crowded = np.bincount(ends[one[times > 2]].ravel(), minlength=count) > 0
    most = int(wedges.max(initial=0)) + 1
    pairs = np.unique(triangles.ravel().astype(np.int64) * most + wedges.ravel())
    parts = np.bincount(pairs // most, minlength=count)
    kind = np.full(count, state.FREE, dtype=np.int32)
    kind[lines > 0] = state.ON_LINE
    kind[(lines == 1) | (lines > 2) | crowded | (parts > 2) | ((lines == 0) & (parts > 1))] = state.PINNED
    return kind


def _measure_lines(places: Float64, triangles: Int32, lines: Int64) -> tuple[Int32, Int32, Float64]:
    """Return the ends of lines, their vertices and their lengths; see `_memoryless_mesh.Surface`.

    places: (V, 3). triangles: (F, 3). lines: (V,), a bit for each line. What is no open line has no ends.
    """
    count = int(lines.max(initial=0)).bit_length()
    ends, left, longest = np.full((count, 2), -1, np.int32), np.zeros(count, np.int32), np.zeros(count)
    sides = triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    edges = np.unique(np.sort(sides[(lines[sides] > 0).all(axis=1)], axis=1), axis=0)
    for line in range(count):
        on = (lines >> line & 1).astype(bool)
        one, other = edges[on[edges].all(axis=1)].T
        degree = np.bincount(np.concatenate([one, other]), minlength=len(lines))
        left[line], longest[line] = on.sum(), np.linalg.norm(places[one] - places[other], axis=1).sum()
        if len(one) == left[line] - 1 and (degree == 1).sum() == 2:
            ends[line] = np.flatnonzero(degree == 1)
    return ends, left, longest


def _roots(onto: Int32, step: Int32, count: int) -> Int32:
    """Return what each vertex has become after the first `count` collapses."""
    root = np.where(step < count, onto, np.arange(len(onto), dtype=np.int32))
    while True:  # each round halves the way to the root
        following = root[root]
        if np.array_equal(following, root):
            return root
        root = following


def part_looks(model: Meshes[Any]) -> Float64:
    """Return (V, 7): number of the part, texture coordinates, colours; differences between them are seams."""
    looks = np.zeros((len(model.vertices), 7))
    for number, part in enumerate(model.parts):
        rows = slice(model.starts[part.name], model.starts[part.name] + len(part.vertices))
        looks[rows, 0] = number
        if part.texcoords is not None:
            looks[rows, 1:3] = part.texcoords
        if part.colours is not None:
            looks[rows, 3:] = part.colours
    return looks


def part_starts(model: Meshes[Any], level: Level) -> list[int]:
    """Return the first vertex of each part on a level that `part_looks` divides, and the number of all."""
    counts = [len(part.vertices) for part in model.parts]
    owner = np.repeat(np.arange(len(counts)), counts)[level.rows[:, 0]]
    return [int(start) for start in np.searchsorted(owner, np.arange(len(counts) + 1))]


def carry_parts(model: Meshes[Any], level: Level) -> Iterator[tuple[Any, slice, dict[str, Any]]]:
    """Yield each part, its vertices on a level, and its arrays there: places, triangles and looks."""
    starts = part_starts(model, level)
    for part, begin, end in zip(model.parts, starts[:-1], starts[1:], strict=True):
        sources, weights = level.rows[begin:end] - model.starts[part.name], level.weights[begin:end]
        own = (level.triangles[:, 0] >= begin) & (level.triangles[:, 0] < end)
        arrays: dict[str, Any] = {
            "vertices": level.positions[begin:end].astype(np.float32),
            "triangles": level.triangles[own] - np.int32(begin),
        }
        for name in ("normals", "texcoords", "colours"):
            values: Float32 | None = getattr(part, name)
            if values is not None:
                arrays[name] = np.einsum("nk,nkd->nd", weights, values[sources]).astype(np.float32)
        yield part, slice(begin, end), arrays

"""Binds feature points to vertices."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
import numpy.typing as npt

from fba.arrays import Float64, Int32, Intp
from fba.errors import ModelError
from fba.face.authoring.surface.surface import Surface, vertices_of_kinds, weld_parts
from fba.face.feature_points import FREE_POINTS, names
from fba.face.model import Part
from fba.parameters import point_rows

KINDS_OF_GROUP = {6: ("tongue",)}
KINDS_OF_POINT = {
    **dict.fromkeys(("3.5", "3.6"), ("eye",)),
    **dict.fromkeys(("9.8", "9.9", "9.10", "9.11"), ("teeth",)),
}
SURFACE_KINDS = ("skin", "mouth")
"""Kinds of parts that together make the one surface that FAPs deform."""
TOLERANCE = 0.15
"""A point may lie this far from its part, as a share of the face's size."""
LIP_SLACK = 0.02
"""A point's own lip may be further away than the nearest lip by this share of the face's size."""
JAW_OF_TEETH = {"9.8": 1, "9.10": 1, "9.9": -1, "9.11": -1}
UPPER_LIP = ("2.2", "2.6", "2.7")
LOWER_LIP = ("2.3", "2.8", "2.9")


@dataclass(frozen=True)
class Binding:
    """Feature points and their vertices.

    points: float64 (84, 3), on their vertices where bound. bound: int32 (84,), -1 where free. far: distance,
    metres, of points that are too far from the part they belong to.
    """

    points: Float64
    bound: Int32
    far: dict[str, float]


def face_size(points: Float64) -> float:
    """Return the size of the face, metres: half the diagonal of the box around its known feature points."""
    known = points[np.isfinite(points).all(axis=1)]
    if len(known) < 2:
        raise ModelError(
            f"only {len(known)} of the {len(points)} feature points are known; at least two are "
            "needed, and for FAPU ten"
        )
    return float(np.linalg.norm(known.max(axis=0) - known.min(axis=0))) / 2


def bind_points(parts: Sequence[Part], points: Float64, bound: npt.ArrayLike | None) -> Binding:
    """Return the feature points (84, 3) bound to the nearest vertices of the parts that they belong to.

    bound: (84,) vertices set by the caller, -1 for the nearest. Raises ModelError where most points are far
    from the mesh, or a vertex does not exist.
    """
    size = face_size(points)
    given = np.full(len(points), -1) if bound is None else np.array(bound)
    total = sum(len(part.vertices) for part in parts)
    if given.shape != (len(points),) or given.dtype.kind not in "iu":
        raise ModelError(f"bound vertices must be {len(points)} whole numbers, -1 for none")
    if (given >= total).any() or (given < -1).any():
        row = int(np.argwhere((given >= total) | (given < -1))[0, 0])
        raise ModelError(
            f"feature point {names()[row]} is bound to vertex {given[row]}, but there are {total}"
        )
    vertices = np.concatenate([part.vertices for part in parts]).astype(np.float64)
    vertex = given.astype(np.int32)
    far: dict[str, float] = {}
    pieces = cache(lambda: _connected_pieces(parts, KINDS_OF_POINT["9.8"]))
    for name, row in point_rows().items():
        if vertex[row] >= 0 or name in FREE_POINTS:
            continue
        pool = vertices_of_kinds(parts, kinds_for_point(name))
        if np.isnan(points[row]).any() or not len(pool):
            continue
        away = np.linalg.norm(vertices[pool] - points[row], axis=1)
        nearest = int(away.argmin())
        if name in JAW_OF_TEETH:
            nearest = _nearest_in_jaw(vertices[pool], pieces(), away, JAW_OF_TEETH[name], LIP_SLACK * size)
        if away[nearest] > TOLERANCE * size:
            far[name] = float(away[nearest])
        else:
            vertex[row] = pool[nearest]
    tried = [name for name in names() if np.isfinite(points[point_rows()[name]]).all()]
    if len(far) > len(tried) / 2 and len(far) > 3:
        worst = max(far, key=lambda name: far[name])
        raise ModelError(
            f"{len(far)} of {len(tried)} feature points are far from the mesh, {worst} by {far[worst]:g} m: "
            "do points and mesh have the same unit and axes?"
        )
    return _bound_to(vertex, points, vertices, far)


def _bound_to(vertex: Int32, points: Float64, vertices: Float64, far: dict[str, float]) -> Binding:
    """Return the binding of points (84, 3) to vertices (84,); free points (-1) stay where they are."""
    points = points.copy()
    is_bound = vertex >= 0
    points[is_bound] = vertices[vertex[is_bound]]
    return Binding(points, vertex, far)


def separate_lips(
    surface: Surface, parts: Sequence[Part], points: Float64, binding: Binding, size: float
) -> Binding:
    """Return the binding with points that were bound to the wrong lip moved to the right one.

    Lips touch, so the nearest vertex may be on the wrong one; the distance along the surface to the outer
    lip points (8.1, 8.2) tells them apart.
    """
    bound, row = binding.bound.copy(), point_rows()
    vertex = surface.find(bound)
    outer = [int(vertex[row[name]]) for name in ("8.1", "8.2")]
    if min(outer) < 0:
        return binding
    walk = [surface.distances([start], limit=2 * size) for start in outer]
    on_skin = surface.vertices[surface.number]
    for own, other, group in ((walk[0], walk[1], UPPER_LIP), (walk[1], walk[0], LOWER_LIP)):
        same_lip = own < other
        for name in group:
            current, point = int(vertex[row[name]]), points[row[name]]
            if current < 0 or same_lip[current] or np.isnan(point).any():
                continue
            away = np.linalg.norm(on_skin - point, axis=1)
            away[~same_lip[surface.number]] = np.inf
            nearest = int(away.argmin())
            if away[nearest] <= float(np.linalg.norm(surface.vertices[current] - point)) + LIP_SLACK * size:
                bound[row[name]] = surface.pool[nearest]
    vertices = np.concatenate([part.vertices for part in parts]).astype(np.float64)
    return _bound_to(bound, binding.points, vertices, binding.far)


def _connected_pieces(parts: Sequence[Part], kinds: tuple[str, ...]) -> Intp:
    """Return (V,) number of the connected piece of each vertex of the parts of some kinds."""
    labels, count = [np.zeros(0, dtype=np.intp)], 0
    for part in parts:
        if part.kind in kinds:
            own = weld_parts([part])
            labels.append(own.component[own.number] + count)
            count += int(own.component.max(initial=-1)) + 1
    return np.concatenate(labels)


def _nearest_in_jaw(vertices: Float64, piece: Intp, away: Float64, jaw: int, slack: float) -> int:
    """Return the nearest vertex in one jaw, at most `slack` metres further than the nearest of all.

    Teeth touch, so the nearest vertex may be in the wrong jaw. jaw: 1 upper, -1 lower.
    """
    close = np.flatnonzero(away <= away.min() + slack)
    height = jaw * (np.bincount(piece, vertices[:, 1]) / np.maximum(np.bincount(piece), 1))[piece[close]]
    right = close[height >= height.max() - slack]
    return int(right[away[right].argmin()])


def lip_sides(surface: Surface, parts: Sequence[Part], bound: Int32) -> Intp | None:
    """Return (V,) 1 and 2 on upper and lower edges of a slit mouth, joined as a seam; None without."""
    left, middle, right = surface.find(bound[[point_rows()[name] for name in ("2.4", "2.2", "2.5")]]).tolist()
    if min(left, middle, right) < 0:
        return None
    walk = np.concatenate([surface.path(left, middle), surface.path(middle, right)])
    walk = np.setdiff1d(walk, [left, right])
    skins = [part for part in parts if part.kind in SURFACE_KINDS]
    starts = np.cumsum([0, *(len(part.vertices) for part in skins)])
    heights, counts = np.zeros(starts[-1]), np.zeros(starts[-1])
    for part, start in zip(skins, starts, strict=False):
        middles = part.vertices[part.triangles, 1].astype(np.float64).mean(axis=1)
        own = part.triangles.astype(np.intp) + start
        heights += np.bincount(own.ravel(), np.repeat(middles, 3), len(heights))
        counts += np.bincount(own.ravel(), minlength=len(counts))
    above = heights / np.maximum(counts, 1) > surface.vertices[surface.number, 1]
    on_line = np.isin(surface.number, walk) & (counts > 0)
    joined = np.intersect1d(surface.number[on_line & above], surface.number[on_line & ~above])
    if len(joined) < len(walk) / 2 or not len(joined):
        return None
    return np.where(np.isin(surface.number, joined), np.where(above, 1, 2), 0).astype(np.intp)


def kinds_for_point(name: str) -> tuple[str, ...]:
    """Return the kinds of parts that a feature point can stand on."""
    if name in KINDS_OF_POINT:
        return KINDS_OF_POINT[name]
    return KINDS_OF_GROUP.get(int(name.split(".", maxsplit=1)[0]), SURFACE_KINDS)

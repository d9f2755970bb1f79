"""The lips: FAPs 4-13, 16, 17 (inner contour) and 51-60 (outer contour).

Eight handles, each a pair of an inner and an outer point, spread smoothly along the lips and into the skin
around them. The corners of a lip that opens are arcs, not the ends of a straight line. The inner FAP moves
what lies towards the inner contour, the outer FAP the rest; sent together, as they mostly are, they move the
lip as a whole.

Lips do not grow thin: their contours have FAPs of their own, and captures would find those moved. But between
these, lips that open or stretch grow flatter.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fba.arrays import Float64, Intp
from fba.face.authoring.regions._smile import RAISING, STRETCHING, add_smile
from fba.face.authoring.surface._fold_limits import Limiter
from fba.face.authoring.surface._motion import Motion, ease_field, including, unfold
from fba.face.authoring.surface._motion_limits import (
    coupled_motions,
    eased_linear_motion,
    stop_at_folds,
    values_to_reach,
)
from fba.face.authoring.surface._weights import reachable_region, solve_smooth_field, trim_small
from fba.face.authoring.surface.landmarks import LIP_CONTOURS, Landmarks
from fba.parameters import faps
from fba.sampling import smoothstep

HANDLES = {
    "left corner": ("2.4", "8.3"),
    "upper left": ("2.6", "8.5"),
    "upper middle": ("2.2", "8.1"),
    "upper right": ("2.7", "8.6"),
    "right corner": ("2.5", "8.4"),
    "lower left": ("2.8", "8.7"),
    "lower middle": ("2.3", "8.2"),
    "lower right": ("2.9", "8.8"),
}
"""The inner and the outer feature point of each handle."""
ENDS = {
    "2.6": ("2.4", "2.2"), "2.7": ("2.5", "2.2"), "2.8": ("2.4", "2.3"), "2.9": ("2.5", "2.3"),
    "8.5": ("8.3", "8.1"), "8.6": ("8.4", "8.1"), "8.7": ("8.3", "8.2"), "8.8": ("8.4", "8.2"),
}  # fmt: skip
"""The corner and the middle of a lip that a point lies between."""
UPPER = ("left corner", "upper left", "upper middle", "upper right", "right corner")
LOWER = ("left corner", "lower left", "lower middle", "lower right", "right corner")
ALONG = {
    6: {"left corner": 1.0, "upper left": 0.5, "lower left": 0.5},
    7: {"right corner": 1.0, "upper right": 0.5, "lower right": 0.5},
    16: {"lower middle": 1.0, "lower left": 0.8, "lower right": 0.8},
    17: {"upper middle": 1.0, "upper left": 0.8, "upper right": 0.8},
}
"""Shares of handles that FAPs move besides their own: a stretched lip keeps its points evenly spaced."""
PUSH = (16, 17)
OUTER_PUSH = 0.9
"""Share of a push of the inner contour with which the outer one, which has no such FAP, follows."""
ARCS = {
    8: "upper left", 9: "upper right", 10: "lower left", 11: "lower right",
    55: "upper left", 56: "upper right", 57: "lower left", 58: "lower right",
}  # fmt: skip
"""Handles beside the corners of the mouth, by the FAPs that make an arc between them."""
ARC = (1.7, 1.8)
"""How high the arc is on the inner and the outer contour, as shares of the motion of the handle."""
ARC_POWERS = (0.8, 2.4)
"""How round it begins at the corner, and how flat it ends at the handle: nearly a quarter of an ellipse."""
ARC_VALUES = (700.0, 600.0, 500.0, 400.0, 300.0, 200.0, 100.0)
"""Values up to which the arc grows: the first at which no skin folds."""
CORNER_ARCS = {"upper": (1.0, 0.7), "lower": (1.0, 0.6)}
"""Shares of it that a corner takes back, lowered or raised: the arc is in the lip's way from its corner."""
FLATTENS = dict.fromkeys((4, 5, 8, 9, 10, 11, 51, 52, 55, 56, 57, 58), -1.0) | dict.fromkeys(STRETCHING, 1.0)
"""FAPs that make the red of the lips flatter, and the sign of the values that do."""
FLATTER, FLAT_VALUE = 0.07, 400.0
"""By how much, as a share of the way of the handle, and the value up to which that grows."""
REACH = 0.75
"""Reach of the lips' motion into the face, in ES0."""
REACH_INSIDE = 0.5
"""Reach into the mouth, in ES0."""
LEAST_ARC = 0.03
"""What is less of an arc is left out."""
CARRIED = 0.02
"""Distance along the lips over which the arcs are evened out behind them, in ES0."""
UNMOVED_POINTS = ("9.1", "9.2", "9.3", "9.4", "9.5", "9.15", "2.1", "10.7", "10.8", "3.9", "3.10")
"""Feature points that the lips do not move."""
SLACK = 0.25
"""Distance in ES0 beyond which the skin does not overshoot."""
TANGENT = 1.0
"""Slope of the curve at its points: with 1, straight lines through the points stay straight; with 0, shares
never get negative."""


@dataclass(frozen=True, eq=False)
class _Lips:
    field: dict[str, Float64]
    """(N,) by handle: share of its motion at each vertex."""
    arc: dict[str, Float64]
    """(N,) by handle of `ARCS`: what the arc beside it adds to that share."""
    inward: Float64
    """(N,) 1 on the inner contour and behind it, 0 on the outer contour and beyond."""


def lip_motions(marks: Landmarks, limiter: Limiter) -> tuple[dict[int, Motion], dict[int, str]]:
    """Return (motions of the surface by FAP, reasons by FAP for those that this face cannot have)."""
    numbers = [fap.number for fap in faps() if fap.group in (2, 8) and fap.number not in (3, 14, 15, 18)]
    lost = {number: reason for number in numbers if (reason := _missing_reason(marks, number))}
    if len(lost) == len(numbers):
        return {}, lost
    lips = _fields(marks)
    surface, pinned = marks.surface, marks.on_contours(*LIP_CONTOURS)
    motions: dict[int, Motion] = {}
    for number in numbers:
        mate = faps()[number - 1].lip_mate
        if number in lost or number in motions:
            continue
        field = marks.step(number)[None] * _fap_field(lips, number)[:, None]
        if number in PUSH or mate is None or mate in lost:
            if number in PUSH:
                share = lips.inward + OUTER_PUSH * (1 - lips.inward)
            else:
                share = lips.inward if _is_inner(number) else 1 - lips.inward
            field = field * share[:, None]
            moving = np.flatnonzero(np.abs(field).max(axis=1) > 0)
            motions[number] = eased_linear_motion(surface, limiter, moving, field[moving], number, pinned)
        elif number < mate:
            field = ease_field(surface, limiter, field, values_to_reach(number), pinned)
            inward = lips.inward[:, None]
            inner, outer = field * inward, field * (1 - inward)
            pair = coupled_motions(limiter, (inner, inner), (outer, outer), number)
            motions[number], motions[mate] = pair
    for number in FLATTENS.keys() & motions.keys():
        motions[number] = _flatter(marks, limiter, lips, number, motions[number])
    for number in sorted((ARCS | RAISING).keys() & motions.keys()):
        _add_arcs(marks, limiter, lips, number, motions)
    return {fap: add_smile(marks, limiter, fap, motion) for fap, motion in motions.items()}, lost


def _missing_reason(marks: Landmarks, number: int) -> str:
    """Return why the lips cannot follow a FAP; empty where they can."""
    if reason := marks.missing_point(number):
        return reason
    point = faps()[number - 1].feature_points[0]
    inner = faps()[number - 1].group == 2
    side = "inner" if inner else "outer"
    if not marks.has(*(("2.4", "2.5") if inner else ("8.3", "8.4"))):
        return f"a corner of the {side} lip contour is not on the skin"
    for half in ("upper", "lower"):
        if not len(marks.contour(f"{half} {side} lip")):
            return f"there is no {half} {side} lip contour"
    own = next(pair for pair in HANDLES.values() if point in pair)
    if not inner and marks.vertex.get(own[0]) == marks.vertex[point]:
        return f"feature point {point} stands on the same vertex as {own[0]}, which the inner lip's FAP moves"
    if twin := _twin(marks, point):
        return f"feature point {point} stands on the same vertex as {twin}, which has a FAP of its own"
    if inner and marks.vertex.get("2.2") == marks.vertex.get("2.3") and marks.has("2.2"):
        return "the mouth has no opening: upper and lower lip are one"
    return ""


def _twin(marks: Landmarks, point: str) -> str:
    """Return the corner or middle of a lip that shares its vertex with a point between them, else ""."""
    ends = ENDS.get(point, ())
    return next(
        (end for end in ends if marks.has(end, point) and marks.vertex[end] == marks.vertex[point]), ""
    )


def _fap_field(lips: _Lips, number: int) -> Float64:
    """Return (N,) share of a FAP's motion at each vertex, of both contours."""
    along = ALONG.get(number) or ALONG.get(faps()[number - 1].lip_mate or 0)
    point = faps()[number - 1].feature_points[0]
    own = next(name for name, pair in HANDLES.items() if point in pair)
    total = np.zeros(len(lips.inward))
    for name, share in (along or {own: 1.0}).items():
        total += lips.field[name] * share
    return total


def _fields(marks: Landmarks) -> _Lips:
    """Return the motion of each handle spread along the contours and into the skin around them."""
    names = list(HANDLES)
    arcs = sorted(set(ARCS.values()))
    size = len(marks.surface)
    values = np.full((size, len(names) + len(arcs)), np.nan)
    for number, side in enumerate(("inner", "outer")):
        for half, handles in (("upper", UPPER), ("lower", LOWER)):
            walk = marks.contour(f"{half} {side} lip")
            if len(walk):
                points = [HANDLES[name][number] for name in handles]
                nodes = [None if _twin(marks, point) else marks.vertex.get(point) for point in points]
                places = _contour_places(marks.surface.vertices, walk, nodes)
                values[walk] = 0.0
                values[walk[:, None], [names.index(name) for name in handles]] = smooth_weights(
                    places, len(nodes)
                )
                for name in arcs if not any(_twin(marks, point) for point in points) else ():
                    if name in handles:
                        away = np.minimum(np.abs(places - (4 if "right" in name else 0)), 1.0)
                        values[walk, len(names) + arcs.index(name)] = _arc(away, ARC[number])
    for name, pair in HANDLES.items():
        for point in pair:
            if marks.has(point) and not _twin(marks, point) and not np.isnan(values[marks.vertex[point], 0]):
                # where one contour runs through a point of the other, the point decides
                values[marks.vertex[point]] = np.array(names + arcs) == name
                values[marks.vertex[point], len(names) :] = 0.0
    fixed = np.flatnonzero(~np.isnan(values[:, 0]))
    es = marks.fapu.ES * 1024
    near = marks.surface.distances(fixed, limit=2 * REACH * es)
    far = marks.surface.distances(marks.vertices_of(UNMOVED_POINTS), limit=4 * REACH * es)
    free = reachable_region(near, far, REACH * es)
    free &= ~marks.inside_mouth | (near < REACH_INSIDE * es)
    solved = solve_smooth_field(marks.surface, free, fixed, values[fixed], slack=SLACK * es)
    solved[:, len(names) :] = _carry_inside(marks, solved[:, len(names) :])
    shares, heights = solved.T[: len(names)], solved.T[len(names) :]
    return _Lips(
        {name: trim_small(share) for name, share in zip(names, shares, strict=True)},
        {name: trim_small(height, LEAST_ARC) for name, height in zip(arcs, heights, strict=True)},
        _inward(marks),
    )


def _arc(away: Float64, height: float) -> Float64:
    """Return (M,) what the arc adds at places from the corner, 0, to the handle, 1."""
    return np.asarray(height * away ** ARC_POWERS[0] * (1 - away) ** ARC_POWERS[1])


def _carry_inside(marks: Landmarks, arcs: Float64) -> Float64:
    """Return arcs (N, K) that go on behind the lips as they are there, as a plate would end them too soon."""
    surface, es = marks.surface, marks.fapu.ES * 1024
    inside = np.flatnonzero(marks.inside_mouth & ~marks.on_inner_lips)
    walks = [walk for half in ("upper", "lower") if len(walk := marks.contour(f"{half} inner lip"))]
    if not len(inside) or len(walks) < 2:
        return arcs
    depths = [surface.distances(walk, limit=2 * REACH_INSIDE * es)[inside] for walk in walks]
    depths = [np.minimum(depth, 2 * REACH_INSIDE * es) for depth in depths]
    arcs = arcs.copy()
    arcs[inside] = 0.0
    for walk, depth, other in zip(walks, depths, depths[::-1], strict=True):
        away = np.linalg.norm(surface.vertices[inside][:, None] - surface.vertices[walk], axis=2)
        near = np.exp(-(((away - away.min(axis=1, keepdims=True)) / (CARRIED * es)) ** 2))
        own = smoothstep(0.5 + (other - depth) / (4 * CARRIED * es))
        own *= 1 - smoothstep(depth / (REACH_INSIDE / 2 * es))
        arcs[inside] += own[:, None] * (near @ arcs[walk]) / near.sum(axis=1, keepdims=True)
    return arcs


def _inward(marks: Landmarks) -> Float64:
    """Return (N,) 1 on the inner contour and behind it, 0 on the outer contour and beyond, smooth between."""
    inner = marks.on_inner_lips | marks.inside_mouth
    outer = marks.on_contours("upper outer lip", "lower outer lip") & ~marks.on_inner_lips
    for inner_point, outer_point in HANDLES.values():
        if marks.has(outer_point) and marks.vertex[outer_point] != marks.vertex.get(inner_point):
            inner[marks.vertex[outer_point]] = False
            outer[marks.vertex[outer_point]] = True
    if not outer.any():
        return np.ones(len(marks.surface))
    if not inner.any():
        return np.zeros(len(marks.surface))
    fixed = np.flatnonzero(inner | outer)
    field = solve_smooth_field(
        marks.surface, marks.lips, fixed, inner[fixed][:, None].astype(np.float64), slack=1.0, harmonic=True
    )
    return smoothstep(field[:, 0])


def _contour_places(vertices: Float64, walk: Intp, nodes: Sequence[int | None]) -> Float64:
    """Return (M,) places of the vertices of a walk among the K nodes along it: the number of each, 0..K-1, at
    it, and smooth between.

    vertices: (N, 3). walk: (M,) vertices from the first to the last node. nodes: the vertex of each
    node, None for nodes that the face does not have: they lie evenly between the others.
    """
    from scipy.interpolate import PchipInterpolator

    steps = np.linalg.norm(np.diff(vertices[walk], axis=0), axis=1)
    length = np.concatenate([[0.0], np.cumsum(np.maximum(steps, 1e-12))])
    step = {int(vertex): k for k, vertex in enumerate(walk)}
    known: list[tuple[float, float]] = []
    end = step[nodes[-1]] if nodes[-1] is not None else len(walk)
    for k, node in enumerate(nodes):
        # of points that share a vertex, or stand in the wrong order, those nearer to the first node count
        last = k == len(nodes) - 1
        if (
            node is not None
            and (not known or length[step[node]] > known[-1][0])
            and (last or step[node] < end)
        ):
            known.append((float(length[step[node]]), float(k)))
    if len(known) == len(walk):
        number = np.array([k for _, k in known])
    else:
        number = PchipInterpolator(*zip(*known, strict=True))(length)
    return np.asarray(np.clip(number, 0, len(nodes) - 1))


def smooth_weights(x: Float64, count: int) -> Float64:
    """Return (M, count) weights of values at 0, 1, ... in the smooth curve through them, at x; sums are 1."""
    k = np.clip(np.floor(x).astype(np.intp), 0, count - 2)
    t = x - k
    start, end = 2 * t**3 - 3 * t**2 + 1, -2 * t**3 + 3 * t**2
    leave, arrive = (t**3 - 2 * t**2 + t) * TANGENT, (t**3 - t**2) * TANGENT
    row = np.arange(len(x))
    weights = np.zeros((len(x), count))
    for tangent, node in ((leave, k), (arrive, k + 1)):
        before, after = np.maximum(node - 1, 0), np.minimum(node + 1, count - 1)
        width = (after - before).astype(np.float64)
        np.add.at(weights, (row, after), tangent / width)
        np.add.at(weights, (row, before), -tangent / width)
    np.add.at(weights, (row, k), start)
    np.add.at(weights, (row, k + 1), end)
    return weights


def _flatter(marks: Landmarks, limiter: Limiter, lips: _Lips, fap: int, motion: Motion) -> Motion:
    """Return the motion with lips that grow flatter."""
    between = 4 * lips.inward * (1 - lips.inward) * np.clip(_fap_field(lips, fap), 0.0, 1.0)
    size = float(np.linalg.norm(marks.step(fap))) * FLATTENS[fap] * FLATTER / 2
    flatter = trim_small(between)[:, None] * -size * marks.surface.normals
    low, high = sorted((0.0, FLATTENS[fap] * FLAT_VALUE))
    shaped = _adding(motion, flatter, (low, high))
    pinned = marks.on_contours(*LIP_CONTOURS)
    return stop_at_folds(limiter, unfold(marks.surface, limiter, shaped, pinned, False))


def _add_arcs(marks: Landmarks, limiter: Limiter, lips: _Lips, fap: int, motions: dict[int, Motion]) -> None:
    """Add the arcs beside a corner of the mouth to the motion of a FAP, in place.

    Where those of an inner FAP would fold its skin, which the outer contour leaves no more room, they go on
    with its mate.
    """
    pinned = marks.on_contours(*LIP_CONTOURS)
    for sign, field in zip((-1.0, 1.0), _arc_fields(marks, lips, fap), strict=True):
        done = 0.0
        for number in (fap, faps()[fap - 1].lip_mate or fap) if _is_inner(fap) else (fap,):
            for most in ARC_VALUES if number in motions else ():
                if most <= done:
                    break
                low, high = sorted((sign * done, sign * most))
                shaped = _adding(motions[number], field, (low, high))
                shaped = unfold(marks.surface, limiter, shaped, pinned, False)
                if _is_sound(limiter, shaped):
                    motions[number], done = shaped, most
                    break


def _is_inner(fap: int) -> bool:
    """Return whether a FAP of the lips moves their inner contour."""
    return faps()[fap - 1].group == 2


def _is_sound(limiter: Limiter, motion: Motion) -> bool:
    patch = limiter.patch(motion.vertices)
    return all(patch.is_sound(limiter.spread(motion.vertices, shifts)) for shifts in motion.shifts)


def _arc_fields(marks: Landmarks, lips: _Lips, fap: int) -> tuple[Float64, Float64]:
    """Return (N, 3) what arcs add for each unit of value below 0, and above.

    A corner moves away from under the arcs beside it, which stay with their lips.
    """
    shares = {ARCS[fap]: (1.0, 1.0)} if fap in ARCS else {}
    if fap in RAISING:
        side = "left" if RAISING[fap] > 0 else "right"
        shares = {f"{lip} {side}": (-low, -high) for lip, (low, high) in CORNER_ARCS.items()}
    field = np.zeros((2, len(lips.inward)))
    own = lips.inward if _is_inner(fap) else 1 - lips.inward
    for name, share in shares.items():
        field += np.array(share)[:, None] * lips.arc[name] * own
    low, high = field[:, :, None] * marks.step(fap)
    return low, high


def _adding(motion: Motion, field: Float64, ends: tuple[float, float]) -> Motion:
    """Return the motion with value x field (N, 3) of the surface added, for values between two ends."""
    motion = including(motion, np.flatnonzero(field.any(axis=1)))
    values = np.union1d(motion.values, np.clip(ends, motion.values[0], motion.values[-1]))
    ways = (np.clip(values, *ends) - np.clip(0.0, *ends))[:, None, None]
    shifts = np.stack([motion.shifts_at(value) for value in values]) + ways * field[motion.vertices]
    return Motion(values, motion.vertices, shifts)

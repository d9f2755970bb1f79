"""Eyelids: FAPs 19-22. Every vertex of a lid stays in its own upright plane and turns about the eyeball.

A lid closes column by column, each in proportion to its own opening, so that upper and lower margin meet
along their whole length however the way is split between them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fba.face.authoring.carry import roots
from fba.face.authoring.extremes import Limiter
from fba.face.authoring.eyes import Eye
from fba.face.authoring.landmarks import Landmarks
from fba.face.authoring.motion import Motion, limits
from fba.face.authoring.relax import relaxed
from fba.face.authoring.saturation import guarded
from fba.face.authoring.weights import smooth_step, smoothed, without_hem
from fba.face.model import Part

Float64 = npt.NDArray[np.float64]
Int = npt.NDArray[np.intp]

LIDS = {19: ("left", "upper"), 20: ("right", "upper"), 21: ("left", "lower"), 22: ("right", "lower")}
CLOSED = 1024
STEP = 128
"""Values between two borders of the tables: an eighth of the way."""
REACH = 0.6
"""How far a lid pulls at the skin around it at most, in ES0."""
CREASE = 0.11
"""Distance from the margin to the crease in ES0, where its feature point is unknown."""
FOLD = {
    ("left", "upper"): "3.13",
    ("right", "upper"): "3.14",
    ("left", "lower"): "3.9",
    ("right", "lower"): "3.10",
}
"""The feature points on the creases."""
AT_CREASE = 0.25
"""The crease goes this share of the margin's way."""
ENDS = 3.5
"""What is this many times as far away as the crease rests."""
EDGE = 0.4
"""The lid's edge, up to this share of the distance to the crease, goes as one."""
FURTHER = 0.2
"""The front edge of a lid may go this much further than the margin."""
OWN_SIDE = 0.6
"""What is closer to the other lid than this share of the way goes less and less with this one."""
NARROW = 0.4
"""At the corners of the eye distances shrink to this."""
SMOOTHINGS = 4
STILL = {
    "left": ("4.1", "4.3", "4.5", "9.7", "9.13", "5.3", "9.12"),
    "right": ("4.2", "4.4", "4.6", "9.6", "9.14", "5.4", "9.12"),
}
HEM = 0.006
CLEARANCE = 0.012
"""Between a lid that has moved and the eyeball, as a share of the eyeball's radius."""
FREED = 0.3
"""Share of the way after which a lid has its full clearance."""
BULGE = np.radians(12.0)
"""The cornea bulges by this much beyond where it is now: the eye may look elsewhere."""
STRICT = np.radians(4.0)
OUTSIDE = 0.97
"""What is this far out, in radii of the eyeball, lies before it."""
COLUMNS = 65


@dataclass(frozen=True, eq=False)
class Opening:
    """The opening of one eye by columns. x: (C,) rising. upper, lower: (C, 2) height and depth of the
    margins there, from the eyeball's centre, metres.
    """

    x: Float64
    upper: Float64
    lower: Float64


def lid_motion(marks: Landmarks, limiter: Limiter, eye: Eye, fap: int, parts: Sequence[Part]) -> Motion | str:
    """The motion of the surface, or why there is none."""
    side, lid = LIDS[fap]
    own, other = marks.contour(f"{side} {lid} lid"), marks.contour(f"{side} {_other(lid)} lid")
    if not len(own) or not len(other):
        return f"the margin of the {side} {lid if not len(own) else _other(lid)} lid is not on the skin"
    opening = measure(marks, eye)
    if opening is None:
        return f"the lids of the {side} eye are not one above the other"
    share = _share(marks, opening, eye, lid, own, other)
    vertices = np.flatnonzero(share > 0)
    points = marks.surface.vertices[vertices]
    values = lid_values(fap)
    shifts = slid(points, share[vertices], opening, eye, lid, values / CLOSED)
    profile = Profile(eye, parts)
    shifts = _freed(profile, points, shifts, values)
    pinned = np.zeros(len(marks.surface), dtype=bool)
    pinned[own] = pinned[other] = True
    motion = relaxed(marks.surface, limiter, Motion(values, vertices, shifts), pinned, True)
    points = marks.surface.vertices[motion.vertices]
    motion = Motion(values, motion.vertices, _freed(profile, points, motion.shifts, values))
    return guarded(limiter, motion, turning=True)


def lid_values(fap: int) -> Float64:
    """Borders: the range of the FAP, and in any case all of the way to the other lid."""
    low, high = limits(fap)
    high = max(high, float(CLOSED))
    between = np.arange(np.ceil(low / STEP) * STEP, high + 1, STEP)
    return np.unique(np.concatenate([[low, 0.0, high], between[(between > low) & (between < high)]]))


def measure(marks: Landmarks, eye: Eye) -> Opening | None:
    """The columns of an eye's opening, or None where its lids are not one above the other."""
    lines = []
    for lid in ("upper", "lower"):
        walk = marks.surface.vertices[marks.contour(f"{eye.side} {lid} lid")]
        lines.append(walk[np.argsort(walk[:, 0], kind="stable")])
    left = max(line[0, 0] for line in lines)
    right = min(line[-1, 0] for line in lines)
    if not right > left:
        return None
    x = np.linspace(left, right, COLUMNS)
    x = np.unique(
        np.concatenate([x, *(line[(line[:, 0] > left) & (line[:, 0] < right), 0] for line in lines)])
    )
    margins = [
        np.stack([np.interp(x, line[:, 0], line[:, axis] - eye.centre[axis]) for axis in (1, 2)], axis=1)
        for line in lines
    ]
    if not (margins[0][1:-1, 0] > margins[1][1:-1, 0]).mean() > 0.7:
        return None
    return Opening(x, *margins)


def slid(
    points: Float64,
    share: Float64,
    opening: Opening,
    eye: Eye,
    lid: str,
    way: Float64,
    *,
    columns: Float64 | None = None,
) -> Float64:
    """(K, N, 3): shifts of points (N, 3) when a lid has gone some shares (K,) of the way to the other.

    share: (N,), how much each goes with the margin of its column. columns: (N,), x of the columns, where
    they are not the points' own, as of a lash that goes with its root.
    """
    own, other = (opening.upper, opening.lower) if lid == "upper" else (opening.lower, opening.upper)
    column = np.clip(points[:, 0] if columns is None else columns, opening.x[0], opening.x[-1])
    here, there = (
        np.stack([np.interp(column, opening.x, line[:, axis]) for axis in (0, 1)], axis=1)
        for line in (own, other)
    )
    radius, across = np.hypot(*here.T), np.hypot(*there.T)
    height = points[:, 1] - eye.centre[1]
    depth = points[:, 2] - eye.centre[2]
    distance = np.hypot(height, depth)
    # what is further out than the margin turns less: it moves no further than the margin does
    part = share if columns is not None else share * np.minimum(1.0, radius / np.maximum(distance, 1e-12))
    start = np.arcsin(np.clip(here[:, 0] / np.maximum(radius, 1e-12), -1, 1))
    shifts = np.zeros((len(way), len(points), 3))
    for k, t in enumerate(way):
        goal = here[:, 0] + t * (there[:, 0] - here[:, 0])
        size = radius + np.clip(t, 0, 1) * (across - radius)
        size = np.maximum(size, np.abs(goal) * 1.0001)
        turn = (np.arcsin(goal / np.maximum(size, 1e-12)) - start) * part
        grown = 1 + share * (size / np.maximum(radius, 1e-12) - 1)
        cos, sin = np.cos(turn), np.sin(turn)
        shifts[k, :, 1] = (height * cos + depth * sin) * grown - height
        shifts[k, :, 2] = (depth * cos - height * sin) * grown - depth
    shifts[way == 0] = 0.0
    return shifts


class Profile:
    """How far the front of an eyeball reaches out in every direction, the cornea included."""

    def __init__(self, eye: Eye, parts: Sequence[Part]) -> None:
        self._eye = eye
        self._angles = np.linspace(0, np.pi, 73)
        self._here = np.full(73, 0.0)
        self._around = np.full(73, eye.radius)
        for part in parts:
            if part.name not in eye.parts:
                continue
            arms = part.vertices.astype(np.float64) - eye.centre
            reach = np.linalg.norm(arms, axis=1)
            angle = np.arccos(np.clip(arms @ eye.gaze / np.maximum(reach, 1e-12), -1, 1))
            for k, at in enumerate(self._angles):
                for radii, spread_ in ((self._here, STRICT), (self._around, BULGE)):
                    near = np.abs(angle - at) < spread_
                    if near.any():
                        radii[k] = max(radii[k], float(reach[near].max()))
        self._here[self._here == 0.0] = eye.radius

    def radius(self, points: Float64, *, around: bool) -> Float64:
        """(N,) how far the eyeball reaches in the directions of points (N, 3), or in those around them."""
        arms = points - self._eye.centre
        reach = np.linalg.norm(arms, axis=1)
        angle = np.arccos(np.clip(arms @ self._eye.gaze / np.maximum(reach, 1e-12), -1, 1))
        result: Float64 = np.interp(angle, self._angles, self._around if around else self._here)
        return result

    def lift(self, points: Float64, shifts: Float64) -> Float64:
        """(N, 3): what must be added, forwards, so that what was outside the eyeball stays outside."""
        at = points + shifts
        needed = self.radius(at, around=True) + CLEARANCE * self._eye.radius
        arms = at - self._eye.centre
        level = (arms[:, :2] ** 2).sum(axis=1)
        outside = np.linalg.norm(points - self._eye.centre, axis=1) >= OUTSIDE * self.radius(
            points, around=False
        )
        before = np.sqrt(np.maximum(needed**2 - level, 0.0))
        moved = np.linalg.norm(shifts, axis=1) > 1e-9
        push = np.where(outside & moved & (arms[:, 2] > 0), np.maximum(before - arms[:, 2], 0.0), 0.0)
        result = np.zeros_like(at)
        result[:, 2] = push
        return result


def _other(lid: str) -> str:
    return "lower" if lid == "upper" else "upper"


def _share(marks: Landmarks, opening: Opening, eye: Eye, lid: str, own: Int, other: Int) -> Float64:
    """(N,) how much each vertex goes with the margin of its column.

    All of it on the lid's edge, a quarter at the crease, nothing well before the brow; towards the corners,
    where the crease comes closer, within a shorter distance.
    """
    surface, es, side = marks.surface, marks.fapu.ES * 1024, eye.side
    stays = np.setdiff1d(other, own)
    still = [marks.vertex[name] for name in STILL[side] if marks.has(name)]
    away = surface.distances(own, 2 * REACH * es)
    crease = CREASE * es
    if marks.has(FOLD[side, lid]):
        crease = float(np.clip(away[marks.vertex[FOLD[side, lid]]], 0.5 * crease, 1.5 * crease))
    gap = np.maximum(opening.upper[:, 0] - opening.lower[:, 0], 0.0)
    high = np.interp(surface.vertices[:, 0], opening.x, gap / gap.max())
    end = min(ENDS, 0.85 * float(away[still].min(initial=np.inf)) / crease)
    folds = away / (crease * (NARROW + (1 - NARROW) * high))
    power = np.log(AT_CREASE) / np.log(1 - (1 - EDGE) / (end - EDGE)) if end > 1 + EDGE else 2.0
    share = np.clip((end - np.maximum(folds, EDGE)) / (end - EDGE), 0.0, 1.0) ** power
    share *= 1 + _overhang(surface.vertices, opening, eye, lid, gap.max()) * np.clip(
        2 - folds / EDGE, 0.0, 1.0
    )
    opposite = surface.distances(stays, 4 * REACH * es)
    with np.errstate(invalid="ignore"):
        share *= smooth_step(np.nan_to_num(opposite / (away + opposite), nan=1.0) / OWN_SIDE)
    # walking along edges makes the distances uneven
    pinned = np.zeros(len(surface), dtype=bool)
    pinned[own] = pinned[stays] = True
    share[own] = 1.0
    share[stays] = 0.0
    share = np.where(pinned, share, smoothed(surface, share, SMOOTHINGS))
    return without_hem(share, HEM)


def _freed(profile: Profile, points: Float64, shifts: Float64, values: Float64) -> Float64:
    """Shifts (K, N, 3) with what would cut the eyeball brought before it, the more the further on its way."""
    result = shifts.copy()
    for k, share in enumerate(smooth_step(np.abs(values) / CLOSED / FREED)):
        result[k] += profile.lift(points, shifts[k]) * share
    return result


def _overhang(points: Float64, opening: Opening, eye: Eye, lid: str, widest: float) -> Float64:
    """(N,) how much further than the margin the front edge of a lid must go to meet that of the other.

    The margin lies on the eyeball; the front edge before it is further away from the other lid.
    """
    margin, sign = (opening.upper, 1.0) if lid == "upper" else (opening.lower, -1.0)
    height, depth = (np.interp(points[:, 0], opening.x, margin[:, axis]) for axis in (0, 1))
    gap = np.interp(points[:, 0], opening.x, opening.upper[:, 0] - opening.lower[:, 0])
    before = points[:, 2] - eye.centre[2] > depth
    back = np.maximum(sign * (points[:, 1] - eye.centre[1] - height), 0.0)
    further = np.clip(2 * back / np.maximum(gap, 0.2 * widest), 0.0, FURTHER)
    return np.where(before, further, 0.0)


def lash_motion(marks: Landmarks, eye: Eye, fap: int, part: Part, lid: Motion) -> Motion:
    """Lashes turn with the margin that they grow on, each vertex as its root does."""
    from fba.face.authoring.surface import Surface

    side, name = LIDS[fap]
    opening = measure(marks, eye)
    assert opening is not None  # the lid moves, so there is one
    shape = Surface([part])
    reach = [
        _distance(shape.vertices, marks.surface.vertices[marks.contour(f"{side} {which} lid")])
        for which in ("upper", "lower")
    ]
    pieces = shape.component
    closest = [np.full(pieces.max() + 1, np.inf) for _ in reach]
    for best, away in zip(closest, reach, strict=True):
        np.minimum.at(best, pieces, away)
    wide = opening.x[-1] - opening.x[0]
    mean = np.bincount(pieces, shape.vertices[:, 1]) / np.bincount(pieces)
    middle = float((opening.upper[:, 0] + opening.lower[:, 0]).mean()) / 2 + eye.centre[1]
    upper = np.where(np.abs(closest[0] - closest[1]) < 0.1 * wide, mean > middle, closest[0] < closest[1])
    grows = (upper == (name == "upper")) & (np.minimum(*closest) < 0.25 * wide)
    root = roots(shape, reach[0 if name == "upper" else 1])
    moving = np.flatnonzero(grows[pieces][shape.number])
    points = part.vertices[moving].astype(np.float64)
    columns = shape.vertices[root[shape.number[moving]], 0]
    ways = np.clip(lid.values, *_sound_range(lid)) / CLOSED
    turns = slid(points, np.ones(len(points)), opening, eye, name, ways, columns=columns)
    return Motion(lid.values, moving, turns)


def _sound_range(lid: Motion) -> tuple[float, float]:
    """Where a lid comes to rest on both sides."""
    moved = np.abs(np.diff(lid.shifts, axis=0)).max(axis=(1, 2)) > 0
    used = np.flatnonzero(moved)
    return (float(lid.values[used[0]]), float(lid.values[used[-1] + 1])) if len(used) else (0.0, 0.0)


def _distance(points: Float64, line: Float64) -> Float64:
    from scipy.spatial import cKDTree

    return np.asarray(cKDTree(line).query(points)[0], dtype=np.float64)

"""Brows, cheeks, chin, nose and ears: FAPs whose feature points pull at the skin around them.

`regions.csv` lists the points and bounds of each region but the ears, `handles.csv` the points that each FAP
moves; the right side mirrors the left. A raised ear turns about its soft root; a pulled one moves most at its
rim.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from itertools import pairwise

import numpy as np

from fba.arrays import Bool, Float64, Intp
from fba.face.authoring.regions._lips import smooth_weights
from fba.face.authoring.surface._fold_limits import Limiter
from fba.face.authoring.surface._motion import Motion
from fba.face.authoring.surface._motion_limits import eased_linear_motion
from fba.face.authoring.surface._weights import (
    average_with_neighbours,
    carry_through,
    reachable_region,
    solve_smooth_field,
    trim_small,
)
from fba.face.authoring.surface.landmarks import Landmarks
from fba.face.feature_points import MATES
from fba.face.points import DIRECTIONS
from fba.parameters import faps
from fba.sampling import smoothstep
from fba.text_files import packaged_rows

SMOOTHING_ROUNDS = 5
"""Rounds of averaging the motion of surfaces behind the skin."""
EARS = {
    "left": {"top": "10.1", "back": "10.3", "lobe": "10.5", "below": "10.7", "above": "10.9"},
    "right": {"top": "10.2", "back": "10.4", "lobe": "10.6", "below": "10.8", "above": "10.10"},
}
"""Feature points of the ears; "below" and "above" are where they meet the face."""
RAISED_EARS = {65: "left", 66: "right"}
PULLED_EARS = {67: "left", 68: "right"}
RIGID_WIDTH = 0.55
"""Share of the ear's width from its rim up to which it moves as a whole."""
ROOT_WIDTH = 1.15
"""Share of the ear's width from its rim beyond which it does not move."""
FADE_RADII = (1.1, 1.7)
"""Multiples of the ear's size between which the motion of the head around it fades out."""
DEPTH_FACTOR = 1.2
"""The ear is taken to be deeper, front to back, than its points say by this factor."""
LEAST_PULL = 0.1
"""Share of a pull that the root of the ear makes."""
EAR_SMOOTHING_ROUNDS = 6
"""Rounds of averaging shares with those of neighbours."""


@dataclass(frozen=True)
class Region:
    """Points that pull at the same skin.

    points: that pull. still, contours: points and contours that stay. reach: of the motion, in ES0. share: of
    the distance to fixed vertices that moves. slack: distance in ES0 beyond which the skin does not
    overshoot. band: distance in ES0 from the line through the points of each side, within which skin moves as
    that line does, or 0. through: depth in ES0 to which surfaces behind the skin move with it, or 0. behind:
    these surfaces, the inside of the "mouth" or "all".
    """

    name: str
    points: tuple[str, ...]
    still: tuple[str, ...]
    contours: tuple[str, ...]
    reach: float
    share: float
    slack: float
    band: float
    through: float
    behind: str


@dataclass(frozen=True)
class Handle:
    """Displacements of a region's points by one FAP. bulge: size of the outward swelling of skin beside."""

    fap: int
    region: str
    values: dict[str, float]
    bulge: float


@cache
def regions() -> dict[str, Region]:
    """Return the regions by name."""
    return {
        row["region"]: Region(
            row["region"],
            tuple(row["points"].split()),
            tuple(row["still"].split()),
            tuple(c for c in row["contours"].split("|") if c),
            float(row["reach"]),
            float(row["share"]),
            float(row["slack"]),
            float(row["band"]),
            float(row["through"]),
            row["behind"],
        )
        for row in packaged_rows(__package__, "regions.csv")
    }


@cache
def handles() -> tuple[Handle, ...]:
    """Return the handles of all FAPs, right mates included."""
    result = []
    for row in packaged_rows(__package__, "handles.csv"):
        pairs = (pair.split("=") for pair in row["values"].split())
        left = {name: float(value) for name, value in pairs}
        result.append(Handle(int(row["fap"]), row["region"], left, float(row["bulge"])))
        mate = faps()[int(row["fap"]) - 1].left_right_mate
        if mate is not None:
            right = {MATES.get(name, name): value for name, value in left.items()}
            result.append(Handle(mate, row["region"], right, float(row["bulge"])))
    return tuple(result)


def brow_cheek_nose_motions(marks: Landmarks, limiter: Limiter) -> tuple[dict[int, Motion], dict[int, str]]:
    """Return (motions of the surface by FAP, reasons by FAP for those that this face cannot have)."""
    lost = {handle.fap: reason for handle in handles() if (reason := marks.missing_point(handle.fap))}
    motions: dict[int, Motion] = {}
    for area in regions().values():
        own = [handle for handle in handles() if handle.region == area.name and handle.fap not in lost]
        if own:
            fields, pinned = _fields(marks, area, own)
            for k, handle in enumerate(own):
                motions[handle.fap] = _motion(marks, limiter, handle, fields[:, k], pinned)
    return motions, lost


def _fields(marks: Landmarks, area: Region, own: list[Handle]) -> tuple[Float64, Bool]:
    """Return (N, H) shares of each handle's motion, and an (N,) mask of vertices whose share is given."""
    surface, es = marks.surface, marks.fapu.ES * 1024
    points = [name for name in area.points if marks.has(name)]
    pulled = marks.vertices_of(points)
    still = np.concatenate([marks.vertices_of(area.still), *(marks.contour(name) for name in area.contours)])
    stays = np.setdiff1d(still, pulled)
    reach = area.reach * es
    near = surface.distances(pulled, reach)
    far = surface.distances(stays, 4 * reach)
    free = reachable_region(near, far, reach, area.share) & ~marks.inside_mouth
    pulled, first = np.unique(pulled, return_index=True)
    given = np.array([[handle.values.get(points[k], 0.0) for handle in own] for k in first])
    fixed = np.concatenate([pulled, stays])
    values = np.concatenate([given, np.zeros((len(stays), len(own)))])
    band, along = _band(marks, area, own, np.flatnonzero(free & ~surface.mask(fixed)))
    held, at_held = np.concatenate([fixed, band]), np.concatenate([values, along])
    solved = solve_smooth_field(surface, free, held, at_held, slack=area.slack * es)
    if area.through:
        behind = surface.distances(pulled, 1.6 * reach) < np.inf
        behind &= marks.inside_mouth if area.behind == "mouth" else ~marks.lips & ~marks.on_inner_lips
        behind[stays] = False
        targets = np.setdiff1d(np.flatnonzero(behind), pulled)  # points stay where they are given
        for k in range(len(own)):
            lifted = carry_through(surface, solved[:, k], targets, area.through * es)
            for _ in range(SMOOTHING_ROUNDS):
                lifted[targets] = average_with_neighbours(surface, lifted, 1)[targets]
            solved[:, k] = lifted
    return trim_small(solved), surface.mask(fixed)


def _band(marks: Landmarks, area: Region, own: list[Handle], free: Intp) -> tuple[Intp, Float64]:
    """Return those of the free vertices that are near the line of points of their side, and shares (M, H).

    Across the line the skin moves alike: a brow keeps its width.
    """
    chosen, shares = [np.zeros(0, dtype=np.intp)], [np.zeros((0, len(own)))]
    for line in (area.points[::2], area.points[1::2]):
        if not area.band or not marks.has(*line):
            continue
        nodes = marks.surface.vertices[marks.vertices_of(line)]
        order = np.argsort(nodes[:, 0])
        places = marks.surface.vertices[free]
        number = np.interp(places[:, 0], nodes[order, 0], np.arange(len(line)))
        weights = smooth_weights(number, len(line))
        near = np.linalg.norm(places - weights @ nodes[order], axis=1) < area.band * marks.fapu.ES * 1024
        given = np.array([[handle.values.get(line[k], 0.0) for handle in own] for k in order])
        chosen.append(free[near])
        shares.append(weights[near] @ given)
    return np.concatenate(chosen), np.concatenate(shares)


def _motion(marks: Landmarks, limiter: Limiter, handle: Handle, field: Float64, pinned: Bool) -> Motion:
    entry = faps()[handle.fap - 1]
    vertices = np.flatnonzero(field)
    weight = field[vertices][:, None]
    direction = np.array(DIRECTIONS[entry.positive])
    swell = handle.bulge * np.clip(weight * (1 - weight), 0, None) * marks.surface.normals[vertices]
    field = (weight * direction + swell) * marks.fapu[entry.unit]
    return eased_linear_motion(marks.surface, limiter, vertices, field, handle.fap, pinned)


def ear_motions(marks: Landmarks, limiter: Limiter) -> tuple[dict[int, Motion], dict[int, str]]:
    """Return (motions of the surface by FAP, reasons by FAP for those that this face cannot have)."""
    motions: dict[int, Motion] = {}
    lost: dict[int, str] = {}
    for fap, side in (RAISED_EARS | PULLED_EARS).items():
        if reason := marks.missing_point(fap):
            lost[fap] = reason
            continue
        share = _ear_share(marks, side, pull=fap in PULLED_EARS)
        vertices = np.flatnonzero(share)
        pinned = marks.surface.mask(marks.vertices_of(faps()[fap - 1].feature_points))
        field = share[vertices][:, None] * marks.step(fap)
        motions[fap] = eased_linear_motion(marks.surface, limiter, vertices, field, fap, pinned)
    return motions, lost


def _ear_share(marks: Landmarks, side: str, *, pull: bool) -> Float64:
    """Return (N,) share of the ear's motion at each vertex."""
    names = EARS[side]
    surface = marks.surface
    top, back, lobe, below, above = (marks.point_or_average(name) for name in names.values())
    root = (below + above) / 2
    width = float(np.linalg.norm(back - root))
    rim = _rim(marks, names)
    away = surface.distances(rim, 1.5 * width) / width
    share = 1 - smoothstep((np.nan_to_num(away, posinf=9.0) - RIGID_WIDTH) / (ROOT_WIDTH - RIGID_WIDTH))
    share = average_with_neighbours(surface, share, EAR_SMOOTHING_ROUNDS)
    centre = ((top + lobe) / 2 + (back + root) / 2) / 2
    half = np.array([np.inf, np.linalg.norm(top - lobe) / 2, abs(back[2] - root[2]) / 2 * DEPTH_FACTOR])
    beside = np.linalg.norm((surface.vertices - centre) / half, axis=1)
    share *= 1 - smoothstep((beside - FADE_RADII[0]) / (FADE_RADII[1] - FADE_RADII[0]))
    if pull:
        out = root - back
        far = 1 - ((surface.vertices - back) @ out) / (out @ out)
        share = share * (LEAST_PULL + (1 - LEAST_PULL) * np.clip(far, 0.0, 1.2))
    own = marks.vertex[names["back" if pull else "top"]]
    return trim_small(share / max(share[own], 1e-9))


def _rim(marks: Landmarks, names: dict[str, str]) -> Intp:
    """Return the vertices around the ear, from its upper end at the face over the back to the lobe."""
    known = marks.vertices_of(names[key] for key in ("top", "back", "lobe"))
    return np.unique(np.concatenate([known, *(marks.surface.path(a, b) for a, b in pairwise(known))]))

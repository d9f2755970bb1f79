"""Brows, cheeks, chin and nose: FAPs whose feature points pull at the skin around them.

`regions.csv` lists the points and bounds of each region, `handles.csv` the points that each FAP moves;
the right side mirrors the left.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import numpy as np

from fba.arrays import Bool, Float64
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
from fba.face.feature_points import MIRRORED
from fba.face.points import DIRECTIONS
from fba.parameters import faps

SMOOTHING_ROUNDS = 5
"""Rounds of averaging the motion of surfaces behind the skin."""


@dataclass(frozen=True)
class Region:
    """Points that pull at the same skin.

    points: that pull. still, contours: points and contours that stay. reach: of the motion, in ES0. share: of
    the distance to fixed vertices that moves. slack: distance in ES0 beyond which the skin does not
    overshoot. through: depth in ES0 to which surfaces behind the skin move with it, or 0. behind: these
    surfaces, the inside of the "mouth" or "all".
    """

    name: str
    points: tuple[str, ...]
    still: tuple[str, ...]
    contours: tuple[str, ...]
    reach: float
    share: float
    slack: float
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
            float(row["through"]),
            row["behind"],
        )
        for row in _rows("regions.csv")
    }


@cache
def handles() -> tuple[Handle, ...]:
    """Return the handles of all FAPs, right mates included."""
    result = []
    mirror = {**MIRRORED, **{right: left for left, right in MIRRORED.items()}}
    for row in _rows("handles.csv"):
        pairs = (pair.split("=") for pair in row["values"].split())
        left = {name: float(value) for name, value in pairs}
        result.append(Handle(int(row["fap"]), row["region"], left, float(row["bulge"])))
        mate = faps()[int(row["fap"]) - 1].left_right_mate
        if mate is not None:
            right = {mirror.get(name, name): value for name, value in left.items()}
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
    """Return ((N, H) share of each handle's motion at each vertex, (N,) mask of vertices whose share is
    given)."""
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
    solved = solve_smooth_field(surface, free, fixed, values, slack=area.slack * es)
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


def _motion(marks: Landmarks, limiter: Limiter, handle: Handle, field: Float64, pinned: Bool) -> Motion:
    entry = faps()[handle.fap - 1]
    vertices = np.flatnonzero(field)
    weight = field[vertices][:, None]
    direction = np.array(DIRECTIONS[entry.positive])
    swell = handle.bulge * np.clip(weight * (1 - weight), 0, None) * marks.surface.normals[vertices]
    field = (weight * direction + swell) * marks.fapu[entry.unit]
    return eased_linear_motion(marks.surface, limiter, vertices, field, handle.fap, pinned)


def _rows(name: str) -> list[dict[str, str]]:
    with (files(__package__) / name).open(encoding="utf-8") as file:
        return list(csv.DictReader(file))

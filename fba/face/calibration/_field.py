"""A smooth deformation of space that takes given points exactly to others, and folds it makes in a mesh."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from fba.arrays import Float64, Floating, Integer, Intp
from fba.face.feature_points import names
from fba.mesh.meshes import vertex_normals

WELL_KNOWN = 0.02
"""Metres: the affine part is trusted along directions in which the points are spread by more."""
ANCHOR_DISTANCE = 0.08
"""Metres from every point, on the scale of an adult head: beyond it the affine part alone holds."""
ANCHORS = 60
SAME_PLACE = 1e-5
"""Metres between sources that are taken as one."""
SLACK = 1e-9
"""Smoothing of the anchors: they hold the far field, but need not be met."""
LEAST_VOLUME = 0.04
"""Share of its usual volume to which space may be pressed together."""
KERNELS = ("thin_plate_spline", "cubic", "linear")
"""From the smoothest to the tamest."""


@dataclass(frozen=True, eq=False)
class Field:
    """A deformation: call it with places (N, 3). matrix, origin, target: its affine part."""

    matrix: Float64
    origin: Float64
    target: Float64
    rest: Any

    def __call__(self, places: Floating) -> Float64:
        flat = np.asarray(places, dtype=np.float64)
        moved: Float64 = self.affine(flat) + self.rest(flat)
        return moved

    def affine(self, places: Float64) -> Float64:
        moved: Float64 = (places - self.origin) @ self.matrix.T + self.target
        return moved

    def turns(self, places: Floating) -> Float64:
        """(N, 3, 3): the rotation in the deformation at each place, without its stretch."""
        u, _, vt = np.linalg.svd(self.jacobians(places))
        turned: Float64 = u @ vt
        return turned

    def jacobians(self, places: Floating, step: float = 1e-4) -> Float64:
        """(N, 3, 3): how the deformation stretches and turns space at each place."""
        flat = np.asarray(places, dtype=np.float64)
        columns = [self(flat + offset) - self(flat - offset) for offset in np.eye(3) * step]
        return np.stack(columns, axis=2) / (2 * step)


def deformation(sources: Float64, targets: Float64, mesh: Floating, kernel: str, size: float) -> Field:
    """The deformation of a mesh (V, 3) that takes sources (N, 3) to targets (N, 3).

    size: how big the person is by the face. An affine part, trusted as far as the points are spread, and
    a radial basis function (thin plate, biharmonic or triharmonic) for the rest, which anchors on the
    mesh hold at zero far away from all points: the back of a head does not follow the tip of a nose.
    """
    from scipy.interpolate import RBFInterpolator

    sources, targets = _distinct(sources, targets)
    origin, target = sources.mean(axis=0), targets.mean(axis=0)
    here, there = sources - origin, targets - target
    spread = here.T @ here / len(here) + WELL_KNOWN**2 * np.eye(3)
    pull = there.T @ here / len(here) + size * WELL_KNOWN**2 * np.eye(3)
    matrix = pull @ np.linalg.inv(spread)
    anchors = far_from(np.asarray(mesh, dtype=np.float64), sources)
    centres = np.vstack([sources, anchors])
    left = np.vstack([there - here @ matrix.T, np.zeros((len(anchors), 3))])
    smoothing = np.concatenate([np.zeros(len(sources)), np.full(len(anchors), SLACK)])
    affine = np.linalg.matrix_rank(centres - centres[0], tol=1e-4) == 3 and len(centres) > 4
    rest = RBFInterpolator(centres, left, kernel=kernel, smoothing=smoothing, degree=1 if affine else 0)
    return Field(matrix, origin, target, rest)


def far_from(mesh: Float64, sources: Float64) -> Float64:
    """Up to `ANCHORS` places spread over that part of a mesh which is far from all sources: (K, 3)."""
    from scipy.spatial import cKDTree

    away = cKDTree(sources).query(mesh)[0]
    rest = mesh[away > ANCHOR_DISTANCE]
    chosen: list[int] = []
    distance = np.full(len(rest), np.inf)
    while len(chosen) < min(ANCHORS, len(rest)):
        nearest = int(distance.argmax()) if chosen else int(away[away > ANCHOR_DISTANCE].argmax())
        if chosen and distance[nearest] < ANCHOR_DISTANCE / 2:
            break
        chosen.append(nearest)
        distance = np.minimum(distance, np.linalg.norm(rest - rest[nearest], axis=1))
    places: Float64 = rest[chosen]
    return places


def bumps(centres: Float64, shifts: Float64, width: float) -> Any:
    """A field of shifts that are met exactly at the centres and fade within about `width` metres."""
    centres, shifts = _distinct(centres, shifts)
    gram = np.exp(-_squares(centres, centres) / (2 * width**2))
    strength = np.linalg.lstsq(gram, shifts, rcond=None)[0]

    def moved(places: Float64) -> Float64:
        found: Float64 = np.exp(-_squares(places, centres) / (2 * width**2)) @ strength
        return found

    return moved


def between(centres: Float64, shifts: Float64) -> Any:
    """A field of shifts that are met exactly at the centres and go evenly from one to the other."""
    from scipy.interpolate import RBFInterpolator

    centres, shifts = _distinct(centres, shifts)
    return RBFInterpolator(centres, shifts, kernel="linear", degree=0)


def _squares(a: Float64, b: Float64) -> Float64:
    squares: Float64 = ((a[:, None, :] - b[None, :, :]) ** 2).sum(axis=2)
    return squares


def _distinct(sources: Float64, targets: Float64) -> tuple[Float64, Float64]:
    """Sources that stand on one spot (upper and lower lip) made one, going to the middle of its targets."""
    from scipy.spatial import cKDTree

    group = np.arange(len(sources))
    for a, b in sorted(cKDTree(sources).query_pairs(SAME_PLACE)):
        group[group == group[b]] = group[a]
    kept, inverse = np.unique(group, return_inverse=True)
    count = np.bincount(inverse).astype(np.float64)[:, None]
    summed = np.zeros((len(kept), 6))
    np.add.at(summed, inverse, np.hstack([sources, targets]))
    mean = summed / count
    return mean[:, :3], mean[:, 3:]


def folded(field: Field, mesh: Floating, size: float) -> Intp:
    """Vertices at which the deformation turns space inside out, or nearly so; size: usual, of lengths."""
    volume = np.linalg.det(field.jacobians(mesh)) / size**3
    return np.flatnonzero(~(volume > LEAST_VOLUME))


def turned_over(before: Floating, after: Float64, triangles: Integer) -> tuple[Intp, float]:
    """Triangles that look the other way than their surroundings do after a deformation, and their area.

    The area is a share of the whole, before.

    Whether a triangle is turned is seen against the mean of its neighbours' normals, before and after: a
    turn of the whole surface is none of the triangle.
    """
    agreeing, areas = [], []
    for vertices in (np.asarray(before, dtype=np.float64), after):
        corners = vertices[triangles]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        around = vertex_normals(vertices, triangles)[triangles].mean(axis=1)
        agreeing.append((normal * around).sum(axis=1))
        areas.append(np.linalg.norm(normal, axis=1))
    wrong = np.flatnonzero((agreeing[0] > 0) & (agreeing[1] < 0))
    return wrong, float(areas[0][wrong].sum() / max(areas[0].sum(), 1e-30))


def blamed(places: Float64, sources: Float64, rows: Intp, count: int = 4) -> tuple[str, ...]:
    """Names of the feature points (rows, at sources) that are nearest to most of the places."""
    from scipy.spatial import cKDTree

    if not len(places) or not len(sources):
        return ()
    _, near = cKDTree(sources).query(places, k=min(3, len(sources)))
    votes = np.bincount(np.ravel(near), minlength=len(sources))
    order = np.argsort(-votes, kind="stable")[:count]
    return tuple(names()[int(rows[place])] for place in order if votes[place])

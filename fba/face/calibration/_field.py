"""Smooth deformations of space that take given points exactly to others, and tests for folds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from fba.arrays import Float64, Floating, Integer, Intp
from fba.face.feature_points import names
from fba.geometry import nearest_orthonormal
from fba.mesh import vertex_normals

MIN_SPREAD = 0.02
"""Metres: the affine part covers directions in which the points spread by more than this."""
ANCHOR_DISTANCE = 0.08
"""Metres from every source, for an adult head, beyond which only the affine part acts."""
ANCHORS = 60
SAME_PLACE = 1e-5
"""Sources within this many metres are merged into one."""
DERIVATIVE_STEP = 1e-4
"""Metres between a point and those at which its derivatives are computed."""
ANCHOR_SMOOTHING = 1e-9
"""Smoothing of the anchors: they keep the far field near zero, not exactly at it."""
LEAST_VOLUME = 0.04
"""The deformation folds where its local volume is below this share of the usual one."""
KERNELS = ("multiquadric", "linear")
"""Kernels of the radial basis functions, from the smoothest to the least prone to fold.

The distance itself bends space least (it is the biharmonic function of three dimensions), but leaves a tip at
each source, which the multiquadric rounds.
"""
ROUNDING = 0.004
"""Metres within which the multiquadric rounds these tips."""


@dataclass(frozen=True, eq=False)
class Field:
    """A deformation of points (N, 3), metres: an affine part, and `rest`, a function of points."""

    matrix: Float64
    origin: Float64
    target: Float64
    rest: Any

    def __call__(self, points: Floating) -> Float64:
        flat = np.asarray(points, dtype=np.float64)
        return np.asarray((flat - self.origin) @ self.matrix.T + self.target + self.rest(flat))

    def rotations(self, points: Floating) -> Float64:
        """Return (N, 3, 3) rotation of the deformation at each point, without its stretch."""
        return nearest_orthonormal(self.jacobians(points))

    def jacobians(self, points: Floating) -> Float64:
        """Return (N, 3, 3) Jacobian of the deformation at each point, by central differences."""
        flat = np.asarray(points, dtype=np.float64)
        columns = [self(flat + offset) - self(flat - offset) for offset in np.eye(3) * DERIVATIVE_STEP]
        return np.stack(columns, axis=2) / (2 * DERIVATIVE_STEP)


def deformation(sources: Float64, targets: Float64, mesh: Floating, kernel: str, size: float) -> Field:
    """Return the deformation of a mesh (V, 3) that takes sources (N, 3) to targets (N, 3).

    size: of the person relative to the face. An affine map covers directions in which the points spread, a
    radial basis function (`KERNELS`) the rest; anchors on the mesh keep that near zero far from all points,
    so that the back of a head does not follow the tip of a nose.
    """
    from scipy.interpolate import RBFInterpolator

    sources, targets = _merge_coincident(sources, targets)
    origin, target = sources.mean(axis=0), targets.mean(axis=0)
    here, there = sources - origin, targets - target
    spread = here.T @ here / len(here) + MIN_SPREAD**2 * np.eye(3)
    pull = there.T @ here / len(here) + size * MIN_SPREAD**2 * np.eye(3)
    matrix = pull @ np.linalg.inv(spread)
    anchors = anchors_far_from(np.asarray(mesh, dtype=np.float64), sources)
    centres = np.vstack([sources, anchors])
    left = np.vstack([there - here @ matrix.T, np.zeros((len(anchors), 3))])
    smoothing = np.concatenate([np.zeros(len(sources)), np.full(len(anchors), ANCHOR_SMOOTHING)])
    affine = np.linalg.matrix_rank(centres - centres[0], tol=1e-4) == 3 and len(centres) > 4
    rest = RBFInterpolator(
        centres, left, kernel=kernel, smoothing=smoothing, degree=1 if affine else 0, epsilon=1 / ROUNDING
    )
    return Field(matrix, origin, target, rest)


def anchors_far_from(mesh: Float64, sources: Float64) -> Float64:
    """Return (K, 3): up to `ANCHORS` vertices, spread over the part of a mesh far from all sources."""
    from scipy.spatial import cKDTree

    away = cKDTree(sources).query(mesh)[0]
    far = mesh[away > ANCHOR_DISTANCE]
    anchors: list[int] = []
    distance = np.full(len(far), np.inf)  # from the nearest anchor
    while len(anchors) < min(ANCHORS, len(far)):
        furthest = int(distance.argmax()) if anchors else int(away[away > ANCHOR_DISTANCE].argmax())
        if anchors and distance[furthest] < ANCHOR_DISTANCE / 2:
            break
        anchors.append(furthest)
        distance = np.minimum(distance, np.linalg.norm(far - far[furthest], axis=1))
    return np.asarray(far[anchors])


def bump_field(centres: Float64, shifts: Float64, width: float) -> Any:
    """Return a function from points (N, 3) to shifts: exact at the centres, fading within `width` metres."""
    centres, shifts = _merge_coincident(centres, shifts)
    gram = np.exp(-_squares(centres, centres) / (2 * width**2))
    strength = np.linalg.lstsq(gram, shifts, rcond=None)[0]

    return lambda points: np.exp(-_squares(points, centres) / (2 * width**2)) @ strength


def linear_field(centres: Float64, shifts: Float64) -> Any:
    """Return a function from points (N, 3) to shifts (N, 3): exact at the centres, linear between them."""
    from scipy.interpolate import RBFInterpolator

    centres, shifts = _merge_coincident(centres, shifts)
    return RBFInterpolator(centres, shifts, kernel="linear", degree=0)


def _squares(a: Float64, b: Float64) -> Float64:
    """Return (N, M) squared distances between points (N, 3) and (M, 3)."""
    return np.asarray(((a[:, None, :] - b[None, :, :]) ** 2).sum(axis=2))


def _merge_coincident(sources: Float64, targets: Float64) -> tuple[Float64, Float64]:
    """Return sources and targets (K, 3), coinciding sources (touching lips) merged, targets averaged."""
    from scipy.spatial import cKDTree

    group = np.arange(len(sources))
    for a, b in sorted(cKDTree(sources).query_pairs(SAME_PLACE)):
        group[group == group[b]] = group[a]
    inverse = np.unique(group, return_inverse=True)[1]
    summed = np.zeros((int(inverse.max()) + 1, 6))
    np.add.at(summed, inverse, np.hstack([sources, targets]))
    mean = summed / np.bincount(inverse)[:, None]
    return mean[:, :3], mean[:, 3:]


def folded_vertices(field: Field, mesh: Floating, size: float) -> Intp:
    """Return the vertices where the deformation turns space nearly inside out. size: its usual scale."""
    volume = np.linalg.det(field.jacobians(mesh)) / size**3
    return np.flatnonzero(~(volume > LEAST_VOLUME))


def turned_over_triangles(before: Floating, after: Float64, triangles: Integer) -> tuple[Intp, float]:
    """Return (triangles that a deformation turns over, their share of the total area before).

    A triangle has turned over if its normal agreed with the mean of its neighbours' normals before but
    opposes it after: a rotation of the whole surface does not count.
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


def nearest_points(points: Float64, sources: Float64, rows: Intp) -> tuple[str, ...]:
    """Return the names of the four feature points (rows, at sources (N, 3)) nearest to most points."""
    from scipy.spatial import cKDTree

    if not len(points) or not len(sources):
        return ()
    _, near = cKDTree(sources).query(points, k=min(3, len(sources)))
    votes = np.bincount(np.ravel(near), minlength=len(sources))
    order = np.argsort(-votes, kind="stable")[:4]
    return tuple(names()[int(rows[k])] for k in order if votes[k])

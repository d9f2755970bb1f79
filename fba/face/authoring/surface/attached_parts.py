"""Motions of small parts attached to the skin, such as brows and lashes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.arrays import Float64, Intp
from fba.face.authoring.surface._motion import Motion
from fba.face.authoring.surface.surface import Surface, weld_parts
from fba.face.model import Part

NEIGHBOURS = 8
"""Candidate triangles for the nearest point on the skin."""
ROOT = 0.3
"""Vertices of a hair up to this much further from the skin than its nearest are roots, in edge lengths."""
MAX_ATTACHED_SIZE = 1.2
"""Size, in ES0, up to which a part of kind "other" is attached: a mole, not a shirt."""
ATTACHED_DISTANCE = 0.1
"""Distance from the skin, in ES0, within which most vertices of a part lie that is attached to it."""


@dataclass(frozen=True, eq=False)
class Anchors:
    """The attachment of each vertex of a part to the skin; made by `attach`.

    surface: the skin. points: (V, 3), the part's vertices, metres. triangles: (V,), the skin's triangle that
    each hangs on; shares: (V, 3), barycentric coordinates in it. distance: (V,) from the skin, metres.
    turning: whether vertices turn with their triangles.
    """

    surface: Surface
    points: Float64
    triangles: Intp
    shares: Float64
    distance: Float64
    turning: bool = True

    def carry(self, motion: Motion) -> Motion:
        """Return the part's motion for one of the surface: vertices go where their triangles go."""
        neutral = self.surface.vertices
        corners = self.surface.triangles[self.triangles]
        moved = self.surface.mask(motion.vertices)[corners] & (self.shares != 0)
        moving = np.flatnonzero(moved.any(axis=1))
        corners, shares, points = corners[moving], self.shares[moving], self.points[moving]
        before = neutral[corners]
        arm = points - (before * shares[:, :, None]).sum(axis=1)
        along = np.einsum("nij,ni->nj", _frames(before), arm)
        skin = np.zeros_like(neutral)
        shifts = np.zeros((len(motion.values), len(moving), 3))
        for k in range(len(motion.values)):
            skin[motion.vertices] = motion.shifts[k]
            after = before + skin[corners]
            foot = (after * shares[:, :, None]).sum(axis=1)
            if self.turning:
                arm = np.einsum("nij,nj->ni", _frames(after), along)
            shifts[k] = foot + arm - points
        shifts[motion.values == 0] = 0.0
        return Motion(motion.values, moving, shifts)


def attach_lashes(surface: Surface, part: Part, margins: Intp) -> Anchors:
    """Return the attachment of a part's lashes, by their roots, to the nearest of the lids' margins.

    They go where the margin goes and do not turn: a drawn lash can lie on skin that moves with the brow.
    """
    from scipy.spatial import cKDTree

    shape = weld_parts([part])
    away, nearest = cKDTree(surface.vertices[margins]).query(shape.vertices)
    root = hair_roots(shape, away)[shape.number]
    found = margins[nearest[root]]
    triangle = np.zeros(len(surface.vertices), np.intp)
    triangle[surface.triangles] = np.arange(len(surface.triangles))[:, None]
    shares = (surface.triangles[triangle[found]] == found[:, None]).astype(np.float64)
    return Anchors(
        surface, part.vertices.astype(np.float64), triangle[found], shares, away[root], turning=False
    )


def attach(surface: Surface, part: Part) -> Anchors:
    """Return the attachment of a part to the nearest triangles of the skin; lashes hang by their roots."""
    from scipy.spatial import cKDTree

    shape = weld_parts([part])
    corners = surface.vertices[surface.triangles]
    _, near = cKDTree(corners.mean(axis=1)).query(shape.vertices, k=min(NEIGHBOURS, len(corners)))
    best, shares, away = _closest_triangles(corners, near.reshape(len(shape.vertices), -1), shape.vertices)
    root = hair_roots(shape, away) if part.kind == "lash" else np.arange(len(shape.vertices))
    return Anchors(
        surface,
        part.vertices.astype(np.float64),
        best[root][shape.number],
        shares[root][shape.number],
        away[shape.number],
    )


def hair_roots(shape: Surface, away: Float64) -> Intp:
    """Return (N,) the root of each vertex along its hair; roots are nearest to the skin, by `away` (N,)."""
    from scipy.sparse.csgraph import dijkstra

    nearest = np.full(int(shape.component.max(initial=-1)) + 1, np.inf)
    np.minimum.at(nearest, shape.component, away)
    span = float(np.median(np.linalg.norm(np.diff(shape.vertices[shape.edges], axis=1), axis=2)))
    start = np.flatnonzero(away <= nearest[shape.component] + ROOT * span)
    root = dijkstra(shape.graph, directed=False, indices=start, min_only=True, return_predecessors=True)[2]
    return np.where(root >= 0, root, np.arange(len(root))).astype(np.intp)


def _closest_triangles(corners: Float64, near: Intp, points: Float64) -> tuple[Intp, Float64, Float64]:
    """Return (triangle, barycentric shares, distance) of the nearest of some candidate triangles (N, K)."""
    best = near[:, 0].copy()
    shares = np.full((len(points), 3), 1 / 3)
    distance = np.full(len(points), np.inf)
    for k in range(near.shape[1]):
        triangle = corners[near[:, k]]
        inside = np.clip(_barycentric(triangle, points), 0, None)
        inside /= inside.sum(axis=1, keepdims=True)
        away = np.linalg.norm((triangle * inside[:, :, None]).sum(axis=1) - points, axis=1)
        better = away < distance
        best[better], shares[better], distance[better] = near[better, k], inside[better], away[better]
    return best, shares, distance


def _barycentric(triangles: Float64, points: Float64) -> Float64:
    """Return (N, 3) barycentric coordinates of points (N, 3) in the planes of triangles (N, 3, 3)."""
    e1, e2 = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    arm = points - triangles[:, 0]
    a, b, c = (e1 * e1).sum(axis=1), (e1 * e2).sum(axis=1), (e2 * e2).sum(axis=1)
    d, e = (e1 * arm).sum(axis=1), (e2 * arm).sum(axis=1)
    area = np.maximum(a * c - b * b, 1e-30)
    v, w = (c * d - b * e) / area, (a * e - b * d) / area
    return np.stack([1 - v - w, v, w], axis=1)


def _frames(triangles: Float64) -> Float64:
    """Return (N, 3, 3) orthonormal frames on triangles, columns along an edge, across it and upright."""
    along = triangles[:, 1] - triangles[:, 0]
    up = np.cross(along, triangles[:, 2] - triangles[:, 0])
    along = along / np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-30)
    up = up / np.maximum(np.linalg.norm(up, axis=1, keepdims=True), 1e-30)
    return np.stack([along, np.cross(up, along), up], axis=2)

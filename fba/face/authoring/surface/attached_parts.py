"""Motions of small parts attached to the skin, such as brows and lashes."""

from __future__ import annotations

import numpy as np

from fba.arrays import Float64, Intp
from fba.face.authoring.surface.motion import Motion
from fba.face.authoring.surface.surface import Surface
from fba.face.model import Part

NEIGHBOURS = 8
"""Candidate triangles for the nearest point on the skin."""
ROOT = 0.3
"""Vertices of a hair up to this much further from the skin than its nearest are roots, in edge lengths."""
LARGEST = 1.2
"""Parts of kind "other" are attached if smaller than this, in ES0: a mole, not a shirt."""
NEAR = 0.1
"""Parts with most of their vertices this close to the skin, in ES0, are attached to it."""


class Anchors:
    """The attachment of each vertex of a part to the skin: a triangle and barycentric coordinates in it."""

    def __init__(self, surface: Surface, part: Part) -> None:
        from scipy.spatial import cKDTree

        self._triangles = surface.triangles
        self._neutral = surface.vertices
        self._points = part.vertices.astype(np.float64)
        shape = Surface([part])
        corners = surface.vertices[surface.triangles]
        tree = cKDTree(corners.mean(axis=1))
        _, near = tree.query(shape.vertices, k=min(NEIGHBOURS, len(corners)))
        best, shares, away = _closest_triangles(
            corners, near.reshape(len(shape.vertices), -1), shape.vertices
        )
        root = hair_roots(shape, away) if part.kind == "lash" else np.arange(len(shape.vertices))
        self.distance: Float64 = away[shape.number]
        self._best: Intp = best[root][shape.number]
        self._shares: Float64 = shares[root][shape.number]

    def carry(self, motion: Motion) -> Motion:
        """The motion of the part for a motion of the surface: vertices move and turn with their triangles."""
        skin = np.zeros_like(self._neutral)
        place = np.full(len(self._neutral), -1)
        place[motion.vertices] = np.arange(len(motion.vertices))
        moving = np.flatnonzero((place[self._triangles[self._best]] >= 0).any(axis=1))
        triangles = self._triangles[self._best[moving]]
        before = self._neutral[triangles]
        shares = self._shares[moving]
        foot = (before * shares[:, :, None]).sum(axis=1)
        arm = self._points[moving] - foot
        frame = _frames(before)
        local = np.einsum("nij,ni->nj", frame, arm)
        shifts = np.zeros((len(motion.values), len(moving), 3))
        for k in range(len(motion.values)):
            skin[motion.vertices] = motion.shifts[k]
            after = before + skin[triangles]
            foot_after = (after * shares[:, :, None]).sum(axis=1)
            shifts[k] = foot_after + np.einsum("nij,nj->ni", _frames(after), local) - self._points[moving]
        shifts[motion.values == 0] = 0.0
        return Motion(motion.values, moving, shifts)


def hair_roots(shape: Surface, away: Float64) -> Intp:
    """(N,) for each vertex of hairs the root vertex that it grows from, along the hair.

    away: (N,) distances from the skin; roots are the nearest vertices of each connected piece.
    """
    from scipy.sparse.csgraph import dijkstra

    nearest = np.full(int(shape.component.max(initial=-1)) + 1, np.inf)
    np.minimum.at(nearest, shape.component, away)
    span = float(np.median(np.linalg.norm(np.diff(shape.vertices[shape.edges], axis=1), axis=2)))
    start = np.flatnonzero(away <= nearest[shape.component] + ROOT * span)
    found = dijkstra(shape.graph, directed=False, indices=start, min_only=True, return_predecessors=True)[2]
    result: Intp = np.where(found >= 0, found, np.arange(len(found))).astype(np.intp)
    return result


def _closest_triangles(corners: Float64, near: Intp, points: Float64) -> tuple[Intp, Float64, Float64]:
    """(triangle, barycentric shares, distance) of the nearest of some candidate triangles (N, K)."""
    best = near[:, 0].copy()
    shares = np.full((len(points), 3), 1 / 3)
    distance = np.full(len(points), np.inf)
    for k in range(near.shape[1]):
        triangle = corners[near[:, k]]
        found = _barycentric(triangle, points)
        found = np.clip(found, 0, None)
        found /= found.sum(axis=1, keepdims=True)
        away = np.linalg.norm((triangle * found[:, :, None]).sum(axis=1) - points, axis=1)
        better = away < distance
        best[better], shares[better], distance[better] = near[better, k], found[better], away[better]
    return best, shares, distance


def _barycentric(triangles: Float64, points: Float64) -> Float64:
    e1, e2 = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    arm = points - triangles[:, 0]
    a, b, c = (e1 * e1).sum(axis=1), (e1 * e2).sum(axis=1), (e2 * e2).sum(axis=1)
    d, e = (e1 * arm).sum(axis=1), (e2 * arm).sum(axis=1)
    area = np.maximum(a * c - b * b, 1e-30)
    v, w = (c * d - b * e) / area, (a * e - b * d) / area
    return np.stack([1 - v - w, v, w], axis=1)


def _frames(triangles: Float64) -> Float64:
    """(N, 3, 3) an orthonormal frame on each triangle, columns along an edge, across it and upright."""
    along = triangles[:, 1] - triangles[:, 0]
    up = np.cross(along, triangles[:, 2] - triangles[:, 0])
    along = along / np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-30)
    up = up / np.maximum(np.linalg.norm(up, axis=1, keepdims=True), 1e-30)
    return np.stack([along, np.cross(up, along), up], axis=2)

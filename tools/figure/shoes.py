"""Low shoes: from the outline of the sole, drawn over the foot to a ring about the ankle."""

from __future__ import annotations

import numpy as np
from clothes import MIRROR, Garment
from meshes import tube

from fba.arrays import Float64, Int64
from fba.easing import smoothstep
from fba.mesh.meshes import vertex_normals

LEATHER = np.array([0.030, 0.026, 0.024])
SOLE = np.array([0.42, 0.41, 0.39])
AROUND = 44
ROOM = 0.007
"""Metres between foot and outline."""
THICK = 0.019
"""Height of the sole, metres."""
SPRING = 0.007
"""Height of the tip of the sole above the ground, metres."""
TOP = 0.115
COVERED = 0.115
"""Height below which the foot is entirely inside shoe or trousers, metres."""
UPPER = (0.0, 0.10, 0.22, 0.36, 0.50, 0.64, 0.76, 0.86, 0.94, 1.0)
"""Positions of the upper's rings on the way from sole to ankle, 0..1."""


def make_shoes(body: Float64, weights: Float64) -> Garment:
    """Return both shoes, for vertices (V, 3) of the person as modelled. weights (V, J)."""
    left = body[:, 0] > 0
    foot = np.flatnonzero(left & (body[:, 1] < TOP + 0.01))
    vertices, triangles, colours = _shoe(body[foot])
    carried = _nearest_weights(vertices, body[foot], weights[foot])
    other = vertices * (-1.0, 1.0, 1.0)
    return Garment(
        np.concatenate([vertices, other]),
        np.concatenate([triangles, triangles[:, ::-1] + len(vertices)]),
        np.concatenate([colours, colours]),
        np.concatenate([carried, carried[:, MIRROR]]),
        np.where(body[:, 1] < TOP + 0.01, COVERED - body[:, 1], -1.0),
        np.zeros(2 * len(vertices), dtype=bool),
    )


def _shoe(foot: Float64) -> tuple[Float64, Int64, Float64]:
    """Return vertices, triangles and colours of the left shoe about the vertices of a foot."""
    low = foot[foot[:, 1] < 0.05]
    ahead, origin = _direction(low)
    aside = np.array([ahead[2], 0.0, -ahead[0]])
    flat = np.stack([(low - origin) @ aside, (low - origin) @ ahead], axis=1)
    outline = _outline(flat)
    ring = foot[np.abs(foot[:, 1] - 0.10) < 0.012]
    ankle = np.stack([(ring - origin) @ aside, (ring - origin) @ ahead], axis=1)
    middle, half = (ankle.max(axis=0) + ankle.min(axis=0)) / 2, np.ptp(ankle, axis=0) / 2 + 0.005
    around = np.arctan2(outline[:, 0] - middle[0], outline[:, 1] - middle[1])
    top = middle + half * np.stack([np.sin(around), np.cos(around)], axis=1)
    forward = (outline[:, 1] - outline[:, 1].min()) / np.ptp(outline[:, 1])
    lift = SPRING * smoothstep((forward - 0.70) / 0.30) ** 1.5
    rings = [_level(outline * 1.0, lift, -0.004), _level(outline, lift, 0.0), _level(outline, lift, THICK)]
    rings[0][:, :2] = outline - 0.004 * _outward(outline)
    rings[0][:, 2] = lift
    rings[1][:, 2] = lift + 0.004
    colours = [SOLE, SOLE, SOLE]
    welt = outline - 0.0035 * _outward(outline)
    rings.append(_level(welt, lift, THICK))
    colours.append(LEATHER)
    reach = np.linalg.norm(top - welt, axis=1)
    front = smoothstep((forward - 0.55) / 0.40)
    # Handles of a cubic curve: up from the welt, and inwards from the side of the ankle.
    rise = 0.034 + 0.006 * front
    slope = np.minimum(0.55 * reach, 0.085)
    for t in UPPER:
        a, b, c, d = (1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t * t * (1 - t), t**3
        inward = (welt - top) / np.maximum(reach, 1e-9)[:, None]
        place = (a + b) * welt + c * (top + inward * slope[:, None]) + d * top
        base = THICK + lift
        handle = TOP - 0.040 + 0.004 * front
        height = a * base + b * (base + rise) + c * handle + d * TOP
        rings.append(np.stack([place[:, 0], place[:, 1], height], axis=1))
        colours.append(LEATHER)
    rings.append(np.stack([*(middle + (top - middle) * 0.6).T, np.full(AROUND, TOP - 0.004)], axis=1))
    colours.append(LEATHER)
    stacked = np.concatenate(rings)
    vertices = origin + stacked[:, :1] * aside + stacked[:, 1:2] * ahead + stacked[:, 2:] * (0.0, 1.0, 0.0)
    shown = np.repeat(np.array(colours), AROUND, axis=0)
    triangles = tube(len(rings), AROUND)[:, ::-1]
    # The bottom: a fan about the middle of the lowest ring.
    bottom = len(vertices)
    centre = vertices[:AROUND].mean(axis=0) * (1, 0, 1)
    vertices = np.concatenate([vertices, centre[None]])
    shown = np.concatenate([shown, SOLE[None] * 0.5])
    k = np.arange(AROUND)
    fan = np.stack([np.full(AROUND, bottom), (k + 1) % AROUND, k], axis=1)
    triangles = np.concatenate([triangles, fan])
    inside = (vertices_out(vertices, triangles) < 0).mean() > 0.5
    triangles = triangles[:, ::-1] if inside else triangles
    gloss = np.where(shown[:, :1] < 0.1, 0.34, 0.10)
    return vertices, triangles, np.concatenate([shown, gloss], axis=1)


def vertices_out(vertices: Float64, triangles: Int64) -> Float64:
    """Return (V,) component of normals away from the middle of a mesh; positive where they point outwards."""
    normals = vertex_normals(vertices, triangles)
    return (normals * (vertices - vertices.mean(axis=0))).sum(axis=1)


def _direction(low: Float64) -> tuple[Float64, Float64]:
    """Return a level unit vector ahead along the foot, and the middle of the foot on the ground."""
    flat = low[:, [0, 2]] - low[:, [0, 2]].mean(axis=0)
    _, _, axes = np.linalg.svd(flat, full_matrices=False)
    ahead = np.array([axes[0, 0], 0.0, axes[0, 1]])
    ahead *= np.sign(ahead[2])
    middle = low.mean(axis=0) * (1, 0, 1)
    return ahead, middle


def _outline(flat: Float64) -> Float64:
    """Return the sole's outline (AROUND, 2) about points (N, 2), evenly spaced, counter-clockwise."""
    from scipy.spatial import ConvexHull

    hull = flat[ConvexHull(flat).vertices]
    closed = np.concatenate([hull, hull[:1]])
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(closed, axis=0), axis=1))])
    fine = np.linspace(0, along[-1], 400, endpoint=False)
    positions = np.stack([np.interp(fine, along, closed[:, k]) for k in (0, 1)], axis=1)
    # A shoe is narrower at its waist, and rounder than toes.
    forward = (positions[:, 1] - positions[:, 1].min()) / np.ptp(positions[:, 1])
    middle = np.interp(positions[:, 1], *_spine(positions))
    waist = 1 - 0.10 * np.exp(-(((forward - 0.42) / 0.16) ** 2))
    positions[:, 0] = middle + (positions[:, 0] - middle) * waist
    positions = positions + ROOM * _outward(positions)
    for _ in range(60):
        positions = 0.5 * positions + 0.25 * (np.roll(positions, 1, axis=0) + np.roll(positions, -1, axis=0))
    steps = np.linalg.norm(np.diff(positions, axis=0, append=positions[:1]), axis=1)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    closed = np.concatenate([positions, positions[:1]])
    even = np.linspace(0, along[-1], AROUND, endpoint=False)
    return np.stack([np.interp(even, along, closed[:, k]) for k in (0, 1)], axis=1)


def _spine(positions: Float64) -> tuple[Float64, Float64]:
    """Return positions along the foot, and the middles between both sides there."""
    levels = np.linspace(positions[:, 1].min(), positions[:, 1].max(), 12)
    middles = []
    for level in levels:
        near = positions[np.abs(positions[:, 1] - level) < 0.02, 0]
        middles.append((near.min() + near.max()) / 2)
    return levels, np.array(middles)


def _outward(outline: Float64) -> Float64:
    """Return (N, 2) unit normals of a closed outline, away from its middle."""
    tangent = np.roll(outline, -1, axis=0) - np.roll(outline, 1, axis=0)
    normal = np.stack([tangent[:, 1], -tangent[:, 0]], axis=1)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    sign = np.sign((normal * (outline - outline.mean(axis=0))).sum())
    return normal * sign


def _level(outline: Float64, lift: Float64, height: float) -> Float64:
    return np.stack([outline[:, 0], outline[:, 1], lift + height], axis=1)


def _nearest_weights(positions: Float64, foot: Float64, weights: Float64) -> Float64:
    """Return (N, J) weights averaged over the nearest vertices of the foot."""
    from scipy.spatial import cKDTree

    away, rows = cKDTree(foot).query(positions, k=12)
    share = 1 / (away + 0.01) ** 2
    share /= share.sum(axis=1, keepdims=True)
    return np.einsum("nk,nkj->nj", share, weights[rows])

"""Low shoes: a surface from the outline of the sole over the foot to a ring around the ankle."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from fba.arrays import Float64, Int64
from fba.mesh import vertex_normals
from fba.sampling import smoothstep
from tools.figure.clothing.clothes import MIRROR, Garment
from tools.figure.meshes import tube
from tools.figure.paint import encode_linear, make_chart

LEATHER = np.array([0.030, 0.026, 0.024])
SOLE = np.array([0.42, 0.41, 0.39])
LACE = np.array([0.48, 0.47, 0.45])
LACES = 5
PICTURE = 512
"""Texels of the picture along each side."""
SEGMENTS = 44
CLEARANCE = 0.007
"""Metres between foot and outline."""
SOLE_HEIGHT = 0.019
"""Height of the sole, metres."""
TOE_SPRING = 0.007
"""Height of the tip of the sole above the ground, metres."""
TOP_HEIGHT = 0.115
COVERED_HEIGHT = 0.115
"""Height below which shoe or trousers cover the foot completely, metres."""
UPPER = (0.0, 0.10, 0.22, 0.36, 0.50, 0.64, 0.76, 0.86, 0.94, 1.0)
"""Positions of the rings of the shoe's upper part between sole and ankle, 0..1."""


def make_shoes(body: Float64, weights: Float64) -> Garment:
    """Return both shoes for a person. body: (V, 3), vertices as modelled. weights: (V, J), of the joints."""
    left = body[:, 0] > 0
    foot = np.flatnonzero(left & (body[:, 1] < TOP_HEIGHT + 0.01))
    vertices, triangles, colours, places, marks = _shoe(body[foot])
    left_weights = _nearest_weights(vertices, body[foot], weights[foot])
    other = vertices * (-1.0, 1.0, 1.0)
    return Garment(
        np.concatenate([vertices, other]),
        np.concatenate([triangles, triangles[:, ::-1] + len(vertices)]),
        np.concatenate([colours, colours]),
        np.concatenate([left_weights, left_weights[:, MIRROR]]),
        np.where(body[:, 1] < TOP_HEIGHT + 0.01, COVERED_HEIGHT - body[:, 1], -1.0),
        np.zeros(2 * len(vertices), dtype=bool),
        np.ones(2 * len(vertices)),
        np.zeros((2 * len(vertices), 3)),
        np.concatenate([places, places]),
        _paint(marks, triangles, places),
    )


def _shoe(foot: Float64) -> tuple[Float64, Int64, Float64, Float64, Float64]:
    """Return vertices, triangles, colours, places in the picture, and marks, of the left shoe around a foot.

    The marks (V, 3): metres to the side of the middle, share of the length from the heel, and height (m).
    """
    sole_vertices = foot[foot[:, 1] < 0.05]
    toe_axis, origin = _direction(sole_vertices)
    side_axis = np.array([toe_axis[2], 0.0, -toe_axis[0]])
    flat = np.stack([(sole_vertices - origin) @ side_axis, (sole_vertices - origin) @ toe_axis], axis=1)
    outline = _outline(flat)
    ring = foot[np.abs(foot[:, 1] - 0.10) < 0.012]
    ankle = np.stack([(ring - origin) @ side_axis, (ring - origin) @ toe_axis], axis=1)
    middle, half = (ankle.max(axis=0) + ankle.min(axis=0)) / 2, np.ptp(ankle, axis=0) / 2 + 0.005
    angles = np.arctan2(outline[:, 0] - middle[0], outline[:, 1] - middle[1])
    top = middle + half * np.stack([np.sin(angles), np.cos(angles)], axis=1)
    forward = (outline[:, 1] - outline[:, 1].min()) / np.ptp(outline[:, 1])
    lift = TOE_SPRING * smoothstep((forward - 0.70) / 0.30) ** 1.5
    rings = [
        _make_ring(outline * 1.0, lift, -0.004),
        _make_ring(outline, lift, 0.0),
        _make_ring(outline, lift, SOLE_HEIGHT),
    ]
    rings[0][:, :2] = outline - 0.004 * _outward(outline)
    rings[0][:, 2] = lift
    rings[1][:, 2] = lift + 0.004
    colours = [SOLE, SOLE, SOLE]
    welt = outline - 0.0035 * _outward(outline)
    rings.append(_make_ring(welt, lift, SOLE_HEIGHT))
    colours.append(LEATHER)
    reach = np.linalg.norm(top - welt, axis=1)
    front = smoothstep((forward - 0.55) / 0.40)
    # Each profile is a cubic Bezier curve that leaves the welt upwards and reaches the ankle from outside.
    rise = 0.034 + 0.006 * front
    slope = np.minimum(0.55 * reach, 0.085)
    for t in UPPER:
        a, b, c, d = (1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t * t * (1 - t), t**3
        inward = (welt - top) / np.maximum(reach, 1e-9)[:, None]
        position = (a + b) * welt + c * (top + inward * slope[:, None]) + d * top
        base = SOLE_HEIGHT + lift
        handle = TOP_HEIGHT - 0.040 + 0.004 * front
        height = a * base + b * (base + rise) + c * handle + d * TOP_HEIGHT
        rings.append(np.stack([position[:, 0], position[:, 1], height], axis=1))
        colours.append(LEATHER)
    rings.append(
        np.stack([*(middle + (top - middle) * 0.6).T, np.full(SEGMENTS, TOP_HEIGHT - 0.004)], axis=1)
    )
    colours.append(LEATHER)
    rings = [np.concatenate([ring, ring[:1]]) for ring in rings]  # the picture has a seam there
    stacked = np.concatenate(rings)
    along = np.concatenate(
        [[0], np.cumsum([np.linalg.norm(b - a, axis=1).mean() for a, b in pairwise(rings)])]
    )
    share = np.arange(SEGMENTS + 1) / SEGMENTS
    places = np.stack([np.tile(share, len(rings)), np.repeat(along / along[-1], SEGMENTS + 1)], axis=1)
    places = np.concatenate([places * 0.98 + 0.01, [[0.5, 0.0]]])
    length = np.ptp(outline[:, 1])
    marks = np.stack([
        stacked[:, 0] - np.interp(stacked[:, 1], *_spine(outline)),
        (stacked[:, 1] - outline[:, 1].min()) / length, stacked[:, 2],
    ], axis=1)  # fmt: skip
    marks = np.concatenate([marks, [[0.0, 0.5, 0.0]]])
    vertices = (
        origin + stacked[:, :1] * side_axis + stacked[:, 1:2] * toe_axis + stacked[:, 2:] * (0.0, 1.0, 0.0)
    )
    vertex_colours = np.repeat(np.array(colours), SEGMENTS + 1, axis=0)
    triangles = tube(len(rings), SEGMENTS + 1)[:, ::-1]
    triangles = triangles[np.ptp(triangles % (SEGMENTS + 1), axis=1) < SEGMENTS]
    # The bottom is a fan around the middle of the lowest ring.
    bottom = len(vertices)
    centre = vertices[:SEGMENTS].mean(axis=0) * (1, 0, 1)
    vertices = np.concatenate([vertices, centre[None]])
    vertex_colours = np.concatenate([vertex_colours, SOLE[None]])
    k = np.arange(SEGMENTS)
    fan = np.stack([np.full(SEGMENTS, bottom), k + 1, k], axis=1)
    triangles = np.concatenate([triangles, fan])
    inside = (outward_components(vertices, triangles) < 0).mean() > 0.5
    triangles = triangles[:, ::-1] if inside else triangles
    gloss = np.where(vertex_colours[:, :1] < 0.1, 0.30, 0.10)
    return vertices, triangles, np.concatenate([np.ones_like(vertex_colours), gloss], axis=1), places, marks


def _paint(marks: Float64, triangles: Int64, places: Float64) -> bytes:
    """Return the picture of a shoe: sole, leather with caps, seams and eyelets, tongue and laces."""
    uvs = (places * (1, -1) + (0, 1))[triangles]
    chart = make_chart(marks, np.zeros((len(marks), 0)), triangles, uvs, PICTURE)
    side, forward, height = chart.positions_at[chart.known].T
    away = np.abs(side)
    above = height - SOLE_HEIGHT - TOE_SPRING * smoothstep((forward - 0.70) / 0.30) ** 1.5

    def line(distance: Float64, half: float) -> Float64:
        return np.exp(-((distance / half) ** 2))

    colour = np.tile(LEATHER, (len(side), 1))
    for part, tone in (
        (smoothstep((forward - 0.80 + 25 * side**2) / 0.006), 1.35),
        (smoothstep((0.20 - forward) / 0.006), 1.35),
        (smoothstep((0.011 - above) / 0.001), 0.8),
    ):  # fmt: skip
        colour *= (1 + (tone - 1) * part)[:, None]
    placket = np.abs(away - 0.021 - 0.012 * (0.72 - forward))
    laced = (forward > 0.36) & (forward < 0.715) & (above > 0.02)
    seams = np.min([
        np.abs(forward - 0.80 + 25 * side**2) * 0.27, np.abs(forward - 0.20) * 0.27,
        np.where(laced | (forward < 0.72), placket, 1.0), np.abs(above - 0.011),
    ], axis=0)  # fmt: skip
    colour *= (1 - 0.5 * line(seams, 0.0009) + 0.5 * line(seams - 0.0028, 0.0008))[:, None]
    tongue = laced & (away < 0.021 + 0.012 * (0.72 - forward))
    colour[tongue] = LEATHER * 0.75
    step = (forward - 0.36) / 0.355 * LACES
    slant = step + 0.35 * side / 0.03 * np.where(np.floor(step) % 2 == 0, 1, -1) * 0.4
    lace = laced & (away < 0.030)
    across = np.abs(slant - np.floor(slant) - 0.5) * 0.355 / LACES * 0.27
    share = (smoothstep((0.0034 - across) / 0.0008) * lace)[:, None]
    colour = colour * (1 - share) + LACE * (0.75 + 0.25 * line(across, 0.002)[:, None]) * share
    shadow = line(across - 0.0046, 0.0012) * lace
    colour *= (1 - 0.5 * shadow)[:, None]
    grooves = line(np.abs(above + 0.006), 0.0010) + line(np.abs(above + 0.0125), 0.0008)
    sole = SOLE * (1 - 0.45 * np.minimum(grooves, 1))[:, None]
    sole = np.where((above < -0.0125)[:, None], SOLE * 0.55, sole)
    colour = np.where((above < 0.0002)[:, None], sole, colour)
    image = np.zeros((PICTURE, PICTURE, 3)) + LEATHER
    image[chart.known] = colour
    image[np.arange(PICTURE) < 0.012 * PICTURE] = SOLE * 0.5
    return encode_linear(image, 88)


def outward_components(vertices: Float64, triangles: Int64) -> Float64:
    """Return (V,) component of each normal away from the middle of a mesh; positive if it points outwards."""
    normals = vertex_normals(vertices, triangles)
    return (normals * (vertices - vertices.mean(axis=0))).sum(axis=1)


def _direction(sole_vertices: Float64) -> tuple[Float64, Float64]:
    """Return a level unit vector along the foot to the toes, and the middle of the foot on the ground."""
    flat = sole_vertices[:, [0, 2]] - sole_vertices[:, [0, 2]].mean(axis=0)
    _, _, axes = np.linalg.svd(flat, full_matrices=False)
    toe_axis = np.array([axes[0, 0], 0.0, axes[0, 1]])
    toe_axis *= np.sign(toe_axis[2])
    middle = sole_vertices.mean(axis=0) * (1, 0, 1)
    return toe_axis, middle


def _outline(flat: Float64) -> Float64:
    """Return the outline of the sole (SEGMENTS, 2) around points (N, 2), evenly spaced, counter-clockwise."""
    from scipy.spatial import ConvexHull

    hull = flat[ConvexHull(flat).vertices]
    closed = np.concatenate([hull, hull[:1]])
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(closed, axis=0), axis=1))])
    fine = np.linspace(0, along[-1], 400, endpoint=False)
    positions = np.stack([np.interp(fine, along, closed[:, k]) for k in (0, 1)], axis=1)
    # A shoe is narrower in the middle, and rounder than toes are.
    forward = (positions[:, 1] - positions[:, 1].min()) / np.ptp(positions[:, 1])
    middle = np.interp(positions[:, 1], *_spine(positions))
    waist = 1 - 0.10 * np.exp(-(((forward - 0.42) / 0.16) ** 2))
    positions[:, 0] = middle + (positions[:, 0] - middle) * waist
    positions = positions + CLEARANCE * _outward(positions)
    for _ in range(60):
        positions = 0.5 * positions + 0.25 * (np.roll(positions, 1, axis=0) + np.roll(positions, -1, axis=0))
    steps = np.linalg.norm(np.diff(positions, axis=0, append=positions[:1]), axis=1)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    closed = np.concatenate([positions, positions[:1]])
    even = np.linspace(0, along[-1], SEGMENTS, endpoint=False)
    return np.stack([np.interp(even, along, closed[:, k]) for k in (0, 1)], axis=1)


def _spine(positions: Float64) -> tuple[Float64, Float64]:
    """Return positions along the foot, and the middle of its width at each."""
    levels = np.linspace(positions[:, 1].min(), positions[:, 1].max(), 12)
    middles = []
    for level in levels:
        near = positions[np.abs(positions[:, 1] - level) < 0.02, 0]
        middles.append((near.min() + near.max()) / 2)
    return levels, np.array(middles)


def _outward(outline: Float64) -> Float64:
    """Return (N, 2) unit normals of a closed outline, pointing outwards."""
    tangent = np.roll(outline, -1, axis=0) - np.roll(outline, 1, axis=0)
    normal = np.stack([tangent[:, 1], -tangent[:, 0]], axis=1)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    sign = np.sign((normal * (outline - outline.mean(axis=0))).sum())
    return normal * sign


def _make_ring(outline: Float64, lift: Float64, height: float) -> Float64:
    return np.stack([outline[:, 0], outline[:, 1], lift + height], axis=1)


def _nearest_weights(positions: Float64, foot: Float64, weights: Float64) -> Float64:
    """Return (N, J) weights averaged over the nearest vertices of the foot."""
    from scipy.spatial import cKDTree

    distance, rows = cKDTree(foot).query(positions, k=12)
    share = 1 / (distance + 0.01) ** 2
    share /= share.sum(axis=1, keepdims=True)
    return np.einsum("nk,nkj->nj", share, weights[rows])

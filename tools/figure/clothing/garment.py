"""A plain shirt over the figure's shoulders, a base for the head as of a bust."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fba.arrays import Float64, Int64
from fba.mesh import vertex_normals
from fba.sampling import smoothstep
from tools.figure import figure
from tools.figure.cutting import Cloth
from tools.figure.meshes import average_with_neighbours, open_edges, tube
from tools.figure.subdivide import refine

COLOUR = np.array([0.052, 0.088, 0.125])
"""Linear light."""
AXIS = -0.088
THICK = 0.0038
AROUND = 84
BAND = ((0.004, -0.003), (0.0, 0.0012), (-0.0012, 0.0036), (0.0008, 0.0068), (0.006, 0.0090),
        (0.0115, 0.0090), (0.0130, 0.0040))  # fmt: skip
"""The collar's profile: below the neckline, out of the skin; metres."""
LOWEST = -0.38
WIDEST = 0.245
BUST = (0.205, 0.185, -0.165, 2.6)
"""Edge of the cloth, as of a sculptor's bust: half its width, depth of its lowest point below the height that
follows (all metres), and the exponent of the curve between."""
ON_EDGE, CORE, OVERLAP = 0.03, -0.11, 0.002
"""Tolerance of that edge; z at which both halves of the underside meet, and by how much they overlap (m)."""
ARCH = -0.24
"""Greatest height at which they meet: at the sides they hang from the arch over the shoulder (m)."""


def neckline(positions: Float64) -> Float64:
    """Return (N,) height of the neckline in the direction of points (N, 3), metres, in the head's frame."""
    turn = np.arctan2(np.abs(positions[:, 0]), positions[:, 2] - AXIS)
    from scipy.interpolate import PchipInterpolator

    degrees = np.array([-75, -40, 0, 40, 75, 110, 180, 250])
    heights = np.array([-0.150, -0.172, -0.183, -0.172, -0.150, -0.136, -0.131, -0.136])
    return PchipInterpolator(degrees, heights)(np.degrees(turn))


def make_shirt(origin: Float64) -> tuple[Float64, Int64, Float64]:
    """Return vertices (V, 3), triangles (F, 3) and colours (V, 4) of the shirt.

    origin: (3,) of the head, in the frame of `figure.head`.
    """
    surface, _ = figure.load()
    surface = replace(surface, vertices=surface.vertices - (0.0, figure.EYE_LEVEL, 0.0) - origin)
    middle = surface.vertices[surface.quads].mean(axis=1)
    trunk = (middle[:, 1] > LOWEST) & (np.abs(middle[:, 0]) < WIDEST) & (surface.tile != 1)
    skin = surface.vertices[np.unique(surface.quads[trunk])]
    torso = _refine_near_neck(surface.select(trunk & (middle[:, 1] < neckline(middle) + 0.004)))
    triangles = torso.quads[:, :3]
    outward = vertex_normals(torso.vertices, triangles).astype(np.float64)
    for _ in range(6):  # cloth does not follow every hollow
        outward = average_with_neighbours(outward, torso.edges)
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    rim = np.unique(open_edges(torso.quads[:, :3]))
    top = rim[torso.vertices[rim, 1] > -0.21]
    vertices = torso.vertices.copy()
    rim_positions = _evenly_around_neck(torso, top)
    vertices[top] = _on_skin(rim_positions, neckline(rim_positions) - 0.006, skin)
    turn = np.arctan2(vertices[top, 0], vertices[top, 2] - AXIS)
    outward[top] = np.stack([np.sin(turn), np.full(len(top), 0.25), np.cos(turn)], axis=1)
    for _ in range(4):  # the rows below follow
        eased = average_with_neighbours(vertices, torso.edges)
        near = smoothstep(1 - (neckline(vertices) - vertices[:, 1]) / 0.05)[:, None]
        near[top] = 0
        vertices = vertices + (eased - vertices) * near * 0.6
    hang = np.clip((-0.19 - vertices[:, 1]) / 0.12, 0, 1)[:, None]
    vertices = vertices + outward * (THICK + 0.004 * hang)
    fallen = vertices.copy()
    for _ in range(5):
        smoothed = average_with_neighbours(fallen, torso.edges)
        fallen = np.where(hang > 0, fallen * (1 - 0.7 * hang) + smoothed * 0.7 * hang, fallen)
    cloth = Cloth(fallen, outward, np.zeros((len(fallen), 0)), np.zeros((len(fallen), 0)), triangles)
    cloth = cloth.cut_above(_within_bust(fallen))
    collar, band = _collar(skin, len(cloth.vertices))
    below, closing = _close_below(cloth, len(cloth.vertices) + len(collar))
    vertices = np.concatenate([cloth.vertices, collar, below])
    colours = np.tile([*COLOUR, 0.06], (len(vertices), 1))
    colours[len(cloth.vertices) :, :3] *= 0.82
    return vertices, np.concatenate([cloth.triangles, band, closing]), colours


def _within_bust(positions: Float64) -> Float64:
    """Return (N,) for points (N, 3): positive within the edge of the bust's cloth, 0 on it."""
    wide, deep, height, power = BUST
    down = np.maximum(height - positions[:, 1], 0.0) / deep
    return 1 - ((np.abs(positions[:, 0]) / wide) ** power + down**power) ** (1 / power)


def _close_below(cloth: Cloth, start: int) -> tuple[Float64, Int64]:
    """Return vertices and triangles that close the bust below, between the edges of front and back.

    start: number of its first vertex. The edge's vertices are duplicated, so that it stays sharp.
    """
    sides = cloth.border
    sides = sides[(_within_bust(cloth.vertices)[sides] < ON_EDGE).all(axis=1)]
    edge, sides = np.unique(sides, return_inverse=True)
    sides = sides.reshape(-1, 2)
    positions = cloth.vertices[edge]
    beyond = np.where(positions[:, 2] > CORE, CORE - OVERLAP, CORE + OVERLAP)
    core = np.stack([positions[:, 0], np.minimum(positions[:, 1], ARCH), beyond], axis=1)
    a, b = start + sides[:, 0], start + sides[:, 1]
    rows = len(edge)
    triangles = [np.stack([b, a, a + rows], axis=1), np.stack([b, a + rows, b + rows], axis=1)]
    return np.concatenate([positions, core]), np.concatenate(triangles)


def _collar(skin: Float64, start: int) -> tuple[Float64, Int64]:
    """Return vertices and triangles of a ribbed band along the neckline; start: its first vertex."""
    from scipy.ndimage import gaussian_filter1d

    turn = np.linspace(0, 2 * np.pi, AROUND, endpoint=False)
    ring = np.stack([np.sin(turn), np.zeros(AROUND), np.cos(turn)], axis=1)
    rows = []
    for down, out in BAND:
        around = ring + np.array([0.0, 0.0, AXIS])
        rim = _on_skin(around, neckline(around) - down, skin)
        away = np.hypot(rim[:, 0], rim[:, 2] - AXIS)
        tight = np.maximum(gaussian_filter1d(away, 4.0, mode="wrap"), away - 0.0015)  # no lumps
        tight = gaussian_filter1d(tight, 1.5, mode="wrap") + out
        rows.append(np.stack([ring[:, 0] * tight, rim[:, 1] + out * 0.25, AXIS + ring[:, 2] * tight], axis=1))
    return np.concatenate(rows), start + tube(len(BAND), AROUND)


def _evenly_around_neck(torso: figure.Surface, top: Int64) -> Float64:
    """Return (N, 3) positions of the collar's vertices, evenly spaced about the neck, in the edge's order.

    The edge climbs in steps along the quads; a collar is even.
    """
    edges = open_edges(torso.quads[:, :3])
    after = dict(edges[np.isin(edges, top).all(axis=1)].tolist())
    chain = [int(top[torso.vertices[top, 2].argmax()])]
    while after[chain[-1]] != chain[0]:
        chain.append(after[chain[-1]])
    positions = torso.vertices[chain]
    turn = np.unwrap(np.arctan2(positions[:, 0], positions[:, 2] - AXIS))
    steps = np.diff(turn, append=turn[0] + np.sign(turn[-1] - turn[0]) * 2 * np.pi)
    for _ in range(30):
        steps = (steps + np.roll(steps, 1) + np.roll(steps, -1)) / 3
    even = turn[0] + np.concatenate([[0.0], np.cumsum(steps)[:-1]])
    away = np.hypot(positions[:, 0], positions[:, 2] - AXIS)
    moved = np.stack([away * np.sin(even), positions[:, 1], AXIS + away * np.cos(even)], axis=1)
    row = {vertex: k for k, vertex in enumerate(chain)}
    return moved[[row[int(vertex)] for vertex in top]]


def _on_skin(positions: Float64, height: Float64, skin: Float64) -> Float64:
    """Return (N, 3) points of the neck's skin at heights (N,), in the directions of points (N, 3)."""
    from scipy.interpolate import LinearNDInterpolator

    def around(points: Float64) -> Float64:
        return np.arctan2(points[:, 0], points[:, 2] - AXIS)

    neck = skin[(skin[:, 1] > -0.24) & (np.hypot(skin[:, 0], skin[:, 2] - AXIS) < 0.13)]
    chart = np.stack([around(neck), neck[:, 1]], axis=1)
    chart = np.concatenate([chart + np.array([turn, 0]) for turn in (-2 * np.pi, 0, 2 * np.pi)])
    away = np.tile(np.hypot(neck[:, 0], neck[:, 2] - AXIS), 3)
    turn = around(positions)
    radius = LinearNDInterpolator(chart, away)(turn, height)
    radius = np.where(np.isfinite(radius), radius, np.hypot(positions[:, 0], positions[:, 2] - AXIS))
    return np.stack([radius * np.sin(turn), height, AXIS + radius * np.cos(turn)], axis=1)


def _refine_near_neck(surface: figure.Surface) -> figure.Surface:
    """Return the surface with quads near the neck cut into four."""
    middle = surface.vertices[surface.quads].mean(axis=1)
    refined = refine(surface, middle[:, 1] > neckline(middle) - 0.016)
    # Triangles as quads with a doubled corner.
    quads = np.concatenate([refined.triangles, refined.triangles[:, 2:]], axis=1)
    return figure.Surface(refined.vertices, quads, quads * 0, refined.uvs)

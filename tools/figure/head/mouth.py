"""Teeth with their gums, and the tongue."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from fba.arrays import Float64, Integer
from tools.figure.meshes import Mesh, join, mirror, tube

ENAMEL = np.array([0.78, 0.68, 0.55])
"""Linear light."""
NECK = np.array([0.66, 0.54, 0.37])
EDGE = np.array([0.71, 0.635, 0.53])
"""The edge of a crown, through which the dark behind it is seen."""
CANINE = np.array([1.0, 0.97, 0.93])
"""Factors of the colour of canines, which are yellower."""
UNDER_LIP = (0.28, 0.32, 0.34)
"""Shares by which a crown is darker at its neck than at its edge."""
UNEVEN = 0.05
"""Share by which teeth are darker or brighter than each other."""
GUM = np.array([0.60, 0.20, 0.165])
TONGUE = np.array([0.58, 0.155, 0.135])
WET = np.array([0.85, 0.42, 0.38])
"""Where a tongue mirrors the light of the opening."""
TONGUE_UNDER = np.array([0.46, 0.120, 0.110])
HALF_WIDTH, DEPTH = 0.0285, 0.0420
"""Half axes of the outer edge of the upper arch of teeth, half an oval, metres."""
UPPER_POWER, LOWER_POWER = 2.55, 2.1
"""How square the arches are, 2 for an ellipse: teeth lie close behind the lips up to their corners."""
LOWER_INSET = 0.0008
"""Metres by which the lower arch is smaller: the incisors' edges touch."""
SINKING = np.array([0.0, 0.1, 0.5, 1.3, 2.4, 3.8, 5.4]) / 1000
"""Metres by which the edge of each lower tooth is deeper than that of the first: the lip hides them."""
SUNK_GUM = 0.4
"""Share of that by which their gum is deeper: so low a crown is short, too."""
RISING = np.array([0.0, 0.55, 0.1, 0.5, 0.9, 1.3, 1.8]) / 1000
"""Metres by which the edge of each upper tooth is higher than that of the first: a line that bends as the
lower lip does, with lateral incisors above it."""
CORNERS = (0.5, 0.9)
"""Millimetres by which an edge is rounded off at its corners, towards the midline and away from it."""
CONVEX = 0.09
"""By how much of its width the outer face of a crown recedes towards its sides."""
TURNS = np.radians([0, 30, 60, 90, 120, 150, 180, 225, 270, 315])
"""Places of the vertices around a crown, denser in front: behind, hardly anything is seen."""
AROUND = len(TURNS)
WALLED, ABOVE_EDGE = 5, 0.0006
"""How many crowns of each side have a wall within, and how far that is from their edges, metres."""
WALL_COLOUR = np.array([0.56, 0.47, 0.36])


def teeth(front: Float64, *, upper: bool) -> tuple[Mesh, dict[str, int]]:
    """Return the mesh of a row of teeth and its gum, with colours (V, 4), and vertices of feature points.

    front: (3,), point at which the edges of the middle incisors meet those of the other jaw.
    """
    sign = 1.0 if upper else -1.0
    meshes: list[Mesh] = []
    with (Path(__file__).parents[1] / "data" / "teeth.csv").open(encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["jaw"] == ("upper" if upper else "lower")]
    along = 0.00006
    for row in rows:
        width, height, thick = (float(row[name]) / 1000 for name in ("width", "height", "thick"))
        place, turn = _arch(along + width / 2, sign)
        number = int(row["place"]) - 1
        height -= RISING[number] if upper else (1 - SUNK_GUM) * SINKING[number]
        tooth = _tooth(width, height, thick, float(row["flat"]), int(row["place"]), sign)
        place[1] += RISING[number] if upper else -SINKING[number]
        placed = _place_tooth(tooth, place, turn)
        meshes += [(mesh[0] + front, *mesh[1:]) for mesh in (placed, mirror(placed))]
        along += width + 0.00008
    # Of all lowest vertices of the first incisor the one nearest to the midline and the front.
    vertices = meshes[0][0]
    lowest = np.abs(vertices[:, 1] - front[1]) < 0.0004
    score = np.where(lowest, vertices[:, 2] - 2 * np.abs(vertices[:, 0]), -1.0)
    points = {"edge": int(score.argmax())}
    gum = _gum(front, sign, rows)
    start = sum(len(mesh[0]) for mesh in meshes)
    meshes += [gum, _wall(front, sign, rows)]
    middle = np.flatnonzero(np.abs(gum[0][:, 0]) < 1e-9)
    high = middle[(gum[0][middle, 1] * sign).argmax()]
    points["root"] = start + int(high)
    return join(meshes), points


def _arch(length: float, sign: float) -> tuple[Float64, float]:
    """Return position (3,) from the front, and turn about y, at a length along the arch from its middle.

    sign: 1 for the upper arch, -1 for the lower.
    """
    inset = 0.0 if sign > 0 else LOWER_INSET
    angle = np.linspace(0, np.pi / 2, 400)
    power = UPPER_POWER if sign > 0 else LOWER_POWER
    far = (np.sin(angle) ** power + np.cos(angle) ** power) ** (-1 / power)
    x, z = (HALF_WIDTH - inset) * np.sin(angle) * far, -DEPTH * (1 - np.cos(angle) * far) - inset
    run = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), np.diff(z)))])
    beyond = max(length - run[-1], 0.0)
    px, pz = np.interp(length, run, x), np.interp(length, run, z) - beyond
    turns = np.arctan2(-np.gradient(z), np.gradient(x))
    turns[0] = 0.0
    return np.array([px, 0.0, pz]), float(np.interp(length, run, turns))


def _tooth(width: float, height: float, thick: float, flat: float, place: int, sign: float) -> Mesh:
    """Return the mesh of a crown: outer face at z = 0, edge at y = 0, gum towards sign x y."""
    cx, cz = _rounded_square(TURNS, 2.8)
    rows = np.array([0.0, 0.09, 0.34, 0.75, 1.12])  # edge to below the gum
    # Narrow at the neck, widest near the edge; the edge of a front tooth is thin. Neighbours meet within each
    # other, so that however few triangles are left, there is no gap.
    wide = np.interp(rows, [0, 0.05, 0.25, 0.7, 1.12], [0.95, 1.01, 1.03, 1.00, 0.88])
    deep = np.interp(rows, [0, 0.05, 0.3, 0.8, 1.12], [flat * 0.80, flat, 0.35 + 0.6 * flat, 0.92, 1.0])
    bulge = np.interp(rows, [0, 0.3, 0.8, 1.12], [0.0, 0.00050, 0.00075, -0.0002])
    vertices = np.zeros((len(rows), AROUND, 3))
    vertices[..., 0] = cx * width / 2 * wide[:, None]
    vertices[..., 1] = rows[:, None] * height * sign
    vertices[..., 2] = (cz - 1) * thick / 2 * deep[:, None] + bulge[:, None]
    vertices[..., 2] -= CONVEX * width * cx**2 * (cz > -0.1)
    if place == 3:  # a canine has a point
        vertices[0, :, 1] += sign * 0.0011 * np.abs(cx)
        vertices[1, :, 1] += sign * 0.0007 * np.abs(cx)
    corner = np.where(cx > 0, CORNERS[1], CORNERS[0]) / 1000 * np.abs(cx) ** 5
    corner *= (min(width / 0.0085, 1.0) if place < 3 else 0.5) * (1.0 if sign > 0 else 0.4)
    vertices[:2, :, 1] += corner * sign * np.array([[1.0], [0.75]])
    cap = vertices[0].mean(axis=0) * np.array([1, 0, 1]) + np.array(
        [0, sign * (0.0 if flat < 0.5 else 0.0006), 0]
    )
    flat_vertices = np.concatenate([vertices.reshape(-1, 3), cap[None]])
    triangles = tube(len(rows), AROUND)
    triangles = triangles if sign > 0 else triangles[:, ::-1]
    last = len(flat_vertices) - 1
    ring = np.arange(AROUND)
    lid = np.stack([np.full(AROUND, last), ring, np.roll(ring, -1)], axis=1)
    lid = lid[:, ::-1] if sign < 0 else lid
    share = np.clip(rows / 1.0, 0, 1) ** 2
    # Teeth further back lie in the shade of the cheeks, whose light is red, and recede into the dark.
    shaded = (0.90, 0.855, 0.82) if sign > 0 else (0.87, 0.81, 0.77)
    behind = np.array(shaded) ** (max(place - 1.4, 0) ** 1.15)
    behind *= 1 + UNEVEN * np.random.default_rng(place).uniform(-1, 1)
    # Less light falls in under the lips.
    colour = (ENAMEL * (1 - share[:, None]) + NECK * share[:, None]) * behind
    colour *= 1 - np.array(UNDER_LIP) * np.clip(rows[:, None], 0, 1)
    if place < 3:
        colour[:2] *= EDGE / ENAMEL * [[1.0], [1.06]]
    elif place == 3:
        colour *= CANINE
    fissure = 1.0 if flat < 0.5 else 0.72
    colours = np.concatenate([np.repeat(colour, AROUND, axis=0), colour[:1] * fissure])
    # Between the teeth it is darker: a thin line.
    side = np.concatenate([np.tile(np.abs(cx) ** 10, len(rows)), [0.0]])
    colours = colours * (1 - side[:, None] * (0.24, 0.31, 0.35))
    return flat_vertices, np.concatenate([triangles, lid]), np.c_[colours, np.full(len(colours), 0.75)]


def _rounded_square(turn: Float64, power: float) -> tuple[Float64, Float64]:
    """Return x and y (N,), at angles (N,), of a circle bulging towards a square; power: 2 for a circle."""
    cos, sin = np.cos(turn), np.sin(turn)
    return np.sign(cos) * np.abs(cos) ** (2 / power), np.sign(sin) * np.abs(sin) ** (2 / power)


def _place_tooth(tooth: Mesh, place: Float64, turn: float) -> Mesh:
    """Return a tooth of the left side turned about y and moved to its place on the arch."""
    vertices, triangles, colours = tooth
    cos, sin = np.cos(turn), np.sin(turn)
    x = vertices[:, 0] * cos + vertices[:, 2] * sin
    z = -vertices[:, 0] * sin + vertices[:, 2] * cos
    return np.stack([x, vertices[:, 1], z], axis=1) + place, triangles, colours


def _gum(front: Float64, sign: float, rows: list[dict[str, str]]) -> Mesh:
    """Return the mesh of the gum: a band along the arch, scalloped round the necks of the teeth."""
    widths, heights, ends = _row(rows)
    half = np.linspace(0, ends[-1] - 0.0005, 32)
    low = np.zeros(len(half))
    for k, length in enumerate(half):
        tooth = min(int(np.searchsorted(ends, length, side="right")) - 1, len(widths) - 1)
        across = (length - ends[tooth]) / widths[tooth] * 2 - 1
        low[k] = heights[tooth] * (0.97 - (0.22 if tooth < 3 else 0.08) * np.abs(across) ** 2.5)
    middles = (ends[:-1] + ends[1:]) / 2
    sunk = np.interp(half, middles, SINKING * SUNK_GUM) if sign < 0 else np.zeros(len(half))
    positions = [_arch(length, sign) for length in half]
    # Out of the arch (mm), above the scallop (mm): the lower gum stays within the lip's inner side.
    under = ((0.7, 5.5), (-2.0, 9.5)) if sign > 0 else ((-1.2, 4.5), (-5.0, 9.5))
    profile = [(-2.0, -0.4), (0.15, -0.25), (0.75, 0.35), (1.05, 1.6), *under, (-8.8, -0.4)]
    band = np.zeros((len(profile), len(half), 3))
    for k, (place, turn) in enumerate(positions):
        outward = np.array([np.sin(turn), 0.0, np.cos(turn)])
        for row, (out, up) in enumerate(profile):
            reach = out / 1000 if out > -4 else out / 1000 * (1 + 0.15 * k / len(half))
            away = low[k] + up / 1000 + sunk[k] * (1 - up / 9.5)
            band[row, k] = place + outward * reach + np.array([0, sign * away, 0])
    band, triangles = _sheet(band, sign)
    columns = band.shape[1]
    shade = 1 - 0.40 * np.abs(np.linspace(-1, 1, columns)) ** 1.5
    colours = np.tile(GUM, (len(profile), columns, 1)) * shade[None, :, None]
    colours[4:] *= np.linspace(0.95, 0.60, len(profile) - 4)[:, None, None]
    flat = np.concatenate([colours, np.full((*colours.shape[:2], 1), 0.6)], axis=2)
    return band.reshape(-1, 3) + front, triangles, flat.reshape(-1, 4)


def _wall(front: Float64, sign: float, rows: list[dict[str, str]]) -> Mesh:
    """Return a strip within the front crowns, of their colour: coarse levels of detail show no gaps."""
    _, heights, ends = _row(rows)
    middles = (ends[:-1] + ends[1:]) / 2
    band = np.zeros((2, 2 * WALLED + 1, 3))
    for k, length in enumerate(np.sort(np.r_[ends[: WALLED + 1], middles[:WALLED]])):
        place, turn = _arch(length, sign)
        low = ABOVE_EDGE + np.interp(length, middles, RISING if sign > 0 else SINKING)
        for row, (back, away) in enumerate(
            ((0.0010, low), (0.0016, 0.75 * np.interp(length, middles, heights)))
        ):
            band[row, k] = place - back * np.array([np.sin(turn), 0.0, np.cos(turn)]) + (0, sign * away, 0)
    band, triangles = _sheet(band, sign)
    return band.reshape(-1, 3) + front, triangles, np.tile([*WALL_COLOUR, 0.6], (band.shape[1] * 2, 1))


def _row(rows: list[dict[str, str]]) -> tuple[Float64, Float64, Float64]:
    """Return widths and heights (N,) of the teeth of a side, and where they end along the arch (N + 1,)."""
    widths, heights = (np.array([float(row[name]) for row in rows]) / 1000 for name in ("width", "height"))
    return widths, heights, np.concatenate([[0.0], np.cumsum(widths + 0.00008)])


def _sheet(band: Float64, sign: float) -> tuple[Float64, Integer]:
    """Return rows of points (R, C, 3) of the left side with those of the right, and their triangles."""
    band = np.concatenate([band[:, :0:-1] * (-1.0, 1.0, 1.0), band], axis=1)
    grid = np.arange(band.shape[0] * band.shape[1]).reshape(band.shape[:2])
    a, b, c, d = grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]
    triangles = np.stack([np.stack([a, b, c], -1), np.stack([a, c, d], -1)]).reshape(-1, 3)
    return band, triangles if sign > 0 else triangles[:, ::-1].copy()


def tongue(tip: Float64) -> tuple[Mesh, dict[str, int]]:
    """Return the mesh of a tongue lying flat, and vertices of its feature points. tip: (3,), at the teeth."""
    # Down the tongue from its root to its tip, mm: z, top, half width, height.
    spine = np.array([
        (-65, -34, 15, 24), (-61.5, -14, 16, 25), (-56, -3.4, 16.5, 24), (-48, 2.2, 16.8, 22.5),
        (-38, 3.6, 16.8, 20.3), (-28, 3.0, 16.4, 16.7), (-19, 1.7, 15.2, 12.0), (-10.5, 0.9, 12.6, 7.9),
        (-4.4, 0.6, 9.3, 5.0), (-1.6, 0.45, 6.6, 3.6), (-0.4, 0.25, 4.0, 2.2),
    ])  # fmt: skip
    from scipy.interpolate import PchipInterpolator

    rings, around = 27, 24
    t = np.linspace(0, 1, rings)
    knots = np.linspace(0, 1, len(spine))
    z, top, half, tall = PchipInterpolator(knots, spine / 1000)(t).T
    turn = np.r_[np.linspace(0, np.pi, 16, endpoint=False), np.linspace(np.pi, 2 * np.pi, 8, endpoint=False)]
    cx, cy = _rounded_square(turn, 2.2)
    vertices = np.zeros((rings, around, 3))
    vertices[..., 0] = half[:, None] * cx
    vertices[..., 1] = top[:, None] + tall[:, None] * (cy - 1) / 2
    groove = (
        0.0009 * np.exp(-((vertices[..., 0] / 0.0028) ** 2)) * (cy > 0.3) * np.clip((t[:, None]) * 3, 0, 1)
    )
    vertices[..., 1] -= groove * np.clip((1 - t[:, None]) * 6, 0, 1)
    vertices[..., 2] = z[:, None]
    flat = np.concatenate([vertices.reshape(-1, 3), [[0, top[0] - tall[0] / 2, z[0]]], [[0, 0.0, 0.0]]])
    triangles = tube(rings, around)[:, ::-1]
    ring = np.arange(around)
    root, point = rings * around, rings * around + 1
    after = np.roll(ring, -1)
    last = (rings - 1) * around
    caps = [
        np.stack([np.full(around, root), after, ring], axis=1),
        np.stack([np.full(around, point), last + ring, last + after], axis=1),
    ]
    under = np.clip(0.5 - cy, 0, 1)[None, :, None]
    colours = TONGUE * (1 - under) + TONGUE_UNDER * under
    # Darker, and redder, towards the throat; pale papillae on its back, and a dark groove along its middle.
    colours = colours * (0.36 + 0.64 * t[:, None, None] ** (1.0, 1.3, 1.4))
    middle = np.exp(-((cx / 0.16) ** 2)) * (cy > 0.3)
    colours = colours * (1 - 0.30 * (middle * np.clip((1 - t[:, None]) * 8, 0, 1)))[..., None]
    # Beside the groove it is round, and wet.
    wet = np.exp(-(((np.abs(cx) - 0.45) / 0.22) ** 2)) * (cy > 0.3) * 0.3 * np.sin(np.pi * t[:, None]) ** 2
    colours = colours + wet[..., None] * (WET - colours)
    random = np.random.default_rng(5)
    colours = colours * (1 + 0.22 * (random.random((rings, around, 1)) - 0.5))
    flat_colours = np.concatenate([colours.reshape(-1, 3), [TONGUE * 0.2], [TONGUE]])
    body = int(np.abs(t - 0.568).argmin())
    upward, opposite = 8, 16
    side = int(np.abs(t - 0.64).argmin()) * around
    points = {"6.1": point, "6.2": body * around + upward, "6.3": side, "6.4": side + opposite}
    mesh = (flat + tip, np.concatenate([triangles, *caps]), np.c_[flat_colours, np.full(len(flat), 0.45)])
    return mesh, points

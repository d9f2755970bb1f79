"""The skin's texture: complexion, lips, brows and cropped hair, painted by position on the head.

`scalp` and `brow` return the density of hair at each point.
"""

from __future__ import annotations

import csv
import io
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFilter
from scipy.interpolate import PchipInterpolator

from fba.arrays import Bool, Float64, Integer
from fba.sampling import smoothstep

SIZE = 2048

# sRGB, 0..255
SKIN = np.array([217, 168, 142.0])
BLUSH = np.array([214, 138, 118.0])
SOCKET = np.array([186, 128, 112.0])
WATERLINE = np.array([203, 138, 126.0])
CARUNCLE = np.array([222, 148, 138.0])
LIP = np.array([184, 104, 96.0])
LIP_LINE = np.array([132, 62, 58.0])
MOUTH = np.array([96, 34, 34.0])
NECK = np.array([206, 158, 131.0])
HAIR = np.array([52, 38, 30.0])
SCALP = np.array([112, 86, 73.0])
AXIS = -0.085
"""z of the vertical axis around which the angles of the hairline are measured."""
CROWN = np.array([0.004, 0.104, -0.118])
HAIR_WIDTH = 0.00023
"""Metres."""
THICKNESS = 0.0035
BROW = np.array([
    # along the left brow: x, y, extent downwards and upwards (mm)
    (12.5, 14.5, 3.4, 3.2), (18, 17.6, 4.0, 3.6), (26, 20.8, 3.9, 3.4), (35, 23.0, 3.2, 3.0),
    (44, 22.6, 2.4, 2.4), (52, 19.0, 1.6, 1.7), (59, 13.6, 0.7, 0.8),
]) / 1000  # fmt: skip


@dataclass(frozen=True, eq=False)
class Chart:
    """The surface at every texel.

    positions_at: (S, S, 3) positions, metres. values_at: (S, S, K). known: (S, S) mask of covered texels.
    """

    positions_at: Float64
    values_at: Float64
    known: Bool


def make_chart(
    vertices: Float64, values: Float64, triangles: Integer, uvs: Float64, size: int = SIZE
) -> Chart:
    """Return the chart of triangles (F, 3) with uvs (F, 3, 2) at their corners, origin at the bottom left."""
    data = np.concatenate([vertices, values], axis=1)
    sampled = np.zeros((size, size, data.shape[1]))
    known = np.zeros((size, size), dtype=bool)
    corners = np.stack([uvs[..., 0] * size - 0.5, (1 - uvs[..., 1]) * size - 0.5], axis=-1)
    for triangle, corner in zip(triangles, corners, strict=True):
        low = np.maximum(np.floor(corner.min(axis=0) - 1).astype(int), 0)
        high = np.minimum(np.ceil(corner.max(axis=0) + 2).astype(int), size)
        if (high <= low).any():
            continue
        x, y = np.meshgrid(np.arange(low[0], high[0]), np.arange(low[1], high[1]))
        a, b, c = corner
        area = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])
        if abs(area) < 1e-12:
            continue
        wb = ((x - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (y - a[1])) / area
        wc = ((b[0] - a[0]) * (y - a[1]) - (x - a[0]) * (b[1] - a[1])) / area
        wa = 1 - wb - wc
        tolerance = -0.6 / max(np.sqrt(abs(area)), 1e-6)  # half a texel beyond the edge, to hide seams
        inside = (wa >= tolerance) & (wb >= tolerance) & (wc >= tolerance)
        weights = np.stack([wa, wb, wc], axis=-1)[inside]
        sampled[y[inside], x[inside]] = weights @ data[triangle]
        known[y[inside], x[inside]] = True
    return Chart(sampled[..., :3], sampled[..., 3:], known)


def scalp(positions: Float64, edge_width: float = 0.004) -> Float64:
    """Return (N,) density of hair at points (N, 3): 0 on the face, 1 on the scalp.

    edge_width: metres over which the hair thins out at its edge.
    """
    with (Path(__file__).parent / "hairline.csv").open(encoding="utf-8") as file:
        line = np.array([[float(row["degrees"]), float(row["y"]) / 1000] for row in csv.DictReader(file)])
    around = np.degrees(np.arctan2(np.abs(positions[:, 0]), positions[:, 2] - AXIS))
    height = PchipInterpolator(line[:, 0], line[:, 1])
    slope = height.derivative()(around) * 180 / np.pi / 0.08
    above = (positions[:, 1] - height(around)) / np.sqrt(1 + slope**2)
    ear = (np.abs(positions[:, 0]) > 0.0765) & (positions[:, 1] < 0.006)
    ear &= (positions[:, 2] > -0.122) & (positions[:, 2] < -0.100)
    return np.where(ear, 0.0, smoothstep(above / edge_width + 0.5))


def brow(positions: Float64) -> tuple[Float64, Float64]:
    """Return (N,) positions along the brow, 0 (inner end) to 1 (outer end), and (N,) density of hair."""
    x = np.abs(positions[:, 0])
    middle, low, high = (np.interp(x, BROW[:, 0], BROW[:, column]) for column in (1, 2, 3))
    offset = positions[:, 1] - middle
    reach = np.where(offset < 0, low, high)
    across = 1 - smoothstep((np.abs(offset) / reach - 0.35) / 0.75)
    along = (x - BROW[0, 0]) / (BROW[-1, 0] - BROW[0, 0])
    ends = smoothstep((along + 0.03) / 0.14) * (1 - smoothstep((along - 0.90) / 0.12))
    front = positions[:, 2] > -0.03
    return along, np.where(front, across * ends, 0.0)


def noise(positions: Float64, scale: float, seed: int) -> Float64:
    """Return (N,) smooth noise in -1..1 at points (N, 3); scale: size of its grains, metres."""
    from scipy.ndimage import map_coordinates

    lattice = np.random.default_rng(seed).uniform(-1, 1, (48, 48, 48))
    return map_coordinates(lattice, (positions / scale).T, order=1, mode="grid-wrap")


def paint(chart: Chart) -> Image.Image:
    """Return the texture of a chart. Its values: rings around mouth and eyes, and the sign of the lip."""
    p = chart.positions_at[chart.known]
    ring_mouth, ring_eye, lip_side = (chart.values_at[chart.known][:, k] for k in range(3))
    colour = _complexion(p)
    colour = _eyes(colour, p, ring_eye)
    colour = _mouth(colour, p, ring_mouth, lip_side)
    hair = scalp(p, 0.011)
    speckle = 0.5 + 0.5 * noise(p, 0.0009, 31)
    cover = smoothstep(hair * 1.25 - 0.55 * speckle * (1 - hair))
    scalp_share = 0.72 * cover[:, None]
    colour = colour * (1 - scalp_share) + SCALP * scalp_share
    brow_share = 0.30 * brow(p)[1][:, None]
    colour = colour * (1 - brow_share) + HAIR * brow_share
    image = np.zeros((*chart.known.shape, 3))
    image[chart.known] = colour
    image = _fill_unknown(image, chart.known)
    picture = Image.fromarray(np.clip(image, 0, 255).astype(np.uint8))
    _strokes(picture, chart)
    filled = _fill_unknown(np.asarray(picture, dtype=np.float64), chart.known)
    return Image.fromarray(filled.astype(np.uint8))


def encode_jpeg(picture: Image.Image, quality: int = 88) -> bytes:
    """Return the picture as a JPEG file."""
    buffer = io.BytesIO()
    picture.save(buffer, "JPEG", quality=quality, optimize=True, subsampling=0)
    return buffer.getvalue()


def _blend(colour: Float64, other: Float64, share: Float64) -> Float64:
    return colour + (other - colour) * np.clip(share, 0, 1)[:, None]


def _spot(p: Float64, centre: tuple[float, float, float], radius: float) -> Float64:
    """Return (N,) weights of a spot on each side of the face, 1 in its middle, 0 at its edge; in mm."""
    folded = np.stack([np.abs(p[:, 0]), p[:, 1], p[:, 2]], axis=1) * 1000
    return 1 - smoothstep(np.linalg.norm(folded - centre, axis=1) / radius)


def _complexion(p: Float64) -> Float64:
    colour = np.tile(SKIN, (len(p), 1))
    colour = _blend(colour, NECK, smoothstep((-0.095 - p[:, 1]) / 0.05) * 0.9)
    broad = 0.75 + 0.5 * noise(p, 0.011, 1)
    for centre, radius, share in (
        ((40, -40, -4), 40, 0.55), ((0, -38, 33), 24, 0.45), ((14, -40, 14), 14, 0.35),
        ((0, -104, 6), 26, 0.25),
        ((84, -15, -98), 44, 0.5), ((0, 40, 12), 40, 0.10),
    ):  # fmt: skip
        colour = _blend(colour, BLUSH, _spot(p, centre, radius) * share * broad)
    colour += np.array([5, 3.2, 2.4]) * (noise(p, 0.018, 2) * 0.8 + noise(p, 0.007, 3) * 0.7)[:, None]
    red = noise(p, 0.0042, 4)[:, None] * np.array([1.5, -2.4, -2.6])
    fine = noise(p, 0.0011, 5)[:, None] * np.array([2.6, 2.6, 2.4])
    pores = np.clip(noise(p, 0.00065, 6) - 0.45, 0, 1)[:, None]
    nose = np.clip(_spot(p, (6, -34, 24), 26) + _spot(p, (28, -34, 6), 26) * 0.7, 0, 1)[:, None]
    colour += red + fine - pores * (6 + 26 * nose) * np.array([0.8, 1.0, 1.0])
    freckle = smoothstep((noise(p, 0.0021, 7) - 0.62) / 0.2) * smoothstep((noise(p, 0.010, 8) + 0.2) / 0.8)
    return _blend(colour, np.array([178, 118, 92.0]), freckle * 0.30 * _spot(p, (24, -26, 8), 42))


def _eyes(colour: Float64, p: Float64, ring: Float64) -> Float64:
    x, y = np.abs(p[:, 0]) * 1000, p[:, 1] * 1000
    near = ring < 90
    upper = _spot(p, (31, 8, 1), 17) * (y > -1)
    lower = _spot(p, (26, -10, 0), 15) * (y <= -1)
    inner = _spot(p, (17, 1, 2), 13)
    colour = _blend(colour, SOCKET, upper * 0.42 + lower * 0.30 + inner * 0.25)
    lid = near & (ring < 5.0)
    colour = _blend(colour, WATERLINE, np.where(lid, smoothstep((4.2 - ring) / 2.4) * 0.75, 0))
    # The roots of the lashes form a line along the outer edge of the lid margin.
    line = np.where(near & (y > -3), np.exp(-(((ring - 3.2) / 0.75) ** 2)) * 0.78, 0.0)
    line = np.where(near & (y <= -3), np.exp(-(((ring - 3.1) / 0.6) ** 2)) * 0.26, line)
    line *= smoothstep((x - 19.0) / 5.0) * (1 - 0.85 * smoothstep((x - 37.5) / 4.0))
    colour = _blend(colour, HAIR, line)
    caruncle = near & (ring < 1.6) & (x < 24)
    return np.where(caruncle[:, None], CARUNCLE + noise(p, 0.001, 9)[:, None] * 10, colour)


def _mouth(colour: Float64, p: Float64, ring: Float64, side: Float64) -> Float64:
    near = ring < 90
    corner = smoothstep((np.abs(p[:, 0]) - 0.015) / 0.012)
    border = np.where(side > 0, 5.0, 5.1) - 1.9 * corner  # the red of the lips is narrower in the corners
    red = np.where(near, smoothstep((border + 0.55 - ring) / 1.0), 0.0)
    lines = noise(p * (1.0, 0.12, 0.12), 0.00065, 11) * 0.6 + noise(p * (1.0, 0.25, 0.25), 0.0016, 12) * 0.4
    lip = LIP + lines[:, None] * np.array([9, 9, 8.0]) + (side > 0)[:, None] * np.array([-8, -7, -6.0])
    colour = _blend(colour, lip, red * 0.88)
    seam = np.where(near, smoothstep((2.1 - ring) / 1.2), 0.0)
    colour = _blend(colour, LIP_LINE, seam * 0.8)
    inside = np.where(near, smoothstep((0.6 - ring) / 1.2), 0.0)
    colour = _blend(colour, MOUTH, inside)
    # A light edge above the upper lip.
    edge = np.where(near & (side > 0), np.exp(-(((ring - border - 0.9) / 0.5) ** 2)), 0.0) * (1 - corner)
    return _blend(colour, SKIN + 12, edge * 0.35)


def _fill_unknown(image: Float64, known: Bool) -> Float64:
    """Return the image with the nearest colour on texels outside all triangles, so that seams do not show."""
    from scipy.ndimage import distance_transform_edt

    _, (row, column) = distance_transform_edt(~known, return_indices=True)
    return image[row, column]


def _strokes(picture: Image.Image, chart: Chart) -> None:
    """Draw single hairs onto the picture: cropped ones on the scalp, longer ones in the brows."""
    random = np.random.default_rng(17)
    step_x = np.gradient(chart.positions_at, axis=1)
    step_y = np.gradient(chart.positions_at, axis=0)
    area = np.linalg.norm(np.cross(step_x, step_y), axis=2)
    solid = chart.known & (area < 1e-6) & (area > 1e-12)
    rows, columns = np.nonzero(solid)
    p = chart.positions_at[rows, columns]
    hair = scalp(p, 0.012)
    weight = area[rows, columns] * np.clip(hair * 1.15 - 0.1, 0, 1)
    chosen = random.choice(len(p), 130000, p=weight / weight.sum())
    away = p[chosen] - CROWN
    whorl = np.cross(away, (0.0, 1.0, 0.0)) * 0.35
    direction = _unit(away + whorl + random.normal(0, 0.018, away.shape)) * random.uniform(
        0.002, 0.0045, (len(chosen), 1)
    )
    other, back = _across_the_seam(p, chosen, direction)
    layers = [(np.concatenate([chosen, other]), np.concatenate([direction, back]), 0.66)]
    along, density = brow(p)
    weight = area[rows, columns] * density**1.2
    chosen = random.choice(len(p), 2600, p=weight / weight.sum())
    layers.append((chosen, _brow_hairs(p[chosen], along[chosen], random), 0.80))
    for chosen, direction, strength in layers:
        mask = Image.new("L", (SIZE * 2, SIZE * 2), 0)
        draw = ImageDraw.Draw(mask)
        roots = np.stack([columns[chosen], rows[chosen]], axis=1).astype(np.float64)
        move = _in_texels(
            step_x[rows[chosen], columns[chosen]], step_y[rows[chosen], columns[chosen]], direction
        )
        good = np.abs(move).max(axis=1) < 60
        # Where texels are small, a hair is wide in texels.
        wide = np.clip(np.round(2 * HAIR_WIDTH / np.sqrt(area[rows[chosen], columns[chosen]])), 1, 8)
        for (x0, y0), (dx, dy), width in zip(roots[good] * 2, move[good] * 2, wide[good], strict=True):
            draw.line((x0 - dx / 2, y0 - dy / 2, x0 + dx / 2, y0 + dy / 2), fill=255, width=int(width))
        blurred = mask.resize((SIZE, SIZE), Image.Resampling.BOX).filter(ImageFilter.GaussianBlur(0.5))
        faded = blurred.point(lambda value, s=strength: int(value * s))
        picture.paste(Image.new("RGB", picture.size, tuple(int(c) for c in HAIR)), (0, 0), faded)


def _across_the_seam(p: Float64, chosen: Integer, direction: Float64) -> tuple[Integer, Float64]:
    """Return texels (M,) and directions (M, 3) of the hairs that cross the middle of the back of the head.

    There the texture has its seam, so that such a hair is drawn on both of its sides: at each end anew.
    """
    from scipy.spatial import cKDTree

    root = p[chosen]
    found = []
    for side in (1, -1):
        tip = root + direction * (0.5 * side)
        crosses = np.flatnonzero((root[:, 0] * tip[:, 0] < 0) & (root[:, 2] < AXIS))
        for sign in (1, -1):
            there = np.flatnonzero((p[:, 0] * sign > 0) & (np.abs(p[:, 0]) < 0.006) & (p[:, 2] < AXIS))
            of = crosses[tip[crosses, 0] * sign > 0]
            _, nearest = cKDTree(p[there]).query(tip[of])
            found.append((there[nearest], direction[of]))
    texels, directions = zip(*found, strict=True)
    return np.concatenate(texels), np.concatenate(directions)


def _brow_hairs(p: Float64, along: Float64, random: np.random.Generator) -> Float64:
    """Return (N, 3) hairs of the brow, metres: upwards at its inner end, then outwards, last downwards."""
    angle = np.interp(along, [0.0, 0.2, 0.6, 1.0], [78.0, 42.0, 12.0, -24.0]) + random.normal(0, 9, len(p))
    middle = np.interp(np.abs(p[:, 0]), [0.012, 0.035, 0.06], [0.0148, 0.0232, 0.0135])
    angle = np.radians(angle - np.clip((p[:, 1] - middle) / 0.003, -1, 1) * 22)
    sampled = np.stack([np.cos(angle) * np.sign(p[:, 0]), np.sin(angle), np.zeros(len(p))], axis=1)
    return sampled * random.uniform(0.0035, 0.0062, (len(p), 1))


def _in_texels(step_x: Float64, step_y: Float64, direction: Float64) -> Float64:
    """Return (N, 2) directions in texels of directions (N, 3) on the surface."""
    xx, yy, xy = ((a * b).sum(axis=1) for a, b in ((step_x, step_x), (step_y, step_y), (step_x, step_y)))
    dx, dy = ((step * direction).sum(axis=1) for step in (step_x, step_y))
    det = np.maximum(xx * yy - xy**2, 1e-24)
    return np.stack([(yy * dx - xy * dy) / det, (xx * dy - xy * dx) / det], axis=1)


def _unit(vectors: Float64) -> Float64:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-12)

"""The skin's texture: complexion, lips, brows and hair, painted by position on the head without hair."""

from __future__ import annotations

import io
from dataclasses import dataclass

import numpy as np
from PIL import Image, ImageDraw, ImageFilter
from scipy.interpolate import PchipInterpolator
from scipy.spatial import cKDTree

from fba.arrays import Bool, Float64, Integer
from fba.sampling import smoothstep
from tools.figure.head.hair import TONES, noise, paint_locks, painted_height
from tools.figure.looks import ALEX, Looks

SIZE = 2048

MOUTH, BEARD = np.array([186, 94, 88.0]), np.array([146, 120, 118.0])
"""sRGB, 0..255."""
MAX_STEP = 0.003
"""Metres: farther apart than this, texels are on both sides of a seam."""
HAIR_WIDTH = 0.00016
"""Metres."""
BROW_STROKES = ((1900, 0.0), (800, 0.25))
"""Of both brows: how many hairs, and how far their colour is towards that of the skin."""
UNFOLDED = 3.2
"""How many times as high the skin of a closed upper lid is as that of an open one."""
SPARSEST = 0.03
"""Density of a brow below which no hair grows."""
TAPER = ((1.0, 110), (0.7, 190), (0.4, 255))
"""Shares of a brow's hair from its root, and how opaque they are, 0..255: it ends in a point."""
BROW = np.array([
    # along the left brow: x, y, extent downwards and upwards (mm)
    (12.5, 14.4, 2.1, 1.5), (18, 17.0, 3.3, 2.7), (26, 20.2, 3.9, 3.4), (35, 22.1, 3.5, 3.2),
    (44, 21.8, 2.7, 2.6), (52, 18.5, 1.9, 1.9), (59, 13.6, 0.9, 0.9),
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


def brow(positions: Float64, height: float = 1.0) -> tuple[Float64, Float64]:
    """Return (N,) positions along the brow, 0 (inner end) to 1 (outer end), and (N,) density of hair.

    height: of the brows, relative to `BROW`.
    """
    x = np.abs(positions[:, 0])
    middle, low, high = (np.interp(x, BROW[:, 0], BROW[:, column]) for column in (1, 2, 3))
    offset = positions[:, 1] - middle
    reach = np.where(offset < 0, low, high) * height
    across = 1 - smoothstep((np.abs(offset) / reach - 0.15) / 0.95)
    along = (x - BROW[0, 0]) / (BROW[-1, 0] - BROW[0, 0])
    ends = smoothstep((along + 0.06) / 0.52) * (1 - smoothstep((along - 0.68) / 0.34))
    front = positions[:, 2] > -0.03
    return along, np.where(front, across * ends, 0.0)


def paint(chart: Chart, looks: Looks) -> Image.Image:
    """Return the texture of a chart. Its values: rings around mouth and eyes, the sign of the lip, and three
    of the position with the layer of hair, metres."""
    p = chart.positions_at[chart.known]
    ring_mouth, ring_eye, lip_side = (chart.values_at[chart.known][:, k] for k in range(3))
    colour = _complexion(p, looks)
    colour = _lines(colour, p, looks)
    colour = _eyes(colour, p, ring_eye, looks)
    colour = _mouth(colour, p, ring_mouth, lip_side, looks)
    colour = _ears(colour, p)
    colour = _hair(colour, p, _grown_chart(chart, looks), looks)
    colour = _blend(colour, np.array(looks.brow), 0.26 * brow(p, looks.brow_height)[1])
    image = np.zeros((*chart.known.shape, 3))
    image[chart.known] = colour
    image = _fill_unknown(image, chart.known)
    picture = Image.fromarray(np.clip(image, 0, 255).astype(np.uint8))
    _strokes(picture, chart, looks)
    filled = _fill_unknown(np.asarray(picture, dtype=np.float64), chart.known)
    return Image.fromarray(filled.astype(np.uint8))


def _grown_chart(chart: Chart, looks: Looks) -> tuple[Float64, Float64]:
    """Return (N, 3) positions of known texels with hair, and (N, 3) metres from each to the texel below; 0 at
    seams."""
    grown = chart.values_at[..., 3:]
    step = np.gradient(grown, axis=0)[chart.known]
    near = np.linalg.norm(step, axis=1, keepdims=True) < MAX_STEP
    grown = grown[chart.known]
    if not looks.hair.curly:  # neither strands nor their parting run straight
        grown = grown + np.stack([0.004 * noise(grown, 0.045, 51 + k) for k in range(3)], axis=1)
    return grown, np.where(near, step, 0.0)


def _hair(colour: Float64, p: Float64, grown: tuple[Float64, Float64], looks: Looks) -> Float64:
    """Return the colour with the hair of the head: strands that thin out towards their tips.

    grown: as of `_grown_chart`. Strands lie straight on that: triangles of the skin are stretched by hair.
    """
    above = painted_height(p, looks.hair)
    near = above > -0.02
    above, hair = above[near], looks.hair
    tone, cover = paint_locks(grown[0][near], grown[1][near], above, hair)
    strands = np.stack([np.interp(tone, TONES, [c[k] for c in hair.colours]) for k in range(3)], axis=1)
    # Through sparse hair skin is seen, in the shade, which reaches beyond its edge above the ears.
    shade = 0.22 * smoothstep((above + 0.011) / 0.012) * smoothstep((p[near, 1] - 0.015) / 0.03)
    below = _blend(
        colour[near] * (1 - shade[:, None]), np.array(looks.scalp), smoothstep(above / 0.014) * 0.85
    )
    colour[near] = _blend(below, strands, cover)
    return colour


def encode_jpeg(picture: Image.Image, quality: int = 84) -> bytes:
    """Return the picture as a JPEG file."""
    buffer = io.BytesIO()
    picture.save(buffer, "JPEG", quality=quality, optimize=True, subsampling=0)
    return buffer.getvalue()


def encode_linear(light: Float64, quality: int = 88) -> bytes:
    """Return linear light (H, W) or (H, W, 3), 0..1, as a JPEG file."""
    light = np.clip(light, 0, 1)
    shown = np.where(light <= 0.0031308, light * 12.92, 1.055 * np.maximum(light, 1e-9) ** (1 / 2.4) - 0.055)
    return encode_jpeg(Image.fromarray(np.rint(shown * 255).astype(np.uint8)), quality)


def _blend(colour: Float64, other: Float64, share: Float64) -> Float64:
    return colour + (other - colour) * np.clip(share, 0, 1)[:, None]


def _spot(p: Float64, centre: tuple[float, float, float], radius: float) -> Float64:
    """Return (N,) weights of a spot on each side of the face, 1 in its middle, 0 at its edge; in mm."""
    folded = np.stack([np.abs(p[:, 0]), p[:, 1], p[:, 2]], axis=1) * 1000
    return 1 - smoothstep(np.linalg.norm(folded - centre, axis=1) / radius)


def _complexion(p: Float64, looks: Looks) -> Float64:
    colour = np.tile(looks.skin, (len(p), 1))
    colour = _blend(colour, np.array(looks.neck), smoothstep((-0.095 - p[:, 1]) / 0.05) * 0.9)
    broad = 0.85 + 0.3 * noise(p, 0.011, 1)
    for centre, radius, share in (
        ((40, -37, -4), 48, 0.50), ((0, -38, 33), 22, 0.60), ((14, -40, 14), 14, 0.50),
        ((0, -104, 6), 26, 0.30), ((24, -66, 8), 16, 0.20),
        ((84, -15, -98), 36, 0.40), ((0, 40, 12), 40, 0.10),
    ):  # fmt: skip
        colour = _blend(colour, np.array(looks.blush), _spot(p, centre, radius) * share * broad)
    colour += np.array([3.4, 2.8, 2.4]) * (noise(p, 0.018, 2) * 0.9 + noise(p, 0.007, 3) * 0.9)[:, None]
    colour = _blend(colour, BEARD, looks.beard * _beard(p))
    red = (noise(p, 0.0042, 4) + 0.8 * noise(p, 0.010, 14))[:, None] * np.array([1.8, -4.8, -4.8])
    fine = noise(p, 0.0011, 5)[:, None] * np.array([5.0, 5.0, 4.8])
    pores = np.clip(noise(p, 0.00065, 6) - 0.30, 0, 0.4)[:, None]
    nose = np.clip(_spot(p, (6, -34, 24), 26) + _spot(p, (28, -34, 6), 26) * 0.7, 0, 1)[:, None]
    colour += (
        red * np.array(looks.skin) / ALEX.skin + fine - pores * (17 + 17 * nose) * np.array([0.8, 1.0, 1.0])
    )
    freckle = smoothstep((noise(p, 0.0021, 7) - 0.62) / 0.2) * smoothstep((noise(p, 0.010, 8) + 0.2) / 0.8)
    return _blend(colour, np.array(looks.freckle), freckle * 0.42 * _spot(p, (24, -26, 8), 42))


def _beard(p: Float64) -> Float64:
    """Return (N,) how much of a shaven beard shows: a shade of single hairs."""
    spots = (((0, -58, 20), 32), ((0, -100, 6), 58), ((36, -86, -8), 50), ((62, -62, -52), 52))
    grown = np.max([_spot(p, centre, radius) for centre, radius in spots], axis=0)
    return grown * (0.7 + 0.6 * np.clip(noise(p, 0.0007, 15), 0, 1) + 0.25 * noise(p, 0.006, 16))


LINES = (
    # points (x, y) of a line on the left, mm; its half width, mm; and its depth, 0..1
    (((16, -39), (23, -48), (29, -58), (33, -68)), 2.2, 0.75), (((29, -75), (31, -83), (30, -92)), 2.0, 0.45),
    (((47, 0), (53, 3), (60, 8)), 0.7, 0.50), (((48, -3), (55, -4), (61, -4)), 0.7, 0.50),
    (((46, -6), (52, -10), (57, -15)), 0.7, 0.45), (((19, -10), (26, -16), (36, -16), (42, -12)), 1.0, 0.45),
    (((-1, 34), (14, 36), (30, 40), (44, 36)), 0.9, 0.40),
    (((-1, 45), (14, 48), (30, 51), (42, 47)), 0.9, 0.45),
    (((-1, 56), (14, 58), (30, 60)), 0.8, 0.30), (((4, 10), (5, 17), (4.5, 25)), 0.8, 0.45),
    (((22, -60), (21, -57)), 0.6, 0.2), (((8, -60), (8, -57)), 0.5, 0.2),
    (((14, -61), (14.5, -58)), 0.5, 0.2),
)  # fmt: skip
"""Lines of an old skin."""


def _lines(colour: Float64, p: Float64, looks: Looks) -> Float64:
    """Return the colour with the lines of an old skin: shade within, light along their lower edges."""
    if not looks.lines:
        return colour
    # They wander, fade and return, each side its own way.
    x = np.abs(p[:, 0]) * 1000 + 1.1 * noise(p, 0.0055, 21) + 0.35 * noise(p, 0.0018, 22)
    y = p[:, 1] * 1000 + 1.1 * noise(p, 0.0055, 23) + 0.35 * noise(p, 0.0018, 24)
    front = smoothstep((p[:, 2] + 0.045) / 0.02) * (0.72 + 0.45 * noise(p, 0.0045, 25))
    for points, width, depth in LINES:
        path = _path(points)
        near = (np.abs(x - path[:, 0].mean()) < 40) & (np.abs(y - path[:, 1].mean()) < 40) & (front > 0)
        distance, row = cKDTree(path).query(np.stack([x[near], y[near]], axis=1))
        fade = np.sin(np.pi * np.clip(row / 59, 0.02, 0.98)) ** 0.6 * front[near] * depth * looks.lines
        below = np.sign(y[near] - path[row, 1])
        light = np.exp(-(((distance - 2 * width) / (1.2 * width)) ** 2)) * (below < 0)
        factor = 1 - 0.26 * fade * np.exp(-((distance / (1.25 * width)) ** 2)) + 0.07 * fade * light
        colour[near] *= factor[:, None]
    return colour


EARS = (
    # points (z, y) of a fold of the ear, mm; its half width, mm; and how much darker it is, 0..1
    (((-89, -1), (-96, -1), (-101, -6), (-102.5, -16), (-100, -25), (-96, -32)), 1.5, 0.46),  # scapha
    (((-88, -5), (-92, -5), (-96, -8)), 2.2, 0.29),  # triangular fossa
    (((-93, -2), (-97, -8), (-98.5, -15), (-96.5, -24), (-92, -30)), 1.3, -0.19),  # antihelix
    (((-86, -9), (-91, -9), (-96, -12)), 1.0, -0.11),  # its lower crus
    (((-88, -17), (-92, -20), (-91, -26), (-86, -29)), 4.0, 0.37),  # concha
    (((-83, -15), (-82, -20), (-83, -26)), 1.6, 0.46),  # behind the tragus
    (((-85, -30), (-87, -32)), 1.6, 0.25),  # below it
)
"""Folds of the left ear that the surface only hints at."""


def _ears(colour: Float64, p: Float64) -> Float64:
    """Return the colour with the folds of the ears; what is darker is redder."""
    x, y, z = np.abs(p[:, 0]), p[:, 1], p[:, 2]
    near = (x > 0.073) & (np.abs(y + 0.02) < 0.03) & (np.abs(z + 0.094) < 0.018)
    places, factor = 1000 * p[near][:, [2, 1]], np.ones((int(near.sum()), 3))
    for points, width, depth in EARS:
        distance, row = cKDTree(_path(points)).query(places)
        fade = np.sin(np.pi * np.clip((row + 5) / 69, 0, 1)) ** 0.5
        factor -= (depth * fade * np.exp(-((distance / width) ** 2)))[:, None] * (0.8, 1.05, 1.1)
    colour[near] *= factor
    return colour


def _path(points: tuple[tuple[float, float], ...]) -> Float64:
    """Return (60, 2) points along the smooth line through given ones."""
    knots = np.array(points, dtype=np.float64)
    run = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(knots, axis=0), axis=1))])
    return PchipInterpolator(run, knots)(np.linspace(0, run[-1], 60))


def _eyes(colour: Float64, p: Float64, ring: Float64, looks: Looks) -> Float64:
    x, y = np.abs(p[:, 0]) * 1000, p[:, 1] * 1000
    near = ring < 90
    upper = _spot(p, (31, 8, 1), 17) * (y > -1)
    lower = _spot(p, (26, -10, 0), 15) * (y <= -1)
    inner = _spot(p, (17, 1, 2), 13)
    colour = _blend(colour, np.array(looks.socket), upper * 0.42 + lower * 0.46 + inner * 0.25)
    margin = np.where(near, smoothstep((3.4 - ring) / 1.6), 0.0)
    colour = _blend(colour, np.array(looks.waterline), 0.45 * margin)
    # The lower lid ends in a fold.
    fold = np.where(near, np.exp(-(((ring - 7.0) / 1.3) ** 2)) * 0.35, 0.0) * smoothstep((-4 - y) / 5)
    colour = _blend(colour, np.array(looks.socket), fold * (1 - smoothstep((x - 34) / 8)))
    colour = _blend(colour, *_thin_lid(p, ring, looks))
    # The upper lid ends in a crease.
    crease = np.where(near & (y > -3), np.exp(-(((ring - 7.7) / 0.55) ** 2)), 0.0)
    crease *= smoothstep((x - 21.0) / 5.0) * (1 - smoothstep((x - 39.0) / 5.0))
    colour = _blend(colour, np.array(looks.socket) * 0.80, 0.28 * crease)
    # The roots of the lashes form a line along the outer edge of the lid margin.
    line = np.where(near & (y > -3), np.exp(-(((ring - 3.2) / 0.75) ** 2)) * 0.55, 0.0)
    line = np.where(near & (y <= -3), np.exp(-(((ring - 3.1) / 0.6) ** 2)) * 0.20, line)
    line *= smoothstep((x - 22.5) / 5.0) * (1 - 0.85 * smoothstep((x - 37.5) / 4.0))
    colour = _blend(colour, np.array(ALEX.brow), line)
    caruncle = np.where(near, smoothstep((2.3 - ring) / 1.6), 0.0) * (1 - smoothstep((x - 21.5) / 2.5))
    return _blend(colour, np.array(looks.caruncle) + noise(p, 0.001, 9)[:, None] * 10, caruncle)


def _thin_lid(p: Float64, ring: Float64, looks: Looks) -> tuple[Float64, Float64]:
    """Return (N, 3) colours of the thin skin of the upper lids, and (N,) how far it has them.

    Closed, that skin is some `UNFOLDED` times as high as in its folds, and its spots with it.
    """
    across = p * (1.0, UNFOLDED, UNFOLDED)
    x, y = np.abs(p[:, 0]) * 1000, p[:, 1] * 1000
    share = (
        smoothstep((ring - 2.8) / 1.2) * (1 - smoothstep((ring - 8.0) / 3.0)) * smoothstep((y + 1.5) / 3.5)
    )
    share *= smoothstep((x - 17.0) / 4.0) * (1 - smoothstep((x - 40.0) / 6.0))
    lid = 0.50 * np.array(looks.skin) + 0.28 * np.array(looks.waterline) + 0.22 * np.array(looks.socket)
    spots = 0.6 * noise(across, 0.0042, 31) + 0.4 * noise(across, 0.0022, 32)
    # Veins are thin lines where a noise changes its sign.
    wander = across + 0.0012 * np.stack([noise(across, 0.0022, 33 + k) for k in range(3)], axis=1)
    veins = np.exp(-((noise(wander, 0.0052, 36) / 0.055) ** 2)) * smoothstep(0.5 + noise(across, 0.006, 37))
    colours = lid + spots[:, None] * (2.0, -8.0, -7.0)
    return _blend(colours, lid * (0.84, 0.76, 0.86), 0.45 * veins), 0.9 * share


def _mouth(colour: Float64, p: Float64, ring: Float64, side: Float64, looks: Looks) -> Float64:
    near = ring < 90
    x, lower = np.abs(p[:, 0]), side < 0
    corner = smoothstep((x - 0.015) / 0.012)
    # The red of the lips is narrower in the corners; that of the lower lip is soft at its edge.
    border = np.where(lower, 4.7 - 0.8 * smoothstep((x - 0.007) / 0.020), 4.6 - 1.4 * corner)
    soft = np.where(lower, 2.6, 1.8)
    red = np.where(near, smoothstep((border + 0.45 * soft - ring) / soft), 0.0)
    lines = noise(p * (1.0, 0.12, 0.12), 0.00065, 11) * 0.6 + noise(p * (1.0, 0.25, 0.25), 0.0016, 12) * 0.4
    lines = np.where(lines < 0, 1.6 * lines, lines)  # creases
    lip = (
        np.array(looks.lip) + 6.0 * lines[:, None] + np.where(lower[:, None], [-20, -23, -19.0], [8, 0, 0.0])
    )
    # Below it is a shade, and its inner half is darker: flesh that bends in.
    below = np.where(near & lower, np.exp(-(((ring - border - 2.4) / 1.5) ** 2)), 0.0) * (1 - corner)
    colour = _blend(colour, np.array(looks.blush) * 0.86, below * 0.34)
    lip = _blend(lip, np.array(looks.lip_line), np.where(lower, 0.38 * smoothstep((3.6 - ring) / 2.8), 0.0))
    colour = _blend(colour, lip, red * 0.88)
    # The lower side of the upper lip is redder: it mirrors the lower one, not the grey studio.
    glow = np.where(lower, 0.0, 1 - smoothstep((ring - 1.6) / 1.8)) * red
    colour += glow[:, None] * (12.0, -6.0, -4.0)
    seam = np.where(near & lower, smoothstep((2.1 - ring) / 1.2), 0.0) * (1 - 0.6 * corner)
    colour = _blend(colour, np.array(looks.lip_line), seam * 0.45)
    # The corners lie in the shade of the cheeks.
    colour = _blend(colour, np.array(looks.lip), 0.30 * _spot(p, (26.2, -69.6, 4.6), 4.6) ** 1.5)
    inside = np.where(near, smoothstep((0.6 - ring) / 1.2), 0.0)
    colour = _blend(colour, MOUTH, inside)
    # A light edge above the upper lip.
    edge = np.where(near & (side > 0), np.exp(-(((ring - border - 0.9) / 0.5) ** 2)), 0.0) * (1 - corner)
    return _blend(colour, np.array(looks.skin) + 12, edge * 0.35)


def _fill_unknown(image: Float64, known: Bool) -> Float64:
    """Return the image with the nearest colour on texels outside all triangles, so that seams do not show."""
    from scipy.ndimage import distance_transform_edt

    _, (row, column) = distance_transform_edt(~known, return_indices=True)
    return image[row, column]


def _strokes(picture: Image.Image, chart: Chart, looks: Looks) -> None:
    """Draw the single hairs of the brows onto the picture."""
    random = np.random.default_rng(17)
    step_x = np.gradient(chart.positions_at, axis=1)
    step_y = np.gradient(chart.positions_at, axis=0)
    area = np.linalg.norm(np.cross(step_x, step_y), axis=2)
    solid = chart.known & (area < 1e-6) & (area > 1e-12)
    rows, columns = np.nonzero(solid)
    p = chart.positions_at[rows, columns]
    layers = []
    along, density = brow(p, looks.brow_height)
    weight = area[rows, columns] * np.where(density > SPARSEST, density, 0.0)
    for count, pale in BROW_STROKES:
        chosen = random.choice(len(p), count, p=weight / weight.sum())
        chosen = chosen[np.argsort(density[chosen])]  # hairs of the edges are fainter, and below the others
        colour = np.array(looks.brow) * (1 - pale) + np.array(looks.skin) * pale
        layers.append((chosen, _brow_hairs(p[chosen], along[chosen], random), colour))
    for chosen, direction, colour in layers:
        mask = Image.new("L", (SIZE * 2, SIZE * 2), 0)
        draw = ImageDraw.Draw(mask)
        roots = np.stack([columns[chosen], rows[chosen]], axis=1).astype(np.float64)
        move = _in_texels(
            step_x[rows[chosen], columns[chosen]], step_y[rows[chosen], columns[chosen]], direction
        )
        good = np.abs(move).max(axis=1) < 90
        # Where texels are small, a hair is wide in texels.
        wide = np.clip(np.round(2 * HAIR_WIDTH / np.sqrt(area[rows[chosen], columns[chosen]])), 1, 8)
        full = (0.25 + 0.75 * np.clip(1.5 * density[chosen], 0, 1)) * random.uniform(0.5, 1.0, len(chosen))
        hairs = zip(roots[good] * 2, move[good] * 2, wide[good], full[good], strict=True)
        for (x0, y0), (dx, dy), width, most in hairs:
            x, y = x0 - dx / 2, y0 - dy / 2
            for share, fill in TAPER:
                draw.line((x, y, x + dx * share, y + dy * share), fill=int(most * fill), width=int(width))
        blurred = mask.resize((SIZE, SIZE), Image.Resampling.BOX).filter(ImageFilter.GaussianBlur(0.5))
        picture.paste(Image.new("RGB", picture.size, tuple(int(c) for c in colour)), (0, 0), blurred)


def _brow_hairs(p: Float64, along: Float64, random: np.random.Generator) -> Float64:
    """Return (N, 3) hairs of the brow, metres: upwards at its inner end, then outwards, last downwards."""
    angle = np.interp(along, [0.0, 0.2, 0.6, 1.0], [64.0, 38.0, 12.0, -24.0])
    angle += random.normal(0, 1, len(p)) * np.interp(along, [0.0, 0.4], [20.0, 10.0])
    middle = np.interp(np.abs(p[:, 0]), [0.012, 0.035, 0.06], [0.0148, 0.0232, 0.0135])
    angle = np.radians(angle - np.clip((p[:, 1] - middle) / 0.003, -1, 1) * 22)
    sampled = np.stack([np.cos(angle) * np.sign(p[:, 0]), np.sin(angle), np.zeros(len(p))], axis=1)
    ends = np.interp(along, [0.0, 0.25, 0.7, 1.0], [0.55, 1.0, 1.0, 0.6])[:, None]
    return sampled * random.uniform(0.0040, 0.0072, (len(p), 1)) * ends


def _in_texels(step_x: Float64, step_y: Float64, direction: Float64) -> Float64:
    """Return (N, 2) directions in texels of directions (N, 3) on the surface."""
    xx, yy, xy = ((a * b).sum(axis=1) for a, b in ((step_x, step_x), (step_y, step_y), (step_x, step_y)))
    dx, dy = ((step * direction).sum(axis=1) for step in (step_x, step_y))
    det = np.maximum(xx * yy - xy**2, 1e-24)
    return np.stack([(yy * dx - xy * dy) / det, (xx * dy - xy * dx) / det], axis=1)


def _unit(vectors: Float64) -> Float64:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-12)

"""The layer of hair over the scalp: how thick it is, which way it is combed, and how strands vary."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import Image, ImageDraw
from scipy.interpolate import PchipInterpolator
from scipy.ndimage import gaussian_filter, map_coordinates
from scipy.spatial import cKDTree

from fba.arrays import Bool, Float64
from fba.rotations import unit
from fba.sampling import smoothstep
from tools.figure.looks import Hair

Complex128 = npt.NDArray[np.complex128]
MIDDLE = np.array([0.0, 0.012, -0.085])
"""Point of the skull from which hair stands away."""
TOP = (0.0, 0.95)
"""Slopes of the head, as the sine of the angle, between which the hair reaches the thickness of the top."""
CALM = (0.080, 0.098)
"""Heights of the skin between which locks cease to stand out, metres."""
PARTING = np.array([[0.040, 0.045, 0.008], [0.012, 0.106, -0.135]])
"""Ends of the parting, on the subject's left, from the forehead to the crown; all strands lead away from it,
metres. Before the hairline it is not seen, but strands at the hairline lead across, not all ways."""
PARTED, MIXED = 0.0009, 0.0020
"""Half the width of the parting, and how far from it strands of both sides cross, metres."""
TONES = (-0.85, -0.30, 0.35, 1.0)
"""How bright hair is where it has each of its colours."""
RADIUS = 0.1
"""Of the ball onto which places on the scalp are carried for their strands, metres."""
VOLUMES = (
    # a place on the left, and how far around it, metres
    ((0.0, 0.090, -0.025), (0.065, 0.040, 0.045)),
    ((0.0, 0.030, -0.185), (0.060, 0.045, 0.040)),
)  # fmt: skip
"""Where hair is thicker than elsewhere: above the forehead, behind."""
DEEPEST = -0.008
"""Least thickness: the skull is flatter at its corners than hair lets it look, metres."""
NEIGHBOURS, EVENED, EDGE = 80, 0.014, 0.014
"""Vertices, and metres around, over which the thickness is averaged; metres over which it begins."""
EARS = (0.0785, 0.0085)
"""Farther from the middle, and lower, than this (m) there are ears, which have no hair."""
AXIS = -0.085
"""z of the vertical axis around which the angles of the hairline are measured."""


LOCKS = (11000, 9000)
"""How many locks of straight and of curly hair are painted."""
RAGGED = (0.0012, 0.0024)
"""How far, metres, the painted hairline of straight and of curly hair wanders."""
THINNING = 0.012
"""Metres above the hairline over which hair becomes full."""
CROPPED = (
    # a place on the left, how far around it, metres; how much
    ((0.0, -0.050, -0.185), (0.085, 0.042, 0.075), 2.8),
    ((0.076, -0.020, -0.066), (0.020, 0.028, 0.018), 2.6),
    ((0.062, 0.036, -0.022), (0.018, 0.034, 0.022), 1.4),
)
"""Where hair is cropped ever shorter towards its edge: the nape, the sideburn, the temple."""
STRANDS, SEGMENTS = 16, 6
"""Of each lock, and straight pieces of each strand."""
WIDTH = 0.0004
"""Of a strand, metres."""
PROFILES = np.array([[-0.24, -0.08, 0.03, 0.08, 0.05, -0.02], [-0.42, 0.0, 0.25, 0.25, 0.0, -0.42]])
"""How much brighter a strand is from its root to its tip: of straight and of curly hair."""
DARKEST, BRIGHTEST = -1.4, 1.4
"""Tones at the ends of what a picture holds."""
DEEP = (-0.5, -0.62)
"""Tones between strands of straight and of curly hair."""
REACH, SCALE, SOFT = 3.25, 900, 2.0
"""Extent of `strand_places` away from the parting; pixels to a unit of them; pixels of blur."""
WITHIN = (-0.375, -0.125, 0.125, 0.375)
"""Shares of a texel at which strands are looked up: on top of the head they are thinner than a texel."""
SPARSER = 16
"""One of so many points is enough to tell where locks grow."""


@dataclass(frozen=True, eq=False)
class Locks:
    """Painted locks of hair, N of them, from the lowest to the topmost.

    roots: places as of `strand_places`. lengths, widths: metres. headings: radians between the lock's root
    and the line through it of `strand_places`; bends: from root to tip. tones: how bright. fullness: 0 where
    hair is short and sparse, 1 where it is full.
    """

    roots: Complex128
    lengths: Float64
    widths: Float64
    headings: Float64
    bends: Float64
    tones: Float64
    fullness: Float64


def grow(vertices: Float64, hair: Hair) -> Float64:
    """Return vertices (V, 3) of the skin with those of the scalp at the outside of the hair; symmetric."""
    folded = vertices * np.where(vertices[:, :1] < 0, (-1.0, 1.0, 1.0), (1.0, 1.0, 1.0))
    above = height_above_hairline(folded)
    towards = unit(folded - MIDDLE)
    full = hair.sides + hair.top * smoothstep((towards[:, 1] - TOP[0]) / (TOP[1] - TOP[0]))
    full = full + _roundness(folded, above > 0)
    for (place, reach), more in zip(VOLUMES, hair.volumes, strict=True):
        full = full + more * np.exp(-(((folded - place) / reach) ** 2).sum(axis=1))
    # Not on the crown, whose highest point is a feature point.
    lumps = hair.lumps * (1 - smoothstep((folded[:, 1] - CALM[0]) / (CALM[1] - CALM[0])))
    grains = folded if hair.curly else folded * (0.7, 0.35, 0.7)  # straight hair hangs in locks
    lumps = lumps * (noise(grains, 0.013, 41) + 0.6 * noise(grains, 0.006, 42))
    # Before the ears hair lies close to the head.
    ahead = smoothstep((folded[:, 2] + 0.135) / 0.05) * (1 - smoothstep((folded[:, 1] + 0.015) / 0.085))
    full = np.maximum(full * (1 - 0.8 * ahead), DEEPEST)
    # Hair of the temples and the nape grows thinner downwards.
    low = smoothstep((0.06 - folded[:, 1]) / 0.05)
    share = np.clip(above / (hair.rise * (1 + 2 * low)), 0.0, 1.0)
    share = share * (2 - share)
    thick = (_evened(vertices, above, full * share) + lumps * share) * smoothstep((above - 0.001) / EDGE)
    return vertices + unit(vertices - MIDDLE) * thick[:, None]


def _evened(vertices: Float64, above: Float64, thick: Float64) -> Float64:
    """Return thicknesses (V,) averaged with those around: on bumps and steep edges strands would look like
    the grain of wood, which is cut likewise. above: (V,), heights above the hairline."""
    free = np.flatnonzero(above > -0.5)  # not ears
    apart, near = cKDTree(vertices[free]).query(vertices, k=NEIGHBOURS)
    share = np.exp(-((apart / EVENED) ** 2)) + 1e-9
    return (share * thick[free][near]).sum(axis=1) / share.sum(axis=1)


def _roundness(vertices: Float64, scalp: Bool) -> Float64:
    """Return (V,) metres from vertices (V, 3) outwards to the smooth shape that fits those of the scalp best.

    The skull is flat on top and has corners; hair is cut so that the head looks round.
    """
    x, y, z = unit(vertices - MIDDLE).T
    radius = np.linalg.norm(vertices - MIDDLE, axis=1)
    terms = np.stack([np.ones_like(x), y, z, y * y, y * z, z * z], axis=1)
    best = np.linalg.lstsq(terms[scalp], radius[scalp], rcond=None)[0]
    return terms @ best - radius


def height_above_hairline(positions: Float64) -> Float64:
    """Return (N,) metres above the hairline of points (N, 3): positive on the scalp, -1 on ears."""
    with (Path(__file__).parents[1] / "data" / "hairline.csv").open(encoding="utf-8") as file:
        line = np.array([[float(row["degrees"]), float(row["y"]) / 1000] for row in csv.DictReader(file)])
    around = np.degrees(np.arctan2(np.abs(positions[:, 0]), positions[:, 2] - AXIS))
    height = PchipInterpolator(line[:, 0], line[:, 1])
    slope = height.derivative()(around) * 180 / np.pi / 0.08
    above = (positions[:, 1] - height(around)) / np.sqrt(1 + slope**2)
    ears = (np.abs(positions[:, 0]) > EARS[0]) & (positions[:, 1] < EARS[1])
    return np.where(ears, -1.0, above)


def painted_height(positions: Float64, hair: Hair) -> Float64:
    """Return (N,) heights above the hairline as hair is painted: less where it is cropped, and irregular.

    positions: (N, 3), of the skin.
    """
    ragged = RAGGED[int(hair.curly)] * (noise(positions, 0.011, 71) + 0.7 * noise(positions, 0.004, 72))
    above = height_above_hairline(positions)
    return np.where(above > -0.5, (above + ragged) / (1 + _cropped(positions)), above)


def _cropped(positions: Float64) -> Float64:
    """Return (N,) how far hair is cropped at points (N, 3): 0 where it is not."""
    folded = np.where(positions[:, :1] < 0, (-1.0, 1.0, 1.0), (1.0, 1.0, 1.0)) * positions
    near = [much * np.exp(-(((folded - at) / reach) ** 2).sum(axis=1)) for at, reach, much in CROPPED]
    return np.sum(near, axis=0)


def scalp(positions: Float64, edge_width: float = 0.004) -> Float64:
    """Return (N,) density of hair at points (N, 3): 0 on the face, 1 on the scalp.

    edge_width: metres over which the hair thins out at its edge.
    """
    return smoothstep(height_above_hairline(positions) / edge_width + 0.5)


def noise(positions: Float64, scale: float, seed: int) -> Float64:
    """Return (N,) noise in -1..1 at points (N, 3). scale: size of its grains, metres."""
    lattice = np.random.default_rng(seed).uniform(-1, 1, (48, 48, 48))
    return map_coordinates(lattice, (positions / scale).T, order=1, mode="grid-wrap")


def strand_places(p: Float64) -> Complex128:
    """Return (N,) where points (N, 3) of the scalp lie: how far along a strand, and, imaginary, on which.

    Strands leave the parting on both sides and at its ends: on a map of the head that keeps angles they are
    the hyperbolas whose foci are those ends. The imaginary part, an angle, is constant along each.
    """
    ahead, aside, middle, focus = _map_axes()
    q = unit(p - MIDDLE)
    flat = (q @ ahead + 1j * (q @ aside)) / np.maximum(1 + q @ middle, 1e-6)
    return np.arccosh(flat / focus)


def strand_points(places: Complex128) -> Float64:
    """Return (N, 3) directions from `MIDDLE` to places as of `strand_places`."""
    ahead, aside, middle, focus = _map_axes()
    flat = focus * np.cosh(places)
    square = np.abs(flat) ** 2
    q = 2 * flat.real[:, None] * ahead + 2 * flat.imag[:, None] * aside + (1 - square)[:, None] * middle
    return q / (1 + square)[:, None]


def _map_axes() -> tuple[Float64, Float64, Float64, float]:
    """Return three axes (3,) of the map of the head, and how far off its middle the parting ends."""
    front, back = (PARTING - MIDDLE) / np.linalg.norm(PARTING - MIDDLE, axis=1, keepdims=True)
    middle = (front + back) / np.linalg.norm(front + back)
    ahead = (front - back) / np.linalg.norm(front - back)
    return ahead, np.cross(middle, ahead), middle, float(front @ ahead / (1 + front @ middle))


def paint_locks(p: Float64, step: Float64, above: Float64, hair: Hair) -> tuple[Float64, Float64]:
    """Return (N,) how bright hair is at points (N, 3), about -1..1, and (N,) how much of them it covers.

    step: (N, 3), how far the texel of a point reaches along the least resolved direction. above: (N,),
    as of `painted_height`.
    """
    picture = _draw_locks(_sow_locks(p, above, hair), hair)
    drawn, cover = np.mean([_look_up(picture, p + share * step) for share in WITHIN], axis=0)
    # Between strands one sees deep into full hair, but the skin where it is sparse.
    gaps = (1 - cover) * smoothstep((above - 0.002) / THINNING)
    cover = cover + gaps
    # Single hairs at the edge are finer than a texel.
    thin = 0.55 + 0.45 * smoothstep(above / THINNING)
    tone = (drawn + gaps * DEEP[int(hair.curly)]) / np.maximum(cover, 0.02)
    if not hair.curly:
        parted, beside = _parting(p, above)
        cover = cover * (1 - parted)
        clump = _clumps(p)
        bright = shine(unit(p - MIDDLE)[:, 1] + 0.07 * tone + 0.07 * clump)
        tone = tone * (1 + 0.3 * bright) + 0.16 * clump + 0.30 * bright + beside
        tone = tone - 0.40 * smoothstep((-0.25 - clump) / 0.4)  # between clumps one sees into the shade
    return tone, np.where(above < -0.5, 0.0, cover * thin)


def _parting(p: Float64, above: Float64) -> tuple[Float64, Float64]:
    """Return (N,) how much of the scalp is seen at points (N, 3), and (N,) how much brighter hair is there.

    The parting ends softly at the hairline and on the crown. above: (N,), heights above the hairline.
    """
    places = strand_places(p)
    away = places.real * _metres(places)
    line = np.maximum(away + 0.0007 * noise(p, 0.004, 67), 0.0)
    crossed = 0.36 - 0.36 * noise(p, 0.006, 68)  # by strands of the other side
    ends = smoothstep((np.cos(places.imag) + 0.75) / 0.7) * smoothstep((above - 0.004) / 0.022)
    # Beside it hair rises out of the shade.
    risen = 0.10 * np.exp(-(((away - 0.015) / 0.009) ** 2)) - 0.12 * np.exp(-((away / 0.004) ** 2))
    return crossed * ends * np.exp(-((line / PARTED) ** 2)), ends * risen


def _clumps(p: Float64) -> Float64:
    """Return (N,), about -1..1, on which of the clumps that straight hair lies in points (N, 3) are."""
    places = strand_places(p)
    around = np.stack([np.cos(places.imag), np.sin(places.imag), 0.22 * places.real], axis=1)
    return 0.6 * noise(around, 0.085, 73) + 0.5 * noise(around, 0.036, 74)


def shine(rise: Float64) -> Float64:
    """Return (N,), 0..1, how far light from above glances off hair that lies `rise` up the head, -1..1.

    It does so from the outside of hairs, and, fainter and lower, from their far sides.
    """
    return np.exp(-(((rise - 0.80) / 0.075) ** 2)) + 0.5 * np.exp(-(((rise - 0.58) / 0.10) ** 2))


def _look_up(picture: tuple[Float64, Float64], p: Float64) -> tuple[Float64, Float64]:
    """Return (N,) what the two pictures of `_draw_locks` hold at points (N, 3)."""
    places = strand_places(p)
    # At the parting, where the pictures' edges meet, both sides are mixed.
    across = 0.5 * np.exp(-((places.real * _metres(places) / MIXED) ** 2))
    drawn, cover = np.zeros(len(p)), np.zeros(len(p))
    for share, along in ((1 - across, places.imag), (across, -places.imag)):
        at = np.stack([places.real, along + np.pi]) * SCALE
        drawn += share * map_coordinates(picture[0], at, order=1)
        cover += share * map_coordinates(picture[1], at, order=1)
    return drawn, cover


def _metres(places: Complex128) -> Float64:
    """Return (N,) how many metres of the head a unit of `strand_places` is, the same in all directions."""
    focus = _map_axes()[3]
    steep = np.maximum(np.abs(np.sinh(places)), 0.15)
    return 2 * RADIUS * focus * steep / (1 + np.abs(focus * np.cosh(places)) ** 2)


def _sow_locks(p: Float64, above: Float64, hair: Hair) -> Locks:
    """Return locks that are evenly spread over points (N, 3) of the scalp, fewer towards the hairline.

    above: (N,), heights above the hairline.
    """
    random, most = np.random.default_rng(61), LOCKS[int(hair.curly)]
    roots = random.uniform((0, -np.pi), (REACH, np.pi), (6 * most, 2)) @ (1, 1j)
    roots = roots[random.uniform(0, 0.11**2, len(roots)) < _metres(roots) ** 2]
    p, above = p[::SPARSER], above[::SPARSER]
    apart, nearest = cKDTree(unit(p - MIDDLE)).query(strand_points(roots))
    height = above[nearest]
    kept = (apart < 0.01) & (random.uniform(0, 1, len(roots)) < smoothstep((height + 0.003) / 0.012))
    roots, height, places = roots[kept][:most], height[kept][:most], p[nearest[kept][:most]]
    count = len(roots)
    long = smoothstep((unit(places - MIDDLE)[:, 1] - 0.1) / 0.7)
    full = smoothstep(height / THINNING)
    normal, uniform = random.normal, random.uniform
    tone = normal(0, 0.17, count) + 0.14 * noise(places, 0.016, 63)
    if hair.curly:
        length, width = uniform(0.013, 0.023, count) * (0.4 + 0.6 * full), uniform(0.0019, 0.0033, count)
        heading = uniform(-np.pi, np.pi, count)
        bend = uniform(3.5, 6.5, count) * random.choice((-1, 1), count)
        order = tone = 0.7 * tone + 0.12 * noise(places, 0.007, 64)
    else:
        length = (0.005 + full * (0.020 + 0.026 * long)) * uniform(0.7, 1.2, count)
        length /= 1 + 0.5 * _cropped(places)
        width = (0.0040 + 0.0016 * full * long) * uniform(0.7, 1.3, count)
        heading, bend = (
            normal(0, 1, count) * (0.05 + 0.25 * (1 - full)),
            normal(0, 0.08, count) + 0.12 * noise(places, 0.030, 62),
        )
        tone += 0.3 * (1 - full)
        order = -roots.real * (1 + 0.06 * normal(size=count))
        # Where they grew from before the parting, they begin there.
        first = uniform(0.0, 0.0010, count) / _metres(roots)
        roots = np.maximum(roots.real - 0.5 * length / _metres(roots), first) + 1j * roots.imag
    order = np.argsort(order)
    return Locks(*(values[order] for values in (roots, length, width, heading, bend, tone, full)))


def _draw_locks(locks: Locks, hair: Hair) -> tuple[Float64, Float64]:
    """Return two pictures on the plane of `strand_places`: tones times how much is covered, and the latter.

    The strands of a lock run together towards its tip. Straight locks lie like tiles, those nearer to the
    parting on top; of curls, the bright ones do.
    """
    random = np.random.default_rng(62)
    each = np.repeat(np.arange(len(locks.roots)), STRANDS)
    full, length = locks.fullness[each], locks.lengths[each] * random.uniform(0.65, 1.1, len(each))
    across = random.uniform(-1, 1, len(each))
    tone = locks.tones[each] - 0.22 * across**2 + random.normal(0, 0.26, len(each))
    path, widths, at = [], [], locks.roots[each]
    at = at + (1 - full) * random.uniform(-0.006, 0.006, len(each)) / _metres(at)
    side = 1j * across * locks.widths[each] / 2
    for share in np.linspace(0, 1, SEGMENTS + 1):
        metres, heading = _metres(at), np.exp(1j * (locks.headings + locks.bends * share))[each]
        path.append(at + side * (1 - 0.7 * full * share**1.5) * heading / metres)
        widths.append(WIDTH * (0.35 + 0.65 * full) * (1.05 - share) ** 0.5 / metres)
        at = at + length / SEGMENTS / metres * heading
    size = int(2 * np.pi * SCALE) + 2, int(REACH * SCALE) + 2
    picture = Image.new("L", size)
    draw = ImageDraw.Draw(picture)
    points = SCALE * (np.stack([np.imag(path) + np.pi, np.real(path)], axis=-1))
    profile = PROFILES[int(hair.curly)] * (0.3 + 0.7 * full[:, None])
    fills = np.clip((tone[:, None] + profile - DARKEST) / (BRIGHTEST - DARKEST) * 254 + 1, 1, 255).astype(int)
    sizes = np.maximum(np.rint(np.array(widths).T * SCALE), 1).astype(int).tolist()
    for line, fill, wide in zip(points.swapaxes(0, 1).tolist(), fills.tolist(), sizes, strict=True):
        for (a, b), value, breadth in zip(pairwise(line), fill, wide, strict=False):
            draw.line((*a, *b), fill=value, width=breadth)
    drawn = np.asarray(picture, dtype=np.float32)
    covered = (drawn > 0).astype(np.float32)
    tones = covered * ((drawn - 1) / 254 * (BRIGHTEST - DARKEST) + DARKEST)
    return gaussian_filter(tones, SOFT), gaussian_filter(covered, SOFT)

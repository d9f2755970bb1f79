"""The layer of hair over the scalp: how thick it is, which way it is combed, and how strands vary."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import numpy.typing as npt
from looks import Hair
from scipy.interpolate import PchipInterpolator

from fba.arrays import Float64
from fba.rotations import unit
from fba.sampling import smoothstep

Complex128 = npt.NDArray[np.complex128]
MIDDLE = np.array([0.0, 0.012, -0.085])
"""Point of the skull from which hair stands away."""
TOP = (0.030, 0.085)
"""Heights between which the hair reaches the thickness of the top, metres."""
CALM = (0.080, 0.098)
"""Heights of the skin between which locks cease to stand out, metres."""
PARTING = np.array([[0.030, 0.107, -0.048], [0.012, 0.106, -0.135]])
"""Ends of the parting, on the subject's left; all strands lead away from it, metres."""
STRAND = 0.00042
"""Width of a strand that is told from its neighbours, metres."""
LOCK = 0.0052
"""Width of a lock of strands, metres."""
CURL = 0.0056
"""Breadth of a curl of curly hair, metres."""
TONES = (-0.85, -0.30, 0.35, 1.0)
"""How bright hair is where it has each of its colours."""
RADIUS = 0.1
"""Of the ball onto which places on the scalp are carried for their strands, metres."""
VOLUMES = (
    # a place on the left, and how far around it, metres
    ((0.062, 0.088, -0.085), (0.030, 0.030, 0.075)),
    ((0.0, 0.090, -0.020), (0.055, 0.030, 0.030)),
    ((0.0, 0.030, -0.185), (0.060, 0.045, 0.040)),
)  # fmt: skip
"""Where hair is thicker or thinner than elsewhere: at the edges of the top, above the forehead, behind."""
DEEPEST = -0.008
"""Least thickness: the skull is flatter at its corners than hair lets it look, metres."""
AXIS = -0.085
"""z of the vertical axis around which the angles of the hairline are measured."""


def grow(vertices: Float64, hair: Hair) -> Float64:
    """Return vertices (V, 3) of the skin with those of the scalp at the outside of the hair; symmetric."""
    folded = vertices * np.where(vertices[:, :1] < 0, (-1.0, 1.0, 1.0), (1.0, 1.0, 1.0))
    above = height_above_hairline(folded)
    full = hair.sides + hair.top * smoothstep((folded[:, 1] - TOP[0]) / (TOP[1] - TOP[0]))
    for (place, reach), more in zip(VOLUMES, hair.volumes, strict=True):
        full = full + more * np.exp(-(((folded - place) / reach) ** 2).sum(axis=1))
    # Not on the crown, whose highest point is a feature point.
    lumps = hair.lumps * (1 - smoothstep((folded[:, 1] - CALM[0]) / (CALM[1] - CALM[0])))
    full = full + lumps * (noise(folded, 0.013, 41) + 0.6 * noise(folded, 0.006, 42))
    # Before the ears hair lies close to the head.
    ahead = smoothstep((folded[:, 2] + 0.125) / 0.03) * (1 - smoothstep((folded[:, 1] + 0.015) / 0.085))
    full = full * (1 - 0.8 * ahead)
    # Locks end in a rounded edge, but hair of the nape grows thinner downwards.
    nape = smoothstep((-0.105 - folded[:, 2]) / 0.03) * smoothstep((0.02 - folded[:, 1]) / 0.03)
    share = np.clip(above / (hair.rise * (1 + nape)), 0.0, 1.0) ** (0.6 + 0.4 * nape)
    share *= smoothstep(above / 0.004)
    return vertices + unit(vertices - MIDDLE) * (share * np.maximum(full, DEEPEST))[:, None]


def height_above_hairline(positions: Float64) -> Float64:
    """Return (N,) metres above the hairline of points (N, 3): positive on the scalp, -1 behind ears."""
    with (Path(__file__).parent / "hairline.csv").open(encoding="utf-8") as file:
        line = np.array([[float(row["degrees"]), float(row["y"]) / 1000] for row in csv.DictReader(file)])
    around = np.degrees(np.arctan2(np.abs(positions[:, 0]), positions[:, 2] - AXIS))
    height = PchipInterpolator(line[:, 0], line[:, 1])
    slope = height.derivative()(around) * 180 / np.pi / 0.08
    above = (positions[:, 1] - height(around)) / np.sqrt(1 + slope**2)
    ear = (np.abs(positions[:, 0]) > 0.0765) & (positions[:, 1] < 0.006)
    ear &= (positions[:, 2] > -0.122) & (positions[:, 2] < -0.100)
    return np.where(ear, -1.0, above)


def scalp(positions: Float64, edge_width: float = 0.004) -> Float64:
    """Return (N,) density of hair at points (N, 3): 0 on the face, 1 on the scalp.

    edge_width: metres over which the hair thins out at its edge.
    """
    return smoothstep(height_above_hairline(positions) / edge_width + 0.5)


def noise(positions: Float64, scale: float, seed: int, order: int = 1) -> Float64:
    """Return (N,) noise in -1..1 at points (N, 3). scale: size of its grains, metres; order: of splines."""
    from scipy.ndimage import map_coordinates

    lattice = np.random.default_rng(seed).uniform(-1, 1, (48, 48, 48))
    return map_coordinates(lattice, (positions / scale).T, order=order, mode="grid-wrap")


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


def strand_noise(p: Float64, width: float, length: float, seed: int) -> Float64:
    """Return (N,) noise in -1..1 with grains of this width across strands and length along them, metres."""
    places = strand_places(p)
    # Two patterns, one twice as fine as the other, so that strands are equally wide where they spread.
    spread = np.abs(np.sinh(places)) * _map_axes()[3] * RADIUS * 2
    octave = np.log2(np.maximum(spread, 1e-4) / RADIUS)
    lower = np.floor(octave)
    values = []
    for level in (lower, lower + 1):
        turn = RADIUS * 2.0**level / width
        at = np.stack([turn * np.cos(places.imag), turn * np.sin(places.imag), level * 7.3], axis=1)
        at[:, 2] += places.real * RADIUS / length
        values.append(noise(at, 1.0, seed))
    share = smoothstep(octave - lower)
    mixed = (1 - share) * values[0] + share * values[1]
    return mixed / np.sqrt((1 - share) ** 2 + share**2)


def strand_tone(p: Float64, hair: Hair) -> Float64:
    """Return (N,) how bright the hair is at points (N, 3) of the scalp, about -1..1."""
    if hair.curly:
        return _curl_tone(p)
    wave = p + 0.0022 * np.stack([noise(p, 0.011, 70 + k) for k in range(3)], axis=1)
    lock = strand_noise(wave, LOCK, 0.030, 61) + 0.6 * strand_noise(wave, LOCK / 2.2, 0.022, 62)
    fine = strand_noise(wave, STRAND, 0.020, 63) + 0.7 * strand_noise(wave, 2.3 * STRAND, 0.026, 64)
    # Light from above glances off the strands where they turn down.
    rise = unit(p - MIDDLE)[:, 1] + 0.05 * strand_noise(wave, LOCK / 2.2, 0.2, 69)
    shine = np.exp(-(((rise - 0.72) / 0.13) ** 2)) * (0.6 + 0.4 * fine)
    return 0.40 * lock + 0.48 * fine + 0.42 * shine - 0.08


def shortness(p: Float64) -> Float64:
    """Return (N,) 0..1 how short hair is cut at points (N, 3): it is shorn towards the nape."""
    behind = smoothstep((-0.092 - p[:, 2]) / 0.02) * (1 - smoothstep((p[:, 1] + 0.030) / 0.035))
    return behind * (1 - smoothstep(height_above_hairline(p) / 0.034))


def _curl_tone(p: Float64) -> Float64:
    """Return (N,) as `strand_tone` for curls: strands that wind, bright upon dark."""
    q = RADIUS * unit(p - MIDDLE)
    fine = 0.34 * noise(q, 0.0004, 86) + 0.22 * noise(q, 0.0009, 89)
    # Strands follow the contours of smooth random fields, loops as wide as a curl; curls lie upon curls.
    tone, warp = np.zeros(len(p)), 0.0009 * np.stack([noise(q, 0.0028, 90 + k) for k in range(3)], axis=1)
    for layer, seed in enumerate((83, 84, 85)):
        field = noise(q + warp * (layer - 1) + 0.013 * layer, CURL * (1.15 - 0.2 * layer), seed, 3)
        coils = 0.42 * np.sin(13 * field + 5 * fine) + 0.20 * np.sin(31 * field)
        place = noise(q, CURL * 0.75, 93 + layer) - 0.02 if layer else np.ones(len(p))
        cover = smoothstep(place / 0.16)
        tone = (1 - cover) * (tone - 0.45 * smoothstep((place + 0.30) / 0.30) * (layer > 0)) + cover * coils
    return tone + fine + 0.22 * noise(q, 1.6 * CURL, 87) + 0.14


def strand_reach(p: Float64, hair: Hair) -> Float64:
    """Return (N,) metres by which strands at points (N, 3) end below the hairline, or, negative, above it."""
    if hair.curly:
        return 0.0022 * noise(p, 0.0032, 52) + 0.0015 * noise(p, 0.0009, 53) + 0.003 * noise(p, 0.011, 51)
    fine = strand_noise(p, 1.2 * STRAND, 0.2, 65)
    nape = 1 + 1.2 * smoothstep((-0.12 - p[:, 2]) / 0.03)
    return nape * (0.0030 * strand_noise(p, LOCK, 0.2, 66) + 0.0048 * fine + 0.0012 * noise(p, 0.0006, 54))


def in_parting(p: Float64) -> Float64:
    """Return (N,) 1 in the parting, 0 beside it, for points (N, 3)."""
    away = strand_places(p).real * _map_axes()[3] * 2 * RADIUS
    uneven = 0.0011 * noise(p, 0.004, 67) + 0.0006 * noise(p, 0.0012, 68)
    return np.exp(-((np.maximum(away + uneven, 0.0) / 0.0016) ** 2))

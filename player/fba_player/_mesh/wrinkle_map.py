"""The map of wrinkles that all faces share: forehead, frown, corner of the eye, cheek.

It shows the left half of a face from the front, in eye separations (ES) from the middle of the pupils.
Wrinkles are drawn as shading, not as geometry: a dark groove with a lighter lower edge, as under light from
above.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fba.arrays import Float64, UInt8
from fba.cache import load_or_make, make_key

WRINKLES = ("forehead", "frown", "eye corner", "cheek")
"""One channel of the map each."""
WIDTH = 1.25
"""Left edge of the map: eye separations from the middle of the pupils."""
TOP = 1.25
BOTTOM = -1.55
"""Upper and lower edge: eye separations above the pupils."""
TEXELS = 256
"""Texels of an eye separation."""
SHAPE = (round((TOP - BOTTOM) * TEXELS), round(WIDTH * TEXELS))
PLAIN = 128
"""Value where there is no wrinkle; lower is darker."""
EDGE_BRIGHTNESS = 0.40
"""Brightness of the lower edge, as a share of the groove's darkness."""
EDGE_BELOW = 1.7
"""Distance of the brightest line of the edge below the groove, in widths of the groove."""
EDGE_BREADTH = 1.5
"""Breadth of the edge, in widths of the groove."""
END_STEEPNESS = 3.2
"""How steeply lines thin out towards their ends: over a third of their length each."""
CACHE_VERSION = 4
"""Cache version; increment when `wrinkle_map` gives other pixels."""

Stroke = tuple[Sequence[tuple[float, float]], float, float]
"""Points of a line, its width (both in eye separations), and its darkness, 0..1."""

STROKES: dict[str, tuple[Stroke, ...]] = {
    "forehead": (
        (((0.20, 0.560), (0.36, 0.590), (0.54, 0.640), (0.68, 0.640)), 0.014, 0.68),
        (((0.40, 0.520), (0.54, 0.555), (0.70, 0.545)), 0.020, 0.30),
        (((-0.16, 0.640), (-0.02, 0.622), (0.10, 0.630)), 0.014, 0.52),
        (((0.14, 0.655), (0.30, 0.700), (0.50, 0.752), (0.66, 0.752), (0.80, 0.705)), 0.017, 1.0),
        (((-0.30, 0.752), (-0.10, 0.726), (0.06, 0.722), (0.20, 0.745)), 0.015, 0.75),
        (((0.02, 0.805), (0.20, 0.822), (0.38, 0.862), (0.56, 0.872)), 0.017, 0.92),
        (((0.60, 0.850), (0.70, 0.845), (0.80, 0.815)), 0.013, 0.30),
        (((-0.34, 0.850), (-0.16, 0.838), (-0.03, 0.832)), 0.012, 0.35),
        (((0.10, 0.930), (0.26, 0.950), (0.42, 0.955)), 0.014, 0.34),
    ),
    "frown": (
        (((0.105, 0.095), (0.118, 0.200), (0.125, 0.300), (0.150, 0.400), (0.165, 0.480)), 0.020, 1.0),
        (((0.205, 0.250), (0.225, 0.330), (0.255, 0.410)), 0.015, 0.50),
        (((-0.130, 0.050), (0.000, 0.035), (0.130, 0.050)), 0.016, 0.60),
    ),
    "eye corner": (
        (((0.755, 0.040), (0.840, 0.072), (0.930, 0.118)), 0.011, 0.44),
        (((0.760, -0.005), (0.850, 0.006), (0.935, 0.030), (1.010, 0.040)), 0.013, 0.68),
        (((0.750, -0.050), (0.830, -0.064), (0.915, -0.092), (0.990, -0.108)), 0.014, 0.76),
        (((0.725, -0.095), (0.800, -0.140), (0.860, -0.192), (0.930, -0.235)), 0.013, 0.60),
        (((0.855, -0.040), (0.930, -0.036)), 0.012, 0.24),
        (((0.690, -0.165), (0.760, -0.225), (0.820, -0.300)), 0.013, 0.32),
        (((0.290, -0.140), (0.400, -0.220), (0.530, -0.250), (0.670, -0.205)), 0.014, 0.50),
        (((0.350, -0.260), (0.450, -0.312), (0.560, -0.325), (0.660, -0.295)), 0.020, 0.19),
    ),
    "cheek": (
        (((0.285, -0.520), (0.330, -0.600), (0.395, -0.700), (0.465, -0.810), (0.520, -0.930),
          (0.545, -1.050), (0.535, -1.150)), 0.020, 0.80),
        (((0.275, -0.500), (0.345, -0.620), (0.430, -0.750), (0.500, -0.880), (0.535, -1.010)), 0.050, 0.24),
        (((0.600, -0.960), (0.630, -1.040), (0.625, -1.120)), 0.018, 0.22),
    ),
}  # fmt: skip
"""The lines of each wrinkle. Those that cross the face's middle begin on the other side of it."""


def wrinkle_map() -> UInt8:
    """Return uint8 (H, W, 4): the wrinkles, each in its own channel, around `PLAIN`, from the disk cache."""
    lines = (TEXELS, EDGE_BRIGHTNESS, EDGE_BELOW, EDGE_BREADTH, END_STEEPNESS, repr(STROKES))
    key = make_key("wrinkles", CACHE_VERSION, *lines)
    return load_or_make(key, ((*SHAPE, len(WRINKLES)),), lambda: [_draw()], np.uint8)[0]


def _draw() -> UInt8:
    y, x = np.mgrid[0 : SHAPE[0], 0 : SHAPE[1]]
    across, up = (x + 0.5) / TEXELS, TOP - (y + 0.5) / TEXELS
    pixels = np.empty((*SHAPE, len(WRINKLES)), dtype=np.uint8)
    for channel, name in enumerate(WRINKLES):
        shade = np.zeros(SHAPE)
        for points, width, darkness in STROKES[name]:
            groove = _stroke(across, up, points, width)
            edge = _stroke(across, up + EDGE_BELOW * width, points, EDGE_BREADTH * width)
            shade += darkness * (EDGE_BRIGHTNESS * edge - groove)
        pixels[..., channel] = np.clip(np.round(PLAIN + 127 * shade), 0, 255)
    return pixels


def _stroke(across: Float64, up: Float64, points: Sequence[tuple[float, float]], width: float) -> Float64:
    """Return (H, W), 0..1: a soft line through points, which thins out towards its ends."""
    line = _smooth(np.array(points))
    along = np.linspace(0, 1, len(line))
    strength = np.zeros(across.shape)
    uneven = 0.87 + 0.13 * np.sin(31.0 * line[:, 0] + 23.0 * line[:, 1])
    for (x, y), where, share in zip(line, along, uneven, strict=True):
        fade = min(1.0, END_STEEPNESS * min(where, 1 - where) + 0.05) * share
        sigma = width * (0.55 + 0.45 * fade)
        reach = 3 * sigma
        near = (np.abs(across[0] - x) < reach).nonzero()[0]
        rows = (np.abs(up[:, 0] - y) < reach).nonzero()[0]
        if not len(near) or not len(rows):
            continue
        box = np.s_[rows[0] : rows[-1] + 1, near[0] : near[-1] + 1]
        squared = (across[box] - x) ** 2 + (up[box] - y) ** 2
        np.maximum(strength[box], fade * np.exp(-squared / (2 * sigma**2)), out=strength[box])
    return strength


def _smooth(points: Float64) -> Float64:
    """Return (N, 2): points on a Catmull-Rom curve through `points`, about two a texel."""
    ends = np.vstack([2 * points[0] - points[1], points, 2 * points[-1] - points[-2]])
    pieces = []
    for a, b, c, d in zip(ends, ends[1:], ends[2:], ends[3:], strict=False):
        steps = max(int(np.linalg.norm(c - b) * TEXELS * 2), 2)
        t = np.arange(steps)[:, None] / steps
        pieces.append(
            0.5 * (2 * b + (c - a) * t + (2 * a - 5 * b + 4 * c - d) * t**2 + (3 * b - a - 3 * c + d) * t**3)
        )
    return np.vstack([*pieces, points[-1:]])

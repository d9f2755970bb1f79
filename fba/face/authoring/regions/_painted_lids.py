"""How far lashes or a liner that are painted on a lid reach from its margin."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fba.arrays import Float64, Integer
from fba.face.authoring.regions._eye_opening import Opening
from fba.face.authoring.regions._eyes import Eye
from fba.face.authoring.surface.landmarks import Landmarks
from fba.face.model import Part
from fba.mesh import read_pixels

LUMINANCE = (0.2126, 0.7152, 0.0722)
"""Shares of red, green and blue (ITU-R BT.709)."""
GAMMA = 2.2
"""Exponent from pictures' values to the linear light of vertices' colours, near enough to compare them."""
STRIPS = 8
"""Number of strips, side by side, into which a lid is cut; each is measured separately."""
MARGIN_STEPS = 24
"""Number of distances from the margin, up to `MAX_DISTANCE`, at which a strip is measured."""
MAX_DISTANCE = 2.0
"""Distance from the margin, in distances of the crease, up to which paint is looked for; skin begins at 1."""
DARK_SHARE = 0.5
"""Brightness, as a share of that of the skin beside, below which paint begins."""
BRIGHT_SHARE = 0.7
"""Brightness, as a share of that of the skin beside, above which paint ends."""
SAMPLES = 12
"""Points across each edge of a triangle at which its colour is read."""


def painted_width(
    marks: Landmarks, opening: Opening, eye: Eye, lid: str, parts: Sequence[Part], crease: float
) -> float:
    """Return the distance from a lid's margin up to which its skin is painted dark, metres; else 0.

    crease: distance of the lid's crease from the margin, metres. The colour is that of the skin's texture and
    of its vertices; a picture that cannot be read is taken for plain.
    """
    away, column, brightness = _samples(marks, opening, eye, lid, parts, MAX_DISTANCE * crease)
    strip = np.floor((column - opening.x[0]) / (opening.x[-1] - opening.x[0]) * STRIPS)
    step = np.minimum(away / (MAX_DISTANCE * crease) * MARGIN_STEPS, MARGIN_STEPS - 1).astype(np.intp)
    widths = []
    for number in range(STRIPS):
        here = strip == number
        line = np.array([_median(brightness[here & (step == each)]) for each in range(MARGIN_STEPS)])
        skin = _median(brightness[here & (away > crease)])
        seen = np.flatnonzero(np.isfinite(line))
        if len(seen) and skin > 0:
            line = np.interp(np.arange(MARGIN_STEPS), seen, line[seen]) / skin
            ends = np.flatnonzero(line > BRIGHT_SHARE)
            dark = line[0] < DARK_SHARE and len(ends) > 0
            widths.append(ends[0] * MAX_DISTANCE * crease / MARGIN_STEPS if dark else 0.0)
    return float(np.median(widths)) if widths else 0.0


def _median(values: Float64) -> float:
    return float(np.median(values)) if len(values) else np.nan


def _samples(
    marks: Landmarks, opening: Opening, eye: Eye, lid: str, parts: Sequence[Part], reach: float
) -> tuple[Float64, Float64, Float64]:
    """Return the distance from the margin (M,), x (M,) and brightness (M,) of points on a lid's outside."""
    surface = marks.surface
    far = surface.distances(marks.contour(f"{eye.side} {lid} lid"), reach)
    margin = opening.upper if lid == "upper" else opening.lower
    weights = _barycentric()
    found: list[tuple[Float64, Float64, Float64]] = []
    start = 0
    for part in parts:
        numbers = surface.find(np.arange(start, start + len(part.vertices)))
        start += len(part.vertices)
        corners = numbers[part.triangles]
        near = (corners >= 0).all(axis=1) & np.isfinite(far[corners]).all(axis=1)
        if part.kind != "skin" or not near.any():
            continue
        triangles = part.triangles[near]
        points = np.einsum("sc,fcx->fsx", weights, part.vertices[triangles].astype(np.float64)).reshape(-1, 3)
        away = np.einsum("sc,fc->fs", weights, far[corners[near]]).reshape(-1)
        height, depth = (np.interp(points[:, 0], opening.x, margin[:, axis]) for axis in (0, 1))
        up = points[:, 1] - eye.centre[1] - height
        outside = (up > 0) if lid == "upper" else (up < 0)
        outside &= points[:, 2] - eye.centre[2] > depth
        outside &= (points[:, 0] > opening.x[0]) & (points[:, 0] < opening.x[-1])
        found.append((away[outside], points[outside, 0], _brightness(part, triangles, weights)[outside]))
    if not found:
        return np.zeros(0), np.zeros(0), np.zeros(0)
    away, column, bright = (np.concatenate(each) for each in zip(*found, strict=True))
    return away, column, bright


def _barycentric() -> Float64:
    """Return (S, 3) weights of a triangle's corners at points spread over it."""
    first, second = np.meshgrid(np.arange(SAMPLES), np.arange(SAMPLES))
    inside = first + second < SAMPLES
    a, b = (first[inside] + 1 / 3) / SAMPLES, (second[inside] + 1 / 3) / SAMPLES
    return np.stack([a, b, 1 - a - b], axis=1)


def _brightness(part: Part, triangles: Integer, weights: Float64) -> Float64:
    """Return (F * S,) brightness of points on a part's triangles, 1 where it is plain white."""
    bright = np.ones(len(triangles) * len(weights))
    if part.colours is not None:
        light = np.einsum("sc,fc->fs", weights, part.colours[triangles, :3] @ LUMINANCE).reshape(-1)
        bright *= np.clip(light, 0.0, 1.0) ** (1 / GAMMA)
    picture = None if part.material.texture is None else read_pixels(part.material.texture)
    if picture is not None and part.texcoords is not None:
        places = np.einsum("sc,fcx->fsx", weights, part.texcoords[triangles]).reshape(-1, 2) % 1.0
        rows, columns = (
            np.minimum((places[:, 1 - axis] * picture.shape[axis]).astype(np.intp), picture.shape[axis] - 1)
            for axis in (0, 1)
        )
        bright *= picture[rows, columns, :3] @ LUMINANCE / 255
    return bright

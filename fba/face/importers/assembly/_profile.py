"""Feature points on the outline of a head: nose, lips and chin on its profile, crown, back and ears."""

from __future__ import annotations

import itertools
from collections.abc import Mapping

import numpy as np

from fba.arrays import Bool, Float64
from fba.face.model import Part

STEPS = 400
"""Number of heights at which the profile is sampled."""
FLAT_LIP = 0.48
"""Beyond this share of the height from the line of the lips to the tip of the nose, no lip is foremost."""
MIN_NOSE_DEPTH = 0.01
"""Least depth of the bottom of a nose behind the line from its tip to the lip, in distances of the pupils."""
MIN_CHIN_DISTANCE = 0.3
"""Distance of the chin from the lower lip at least, by that of the lips from the eyes; nearer is the lip."""


def profile_points(skin: Part, located: Mapping[str, Float64]) -> dict[str, Float64]:
    """Return 9.3, 9.15, 8.1, 8.2, 2.10 and 2.1 on the profile of a skin, and 11.4, 11.6, 10.3, 10.4 of the
    head.

    located: at least the pupils (3.5, 3.6) and the lips (2.2, 2.3). Points that do not show clearly are
    left out.
    """
    pupils = (located["3.5"] + located["3.6"]) / 2
    apart = float(located["3.5"][0] - located["3.6"][0])
    tall = float(pupils[1] - located["2.2"][1])
    result = _head(skin.vertices.astype(np.float64), pupils, apart)
    heights = np.linspace(located["2.3"][1] - 1.2 * tall, pupils[1], STEPS)
    front = _front(skin, float(pupils[0]), heights)
    if not np.isfinite(front).any():
        return result

    def point(index: int) -> Float64:
        return np.array([pupils[0], heights[index], front[index]])

    def foremost(low: float, high: float) -> int | None:
        inside = (heights > low) & (heights < high) & np.isfinite(front)
        return int(np.where(inside, front, -np.inf).argmax()) if inside.any() else None

    lip, tip = located["2.2"], foremost(located["2.2"][1] + 0.2 * tall, pupils[1] - 0.2 * tall)
    if tip is None:
        return result
    result["9.3"] = point(tip)
    upper = foremost(lip[1], float(lip[1] + 0.5 * (heights[tip] - lip[1])))
    if upper is not None:
        # drawn faces have hardly any lip: there the profile only rises towards the nose
        has_lip = bool(heights[upper] < lip[1] + FLAT_LIP * (heights[tip] - lip[1]))
        start = upper if has_lip else int(np.abs(heights - lip[1]).argmin())
        # the nose ends where the profile is furthest behind the line from its tip to the lip
        along = (heights - heights[start]) / (heights[tip] - heights[start])
        behind = front[start] + along * (front[tip] - front[start]) - front
        between = (np.arange(STEPS) > start) & (np.arange(STEPS) < tip) & np.isfinite(front)
        if between.any() and float(np.nanmax(behind[between])) > MIN_NOSE_DEPTH * apart:
            result |= {"8.1": point(upper)} if has_lip else {}
            result["9.15"] = point(int(np.where(between, behind, -np.inf).argmax()))
    chin = _hill(
        front,
        (heights > located["2.3"][1] - 0.8 * tall) & (heights < located["2.3"][1] - MIN_CHIN_DISTANCE * tall),
    )
    if chin is None:
        return result
    result["2.10"] = point(chin)
    dent = (heights > heights[chin]) & (heights < located["2.3"][1] - 0.02 * tall) & np.isfinite(front)
    if dent.any():
        # the lower lip ends between its foremost point and the dent above the chin
        low = int(np.where(dent, front, np.inf).argmin())
        lower = foremost(float(heights[low]), float(located["2.3"][1]))
        if lower is not None:
            result["8.2"] = point((low + 3 * lower) // 4)
    below = np.flatnonzero(
        np.isfinite(front) & (heights < heights[chin]) & (front > front[chin] - 0.3 * apart)
    )
    if len(below):
        result["2.1"] = point(int(below[0]))
    return result


def _front(skin: Part, x: float, heights: Float64) -> Float64:
    """Return the foremost z at each height where the skin cuts the plane at x; NaN where it does not."""
    vertices = skin.vertices.astype(np.float64)
    # a plane through vertices cuts twice or not at all; one beside them cuts once
    beside = x + 1e-5 * float(np.ptp(vertices[:, 0]))
    corners = vertices[skin.triangles]
    side = corners[:, :, 0] > beside
    corners = corners[side.any(axis=1) & ~side.all(axis=1)]
    ends: list[Float64] = []
    for a, b in itertools.pairwise((0, 1, 2, 0)):
        p, q = corners[:, a], corners[:, b]
        cuts = (p[:, 0] > beside) != (q[:, 0] > beside)
        share = np.where(cuts, (beside - p[:, 0]) / np.where(cuts, q[:, 0] - p[:, 0], 1.0), np.nan)
        ends.append(p[:, 1:] + share[:, None] * (q[:, 1:] - p[:, 1:]))
    three = np.stack(ends, axis=1)
    two = three[~np.isnan(three[:, :, 0])].reshape(-1, 2, 2)
    result = np.full(len(heights), np.nan)
    for start, end in two:
        low, high = sorted((start, end), key=lambda point: float(point[0]))
        inside = np.flatnonzero((heights >= low[0]) & (heights <= high[0]))
        rise = max(high[0] - low[0], 1e-12)
        depth = low[1] + (heights[inside] - low[0]) / rise * (high[1] - low[1])
        result[inside] = np.fmax(result[inside], depth)
    return result


def _hill(front: Float64, inside: Bool) -> int | None:
    """Return the index of the foremost local maximum of the profile within a stretch, or None."""
    around = np.stack([np.roll(front, shift) for shift in (-6, -3, -1, 1, 3, 6)])
    hills = inside & np.isfinite(front) & (front[None] >= np.nan_to_num(around, nan=-np.inf)).all(axis=0)
    return int(np.where(hills, front, -np.inf).argmax()) if hills.any() else None


def _head(vertices: Float64, pupils: Float64, apart: float) -> dict[str, Float64]:
    """Return crown and back of a whole head, and the ears where they stand out."""
    result: dict[str, Float64] = {}
    crown = vertices[int(vertices[:, 1].argmax())]
    if abs(crown[0] - pupils[0]) < 0.3 * apart and crown[1] > pupils[1] + apart:
        result["11.4"] = np.array([pupils[0], crown[1], crown[2]])
    level = np.abs(vertices[:, 1] - pupils[1] - 0.4 * apart) < 0.3 * apart
    if level.any():
        back = vertices[int(np.where(level, vertices[:, 2], np.inf).argmin())]
        if back[2] < pupils[2] - 1.8 * apart:
            result["11.6"] = np.array([pupils[0], back[1], back[2]])
    ears = (np.abs(vertices[:, 1] - pupils[1] + 0.2 * apart) < 0.6 * apart) & (
        vertices[:, 2] < pupils[2] - 0.9 * apart
    )
    temple = (np.abs(vertices[:, 1] - pupils[1] - apart) < 0.4 * apart) & (vertices[:, 2] < pupils[2])
    for name, sign in (("10.3", 1.0), ("10.4", -1.0)):
        out = (vertices[:, 0] - pupils[0]) * sign
        if ears.any() and temple.any():
            tip = int(np.where(ears, out, -np.inf).argmax())
            if out[tip] > out[temple].max() + 0.05 * apart:
                result[name] = vertices[tip]
    return result

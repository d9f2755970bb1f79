"""`find_side_points`: points of a profile from its outline, as in Karpouzis, section 7.3.

The head is told from an even background by its brightness and colour; its outline towards the face becomes a
signal x(y), whose extrema are the tip of the nose, the lips and the folds between them.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import binary_fill_holes, gaussian_filter1d, label

from fba.arrays import Bool, Float64, UInt8
from fba.errors import ModelError
from fba.face.fitting._photographs import FoundPoints, Photograph, Step

ROWS = 480
"""Rows of the copy of the picture in which the outline is followed."""
SMOOTH = 1.6
"""Rows over which the outline is smoothed."""
LEAST_SHARE, MOST_SHARE = 0.08, 0.9
"""Share of the picture that a head covers."""
RIPPLE = 0.5
"""Pixels by which an outline goes back, at least, between two of its extrema."""
SLOPES = (0.0, 0.15, 0.3, 0.45)
"""Slants of the outline, tried one after another, at which its extrema are looked for."""
RANGES = {
    "9.15": ((0.12, 0.42), (0.06, 0.38)), "8.1": ((0.22, 0.60), (-0.05, 0.38)),
    "2.2": ((0.33, 0.72), (0.05, 0.45)), "8.2": ((0.40, 0.85), (0.0, 0.42)),
    "2.10": ((1.0, 1.0), (0.10, 0.52)),
}  # fmt: skip
"""How far points are below and behind the tip of the nose, as shares of the height from there to the chin."""
LEAST_HEIGHT = 0.1
"""Least height from nose to chin as a share of the picture's."""
NOSE_WIDTH = 0.06
"""Half height of a nose as a share of the head's."""


def find_side_points(photograph: Photograph) -> FoundPoints:
    """Return the points of the middle of the face on a profile before an even background.

    Raises ModelError where the head cannot be told from the background, or its outline is no face's.
    """
    name = photograph.name or "the picture"
    step = max(photograph.pixels.shape[0] // ROWS, 1)
    small = photograph.pixels[::step, ::step]
    mask = find_head(small, name)
    sides = []
    for facing in (-1, 1):
        signal = _outline(mask, facing)
        nose, sharp = _nose(signal)
        if sharp > 0:
            sides.append((sharp, facing, signal, nose))
    found: dict[str, float] = {}
    facing, signal = 1, np.zeros(0)
    for _, towards, outline, nose in sorted(sides, key=lambda side: -side[0]):
        down = np.arange(len(outline)) - nose
        for slope in SLOPES:  # where a chin recedes, it is an extremum of a slanted outline
            extrema = _extrema(outline + slope * down, nose)
            if _is_face(extrema, outline):
                found, facing, signal = extrema, towards, outline
                break
        if found:
            break
    if not found:
        raise ModelError(
            f"{name}: its outline is not that of a face in profile: no nose, lips and chin were found in "
            "it; is the background even? Place the points by hand"
        )
    width = small.shape[1]
    places = {}
    for point, y in found.items():
        x = signal[round(y)]
        column = x if facing > 0 else width - 1 - x
        places[point] = (
            float((column + 0.5) * step * photograph.scale),
            float((y + 0.5) * step * photograph.scale),
        )
    step_shown = Step("The profile as a curve, and its extrema", _draw(mask, found, signal, facing))
    return FoundPoints(places, 1.0, [step_shown])


def find_head(pixels: UInt8, name: str) -> Bool:
    """Return the mask of the largest thing that differs from the background at the upper edges."""
    colour = pixels.astype(np.float64)
    edge = max(colour.shape[1] // 40, 2)
    # The background may get darker downwards, so each row is compared with its own ends.
    sides = np.stack([np.median(colour[:, :edge], axis=1), np.median(colour[:, -edge:], axis=1)])
    sides = gaussian_filter1d(sides, 6, axis=1)
    away = np.minimum(*(np.linalg.norm(colour - side[:, None], axis=2) for side in sides))
    limit = _threshold(away)
    regions, count = label(away > limit)
    if not count:
        raise ModelError(f"{name}: nothing stands out from the background; place the points by hand")
    sizes = np.bincount(regions.ravel())[1:]
    mask: Bool = np.asarray(binary_fill_holes(regions == int(sizes.argmax()) + 1))
    if not LEAST_SHARE < mask.mean() < MOST_SHARE:
        raise ModelError(
            f"{name}: no head can be told from the background, which must be even; place the points by hand"
        )
    return mask


def _threshold(values: Float64) -> float:
    """Return the threshold that parts values into two groups with the least variance (Otsu, 1979)."""
    counts, edges = np.histogram(values, 128)
    middles = (edges[:-1] + edges[1:]) / 2
    below = np.cumsum(counts)
    above = below[-1] - below
    low = np.cumsum(counts * middles) / np.maximum(below, 1)
    high = ((counts * middles).sum() - np.cumsum(counts * middles)) / np.maximum(above, 1)
    best = float(middles[int((below * above * (low - high) ** 2).argmax())])
    return min(best, 40.0)


def _outline(mask: Bool, facing: int) -> Float64:
    """Return for each row how far the head reaches towards its face, pixels; NaN in rows without it."""
    seen = mask if facing > 0 else mask[:, ::-1]
    width = seen.shape[1]
    reach = np.where(seen.any(axis=1), width - 1 - seen[:, ::-1].argmax(axis=1), np.nan)
    known = np.flatnonzero(np.isfinite(reach))
    smooth = gaussian_filter1d(reach[known], SMOOTH)
    result = np.full(len(reach), np.nan)
    result[known] = smooth
    return result


def _nose(signal: Float64) -> tuple[int, float]:
    """Return the row of the tip of the nose, and how far it stands out, as a share of the head's height."""
    known = np.flatnonzero(np.isfinite(signal))
    tall = len(known)
    reach = max(round(NOSE_WIDTH * tall), 3)
    best, row = 0.0, int(known[0])
    for y in known[2 * reach : -2 * reach]:
        here = signal[y]
        if here < np.nanmax(signal[y - 2 : y + 3]) - 1e-9:
            continue
        out = here - max(
            np.nanmean(signal[y - 2 * reach : y - reach]), np.nanmean(signal[y + reach : y + 2 * reach])
        )
        # A nose ends quickly below; a chin or a brow recedes slowly on both sides.
        sharp = -(signal[y - 3] - 2 * here + signal[y + 3]) if y >= 3 else 0.0
        if out > 0 and out + sharp > best:
            best, row = float(out + sharp), int(y)
    return row, best / max(tall, 1)


def _extrema(signal: Float64, nose: int) -> dict[str, float]:
    """Return rows of the points along a profile: nose, its base, lips, mouth, chin."""
    known = np.flatnonzero(np.isfinite(signal))
    turning = np.sign(np.diff(signal))
    maxima = [y for y in known[2:-2] if turning[y - 1] > 0 >= turning[y]]
    minima = [y for y in known[2:-2] if turning[y - 1] < 0 <= turning[y]]
    ripples = _ripples(signal, sorted([*maxima, *minima]))
    maxima, minima = ([y for y in rows if y not in ripples] for rows in (maxima, minima))

    def after(rows: list[int], start: float) -> float | None:
        return next((float(y) for y in rows if y > start + 1), None)

    found: dict[str, float] = {"9.3": float(nose)}
    at: float | None = float(nose)
    for name, rows in (
        ("9.15", minima),
        ("8.1", maxima),
        ("2.2", minima),
        ("8.2", maxima),
        (None, minima),
        ("2.10", maxima),
    ):
        at = after(rows, at) if at is not None else None
        if at is None:
            break
        if name is not None:
            found[name] = at
    return found


def _ripples(signal: Float64, rows: list[int]) -> set[int]:
    """Return those of the rows of extrema between which the outline hardly goes back: edges of pixels."""
    kept = list(rows)
    while len(kept) > 1:
        depths = np.abs(np.diff(signal[kept]))
        least = int(depths.argmin())
        if depths[least] >= RIPPLE:
            break
        del kept[least : least + 2]
    return set(rows) - set(kept)


def _is_face(found: dict[str, float], signal: Float64) -> bool:
    """Whether the extrema lie as those of a face: all there, and at its usual proportions."""
    if "2.10" not in found:
        return False
    nose = found["9.3"]
    tall = found["2.10"] - nose
    if tall < LEAST_HEIGHT * len(signal):
        return False
    for name, limits in RANGES.items():
        down, behind = found[name] - nose, signal[round(nose)] - signal[round(found[name])]
        if not all(low <= at / tall <= high for at, (low, high) in zip((down, behind), limits, strict=True)):
            return False
    return True


def _draw(mask: Bool, found: dict[str, float], signal: Float64, facing: int) -> UInt8:
    from PIL import Image, ImageDraw

    picture = np.where(mask[..., None], (210, 210, 210), (40, 44, 52)).astype(np.uint8)
    image = Image.fromarray(picture)
    pen = ImageDraw.Draw(image)
    width = mask.shape[1]
    line = [(x if facing > 0 else width - 1 - x, y) for y, x in enumerate(signal) if np.isfinite(x)]
    pen.line(line, fill=(80, 160, 255), width=2)
    for name, y in found.items():
        x = signal[round(y)] if facing > 0 else width - 1 - signal[round(y)]
        pen.ellipse([x - 4, y - 4, x + 4, y + 4], fill=(40, 220, 90))
        pen.text((x + 8, y - 6), name, fill=(255, 160, 60))
    return np.asarray(image)

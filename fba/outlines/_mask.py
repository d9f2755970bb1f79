"""Silhouettes: the mask of the figure in a picture, and a mask cut and scaled to a standard size."""

from __future__ import annotations

import os
import warnings

import numpy as np

from fba.arrays import Bool, Float32, Int32, Intp, UInt8
from fba.errors import FormatError, warn
from fba.limits import DEFAULT_LIMITS, Limits
from fba.source import naming_file, open_source

SIDE = 96
"""Pixels of the longer side of a silhouette that is described."""
WORKED = 2048
"""Longest side, in pixels, at which a picture is examined; larger ones are reduced first."""
FORMATS = ("PNG", "JPEG", "WEBP", "GIF", "BMP", "TIFF", "PPM")
TOLERANCE, FINEST = 32, 20
"""Largest difference of a channel, 0..255, from the background's colour within the background; and the
largest where the background is of one colour, without noise."""
NOISE = 2.5
"""Differences from the background beyond its noise, which nine tenths of its border stay within."""
PLAIN = 0.8
"""Share of the border that has the background's colour, at least."""
OPAQUE = 0.99
"""Share of opaque pixels from which a few others tell nothing."""
FITS = 4
"""Times that the background is fitted."""
SHADED = (0.55, 1.25)
"""Light of a floor beside its background's, in a shadow and where it is brighter than the wall."""
FLOOR = 0.2
"""The lowest share of a figure, beside which floor is seen."""
HOLE = 1 / 500
"""Area of a hole, as a share of the figure, below which it is noise."""
SECOND = 0.1
"""Area of a further figure, as a share of the largest, from which it is more than a speck."""
SMALLEST = 16
"""Pixels of the longer side of a figure, at least."""


def read_mask(path: str | os.PathLike[str], *, limits: Limits = DEFAULT_LIMITS) -> Bool:
    """Return the mask (H, W) of the figure in a picture; pictures beyond 2048 pixels are reduced first.

    A picture with transparent parts: the figure is what is opaque. Others: what differs from a plain
    background, whose colour is that of the border, and may change evenly across the picture. Shadows on the
    floor are left out. A photograph is turned as its camera was held. Raises FormatError for a file that is
    no picture, or has no figure, no plain background, or several figures; LimitError beyond `limits.pixels`.
    Warns of a figure at the edge of the picture, which may be cut off.
    """
    pixels = _read_pixels(path, limits)
    with naming_file(path):
        mask = _single_figure(_foreground(pixels))
    if mask[[0, -1]].any() or mask[:, [0, -1]].any():
        warn(
            f"{os.fspath(path)}: the figure reaches the edge of the picture; what is cut off is missed in "
            "its outline",
            stacklevel=2,
        )
    return mask


def fit_mask(mask: Bool) -> Bool:
    """Return the figure of a mask, cut out and scaled so that its longer side has 96 pixels.

    The result has a margin of 2 pixels. Raises FormatError for an empty mask, or a tiny figure.
    """
    from PIL import Image

    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    if not len(rows):
        raise FormatError("shows no figure: the outline is empty")
    cut = mask[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    if max(cut.shape) < SMALLEST:
        raise FormatError(
            f"the figure is {cut.shape[1]} x {cut.shape[0]} pixels large; its longer side needs {SMALLEST}"
        )
    scale = SIDE / max(cut.shape)
    if scale != 1:
        size = [max(round(side * scale), 1) for side in cut.shape[::-1]]
        filter_ = Image.Resampling.BOX if scale < 1 else Image.Resampling.BILINEAR
        grey = Image.fromarray(cut.astype(np.uint8) * np.uint8(255)).resize((size[0], size[1]), filter_)
        cut = np.asarray(grey) >= 128
    return np.pad(cut, 2)


def _read_pixels(path: str | os.PathLike[str], limits: Limits) -> UInt8:
    """Return the picture, (H, W, 4)."""
    from PIL import Image, ImageOps

    file, _ = open_source(path)
    with file, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of Pillow: sizes are checked here, the rest does not matter
        try:
            with Image.open(file, formats=FORMATS) as image:
                with naming_file(path):
                    limits.check_pixels(image.width, image.height, "the picture")
                picture = ImageOps.exif_transpose(image).convert("RGBA")
        except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
            if isinstance(error, ValueError) and hasattr(error, "remedies"):
                raise  # a LimitError
            raise FormatError(
                f"cannot be read as a picture ({', '.join(FORMATS)}): {error}", path=path
            ) from error
    factor = -(-max(picture.size) // WORKED)
    return np.asarray(picture.reduce(factor) if factor > 1 else picture)


def _foreground(pixels: UInt8) -> Bool:
    """Return the mask (H, W) of all that is not background; FormatError if there is no background."""
    opaque = pixels[..., 3] >= 128
    if opaque.mean() < OPAQUE:
        return opaque
    colours = pixels[..., :3].astype(np.float32)
    background = _background(colours)
    away = np.abs(colours - background).max(axis=2)
    border = np.concatenate([away[0], away[-1], away[:, 0], away[:, -1]])
    plain = float((border <= TOLERANCE).mean())
    if plain < PLAIN:
        raise FormatError(
            f"has no plain background: {plain:.0%} of the border has its colour, and {PLAIN:.0%} must have; "
            "cut the figure out, and save it as a PNG that is transparent around it, or as a white figure "
            "on black"
        )
    noise = float(np.quantile(border[border <= TOLERANCE], 0.9))
    different: Bool = away > np.clip(NOISE * noise, FINEST, TOLERANCE)
    return _without_shadow(different, colours, background)


def _background(colours: Float32) -> Float32:
    """Return the colours (H, W, 3) of the background.

    A second-degree polynomial of the place, for light that changes across a wall; fitted to the border
    pixels near it, at first those near the median.
    """
    height, width = colours.shape[:2]
    x, y = np.linspace(-1, 1, width, dtype=np.float32), np.linspace(-1, 1, height, dtype=np.float32)
    edge = np.zeros((height, width), dtype=bool)
    edge[[0, -1]] = edge[:, [0, -1]] = True
    rows, columns = np.nonzero(edge)
    border = colours[rows, columns]
    powers = [(i, j) for i in range(3) for j in range(3 - i)]
    terms = np.stack([y[rows] ** i * x[columns] ** j for i, j in powers], axis=1)
    even = np.zeros((6, 3), dtype=np.float32)
    even[0] = np.median(border, axis=0)
    for _ in range(FITS):
        inside = np.abs(border - terms @ even).max(axis=1) <= TOLERANCE
        if inside.sum() < PLAIN / 2 * len(border):
            break
        even = np.linalg.lstsq(terms[inside], border[inside])[0]
    result: Float32 = np.zeros_like(colours)
    for (i, j), colour in zip(powers, even, strict=True):
        result += (y**i)[:, None, None] * (x**j)[:, None] * colour
    return result


def _without_shadow(mask: Bool, colours: Float32, background: Float32) -> Bool:
    """Return a mask without what has the background's hue, but other light, in its lowest fifth."""
    rows = np.flatnonzero(mask.any(axis=1))
    if not len(rows):
        return mask
    low = int(rows[-1] + 1 - FLOOR * (rows[-1] + 1 - rows[0]))
    near, light = colours[low:], background[low:]
    share = np.clip((near * light).sum(axis=2) / np.maximum((light * light).sum(axis=2), 1), *SHADED)
    shaded = np.abs(near - share[..., None] * light).max(axis=2) <= 0.75 * TOLERANCE
    result = mask.copy()
    result[low:] &= ~shaded
    return result


def without_specks(mask: Bool) -> Bool:
    """Return the mask of the largest figure alone, its smallest holes filled; one of no figure as it is."""
    labels, areas = _label(mask)
    return _cut_figure(labels, areas) if areas.any() else mask


def _single_figure(mask: Bool) -> Bool:
    """Return the mask of the only figure, without specks; FormatError for none or several."""
    labels, areas = _label(mask)
    if not areas.any():
        raise FormatError("shows no figure before a background: it is all of one colour, or transparent")
    figures = int((areas >= SECOND * areas.max()).sum())
    if figures > 1:
        raise FormatError(f"shows {figures} figures that do not touch; cut out the one that is meant")
    figure = _cut_figure(labels, areas)
    fit_mask(figure)  # its size
    return figure


def _label(mask: Bool) -> tuple[Int32, Intp]:
    """Return which figure each pixel belongs to (H, W), and the areas; figure 0, the background, has none."""
    from scipy import ndimage

    labels, count = ndimage.label(mask, np.ones((3, 3)))
    areas = np.bincount(labels.ravel(), minlength=count + 1)
    areas[0] = 0
    return labels, areas


def _cut_figure(labels: Int32, areas: Intp) -> Bool:
    from scipy import ndimage

    figure: Bool = labels == areas.argmax()
    holes, _ = ndimage.label(~figure)
    small = np.bincount(holes.ravel()) < HOLE * areas.max()
    return np.asarray(figure | (small[holes] & ~figure))

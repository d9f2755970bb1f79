"""Silhouettes: the mask of the figure in a picture, and a mask cut and scaled to a standard size."""

from __future__ import annotations

import os
import warnings

import numpy as np

from fba.arrays import Bool, UInt8
from fba.errors import FormatError, warn
from fba.limits import DEFAULT_LIMITS, Limits
from fba.source import naming_file, open_source

SIDE = 96
"""Pixels of the longer side of a silhouette that is described."""
WORKED = 2048
"""Longest side, in pixels, at which a picture is examined; larger ones are reduced first."""
FORMATS = ("PNG", "JPEG", "WEBP", "GIF", "BMP", "TIFF", "PPM")
TOLERANCE = 32
"""Largest difference of a channel, 0..255, from the background's colour within the background."""
PLAIN = 0.8
"""Share of the border that has the background's colour, at least."""
SECOND = 0.1
"""Area of a further figure, as a share of the largest, from which it is more than a speck."""
SMALLEST = 16
"""Pixels of the longer side of a figure, at least."""


def read_mask(path: str | os.PathLike[str], *, limits: Limits = DEFAULT_LIMITS) -> Bool:
    """Return the mask (H, W) of the figure in a picture; pictures beyond 2048 pixels are reduced first.

    A picture with transparent parts: the figure is what is opaque. Others: what differs from a plain
    background, whose colour is that of the border. Raises FormatError for a file that is no picture, or has
    no figure, no plain background, or several figures; LimitError beyond `limits.pixels`.
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
    from PIL import Image

    file, _ = open_source(path)
    with file, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of Pillow: sizes are checked here, the rest does not matter
        try:
            with Image.open(file, formats=FORMATS) as image:
                with naming_file(path):
                    limits.check_pixels(image.width, image.height, "the picture")
                picture = image.convert("RGBA")
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
    if not opaque.all():
        return opaque
    colours = pixels[..., :3].astype(np.int16)
    border = np.concatenate([colours[0], colours[-1], colours[:, 0], colours[:, -1]])
    background = np.median(border, axis=0)
    plain = float((np.abs(border - background).max(axis=1) <= TOLERANCE).mean())
    if plain < PLAIN:
        raise FormatError(
            f"has no plain background: {plain:.0%} of the border has its colour, and {PLAIN:.0%} must have; "
            "cut the figure out, and save it as a PNG that is transparent around it"
        )
    result: Bool = np.abs(colours - background).max(axis=2) > TOLERANCE
    return result


def _single_figure(mask: Bool) -> Bool:
    """Return the mask of the only figure, without specks; FormatError for none or several."""
    from scipy import ndimage

    labels, count = ndimage.label(mask, np.ones((3, 3)))
    if not count:
        raise FormatError("shows no figure before a background: it is all of one colour, or transparent")
    areas = np.bincount(labels.ravel(), minlength=count + 1)
    areas[0] = 0
    largest = int(areas.argmax())
    figures = int((areas >= SECOND * areas[largest]).sum())
    if figures > 1:
        raise FormatError(f"shows {figures} figures that do not touch; cut out the one that is meant")
    result: Bool = labels == largest
    fit_mask(result)  # its size
    return result

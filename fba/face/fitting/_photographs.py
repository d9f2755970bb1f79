"""Photographs: read upright, as colours, no larger than a skin needs; what finders of points return."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from fba.arrays import UInt8
from fba.errors import FormatError, ModelError, warn
from fba.limits import DEFAULT_LIMITS, Limits

LARGEST_SIDE = 2048
"""Pixels of the longer side that are kept; a texture of 2048 pixels shows no more."""
SMALLEST_SIDE = 64
"""Pixels of the shorter side below which no face can be told."""
FORMATS = ("JPEG", "PNG", "WEBP", "TIFF", "BMP")
GREY_DIFFERENCE = 4
"""Colours that differ by at most this much between channels are grey."""


@dataclass(frozen=True, eq=False)
class Photograph:
    """A photograph, upright.

    pixels: uint8 (H, W, 3), sRGB, from the top left. size: (width, height) of the file's picture, upright;
    positions of points refer to it. name: of the file. grey: whether it has no colours.
    """

    pixels: UInt8
    size: tuple[int, int]
    name: str = ""

    @property
    def scale(self) -> float:
        """Pixels of the file for one of `pixels`."""
        return self.size[0] / int(self.pixels.shape[1])

    @property
    def grey(self) -> bool:
        """Whether no pixel has a colour."""
        sample = self.pixels[::4, ::4].astype(np.int16)
        return bool((sample.max(axis=2) - sample.min(axis=2)).max(initial=0) <= GREY_DIFFERENCE)


def read_photograph(path: str | os.PathLike[str], *, limits: Limits = DEFAULT_LIMITS) -> Photograph:
    """Return a photograph: JPEG, PNG, WebP, TIFF or BMP, turned upright as its EXIF says.

    Only 2048 pixels of the longer side are kept. Raises FormatError for a file that is no picture or is
    damaged; LimitError for more pixels than the limits allow; ModelError for a picture too small to show a
    face. Warns (FbaWarning) of a picture without colours.
    """
    from PIL import Image, ImageOps

    name = Path(path).name
    try:
        with Image.open(path, formats=FORMATS) as image:
            limits.check_pixels(*image.size, f"{path}: the picture")
            turned = image.getexif().get(0x0112, 1) >= 5  # rotated by a quarter
            size = image.size[::-1] if turned else image.size
            if min(size) < SMALLEST_SIDE:
                raise ModelError(
                    f"{path}: the picture has {size[0]} x {size[1]} pixels; to show a face it needs at least "
                    f"{SMALLEST_SIDE} each way"
                )
            image.draft("RGB", (LARGEST_SIDE, LARGEST_SIDE))  # JPEG is decoded at a fraction of its size
            if image.mode.startswith("I") or image.mode == "F":
                raise FormatError(
                    f"its pixels are of the kind {image.mode}, not colours of 8 bits", path=path
                )
            image.thumbnail((LARGEST_SIDE, LARGEST_SIDE), Image.Resampling.LANCZOS)
            upright = ImageOps.exif_transpose(image).convert("RGB")
    except FileNotFoundError as error:
        raise FormatError("there is no such file", path=path) from error
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        if isinstance(error, FormatError | ModelError) or error.__class__.__module__.startswith("fba"):
            raise
        raise FormatError(f"is no picture that can be read ({error})", path=path) from error
    photograph = Photograph(np.asarray(upright), size, name)
    if photograph.grey:
        warn(f"{path}: the picture has no colours; the skin of the head will be grey, too", stacklevel=2)
    return photograph


@dataclass(frozen=True, eq=False)
class Step:
    """A picture of one step: uint8 (H, W, 3), and what it shows."""

    title: str
    pixels: UInt8


@dataclass(frozen=True, eq=False)
class FoundPoints:
    """Points that were found on a photograph.

    points: pixels to the right and down by name. score: how well they look like those of a face, 0 to 1.
    steps: pictures of how they were found. doubts: by part of the face (eyes, brows, nose, mouth, chin), how
    far its points are apart when they are found from several places, in distances between the pupils.
    """

    points: dict[str, tuple[float, float]]
    score: float
    steps: list[Step] = field(default_factory=list)
    doubts: dict[str, float] = field(default_factory=dict)

"""Single pictures as PNG, optionally transparent, and JPEG files."""

from __future__ import annotations

import zlib
from pathlib import Path
from typing import BinaryIO

import numpy as np

from fba.arrays import UInt8
from fba.atomic import PathLike, atomic
from fba.errors import UnsupportedError

PICTURES = (".png", ".jpg", ".jpeg")
JPEG_QUALITY = 90


def write_picture(path: PathLike, pixels: UInt8, *, transparent: bool = False) -> Path:
    """Write pixels, uint8 (H, W, 3 or 4), sRGB, as .png or .jpg, atomically; returns the path.

    transparent: keeps the fourth channel, the opacity (not premultiplied); PNG only. Raises UnsupportedError
    for another suffix or a transparent JPEG, FormatError if it cannot be written.
    """
    target = Path(path)
    check_picture(target, transparent=transparent)
    with atomic(target) as file:
        put_picture(file, pixels, target.suffix, transparent=transparent)
    return target


def put_picture(file: BinaryIO, pixels: UInt8, suffix: str, *, transparent: bool = False) -> None:
    """Write pixels as `write_picture` does, into an open file."""
    from PIL import Image

    channels = slice(None) if transparent else slice(3)
    picture = Image.fromarray(np.ascontiguousarray(pixels[..., channels]))
    if suffix.lower() == ".png":
        # Searching for repeats other than runs takes five times as long and finds little in shaded skin:
        # files are as large without it, and smaller than with a quick search.
        picture.save(file, format="PNG", compress_type=zlib.Z_RLE)
    else:
        picture.save(file, format="JPEG", quality=JPEG_QUALITY)


def check_picture(target: Path, *, transparent: bool) -> None:
    """Raise UnsupportedError if the suffix is none of a picture, or the picture cannot be transparent."""
    suffix = target.suffix.lower()
    if suffix not in PICTURES:
        raise UnsupportedError(
            f"{target}: pictures are written as .png or .jpg, not as {suffix or 'a bare name'}",
            what=f"rendering to {suffix or 'no suffix'}",
        )
    if transparent and suffix != ".png":
        raise UnsupportedError(
            f"{target}: only PNG pictures can be transparent; name it {target.with_suffix('.png').name}",
            what=f"transparency in {suffix}",
        )

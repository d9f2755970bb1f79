"""Reads the pictures of textures."""

from __future__ import annotations

import io
import math

import numpy as np

from fba.arrays import UInt8
from fba.limits import DEFAULT_LIMITS


def read_pixels(texture: bytes, most: float = math.inf) -> UInt8 | None:
    """Return uint8 (H, W, 4) of a PNG, JPEG or WebP picture, made smaller to have at most `most` pixels each
    way.

    None where it is damaged, or has more pixels than the default limits allow.
    """
    from PIL import Image

    try:
        with Image.open(io.BytesIO(texture), formats=("PNG", "JPEG", "WEBP")) as image:
            if image.width * image.height > DEFAULT_LIMITS.pixels:
                return None
            factor = min(most / max(image.size), 1.0)
            whole: Image.Image = image.convert("RGBA")
            if factor < 1:
                size = max(int(image.width * factor), 1), max(int(image.height * factor), 1)
                whole = whole.resize(size, Image.Resampling.LANCZOS)
            return np.asarray(whole)
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError):
        return None

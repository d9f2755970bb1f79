"""The picture that lies on a part of a face.

To decode one takes a tenth of a second: what a screen shows of it is kept on disk.
"""

from __future__ import annotations

import io
from functools import cache

import numpy as np

from fba.arrays import Int32, UInt8
from fba.cache import kept, key_of

LARGEST = 4096
"""Pictures of more pixels across are made smaller."""
LARGE = 100_000
"""Of files of so many bytes and more something is kept."""
MAKING = 1
"""Counts up with every change of what is made of a picture: what was kept before is then made anew."""


class FacePicture:
    """A picture in a file of PNG or JPEG.

    Raises OSError, ValueError or SyntaxError where it cannot be read.
    """

    def __init__(self, data: bytes) -> None:
        self._data = data
        self._bytes = np.frombuffer(data, dtype=np.uint8)
        if len(data) < LARGE:
            (found,) = self._measured()
        else:
            (found,) = kept(key_of("picture", MAKING, self._bytes), ((3,),), self._measured, np.int32)
            if found.min() < 0 or found.max() > LARGEST:
                (found,) = self._measured()
        self.size = (int(found[0]), int(found[1]))
        """Width and height."""
        self.opaque = bool(found[2])
        """Whether nothing shines through it anywhere."""

    @property
    def pixels(self) -> UInt8:
        """(H, W, 4), decoded anew."""
        from PIL import Image

        try:
            with Image.open(io.BytesIO(self._data), formats=("PNG", "JPEG")) as image:
                if max(image.size) > LARGEST:
                    image.draft("RGB", (LARGEST, LARGEST))
                    image.thumbnail((LARGEST, LARGEST))
                return np.asarray(image.convert("RGBA"))
        except Image.DecompressionBombError as error:
            raise ValueError(str(error)) from error

    def seen(self, factor: int) -> UInt8:
        """Every `factor` texels made one, (h, w, 4), and the square roots of their linear light."""
        if factor < 2 or len(self._data) < LARGE:
            return _reduced(self.pixels, factor)
        width, height = (-(-across // factor) for across in self.size)
        key = key_of("texture", MAKING, factor, self._bytes)
        (found,) = kept(key, ((height, width, 4),), lambda: [_reduced(self.pixels, factor)], np.uint8)
        return found

    def _measured(self) -> list[Int32]:
        pixels = self.pixels
        height, width = pixels.shape[:2]
        return [np.array([width, height, (pixels[..., 3] == 255).all()], dtype=np.int32)]


def _reduced(pixels: UInt8, factor: int) -> UInt8:
    from PIL import Image

    image = Image.fromarray(pixels)
    if factor > 1:
        image = image.reduce(factor)
    return np.asarray(image.point([*_roots()] * 3 + list(range(256))))


@cache
def _roots() -> tuple[int, ...]:
    """sRGB codes -> square roots of linear light, 0..255."""
    code = np.arange(256) / 255
    linear = np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4)
    return tuple(int(v) for v in np.round(255 * np.sqrt(linear)))
